"""Wilson's method in its first steps beside an unresolved vibration."""

from __future__ import annotations

from ...definition import Definition, Method
from ...measures import amplitude
from ...scale import LOG

STEPS = 20


def _overshoot(rate: float, method: str) -> float:
    return float(amplitude(rate, STEPS, method).max())


CASE = Definition(
    name="wilson-overshoot",
    title="Wilson's method: overshoot in the first steps",
    why="Wilson's collocation lies behind the end of the step. It is stable for any step, and yet "
    "the first ones leave a stretched spring by the square of step times frequency: nothing "
    "blows up, and the numbers of the first instants are wrong by any factor. L-stable methods "
    "of Rosenbrock's kind fall at once.",
    parameter="step times angular frequency", unit="", low=0.1, high=1e5, scale=LOG,
    measured="largest amplitude in 20 steps, of the start's", limit=1.05,
    method=Method("wilson", lambda rate: _overshoot(rate, "wilson")),
    remedy=Method("rodas4p2", lambda rate: _overshoot(rate, "rodas4p2")), reach=1e6,
    source="Goudreau, Taylor, Computer Methods in Applied Mechanics and Engineering 2, 1972; "
    "Hilber, Hughes, Earthquake Engineering and Structural Dynamics 6, 1978",
)  # fmt: skip
