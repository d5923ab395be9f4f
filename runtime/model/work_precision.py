"""What accuracy costs: runs over methods and tolerances, and the cheapest that is good enough.

A tolerance is no error: how large the error at the end is depends on the motion.  So the settings
are tried, and each is compared with a reference.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import NumericalFailure

from ..integrate.settings import Settings
from ..run import engine_choice as compiled_run
from ..run.simulate import advance, choice_of, make_run, said
from ..run.system import SceneSystem

if TYPE_CHECKING:
    from .model import Model


METHODS = ("dop853", "pirk13")
TOLERANCES = tuple(10.0 ** (-k / 2) for k in range(10, 27))


@dataclass(frozen=True)
class WorkPoint:
    """One setting.

    Attributes:
        method, tolerance: `simulate(t_end, method, rtol=tolerance, atol=tolerance)`.
        error: largest deviation of a coordinate or speed at t_end from the reference, in its unit.
        evaluations: calls of the right-hand side.
        seconds: processor time of the loop in C, the least of the repetitions.
    """

    method: str
    tolerance: float
    error: float
    evaluations: int
    seconds: float


def run_once(model: Model, settings: Settings) -> tuple[Array, int, float]:
    """(q and u at t_end, evaluations, processor time of the loop in s) of one run.

    Raises NumericalFailure if it does not reach the end.
    """
    q, u = model.initial_state()
    code = compiled_run.at_once(model, settings, None)
    system = SceneSystem(model.looped, code, with_power=False)
    run = make_run(system, settings, q, u)
    start = time.thread_time()
    status = advance(run, choice=choice_of(system, settings, run))
    seconds = time.thread_time() - start
    if status is None or status < 0:
        why = said(system, run, status)
        raise NumericalFailure(f"{settings.method}, rtol {settings.rtol:g}: {why}")
    return run.y[: model.nq + model.nu], run.statistics.evaluations, seconds


def work_precision(
    model: Model,
    t_end: float,
    reference: Array,
    methods: Sequence[str] = METHODS,
    tolerances: Iterable[float] = TOLERANCES,
    repeat: int = 5,
) -> list[WorkPoint]:
    """Runs from the scene's start to t_end (s) against reference (nq + nu,): q and u at t_end."""
    points = []
    for method in methods:
        for tolerance in tolerances:
            settings = Settings(
                t_end, method=method, rtol=tolerance, atol=tolerance, output_times=(t_end,)
            )
            runs = [run_once(model, settings) for _ in range(repeat)]
            state, evaluations, _ = runs[0]
            error = float(np.abs(state - reference).max())
            seconds = min(run[2] for run in runs)
            points.append(WorkPoint(method, tolerance, error, evaluations, seconds))
    return points


def cheapest(points: Iterable[WorkPoint], error: float) -> WorkPoint:
    """The setting of least time whose error is at most `error`, as is that of all tighter ones of
    its method (so that a lucky hit is not taken for accuracy).

    Raises NumericalFailure if no setting is so accurate.
    """
    points = list(points)
    enough = [
        point
        for point in points
        if all(
            other.error <= error
            for other in points
            if other.method == point.method and other.tolerance <= point.tolerance
        )
    ]
    if not enough:
        best = min(points, key=lambda point: point.error)
        raise NumericalFailure(
            f"no setting errs by at most {error:g}; the best is {best.method} with "
            f"rtol {best.tolerance:g}: {best.error:g}"
        )
    return min(enough, key=lambda point: point.seconds)
