"""Method and tolerance of a model: what a wanted error leads to, or what is cheaper."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mstmm.errors import MstmmError, NumericalFailure

from ..chart.chart_points import Point, Reference, Setting
from ..chart.method_families import PROMISING
from ..chart.method_survey import Curve, Survey, method_curve
from ..chart.pareto_front import bound_errors, recommend
from ..chart.repeated_timing import repeat_timings
from ..chart.time_budget import ALL, EARLY, Budget, OutOfTime
from ..chart.trial_run import Runs
from .measure_renaming import rename_reference
from .trial_models import TrialResult, TrialRunner

#: What is left of the error asked beside the model's own: this part of it is wanted of the
#: integration, and where an error is down to this part of what is asked, tighter settings show
#: nothing more.
_WANTED, _ENOUGH = 0.5, 0.3

#: Settings whose times are taken again; a model counts as quick as another up to so many times its
#: time, for times scatter.
_AGAIN, _AS_QUICK = 8, 1.15


@dataclass(frozen=True)
class SelectedSetting:
    """A setting of a model: its point holds error and processor time over the span; those of the
    integration over the `whole` run, where that is more."""

    tried: TrialResult
    point: Point
    whole: bool = False


def cheapest(
    finalists: list[TrialResult],
    bench: TrialRunner,
    asked: float,
    of: tuple[str, ...],
    rounds: int,
    seconds: float,
) -> SelectedSetting:
    """The cheapest setting of any of these models that errs by at most `asked` over the span; the
    first of them is the smallest.

    `seconds` of the clock may be taken.  Raises NumericalFailure where no setting does.
    """
    budget = Budget(seconds, bench.budget.clock)
    runs = Runs(bench.span.t_end, np.array(bench.runs.times), budget)
    survey = Survey(bench.reference, bench.measure, runs, bench.tell)
    reference = Reference(0.0, "", "", bench.measure.name, bench.measure.unit, "")
    own = {one.name: one.error / bench.span.growth for one in finalists}
    curves = []
    for one in finalists:
        model, enough = one.running, _ENOUGH * asked
        names = bench.measure.names_in(model)
        theirs = tuple(rename_reference(name, names) for name in of)
        found = _wanted(one, runs, theirs, _WANTED * (asked - own[one.name]))
        if found is not None:
            curves.append(Curve(found.method, one.name, model, enough, "", iter((found,))))
        curves += [
            method_curve(method, one.name, model, bench.span.t_end, enough, own[one.name])
            for method in PROMISING
        ]
    found_all = survey.make(curves, EARLY)
    points = bound_errors(found_all.points, reference)
    good = [i for i, p in enumerate(points) if p.sure_error is not None and p.sure_error <= asked]
    if not good:
        raise NumericalFailure(f"none of the methods that were tried errs by at most {asked:.1e}")
    few = sorted(good, key=lambda i: points[i].cpu_s or 0.0)
    few = [*few[:_AGAIN], *(i for i in few[_AGAIN:] if points[i].model == finalists[0].name)]
    few = few[: 2 * _AGAIN]
    models = [found_all.models[i] for i in few]
    again, _ = repeat_timings([points[i] for i in few], models, rounds, runs, bench.tell)
    best = recommend(again, asked, reference)
    own_ones = [point for point in again if point.model == finalists[0].name]
    if own_ones:  # the smallest model counts where it is no slower
        smallest = recommend(own_ones, asked, reference)
        if (smallest.cpu_s or 0.0) <= _AS_QUICK * (best.cpu_s or 0.0):
            best = smallest
    return SelectedSetting(next(one for one in finalists if one.name == best.model), best)


def _wanted(one: TrialResult, runs: Runs, of: tuple[str, ...], error: float) -> Setting | None:
    """The setting to which an error of the integration alone leads; None where it leads to none."""
    try:
        options = {"error": error, "error_of": of}
        result, _ = runs.called(one.running, options, runs.budget.share(ALL))
    except (OutOfTime, MstmmError, ArithmeticError, np.linalg.LinAlgError):
        return None
    known = result.error_estimate
    if known is None or not result.is_comparable:
        return None
    return Setting(known.method, one.name, known.rtol)


def compare_cpu_times(
    a: TrialResult,
    setting: Setting,
    b: TrialResult,
    other: Setting,
    bench: TrialRunner,
    rounds: int,
) -> tuple[float, float] | None:
    """Processor times of two runs in alternating rounds, s; None where one fails or takes too
    long."""
    points, models = [], [a.running, b.running]
    for model, one in zip(models, (setting, other), strict=True):
        trial = bench.runs.trial(model, one, bench.measure, bench.budget.left() / 2)
        if trial.numbers is None:
            return None
        points.append(Point(one, 0.0, trial.cpu_s, 1))
    timed, _ = repeat_timings(points, models, rounds, bench.runs, bench.tell)
    first, second = (point.cpu_s or 0.0 for point in timed)
    return first, second
