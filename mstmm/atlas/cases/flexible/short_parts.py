"""The dynamic stiffness of ever shorter parts of a beam."""

from __future__ import annotations

from ...definition import Definition, Method
from ...measures import root_inertia
from ...scale import LOG
from ...variants import stiffness_quotient


def _error(z: float, inertia: float) -> float:
    return abs(inertia / stiffness_quotient.exact(z) - 1)


CASE = Definition(
    name="short-parts",
    title="Exact beams: dynamic stiffness of short parts",
    why="Entries of the dynamic stiffness are quotients of circular and hyperbolic functions; near "
    "rest numerator and divisor vanish together, and what is left of them is the static stiffness, "
    "beside which inertia is beta L to the fourth power. A beam cut into many parts loses its mass "
    "in rounding. What lies beyond the static part is a power series there.",
    parameter="beta L of a part", unit="", low=1e-3, high=3.0, scale=LOG,
    measured="error of the part's inertia, relative", limit=1e-6,
    method=Method(
        "quotients of sines", lambda z: _error(z, stiffness_quotient.inertia(z))
    ),
    remedy=Method("power series beyond the static part", lambda z: _error(z, root_inertia(z))),
    reach=1e-6,
    source="Wittrick and Williams, Q. J. Mech. Appl. Math. 24, 1971 (dynamic stiffness); "
    "Przemieniecki, Theory of Matrix Structural Analysis, 1968, ch. 12 (its power series)",
)  # fmt: skip
