"""Find the smallest sufficient model: estimates, reference, search, method and tolerance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from mstmm.errors import NumericalFailure

from ...integrate.steppers import AUTO
from ..chart.chart_record import Point
from ..error_measure import scene_length_with_ends, select_measure
from ..model_levels import Variant, model_levels
from ..runs import Budget, Compile, Report
from ..trial import Setting
from ..tuning import REDUCTION as TUNING
from .advice import Advice
from .advice_state import RICHEST, AdviceState, Request, motion_size
from .advice_summary import build_advice
from .beam_splitting import subdivide_beams
from .body_models import Bodies, ErrorPrediction, predict_errors
from .method_selection import SelectedSetting, cheapest_setting, whole_run_tolerance
from .scene_reduction import (
    merge_welded,
    omission_changes,
    reduce_by_halves,
    reduce_to_plane,
    rigid_hinge_changes,
)
from .search import Choices, ModelSearch
from .trial_models import Renaming, TrialResult, TrialRunner, choose_window, initial_rtol

if TYPE_CHECKING:
    from ..simulation import SimulatedScene


def make_advice(
    model: SimulatedScene, request: Request, compile: Compile, report: Report,
    report_status: Report, budget: Budget | None = None,
) -> Advice:  # fmt: skip
    """Find the smallest sufficient model; `compile` makes the models that are compared.

    `report_status` is called with a description of the comparison, `report` before every run.
    Raises SceneError for an unknown quantity, NumericalFailure if the scene cannot be simulated or
    errors of this size cannot be resolved.
    """
    state = AdviceState(model.scene, request, budget or Budget(request.budget), compile, report)
    top = model_levels(state.scene)[-1]
    richest = compile(top.scene)
    start = richest.simulate(0.0, method="dop853")
    state.measure = Renaming(select_measure(richest, start, request.of, True))
    state.length = scene_length_with_ends(richest)
    one_way = state.run_one_way(state.scene)
    state.size = motion_size(state.measure, one_way)
    predictions = predict_errors(one_way, state.length)[0]
    state.runner, base = _make_runner(state, top, richest, predictions, report_status)
    evidence, reason = state.error_predictions(one_way, richest)
    if reason:
        state.notes.append(f"no error estimates for the flexible bodies: {reason}")
    base = reduce_to_plane(state, top, richest, base)
    q = state.runner.reference.trajectory.q
    state.unsplit_models = Bodies(top.scene).richest
    base, evidence = subdivide_beams(state, base, evidence)
    changes = rigid_hinge_changes(base.scene, richest, q, state.length)
    max_error = TUNING.rigid_error * request.error
    base = reduce_by_halves(state, base, "rigid", changes, max_error, cheap=True)
    state.runner.names = state.measure.names_of(base.compiled_model)
    return _reduce_bodies(state, base, evidence)


def _make_runner(
    state: AdviceState,
    top: Variant,
    model: SimulatedScene,
    evidence: Mapping[str, ErrorPrediction],
    report_status: Report,
) -> tuple[TrialRunner, TrialResult]:
    """Runner of trial models with its reference, over the whole run or a window of it."""
    request = state.request
    rtol = initial_rtol(state.relative_target)
    span = choose_window(model, request.t_end, request.samples, state.budget, state.measure, rtol)
    if not span.is_whole_run:
        rise = max((prediction.rise(span.t_end) for prediction in evidence.values()), default=1.0)
        span = replace(span, rise=min(rise, TUNING.max_rise))
    runner = TrialRunner(
        span, request.samples, state.budget, state.measure, state.compile, state.report
    )
    richest = runner.make_reference(top.scene, model, RICHEST, request.error, state.relative_target)
    report_status(
        f"models are compared over {span}; error of the reference about {richest.error:.1e}"
    )
    if not span.is_whole_run:
        state.notes.append(
            "motion after the window was not simulated: plane, hinges, springs and dampers stay as "
            "they are; give a larger --budget to have them examined"
        )
    return runner, richest


def _reduce_bodies(
    state: AdviceState, base: TrialResult, evidence: Mapping[str, ErrorPrediction]
) -> Advice:
    """Advice for a scene whose plane, beams and rigid hinges have been decided."""
    state.bodies = Bodies(base.scene)
    search = ModelSearch(
        state.bodies, state.runner, evidence, state.error_budget, state.error_per_metre,
        lambda: state.budget.remaining(TUNING.search_budget) > 0,
    )  # fmt: skip
    for name in (RICHEST, base.name):
        search.choices_by_name[name] = state.bodies.richest
    choices, best = search.run() if state.bodies.richest else ({}, base)
    state.skipped += [f"smaller models of body {name}" for name in search.skipped]
    state.change_texts.setdefault(best.name, state.change_texts[base.name])
    max_error = TUNING.omission_error * state.request.error
    max_error = max(max_error, TUNING.omission_growth * best.error)
    best = reduce_by_halves(
        state, best, "without", omission_changes(best.scene), max_error, cheap=False
    )
    best = merge_welded(state, best, max_error)
    search.choices_by_name.setdefault(best.name, choices)
    selected = _select_setting(state, best, choices, search)
    choices = search.choices_by_name.get(selected.trial.name, choices)
    return build_advice(state, choices, evidence, selected, search, base.name)


def _select_setting(
    state: AdviceState, best: TrialResult, choices: Choices, search: ModelSearch
) -> SelectedSetting:
    """Cheapest setting of the model found, or of another one that is nearly as fast.

    A more accurate model leaves more of the target error to the integration, and may be cheaper in
    total.
    """
    available = state.remaining_target
    if best.error > TUNING.accurate_error * available and choices != state.bodies.richest:
        search.try_choices(search.richer(choices))

    def time_factor(tried: TrialResult) -> float:
        is_accurate = tried.error <= TUNING.accurate_error * state.request.error
        return TUNING.accurate_time_factor if is_accurate else TUNING.time_factor

    others = [
        tried
        for tried in sorted(state.runner.results, key=lambda tried: tried.cpu_s)
        if search.choices_by_name.get(tried.name, choices) != choices
        and tried.error <= state.error_budget
        and tried.cpu_s <= time_factor(tried) * best.cpu_s
    ]
    if not state.runner.span.is_whole_run:
        selected = whole_run_tolerance(best, state, TUNING.total_error * available - best.error)
        if selected is not None:
            return selected
        state.notes.append(
            "method and tolerance were selected over the window only: their error after it is "
            "extrapolated"
        )
    finalists = [best, *others][: TUNING.max_finalists]
    seconds = max(TUNING.method_budget * state.request.budget, state.budget.remaining())
    max_error, growth = TUNING.total_error * available, state.runner.span.growth
    try:
        return cheapest_setting(finalists, state, max_error / growth, seconds)
    except NumericalFailure:  # keep the setting of the trial runs
        setting = Setting(AUTO, best.name, state.runner.rtol)
        return SelectedSetting(best, Point(setting, best.error / growth, best.cpu_s, 1))
