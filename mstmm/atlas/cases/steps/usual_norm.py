"""Adaptive steps with errors of speeds weighted separately, for a slack stiff spring."""

from __future__ import annotations

from ...definition import Definition, Method
from ...measures import simulated
from ...scale import LOG
from ...scenes import sprung_elbow
from ...variants.plain_rosenbrock import Steps

T_END, RTOL, ATOL = 0.5, 1e-4, 1e-6

#: Largest number of steps that is counted.
MOST = 4000


def _usual(stiffness: float) -> float:
    return Steps(sprung_elbow(stiffness), "rodas4p2").needed(T_END, RTOL, ATOL, MOST)


def _ours(stiffness: float) -> float:
    run = simulated(sprung_elbow(stiffness), T_END, "rodas4p2", rtol=RTOL, atol=ATOL)
    assert run.statistics is not None
    return run.statistics.steps + run.statistics.rejected


CASE = Definition(
    name="usual-norm",
    title="The usual error norm: a stiff spring that is slack at the start",
    why="A slack spring starts to vibrate with the speed of the load over its frequency, far "
    "above any tolerance, while the displacement of that vibration is far below. In the usual norm "
    "that speed forces every period to be resolved. Weighted by the displacement within the step "
    "the speed is ignored, and the run follows only the slow motion. (A spring so stiff that even "
    "its speed is below the tolerance is harmless in both norms.)",
    parameter="stiffness of an elbow between falling rods", unit="N m/rad", low=1.0, high=1e8,
    scale=LOG,
    measured="steps in 0.5 s, including rejected ones", limit=500,
    method=Method("rodas4p2, rtol 1e-4, speeds weighted separately", _usual),
    remedy=Method("rodas4p2, rtol 1e-4", _ours), reach=1e16,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.8 (the norm); "
    "Lubich, ZAMP 44, 1993 (stiff mechanical systems)",
)  # fmt: skip
