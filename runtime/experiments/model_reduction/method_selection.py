"""Select method and tolerance: the cheapest setting that meets a target error."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mstmm.errors import NumericalFailure

from ...integrate.steppers import AUTO
from ..chart.chart_record import Point, Reference, bound_errors, recommend
from ..chart.method_survey import Curve, Survey, method_curve, repeat_timings
from ..method_families import PROMISING
from ..run_request import ErrorRequest
from ..runs import ALL, EARLY, Budget, Runs
from ..trial import Setting, max_error
from ..tuning import REDUCTION as TUNING
from .scene_edits import rename_reference
from .trial_models import TrialResult

if TYPE_CHECKING:
    from .advice_state import AdviceState


@dataclass(frozen=True)
class SelectedSetting:
    """Setting of a model, with its error and CPU time in `point`.

    They refer to the compared time span; with `covers_whole_run` the integration was checked over
    the whole run.
    """

    trial: TrialResult
    point: Point
    covers_whole_run: bool = False


def cheapest_setting(
    finalists: list[TrialResult], state: AdviceState, target_error: float, seconds: float
) -> SelectedSetting:
    """Cheapest setting of any of these models with an error of at most `target_error`.

    The first model is the smallest.  `seconds` limits the wall-clock time.  Raises NumericalFailure
    if no setting reaches the error.
    """
    bench, rounds = state.runner, state.request.rounds
    budget = Budget(seconds, bench.budget.clock)
    runs = Runs(bench.span.t_end, np.array(bench.runs.times), budget)
    survey = Survey(bench.reference, bench.measure, runs, bench.report)
    reference = Reference(0.0, "", "", bench.measure.name, bench.measure.unit, "")
    model_errors = {tried.name: tried.error / bench.span.growth for tried in finalists}
    curves = []
    for tried in finalists:
        model, enough = tried.compiled_model, TUNING.sufficient_error * target_error
        names = bench.measure.names_of(model)
        quantities = tuple(rename_reference(name, names) for name in state.request.of)
        model_error = model_errors[tried.name]
        integration_error = TUNING.integration_error * (target_error - model_error)
        setting = _setting_for_error(tried, runs, quantities, integration_error)
        if setting is not None:
            curves.append(Curve(setting.method, tried.name, model, enough, "", iter((setting,))))
        curves += [
            method_curve(method, tried.name, model, bench.span.t_end, enough, model_error)
            for method in PROMISING
        ]
    survey.run_curves(curves, EARLY)
    points = bound_errors(survey.points, reference)
    bounds = [math.inf if point.error_bound is None else point.error_bound for point in points]
    sufficient = [i for i, bound in enumerate(bounds) if bound <= target_error]
    if not sufficient:
        raise NumericalFailure(f"no setting reaches an error of {target_error:.1e}")
    smallest_name = finalists[0].name
    order = sorted(sufficient, key=lambda i: points[i].cpu_s or 0.0)
    fastest, others = order[: TUNING.repeated_settings], order[TUNING.repeated_settings :]
    repeated = [*fastest, *(i for i in others if points[i].model == smallest_name)]
    repeated = repeated[: 2 * TUNING.repeated_settings]
    models = [survey.models[i] for i in repeated]
    timed, _ = repeat_timings([points[i] for i in repeated], models, rounds, runs, bench.report)
    best = recommend(timed, target_error, reference)
    of_smallest = [point for point in timed if point.model == smallest_name]
    if of_smallest:  # prefer the smallest model unless it is slower
        smallest = recommend(of_smallest, target_error, reference)
        if (smallest.cpu_s or 0.0) <= TUNING.equal_time_ratio * (best.cpu_s or 0.0):
            best = smallest
    return SelectedSetting(next(tried for tried in finalists if tried.name == best.model), best)


def _setting_for_error(
    tried: TrialResult, runs: Runs, of: tuple[str, ...], error: float
) -> Setting | None:
    """Setting that `simulate` selects for an integration error; None if it fails."""
    options, limit = {"error": ErrorRequest(error, of)}, runs.budget.run_limit(ALL)
    result, _ = runs.try_simulate(tried.compiled_model, options, limit)
    estimate = None if result is None else result.achieved_error
    if result is None or estimate is None or not result.is_comparable:
        return None
    return Setting(estimate.method, tried.name, estimate.rtol)


def compare_cpu_times(
    state: AdviceState, *settings: tuple[TrialResult, Setting]
) -> tuple[float, float] | None:
    """CPU times of two runs in alternating rounds, s; None if one fails or takes too long."""
    bench, points = state.runner, []
    models = [tried.compiled_model for tried, _ in settings]
    for model, (_, setting) in zip(models, settings, strict=True):
        trial = bench.runs.trial(model, setting, bench.measure, bench.budget.remaining() / 2)
        if trial.numbers is None:
            return None
        points.append(Point(setting, 0.0, trial.cpu_s, 1))
    timed, _ = repeat_timings(points, models, state.request.rounds, bench.runs, bench.report)
    first, second = (point.cpu_s or 0.0 for point in timed)
    return first, second


def whole_run_tolerance(
    best: TrialResult, state: AdviceState, allowed_error: float
) -> SelectedSetting | None:
    """Tolerance of method "auto" whose error over the whole run is at most `allowed_error`.

    None if none is found in time.
    """
    span, measure = state.runner.span, state.measure
    seconds = max(TUNING.min_whole_run_budget * state.request.budget, state.budget.remaining())
    budget = Budget(seconds, state.budget.clock)
    times = np.linspace(0.0, span.whole_t_end, state.request.samples)
    runs = Runs(span.whole_t_end, times, budget)
    tightest = TUNING.tightest_rtol / TUNING.verification_ratio
    rtol = min(max(TUNING.first_rtol * state.relative_target, tightest), 1e-3)
    for _ in range(TUNING.max_whole_run_trials):
        setting = Setting(AUTO, best.name, rtol)
        tighter = Setting(AUTO, best.name, rtol * TUNING.verification_ratio)
        trial = runs.trial(best.compiled_model, setting, measure, budget.remaining() / 3)
        verification = runs.trial(best.compiled_model, tighter, measure, budget.remaining() / 2)
        if trial.numbers is None or verification.numbers is None:
            return None
        error, reason = max_error(trial, verification, measure)
        if reason:
            return None
        if error <= allowed_error:
            total_error = (best.error + error) / span.growth
            return SelectedSetting(
                best, Point(setting, total_error, trial.cpu_s, 1), covers_whole_run=True
            )
        if rtol <= tightest:
            return None
        ratio = min(max(TUNING.target_fraction * allowed_error / error, 1e-4), 0.1)
        rtol = max(rtol * ratio, tightest)
    return None
