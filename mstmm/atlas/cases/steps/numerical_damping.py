"""Numerical damping of a wanted vibration by implicit methods."""

from __future__ import annotations

import math

from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import relative_amplitudes
from ...parameter_scale import LOG_SCALE

PERIODS = 10


def _lost_amplitude(rate: float, method: str) -> float:
    steps = round(PERIODS * 2 * math.pi / rate)
    return abs(1 - float(relative_amplitudes(rate, steps, method)[-1]))


CASE = CaseDefinition(
    name="numerical-damping",
    title="Numerical damping of a wanted vibration",
    cause="Implicit methods damp fast vibration, but a wanted one too, with a power of step times "
    "frequency that is one above the order of the method. A higher order keeps the vibration "
    "longer. Generalised-alpha with radius 1 keeps all of it, with a period too long and no "
    "damping of fast motion; exprb32 follows it exactly.",
    parameter="step times angular frequency", unit="", low=0.03, high=3.0, scale=LOG_SCALE,
    measured="relative loss of amplitude in 10 periods", limit=0.01,
    method=MethodDefinition("genalpha", lambda rate: _lost_amplitude(rate, "genalpha")),
    remedy=MethodDefinition("rodas5p", lambda rate: _lost_amplitude(rate, "rodas5p")), reach=3.0,
    source="Chung, Hulbert, Journal of Applied Mechanics 60, 1993; Steinebach, BIT 63, 2023",
)  # fmt: skip
