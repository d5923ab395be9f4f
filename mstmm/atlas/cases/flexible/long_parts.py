"""Dynamic stiffness of longer and longer elements of a beam."""

from __future__ import annotations

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import root_inertia
from ...parameter_scale import LOG_SCALE
from ...variants import finite_difference_mass


def _error(z: float, inertia: float) -> float:
    return abs(inertia / finite_difference_mass.exact_inertia(z) - 1)


CASE = CaseDefinition(
    name="long-parts",
    title="Exact beams: dynamic stiffness of long elements",
    cause="Hyperbolic functions in the quotients of the dynamic stiffness grow with exp(beta L) "
    "and cancel only in the quotient. The quotients stay accurate longer than transfer matrices, "
    "which have lost all digits at the twelfth mode. At last numerator and divisor both overflow, "
    "and the quotient is undefined. Divided by the growing terms, only decaying exponentials "
    "remain.",
    parameter="beta L of an element",
    unit="",
    low=1.0,
    high=1e4,
    scale=LOG_SCALE,
    measured="error of the element's inertia, relative",
    limit=1e-6,
    method=MethodDefinition(
        "quotients of sines", lambda z: _error(z, finite_difference_mass.quotient_inertia(z))
    ),
    remedy=MethodDefinition("decaying exponentials", lambda z: _error(z, root_inertia(z))),
    reach=1e6,
    source="Wittrick and Williams, Q. J. Mech. Appl. Math. 24, 1971 (dynamic stiffness); "
    "Goncalves, Brennan, Elliott, Journal of Sound and Vibration 301, 2007 (high numbers)",
)
