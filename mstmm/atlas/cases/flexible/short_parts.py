"""Dynamic stiffness of shorter and shorter elements of a beam."""

from __future__ import annotations

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import root_inertia
from ...parameter_scale import LOG_SCALE
from ...variants import finite_difference_mass


def _error(z: float, inertia: float) -> float:
    return abs(inertia / finite_difference_mass.exact_inertia(z) - 1)


CASE = CaseDefinition(
    name="short-parts",
    title="Exact beams: dynamic stiffness of short elements",
    cause="Entries of the dynamic stiffness are quotients of circular and hyperbolic functions. "
    "For short elements numerator and divisor vanish together, and their quotient is the static "
    "stiffness, next to which inertia is of the size of (beta L)^4. A beam divided into many "
    "elements loses its mass in rounding. The remedy computes the terms beyond the static "
    "stiffness as a power series.",
    parameter="beta L of an element",
    unit="",
    low=1e-3,
    high=3.0,
    scale=LOG_SCALE,
    measured="error of the element's inertia, relative",
    limit=1e-6,
    method=MethodDefinition(
        "quotients of sines", lambda z: _error(z, finite_difference_mass.quotient_inertia(z))
    ),
    remedy=MethodDefinition(
        "power series beyond the static part", lambda z: _error(z, root_inertia(z))
    ),
    reach=1e-6,
    source="Wittrick and Williams, Q. J. Mech. Appl. Math. 24, 1971 (dynamic stiffness); "
    "Przemieniecki, Theory of Matrix Structural Analysis, 1968, ch. 12 (its power series)",
)
