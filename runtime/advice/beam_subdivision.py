"""Split beams whose bending exceeds one floating frame; the finest split is the reference."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from mstmm.errors import MstmmError
from mstmm.scene import Scene
from mstmm.scene.tables.beam import Beam

from ..chart.model_levels import with_tables
from .beam_splitting import SplitScene, make_splittable, split_beams, split_obstacle
from .body_model_levels import Bodies
from .error_predictors import ErrorPrediction
from .trial_models import TrialResult

if TYPE_CHECKING:
    from ..chart.trial_run import Trial
    from .advice_state import AdviceState

#: Beams are halved until the result changes by less than this fraction of the target error; the
#: error of the finer parts is smaller than this change by the second factor.
_MAX_CHANGE, _ERROR_REDUCTION = 0.5, 4.0

#: Numbers of parts that are tried.
_COUNTS = (2, 4, 8, 16)

#: Largest error, as a fraction of the target error, of the changes that make a beam splittable.
_PREPARATION_ERROR = 0.3


def subdivide_beams(
    state: AdviceState, base: TrialResult, evidence: dict[str, ErrorPrediction]
) -> tuple[TrialResult, dict[str, ErrorPrediction]]:
    """Split the beams that bend too far for one frame; return the model and its evidence.

    They are halved until the result hardly changes; the finest split becomes the reference.
    """
    steep = {
        beam.name for beam in base.scene.beam if state.may_need_splitting(evidence.get(beam.name))
    }
    steep -= {beam.name for beam in base.scene.beam if split_obstacle(beam)}
    if not steep:
        return base, evidence
    try:
        whole, run, changes = _prepare_splitting(state, base, steep, evidence)
        split, finest, change = _refine_parts(state, whole, run, steep)
    except MstmmError as problem:
        state.notes.append(f"beams could not be split: {problem}")
        return base, evidence
    if split.scene is whole:
        state.split_error = change if math.isfinite(change) else None
        state.reference_error = 0.0
        return base, evidence
    remaining = change / _ERROR_REDUCTION
    state.reference_error += remaining
    if change > _MAX_CHANGE * state.request.error:
        state.notes.append(
            f"the last halving of beams still changed the result by {change:.1e}; the error "
            f"includes an estimated remainder of {remaining:.1e}"
        )
    return _compare_with_parts(state, base, split, finest, changes)


def _prepare_splitting(
    state: AdviceState, base: TrialResult, steep: set[str], evidence: Mapping[str, ErrorPrediction]
) -> tuple[Scene, Trial, tuple[str, ...]]:
    """The scene with splittable beams, its run, and a sentence for each change.

    If these changes alter the motion too much, their beams are removed from `steep`.
    """
    scene, changes = _splittable_scene(base.scene, steep, evidence)
    if not changes:
        return scene, state.runner.finer(scene, state.runner.names, base.name), ()
    run = state.runner.finer(scene, state.runner.names, "splittable beams")
    error = math.inf if run.numbers is None else state.runner.distance(state.runner.reference, run)
    if error <= _PREPARATION_ERROR * state.request.error:
        state.reference_error = error
        sentences = (
            f'beam "{name}": {change}, which changes the result by {error:.1e}'
            for name, change in changes.items()
        )
        return scene, run, tuple(sentences)
    state.notes += [
        f'beam "{name}" is not split: this requires {change}, which changes the result by '
        f"{error:.1e}"
        for name, change in changes.items()
    ]
    steep -= {*changes}
    return base.scene, state.runner.finer(base.scene, state.runner.names, base.name), ()


def _splittable_scene(
    scene: Scene, steep: set[str], evidence: Mapping[str, ErrorPrediction]
) -> tuple[Scene, dict[str, str]]:
    """The scene with splittable beams, and the change of each beam in words."""
    changes = {}

    def splittable(beam: Beam) -> Beam:
        if beam.name not in steep:
            return beam
        changed, change = make_splittable(beam, evidence[beam.name].frequency)
        if change:
            changes[beam.name] = change
        return changed

    beams = tuple(map(splittable, scene.beam))
    return with_tables(scene, beam=beams) if changes else scene, changes


def _refine_parts(
    state: AdviceState, whole: Scene, run: Trial, names: set[str]
) -> tuple[SplitScene, Trial, float]:
    """The scene with beams in enough parts, the finest run, and the change by the last halving."""
    split, change = SplitScene(whole, {}, {}), math.inf
    for count in _COUNTS if names else ():
        parts = split_beams(whole, names, count)
        finer = state.runner.finer(parts.scene, parts.names, f"beams in {count} parts")
        if finer.numbers is None:
            state.notes.append(f"beams in {count} parts could not be simulated: {finer.failure}")
            break
        change = state.runner.distance(run, finer)
        if change <= _MAX_CHANGE * state.request.error:
            return split, finer, change
        split, run = parts, finer
    return split, run, change


def _compare_with_parts(
    state: AdviceState,
    base: TrialResult,
    split: SplitScene,
    reference: Trial,
    changes: tuple[str, ...],
) -> tuple[TrialResult, dict[str, ErrorPrediction]]:
    """Use the split scene as the richest model; return it and its evidence.

    `reference` is a run with as many parts or more.
    """
    state.parts = split.parts
    state.unsplit_models = {**Bodies(split.scene).richest, **state.unsplit_models}
    single_frame_error = state.runner.distance(state.runner.reference, reference)
    state.runner.use_as_reference(reference, split.names)
    tried = state.runner.run_trial("beams in parts", split.scene)
    parts_by_beam: dict[str, list[str]] = {}
    for part, beam in split.parts.items():
        parts_by_beam.setdefault(beam, []).append(part)
    state.change_texts[tried.name] = (*state.change_texts[base.name], *changes, *(
        f'beam "{beam}": {len(parts)} welded beams ({", ".join(parts)}) with a frame each; with '
        f"one frame its error is {single_frame_error:.1e}" + _renamed_ends(beam, split.names)
        for beam, parts in parts_by_beam.items()
    ))  # fmt: skip
    evidence, reason = state.error_predictions(state.run_one_way(split.scene), tried.compiled_model)
    if reason:
        state.notes.append(f"no error estimates for the parts of beams: {reason}")
    return tried, evidence


def _renamed_ends(beam: str, names: Mapping[str, str]) -> str:
    """Ends of a beam that are now ends of a part, whose former names mean other places."""
    ends = [f"{old} is {new}" for old, new in names.items() if old.startswith(f"{beam}.")]
    return f"; {', '.join(ends)} now" if ends else ""
