"""Repeat the measurement of CPU times in rounds, each point once in every round."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from .chart_points import Point
from .time_budget import OutOfTime
from .trial_run import Runs

if TYPE_CHECKING:
    from ..model.model import Model

#: Runs that take more than the remaining time over this number are not repeated: their times vary
#: little, and they would leave too little time for the others.
_MIN_RUNS = 50.0

#: In each round a short run is called repeatedly up to this CPU time (s) and number of calls.
_ROUND_CPU_S, _MAX_CALLS = 5e-3, 5


def repeat_timings(
    points: list[Point], models: list[Model], rounds: int, runs: Runs, report: Callable[[str], None]
) -> tuple[list[Point], int]:
    """Repeat the timing of points; return them, and how many missed at least one round.

    CPU times become the smallest of all runs.  A round runs cheap points first, and skips points
    that no longer fit into the budget; very long runs are not repeated.
    """
    timed = list(points)
    longest = runs.budget.remaining() / _MIN_RUNS
    times = {i: point.cpu_s for i, point in enumerate(points) if point.cpu_s is not None}
    order = sorted((i for i in times if times[i] <= longest), key=lambda i: (times[i], i))
    missed: set[int] = set()
    for number in range(rounds):
        report(f"repeat timings, round {number + 1} of {rounds}")
        remaining = rounds - number
        reserved = runs.budget.remaining() * (remaining - 1) / remaining  # for the later rounds
        missed |= {i for i in order if not _time_point(timed, i, models[i], runs, reserved)}
    return timed, len(missed) + len(times) - len(order)


def _time_point(timed: list[Point], i: int, model: Model, runs: Runs, reserved: float) -> bool:
    """Time point i again; return False if that would use the reserved time (s)."""
    point = timed[i]
    assert point.cpu_s is not None
    left, once = runs.budget.remaining() - reserved, max(point.cpu_s, 1e-6)
    calls = max(1, min(_MAX_CALLS, int(_ROUND_CPU_S / once)))
    if calls * once > left:
        return False
    try:
        spent = [runs.simulate(model, point.setting, left)[1] for _ in range(calls)]
    except OutOfTime:
        return False
    timed[i] = replace(point, cpu_s=min(point.cpu_s, *spent), repeats=point.repeats + len(spent))
    return True
