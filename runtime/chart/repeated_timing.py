"""Processor times taken again in alternating rounds, each point once in every round."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from .chart_points import Point
from .time_budget import OutOfTime
from .trial_run import Runs

if TYPE_CHECKING:
    from ..model.model import Model

#: Runs that take more than this part of the time for all rounds are not made again: their times
#: vary little, and others would lose theirs.
_LONG = 50.0

#: Processor time (s) that short runs fill with calls in one round, and how many calls at most.
_FILLED, _CALLS = 5e-3, 5


def repeat_timings(
    points: list[Point], models: list[Model], rounds: int, runs: Runs, tell: Callable[[str], None]
) -> tuple[list[Point], int]:
    """The points with the least time of all their runs; and how many missed a round.

    A round takes the cheap points first and leaves out those that no longer fit into the budget;
    runs so long that a few of them would fill it have no part in rounds.
    """
    timed = list(points)
    longest = runs.budget.left() / _LONG
    times = {i: p.cpu_s for i, p in enumerate(points) if p.cpu_s is not None}
    order = sorted((i for i in times if times[i] <= longest), key=lambda i: (times[i], i))
    missed: set[int] = set()
    for number in range(rounds):
        tell(f"times taken again, round {number + 1} of {rounds}")
        rest = rounds - number
        kept = runs.budget.left() * (rest - 1) / rest  # for the rounds that follow
        missed |= {i for i in order if not _again(timed, i, models[i], runs, kept)}
    return timed, len(missed) + len(times) - len(order)


def _again(timed: list[Point], i: int, model: Model, runs: Runs, kept: float) -> bool:
    """Time one point again; False where that would take of the time that is kept."""
    point = timed[i]
    assert point.cpu_s is not None
    left, once = runs.budget.left() - kept, max(point.cpu_s, 1e-6)
    calls = max(1, min(_CALLS, int(_FILLED / once)))
    if calls * once > left:
        return False
    try:
        spent = [runs.simulate(model, point.setting, left)[1] for _ in range(calls)]
    except OutOfTime:
        return False
    timed[i] = replace(point, cpu_s=min(point.cpu_s, *spent), repeats=point.repeats + len(spent))
    return True
