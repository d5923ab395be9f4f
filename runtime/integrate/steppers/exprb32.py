"""Exponential Rosenbrock method with two stages: steps may be longer than vibration periods.

M. Hochbruck, A. Ostermann, J. Schweitzer, Exponential Rosenbrock-type methods, SIAM Journal on
Numerical Analysis 47 (2009) 786-803: the pair exprb32.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .implicit_methods import EXPONENTIAL, Implicit, two_position_arrays

#: For more unknowns the exponential of a matrix dominates the cost of a step.
MAX_UNKNOWNS = 40


@dataclass(frozen=True, eq=False)
class Exponential(Implicit):
    """Exponential Rosenbrock method: exact linearised motion, two evaluations per step.

    Its weights are functions of a matrix, see `c/exponential.c`; the arrays here only define the
    positions of the step and its error for the loop.
    """

    kind: ClassVar[int] = EXPONENTIAL

    def _check_consistency(self) -> None:
        if not self.max_unknowns > 0:
            raise ValueError(f"tableau {self.name}: max_unknowns must be positive")

    def amplification(self, z: ArrayLike) -> NDArray[np.complex128]:
        """R(z) = exp(z) of one step on y' = lambda y with z = h lambda: exact."""
        return np.asarray(np.exp(np.asarray(z, dtype=np.complex128)))


def tableau() -> Exponential:
    """The method `exprb32`."""
    source = "Hochbruck, Ostermann and Schweitzer (2009), exprb32"
    return Exponential(
        name="exprb32", source=source, max_unknowns=MAX_UNKNOWNS, **two_position_arrays(order=3)
    )
