"""What implicit methods leave of a vibration that is wanted."""

from __future__ import annotations

import math

from ...definition import Definition, Method
from ...measures import amplitude
from ...scale import LOG

PERIODS = 10


def _lost(rate: float, method: str) -> float:
    steps = round(PERIODS * 2 * math.pi / rate)
    return abs(1 - float(amplitude(rate, steps, method)[-1]))


CASE = Definition(
    name="numerical-damping",
    title="Numerical damping: a vibration that is wanted",
    why="What makes implicit methods forget fast vibration also takes from one that is wanted, by "
    "a power of step times frequency that is the order of the method and one more. A higher order "
    "keeps it longer; generalised-alpha with radius 1 keeps all of it, with a period too long and "
    "nothing forgotten; exprb32 follows it exactly.",
    parameter="step times angular frequency", unit="", low=0.03, high=3.0, scale=LOG,
    measured="amplitude lost in 10 periods, of the start's", limit=0.01,
    method=Method("genalpha", lambda rate: _lost(rate, "genalpha")),
    remedy=Method("rodas5p", lambda rate: _lost(rate, "rodas5p")), reach=3.0,
    source="Chung, Hulbert, Journal of Applied Mechanics 60, 1993; Steinebach, BIT 63, 2023",
)  # fmt: skip
