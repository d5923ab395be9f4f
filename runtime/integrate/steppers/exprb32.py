"""Exponential Rosenbrock method with two stages: steps may be longer than vibration periods.

M. Hochbruck, A. Ostermann, J. Schweitzer, Exponential Rosenbrock-type methods, SIAM Journal on
Numerical Analysis 47 (2009) 786-803: the pair exprb32.
"""

from __future__ import annotations

from .implicit_methods import Implicit, make_exponential

#: For more unknowns the exponential of a matrix dominates the cost of a step.
MAX_UNKNOWNS = 40


def tableau() -> Implicit:
    """The method `exprb32`."""
    source = "Hochbruck, Ostermann and Schweitzer (2009), exprb32"
    return make_exponential("exprb32", 3, 2, MAX_UNKNOWNS, source)
