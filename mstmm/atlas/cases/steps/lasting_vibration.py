"""A method that is stable for every stiffness and forgets nothing of what it cannot follow."""

from __future__ import annotations

import numpy as np

from ...definition import Definition, Method
from ...measures import STEP, amplitude
from ...scale import LOG
from ...scenes import LET_GO, sprung_rod, stiffness_of_rate
from ...variants import ros3p
from ...variants.plain_rosenbrock import Steps

#: Step times angular frequency.
RATE = 1e4


def _lasting(steps: float) -> float:
    count, rate = max(1, round(steps)), RATE / STEP
    rod = sprung_rod(stiffness_of_rate(rate))
    q, u, _ = Steps(rod, ros3p.tableau()).fixed(STEP, count)[-1]
    return float(np.hypot(q[0], u[0] / rate) / LET_GO)


def _forgotten(steps: float) -> float:
    return float(amplitude(RATE, max(1, round(steps)), "rodas4p2")[-1])


CASE = Definition(
    name="lasting-vibration",
    title="Stable for every stiffness, and nothing forgotten",
    why="A method may be stable however stiff a scene is and still keep most of a vibration far "
    "too fast for its steps: of this one three quarters are left after each step, and over the "
    "first ten or so they cover whatever else moves. The methods of a run leave next to nothing "
    "(they are L-stable, or damp by a radius that is chosen).",
    parameter="steps after the start", unit="", low=1.0, high=100.0, scale=LOG,
    measured="amplitude left, of the start's", limit=0.01,
    method=Method("ros3p, step times frequency 1e4", _lasting),
    remedy=Method("rodas4p2", _forgotten), reach=1.0,
    source="Lang, Verwer, BIT 41, 2001; Hairer, Wanner, Solving Ordinary Differential Equations "
    "II, 1996, IV.3",
)  # fmt: skip
