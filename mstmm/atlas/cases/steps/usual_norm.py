"""Adaptive steps that judge speeds by themselves, beside a spring that begins slack."""

from __future__ import annotations

from ...definition import Definition, Method
from ...measures import simulated
from ...scale import LOG
from ...scenes import sprung_elbow
from ...variants.plain_rosenbrock import Steps

T_END, RTOL, ATOL = 0.5, 1e-4, 1e-6

#: Where counting steps ends.
MOST = 4000


def _usual(stiffness: float) -> float:
    return Steps(sprung_elbow(stiffness), "rodas4p2").needed(T_END, RTOL, ATOL, MOST)


def _ours(stiffness: float) -> float:
    run = simulated(sprung_elbow(stiffness), T_END, "rodas4p2", rtol=RTOL, atol=ATOL)
    assert run.statistics is not None
    return run.statistics.steps + run.statistics.rejected


CASE = Definition(
    name="usual-norm",
    title="The usual norm of errors: a stiff spring that begins slack",
    why="A slack spring begins to swing with the speed of the load over its frequency, which is "
    "far above any tolerance where the way it swings is far below. Judged by itself that speed "
    "makes every period resolved. Judged by what it moves within the step it is let go, and the "
    "run follows the motion alone. (A spring so stiff that even its speed is below the tolerance "
    "is harmless either way.)",
    parameter="stiffness of an elbow between falling rods", unit="N m/rad", low=1.0, high=1e8,
    scale=LOG,
    measured="steps in 0.5 s, rejected ones with them", limit=500,
    method=Method("rodas4p2, rtol 1e-4, speeds by themselves", _usual),
    remedy=Method("rodas4p2, rtol 1e-4", _ours), reach=1e16,
    source="Hairer, Wanner, Solving Ordinary Differential Equations II, 1996, IV.8 (the norm); "
    "Lubich, ZAMP 44, 1993 (stiff mechanical systems)",
)  # fmt: skip
