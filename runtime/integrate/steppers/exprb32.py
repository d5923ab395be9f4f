"""An exponential Rosenbrock method with two stages: vibration is followed, not resolved.

M. Hochbruck, A. Ostermann, J. Schweitzer, Exponential Rosenbrock-type methods, SIAM Journal on
Numerical Analysis 47 (2009) 786-803: the pair exprb32.
"""

from __future__ import annotations

from .implicit import Implicit, exponential

#: From here on the exponential of a matrix takes most of a step.
MOST_UNKNOWNS = 40


def tableau() -> Implicit:
    """The method `exprb32`."""
    source = "Hochbruck, Ostermann and Schweitzer (2009), exprb32"
    return exponential("exprb32", 3, 2, MOST_UNKNOWNS, source)
