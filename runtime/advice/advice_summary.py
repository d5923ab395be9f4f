"""What an advice says of what was found: every choice alone, with its reason; what was saved."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from mstmm.defaults import METHOD, RTOL
from mstmm.safe_text import abbreviate_names

from ..chart.chart_points import Point, Setting
from ..chart.trial_run import max_error
from ..integrate.steppers import AUTO
from .advice import Advice, BodyAdvice, TriedModel
from .advice_state import AdviceState
from .body_model_levels import RIGID, BodyModel, given_choice
from .error_predictors import ErrorPrediction
from .full_run_settings import whole_run_tolerance
from .method_selection import SelectedSetting, compare_cpu_times
from .reason_text import reason
from .reduced_outputs import with_outputs_there
from .search import Choices, ModelSearch

if TYPE_CHECKING:
    from mstmm.scene.tables.beam import Beam
    from mstmm.scene.tables.elastic import Elastic

#: Name of the scene as it was given, among the models tried.
AS_GIVEN = "as given"


def build_advice(
    work: AdviceState,
    choices: Mapping[str, BodyModel],
    evidence: Mapping[str, ErrorPrediction],
    chosen: SelectedSetting,
    search: ModelSearch,
    base: str,
) -> Advice:
    """The advice.  `base` is the model that has what was changed before bodies were looked at."""
    asked, bench = work.asked, work.bench
    model_saving, setting_saving = _savings(work, chosen)
    instead = _scene_as_given(work, chosen, model_saving)
    if instead is not None:
        chosen, bodies, work.parts = instead, _bodies_as_given(work, evidence), {}
        model_saving, setting_saving = _savings(work, chosen)
    else:
        bodies = tuple(
            _body(work, name, choice, evidence.get(name), search)
            for name, choice in {**_straightened(work), **choices}.items()
        )
    changes = work.told.get(chosen.tried.name, work.told[base])
    if not bodies:
        work.notes.append("there is nothing to reduce in the bodies: none of them deforms")
    missing = [*work.skipped, *(f"model {name}" for name in bench.late)]
    if missing:
        work.notes.append(
            f"the budget of {asked.budget:g} s limits this advice; not examined: "
            f"{abbreviate_names(missing)}; with more --budget another model may be advised"
        )
    growth = bench.span.growth
    error = chosen.point.error
    assert error is not None and chosen.point.cpu_s is not None
    return Advice(
        asked.error, work.measure.name, work.measure.unit, work.measure.scaling, asked.t_end,
        _compared(work, chosen), bench.span.whole, max(bench.floor, work.unseen), bodies, changes,
        chosen.point.setting, error * growth + work.unseen, chosen.point.cpu_s, model_saving,
        setting_saving, with_outputs_there(chosen.tried.scene, work.compile),
        dict(work.measure.names_in(chosen.tried.running)), dict(work.parts),
        tuple(work.notes),
        tuple(
            TriedModel(
                one.name, one.error if math.isfinite(one.error) else None, one.cpu_s, one.why
            )
            for one in bench.all
            if math.isfinite(one.cpu_s)
        ),
    )  # fmt: skip


def _scene_as_given(
    work: AdviceState, chosen: SelectedSetting, saving: float | None
) -> SelectedSetting | None:
    """The scene as given, where the model found takes longer, errs more, and this one suffices."""
    bench, setting = work.bench, chosen.point.setting
    scene = bench.tried(AS_GIVEN, work.scene, {})
    if saving is None or saving >= 1 or scene.model is None:
        return None
    if scene.error >= chosen.tried.error or scene.error > work.enough:
        return None
    if chosen.whole:
        instead = whole_run_tolerance(scene, work, work.beside_unseen - scene.error)
    else:
        trial = bench.runs.trial(scene.model, setting, bench.measure, bench.budget.left())
        error = max_error(trial, bench.reference, bench.measure)
        if isinstance(error, str) or error * bench.span.growth > work.beside_unseen:
            return None
        instead = SelectedSetting(
            scene, Point(replace(setting, model=AS_GIVEN), error, trial.cpu_s, 1)
        )
    if instead is not None:
        work.told[AS_GIVEN] = ()
        work.notes.append(
            f"a smaller model errs by {chosen.tried.error:.1e} and takes {1 / saving:.2f} times "
            f"the time of the scene as given, which errs by {scene.error:.1e}: the scene stays as "
            "it is"
        )
    return instead


def _bodies_as_given(
    work: AdviceState, evidence: Mapping[str, ErrorPrediction]
) -> tuple[BodyAdvice, ...]:
    """Every flexible body as the scene has it."""
    written = {name: _given(work, name) for name in work.whole}
    why = "stays as it is: less of the scene takes longer and errs more"
    return tuple(
        BodyAdvice(name, choice, choice, None, None, why, evidence.get(name))
        for name, choice in written.items()
    )


def _compared(work: AdviceState, chosen: SelectedSetting) -> str:
    """Over what errors were seen."""
    bench, said = work.bench, str(work.bench.span)
    if chosen.whole:
        said += f" (the integration over all of its {work.asked.t_end:g} s)"
    ended = bench.reference.ended
    return f"{said}, up to its end at {bench.reference.t[-1]:.4g} s: {ended}" if ended else said


def _body(
    work: AdviceState,
    name: str,
    choice: BodyModel,
    known: ErrorPrediction | None,
    search: ModelSearch,
) -> BodyAdvice:
    """What is said of one body; its choice is tried alone beside the richest of all others."""
    most = work.bodies.richest
    as_in_most = choice == most.get(name, choice)
    error, saving = (work.bench.floor, 1.0) if as_in_most else (None, None)
    if not as_in_most and work.budget.left():
        alone = search.tried({**most, name: choice})
        if math.isfinite(alone.error):
            whole_model = search.tried(most)
            error, saving = alone.error, whole_model.cpu_s / alone.cpu_s
    split = None
    if known is not None and work.steep(known) and name not in work.parts:
        split = work.split_error or known.frame_error * work.in_measure
    richest = most.get(name, choice) if name in work.parts else work.whole[name]
    why = reason(choice, richest, known, work.in_measure, work.asked.error)
    if split is not None and known is not None:
        why += f"; it bends by a slope of {known.slope:.2g}, so that one floating frame "
        why += (
            f"was seen to err by {split:.1e}, which is little beside what is asked"
            if work.split_error is not None
            else f"may err by {split:.1e}: split it into welded beams"
        )
    return BodyAdvice(name, _given(work, name), choice, error, saving, why, known, split)


def _straightened(work: AdviceState) -> Choices:
    """Bodies that do not bend at all in the plane of the motion."""
    return {
        name: BodyModel(RIGID)
        for name in work.whole
        if name not in work.bodies.richest and name not in work.parts.values()
    }


def _given(work: AdviceState, name: str) -> BodyModel:
    """What a body, or the whole that it is a part of, is in the scene as it was written."""
    bodies: tuple[Beam | Elastic, ...] = (*work.scene.beam, *work.scene.elastic)
    of = work.parts.get(name, name)
    written = next(body for body in bodies if body.name == of)
    return given_choice(written, work.whole[of])


def _savings(work: AdviceState, chosen: SelectedSetting) -> tuple[float | None, float | None]:
    """Time of the scene as given over that of the advised one, by the same tolerance; of the
    default method and tolerance over the advised ones."""
    setting, tried, rounds = chosen.point.setting, chosen.tried, work.asked.rounds
    rtol = RTOL if setting.fixed else setting.value
    alike = Setting(AUTO, tried.name, rtol)
    as_given = work.bench.tried(AS_GIVEN, work.scene, {})
    found: list[float | None] = [None, None]
    pairs = (
        (as_given, alike, alike), (tried, Setting(METHOD, tried.name, RTOL), setting),
    )  # fmt: skip
    for k, (other, theirs, ours) in enumerate(pairs):
        if other.scene == tried.scene and theirs == ours:
            found[k] = 1.0
        elif other.model is not None:
            times = compare_cpu_times(other, theirs, tried, ours, work.bench, rounds)
            found[k] = None if times is None else times[0] / times[1]
    return found[0], found[1]
