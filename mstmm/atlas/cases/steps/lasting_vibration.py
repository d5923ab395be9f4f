"""Method that is A-stable but keeps unresolved vibrations."""

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
    title="A-stable but not L-stable: unresolved vibration remains",
    why="A method may be stable for any stiffness and still keep most of a vibration far too "
    "fast for its steps. This one keeps three quarters of it per step, and over about the first "
    "ten steps the vibration hides all other motion. The methods of a run keep next to nothing "
    "(they are L-stable, or damp by a chosen radius).",
    parameter="steps after the start", unit="", low=1.0, high=100.0, scale=LOG,
    measured="remaining amplitude, relative to the start", limit=0.01,
    method=Method("ros3p, step times frequency 1e4", _lasting),
    remedy=Method("rodas4p2", _forgotten), reach=1.0,
    source="Lang, Verwer, BIT 41, 2001; Hairer, Wanner, Solving Ordinary Differential Equations "
    "II, 1996, IV.3",
)  # fmt: skip
