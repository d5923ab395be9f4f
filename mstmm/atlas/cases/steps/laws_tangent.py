"""Rosenbrock method with a tangent matrix of hinge laws only."""

from __future__ import annotations

from ....runtime.integrate.methods import Implicit
from ...case_definition import CaseDefinition, MethodDefinition
from ...error_measures import relative_growth
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import hanging_rod

STEP, STEPS = 0.01, 400


def _growth(rate: float, tangent: str) -> float:
    """`rate` is the step times the angular frequency of the rod."""
    method = Implicit("ros34pw2", tangent=tangent)
    return relative_growth(hanging_rod(rate / STEP), STEP, STEPS, method)


CASE = CaseDefinition(
    name="laws-tangent",
    title="Tangent of hinge laws only: stiffness due to loads",
    cause="Weight, spin and preload make a motion stiff without any spring. A linearisation with "
    "the derivatives of springs and dampers only does not include that stiffness; a Rosenbrock "
    "method is then explicit in that direction. The exact tangent includes it.",
    parameter="step times angular frequency of a hanging rod",
    unit="",
    low=0.03,
    high=100.0,
    scale=LOG_SCALE,
    measured="largest over initial angle in 400 steps",
    limit=1.01,
    method=MethodDefinition("ros34pw2, tangent of laws", lambda rate: _growth(rate, "laws")),
    remedy=MethodDefinition("ros34pw2, exact tangent", lambda rate: _growth(rate, "exact")),
    reach=1e3,
    source="Rang, Angermann, BIT 45, 2005 (W-methods); Hairer, Wanner, Solving Ordinary "
    "Differential Equations II, 1996, IV.7",
)
