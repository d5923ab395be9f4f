"""Loop that cannot close, with gaps weighted by the mobility of the bodies."""

from __future__ import annotations

import math
from functools import cache

from ....runtime.model.model import Model
from ...definition import Definition, Method
from ...scale import LOG
from ...scenes import four_bar, model
from ...variants.gap_by_masses import nearest

#: Distance of the feet, m; fixed angle of the crank and initial rotation of the coupler, rad.
FEET, HELD, BESIDE = 1.6, 2.8, 1.0
CRANK, COUPLER, ROCKER = 0.5, 1.1, 0.8


@cache
def _linkage(spread: float) -> Model:
    """Four-bar linkage with a very light coupler that is too short at some crank angles."""
    scene = four_bar(ratio=1e-3, spread=spread, feet=FEET)
    closing = scene["hinge"][-1]
    closing["inboard"], closing["outboard"] = closing["outboard"], closing["inboard"]
    return model(scene)


def _error(spread: float, by_masses: bool) -> float:
    """Relative excess of the gap; the least gap has coupler and rocker on the line of the pins."""
    linkage = _linkage(spread)
    q = linkage.initial_state()[0]
    hinges = linkage.layout.hinges
    q[hinges["foot"].q_slice] = HELD
    q[hinges["knee"].q_slice] += BESIDE
    pose = nearest(linkage, q, "foot", by_masses)
    knee = [CRANK * math.cos(HELD), CRANK * math.sin(HELD)]
    least = math.dist(knee, (FEET, 0.0)) - COUPLER - ROCKER
    turned = HELD + pose["knee"]
    tips = (
        (knee[0] + COUPLER * math.cos(turned), knee[1] + COUPLER * math.sin(turned)),
        (FEET + ROCKER * math.cos(pose["heel"]), ROCKER * math.sin(pose["heel"])),
    )
    return math.dist(*tips) / least - 1.0


CASE = Definition(
    name="least-gap",
    title="Least gaps of open loops weighted by masses: a slender coupler",
    why="Where a loop cannot be closed, the pose of the least gap shows the reason. Weighted by "
    "the mobility of each row, gaps across a coupler with its mass in the middle count next to "
    "nothing. The iteration then ends with the bodies far apart, and the message reports a "
    "misleading gap and pose. One scale for all rows of a kind leaves the least gap to the "
    "geometry, and still prefers steps that move little mass.",
    parameter="moments of inertia of rods over those of uniform ones", unit="",
    low=1e-4, high=10.0, scale=LOG,
    measured="gap in excess of the least one, relative", limit=1e-3,
    method=Method("each row by its own mobility", lambda x: _error(x, True)),
    remedy=Method("one scale for all rows of a kind", lambda x: _error(x, False)), reach=1e-8,
    source="Levenberg, Quarterly of Applied Mathematics 2, 1944 (damped least squares); "
    "Bjorck, Numerical Methods for Least Squares Problems, 1996, 4.4 (weighted problems)",
)  # fmt: skip
