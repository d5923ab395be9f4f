"""Runs by SciPy and SUNDIALS with the same compiled callbacks, to verify the C loop."""

from .callbacks import Equations as Equations
from .solver_loop import METHODS as METHODS
from .solver_loop import integrate as integrate
