"""Loop that cannot close, with gaps weighted by the mobility of the bodies."""

from __future__ import annotations

import math
from functools import cache

from ....runtime.model.model import Model
from ...case_definition import CaseDefinition, MethodDefinition
from ...parameter_scale import LOG_SCALE
from ...shared_scenes import compile_looped, four_bar
from ...variants.mass_weighted_assembly import nearest_pose

#: Distance of the feet, m; fixed angle of the crank and initial rotation of the coupler, rad.
FOOT_DISTANCE, CRANK_ANGLE, COUPLER_OFFSET = 1.6, 2.8, 1.0
CRANK, COUPLER, ROCKER = 0.5, 1.1, 0.8


@cache
def _linkage(spread: float) -> Model:
    """Four-bar linkage with a very light coupler that is too short at some crank angles."""
    scene = four_bar(ratio=1e-3, spread=spread, feet=FOOT_DISTANCE)
    closing = scene["hinge"][-1]
    closing["inboard"], closing["outboard"] = closing["outboard"], closing["inboard"]
    return compile_looped(scene)


def _error(spread: float, by_masses: bool) -> float:
    """Relative excess of the gap; at the least gap coupler and rocker are in line."""
    linkage = _linkage(spread)
    q = linkage.initial_state()[0]
    hinges = linkage.coordinate_layout.hinges
    q[hinges["foot"].q_slice] = CRANK_ANGLE
    q[hinges["knee"].q_slice] += COUPLER_OFFSET
    pose = nearest_pose(linkage, q, "foot", by_masses)
    knee = [CRANK * math.cos(CRANK_ANGLE), CRANK * math.sin(CRANK_ANGLE)]
    least_gap = math.dist(knee, (FOOT_DISTANCE, 0.0)) - COUPLER - ROCKER
    coupler_angle = CRANK_ANGLE + pose["knee"]
    tips = (
        (knee[0] + COUPLER * math.cos(coupler_angle), knee[1] + COUPLER * math.sin(coupler_angle)),
        (FOOT_DISTANCE + ROCKER * math.cos(pose["heel"]), ROCKER * math.sin(pose["heel"])),
    )
    return math.dist(*tips) / least_gap - 1.0


CASE = CaseDefinition(
    name="least-gap",
    title="Least gaps of open loops weighted by masses: a slender coupler",
    cause="Where a loop cannot be closed, the pose of the least gap shows the reason. Weighted by "
    "the mobility of each row, gaps across a coupler with its mass in the middle count next to "
    "nothing. The iteration then ends with the bodies far apart, and the message reports a "
    "misleading gap and pose. One scale for all rows of a kind leaves the least gap to the "
    "geometry, and still prefers steps that move little mass.",
    parameter="moments of inertia of rods over those of uniform ones",
    unit="",
    low=1e-4,
    high=10.0,
    scale=LOG_SCALE,
    measured="gap in excess of the least one, relative",
    limit=1e-3,
    method=MethodDefinition("each row by its own mobility", lambda x: _error(x, True)),
    remedy=MethodDefinition("one scale for all rows of a kind", lambda x: _error(x, False)),
    reach=1e-8,
    source="Levenberg, Quarterly of Applied Mathematics 2, 1944 (damped least squares); "
    "Bjorck, Numerical Methods for Least Squares Problems, 1996, 4.4 (weighted problems)",
)
