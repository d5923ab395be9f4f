"""Build the advice from the results of the search: choices with reasons, savings, outputs."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from mstmm.defaults import METHOD, RTOL
from mstmm.display import abbreviate_names
from mstmm.scene import Scene

from ...integrate.steppers import AUTO
from ..chart.chart_record import Point
from ..model_levels import with_tables
from ..trial import Setting, max_error
from .advice import Advice, BodyAdvice, TriedModel
from .advice_state import AdviceState
from .body_models import (
    LINEAR,
    ONE_WAY,
    RIGID,
    STIFFENED,
    BodyModel,
    ErrorPrediction,
    given_body_model,
)
from .method_selection import SelectedSetting, compare_cpu_times, whole_run_tolerance
from .search import ModelSearch

if TYPE_CHECKING:
    from mstmm.scene.tables.beam import Beam
    from mstmm.scene.tables.elastic import Elastic

    from ..simulation import SimulatedScene


#: Name of the given scene among the models tried.
AS_GIVEN = "as given"


def build_advice(
    state: AdviceState,
    choices: Mapping[str, BodyModel],
    evidence: Mapping[str, ErrorPrediction],
    selected: SelectedSetting,
    search: ModelSearch,
    base: str,
) -> Advice:
    """Build the advice; `base` is the name of the model before the search over bodies."""
    request, bench = state.request, state.runner
    model_saving, setting_saving = _savings(state, selected)
    given = _given_scene_if_better(state, selected, model_saving)
    if given is not None:
        reason = "stays as it is: a smaller model of the scene is slower and less accurate"
        given_models = {name: _given_model(state, name) for name in state.unsplit_models}
        bodies = tuple(
            BodyAdvice(name, model, model, None, None, reason, evidence.get(name))
            for name, model in given_models.items()
        )
        selected, state.parts = given, {}
        model_saving, setting_saving = _savings(state, selected)
    else:
        undeformed = {  # bodies that do not deform in the plane of motion
            name: BodyModel(RIGID)
            for name in state.unsplit_models
            if name not in state.bodies.richest and name not in state.parts.values()
        }
        bodies = tuple(
            _body_advice(state, name, choice, evidence.get(name), search)
            for name, choice in {**undeformed, **choices}.items()
        )
    changes = state.change_texts.get(selected.trial.name, state.change_texts[base])
    if not bodies:
        state.notes.append("there is nothing to reduce in the bodies: none of them is flexible")
    missing = [*state.skipped, *(f"model {name}" for name in bench.late)]
    if missing:
        state.notes.append(
            f"the budget of {request.budget:g} s limits this advice; not examined: "
            f"{abbreviate_names(missing)}; a larger --budget may lead to another model"
        )
    growth = bench.span.growth
    error = selected.point.error
    assert error is not None and selected.point.cpu_s is not None
    return Advice(
        request.error, state.measure.name, state.measure.unit, state.measure.scaling, request.t_end,
        _comparison_text(state, selected), bench.span.is_whole_run,
        max(bench.floor, state.reference_error), bodies, changes, selected.point.setting,
        error * growth + state.reference_error, selected.point.cpu_s, model_saving, setting_saving,
        with_available_outputs(selected.trial.scene, state.compile),
        dict(state.measure.names_of(selected.trial.compiled_model)), dict(state.parts),
        tuple(state.notes),
        tuple(
            TriedModel(
                tried.name, tried.error if math.isfinite(tried.error) else None, tried.cpu_s,
                tried.reason,
            )
            for tried in bench.results if math.isfinite(tried.cpu_s)
        ),
    )  # fmt: skip


def _given_scene_if_better(
    state: AdviceState, selected: SelectedSetting, saving: float | None
) -> SelectedSetting | None:
    """Setting of the given scene if the reduced model is slower and less accurate, else None."""
    bench, setting = state.runner, selected.point.setting
    scene = bench.run_trial(AS_GIVEN, state.scene, {})
    if saving is None or saving >= 1 or scene.model is None:
        return None
    if scene.error >= selected.trial.error or scene.error > state.error_budget:
        return None
    if selected.covers_whole_run:
        given = whole_run_tolerance(scene, state, state.remaining_target - scene.error)
    else:
        trial = bench.runs.trial(scene.model, setting, bench.measure, bench.budget.remaining())
        error, _ = max_error(trial, bench.reference, bench.measure)
        if error * bench.span.growth > state.remaining_target:
            return None
        given = SelectedSetting(
            scene, Point(replace(setting, model=AS_GIVEN), error, trial.cpu_s, 1)
        )
    if given is not None:
        state.change_texts[AS_GIVEN] = ()
        state.notes.append(
            f"the scene is not reduced: a smaller model has an error of {selected.trial.error:.1e} "
            f"and takes {1 / saving:.2f} times the time of the scene as given, whose error is "
            f"{scene.error:.1e}"
        )
    return given


def _comparison_text(state: AdviceState, selected: SelectedSetting) -> str:
    """Description of the time span over which errors were measured."""
    bench, text = state.runner, str(state.runner.span)
    if selected.covers_whole_run:
        text += f" (the integration over all of its {state.request.t_end:g} s)"
    ended = bench.reference.ended
    end = bench.reference.trajectory.t[-1]
    return f"{text}, up to its end at {end:.4g} s: {ended}" if ended else text


def _body_advice(
    state: AdviceState,
    name: str,
    choice: BodyModel,
    prediction: ErrorPrediction | None,
    search: ModelSearch,
) -> BodyAdvice:
    """Advice for one body; its choice alone is tried with the richest models of all others."""
    richest_choices = state.bodies.richest
    is_richest = choice == richest_choices.get(name, choice)
    error, saving = (state.runner.floor, 1.0) if is_richest else (None, None)
    if not is_richest and state.budget.remaining():
        single = search.try_choices({**richest_choices, name: choice})
        if math.isfinite(single.error):
            richest_model = search.try_choices(richest_choices)
            error, saving = single.error, richest_model.cpu_s / single.cpu_s
    split = None
    if prediction is not None and state.may_need_splitting(prediction) and name not in state.parts:
        split = state.split_error or prediction.frame_error * state.error_per_metre
    is_part = name in state.parts
    richest = richest_choices.get(name, choice) if is_part else state.unsplit_models[name]
    reason = _choice_reason(choice, richest, prediction, state.error_per_metre, state.request.error)
    if split is not None and prediction is not None:
        reason += f"; its slope is {prediction.slope:.2g}, for which one floating frame "
        reason += (
            f"has a measured error of {split:.1e}, small compared with the target error"
            if state.split_error is not None
            else f"may have an error of {split:.1e}: split it into welded beams"
        )
    return BodyAdvice(
        name, _given_model(state, name), choice, error, saving, reason, prediction, split
    )


def _given_model(state: AdviceState, name: str) -> BodyModel:
    """Model of a body in the given scene; for a part of a split beam, that of the whole beam."""
    bodies: tuple[Beam | Elastic, ...] = (*state.scene.beam, *state.scene.elastic)
    whole = state.parts.get(name, name)
    given = next(body for body in bodies if body.name == whole)
    return given_body_model(given, state.unsplit_models[whole])


def _savings(state: AdviceState, selected: SelectedSetting) -> tuple[float | None, float | None]:
    """Factors of CPU time saved by the model, and by method and tolerance; None if unknown.

    The first compares the given scene with the advised one at the same tolerance, the second the
    default setting with the advised one on the advised scene.
    """
    setting, tried = selected.point.setting, selected.trial
    rtol = RTOL if setting.fixed else setting.value
    same_setting = Setting(AUTO, tried.name, rtol)
    default_setting = Setting(METHOD, tried.name, RTOL)
    given = state.runner.run_trial(AS_GIVEN, state.scene, {})
    savings: list[float | None] = []
    for model, before, after in (
        (given, same_setting, same_setting), (tried, default_setting, setting),
    ):  # fmt: skip
        saving = None
        if model.scene == tried.scene and before == after:
            saving = 1.0
        elif model.model is not None:
            times = compare_cpu_times(state, (model, before), (tried, after))
            saving = None if times is None else times[0] / times[1]
        savings.append(saving)
    return savings[0], savings[1]


def with_available_outputs(scene: Scene, compile: Callable[[Scene], SimulatedScene]) -> Scene:
    """The scene without the outputs that its results cannot provide."""
    if not scene.output:
        return scene
    available = compile(scene).simulate(0.0, "dop853").outputs()
    return with_tables(
        scene, output=tuple(output for output in scene.output if output.name in available)
    )


# --- reasons --------------------------------------------------------------------------------------


def _choice_reason(
    choice: BodyModel,
    richest: BodyModel,
    prediction: ErrorPrediction | None,
    in_measure: float,
    target_error: float,
) -> str:
    """Reason why a model suffices and no smaller one does.

    `in_measure` is the factor from m to the unit of errors.
    """
    if prediction is None:
        return "found by trial runs, without error estimates"
    deflects = f"it deflects by {prediction.deflection * in_measure:.1e}"
    if not prediction.deflection > 0:
        deflects = "its ends do not move in its floating frame"
    if choice.level == RIGID:
        omitted = ", about the error of a rigid body" if prediction.deflection > 0 else ""
        return f"{deflects}{omitted}"
    if choice.level == ONE_WAY:
        return (
            f"{deflects}; its reaction on the motion is small (chi {prediction.coupling:.2g}, "
            f"gamma {prediction.load_ratio:.1e})"
        )
    parts = [deflects, _stiffening_text(choice, prediction, in_measure, target_error)]
    omitted_shapes = sorted(name for name in prediction.by_shape if not choice.keeps_shape(name))
    if omitted_shapes:
        deflection = sum(prediction.by_shape[name] for name in omitted_shapes) * in_measure
        parts.append(
            f"the shapes left out ({', '.join(omitted_shapes)}) deflect it by {deflection:.1e}"
        )
    elif choice.shapes != richest.shapes:
        parts.append("fewer shapes suffice in trial runs")
    return "; ".join(parts)


def _stiffening_text(
    choice: BodyModel, prediction: ErrorPrediction, in_measure: float, target_error: float
) -> str:
    """Change of the stiffness by loads, and whether the model includes it."""
    effect = prediction.deflection * prediction.load_ratio * in_measure
    text = (
        f"its loads change its stiffness by gamma {prediction.load_ratio:.1e}, an effect of "
        f"{effect:.1e}"
    )
    if choice.level == LINEAR:
        return f"{text}, which linear kinematics neglect"
    needed = choice.level == STIFFENED and (effect > target_error or prediction.stiffens)
    return f"{text}, which stiffening includes" + ("" if needed else " at no cost")
