"""Discrete-time transfer matrix method: generalised alpha with one linear solution per step.

The equations of motion are linearised at a predictor of second order and solved once, in the
coordinates of the hinges.  For smooth motion the result is as accurate as that of the iterated
method, for less than half its cost.  Errors of fast motion that the step does not resolve remain.

B. Rong, X. Rui, L. Tao, G. Wang, Discrete time transfer matrix method for launch dynamics modeling
and cosimulation of self-propelled artillery system, Journal of Applied Mechanics 80 (2013) 011008;
the integration formulas are those of `genalpha`.
"""

from __future__ import annotations

from typing import Any

from .genalpha import DEFAULT_RADIUS, constants
from .implicit_methods import Implicit, make_newmark_family


def tableau(radius: float = DEFAULT_RADIUS) -> Implicit:
    """The method `dttmm`."""
    method_constants: dict[str, Any] = dict(constants(radius))
    source = "one linearisation per step of Chung and Hulbert (1993)"
    return make_newmark_family("dttmm", source, one_iteration=True, **method_constants)
