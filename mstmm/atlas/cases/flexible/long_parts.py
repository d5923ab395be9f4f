"""Dynamic stiffness of longer and longer elements of a beam."""

from __future__ import annotations

from ...definition import Definition, Method
from ...measures import root_inertia
from ...scale import LOG
from ...variants import stiffness_quotient


def _error(z: float, inertia: float) -> float:
    return abs(inertia / stiffness_quotient.exact(z) - 1)


CASE = Definition(
    name="long-parts",
    title="Exact beams: dynamic stiffness of long elements",
    why="Hyperbolic functions in the quotients of the dynamic stiffness grow with exp(beta L) "
    "and cancel only in the quotient. The quotients stay accurate longer than transfer matrices, "
    "which have lost all digits at the twelfth mode. At last numerator and divisor both overflow, "
    "and the quotient is undefined. Divided by the growing terms, only decaying exponentials "
    "remain.",
    parameter="beta L of an element", unit="", low=1.0, high=1e4, scale=LOG,
    measured="error of the element's inertia, relative", limit=1e-6,
    method=Method("quotients of sines", lambda z: _error(z, stiffness_quotient.inertia(z))),
    remedy=Method("decaying exponentials", lambda z: _error(z, root_inertia(z))), reach=1e6,
    source="Wittrick and Williams, Q. J. Mech. Appl. Math. 24, 1971 (dynamic stiffness); "
    "Goncalves, Brennan, Elliott, Journal of Sound and Vibration 301, 2007 (high numbers)",
)  # fmt: skip
