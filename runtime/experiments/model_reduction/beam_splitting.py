"""Split a beam into welded beams of equal length, each with its own floating frame.

"arm" becomes "arm", "arm_2" and so on; its tip is the tip of the last part.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from mstmm.errors import MstmmError
from mstmm.scene import Hinge, Load, Scene, split_reference
from mstmm.scene.tables.beam import GIVEN, ROOT, TIP, Beam, Modes
from mstmm.scene.tables.flexible_keys import AUTO

from ..model_levels import with_tables
from ..tuning import REDUCTION as TUNING
from .body_models import Bodies, ErrorPrediction
from .scene_edits import unused_name, with_references
from .trial_models import TrialResult

if TYPE_CHECKING:
    from ..trial import Trial
    from .advice_state import AdviceState


@dataclass(frozen=True)
class SplitScene:
    """Scene with split beams.

    Attributes:
        scene: the new scene.
        names: end in the former scene -> its name in the new one, if different.
        parts: name of a new beam -> beam of the former scene that it is a part of.
    """

    scene: Scene
    names: Mapping[str, str]
    parts: Mapping[str, str]


def split_obstacle(beam: Beam) -> str:
    """Reason why a beam cannot be split, or ""."""
    if beam.modes is None:
        return "its number of shapes is left open"
    if beam.initial.eta is not None or beam.initial.etad is not None:
        return "its initial state is given by shape functions of the whole beam"
    return ""


def make_splittable(beam: Beam, frequency: float) -> tuple[Beam, str]:
    """Replace the properties that refer to shapes of the whole beam; also describe the change.

    Modal damping becomes stiffness-proportional damping that is equal for the first shape, of
    `frequency` omega (rad/s): 2 zeta omega m = s k with k = omega^2 m.  The description is "" if
    nothing changes.
    """
    update: dict[str, Any] = {}
    changes = []
    if any(beam.damping.ratio):
        time = 2 * beam.damping.ratio[0] / frequency
        stiffness = beam.damping.stiffness + time
        update["damping"] = beam.damping.model_copy(
            update={"ratio": (0.0,), "stiffness": stiffness}
        )
        changes.append(f"stiffness-proportional damping ({time:.3g} s) instead of modal damping")
    if beam.basis == GIVEN:
        update |= {"basis": AUTO, "shapes": None}
        changes.append("automatic shapes instead of the given ones")
    return beam.model_copy(update=update) if update else beam, " and ".join(changes)


def split_beams(scene: Scene, names: Collection[str], count: int) -> SplitScene:
    """Split each of these beams into `count` parts; SceneError if the result is not valid."""
    split = SplitScene(scene, {}, {})
    for name in names:
        split = _split_beam(split, next(beam for beam in scene.beam if beam.name == name), count)
    data = split.scene.model_dump(by_alias=True)
    return SplitScene(Scene.from_data(_without_none(data)), split.names, split.parts)


def _split_beam(split: SplitScene, beam: Beam, count: int) -> SplitScene:
    """Split one more beam."""
    scene, part_length = split.scene, beam.length / count
    parts = [beam.name, *(_unused_name(f"{beam.name}_{k}", scene) for k in range(2, count + 1))]
    last = count - 1
    part_index = {
        end: 0 if end == ROOT else last if end == TIP
        else min(max(math.ceil(beam.end_x(end) / part_length) - 1, 0), last)
        for end in beam.ends
    }  # fmt: skip
    moved = {f"{beam.name}.{end}": f"{parts[k]}.{end}" for end, k in part_index.items() if k}
    inboard_hinge = next((h for h in scene.hinge if h.outboard_body == beam.name), None)
    # Index of the part next to the root of the tree: the welds point away from it.
    inboard_part = 0 if inboard_hinge is None else part_index[inboard_hinge.outboard_end or ROOT]
    renamed = with_references(scene, moved)
    welds = []
    for k, (near, far) in enumerate(pairwise(parts)):
        ends = (f"{near}.{TIP}", f"{far}.{ROOT}")
        inboard, outboard = reversed(ends) if k < inboard_part else ends
        weld = _unused_name(f"{near}_to_{far}", scene)
        welds.append(Hinge(name=weld, type="fixed", inboard=inboard, outboard=outboard))
    tables: dict[str, Any] = {
        "load": tuple(
            part for load in renamed.load for part in _part_loads(load, beam, parts, part_length)
        ),
        "hinge": (*renamed.hinge, *welds),
    }
    part_beams = [
        _beam_part(
            beam, name, k * part_length, beam.length if k == last else (k + 1) * part_length,
            {end for end, index in part_index.items() if index == k},
        )
        for k, name in enumerate(parts)
    ]  # fmt: skip
    tables["beam"] = tuple(
        part
        for other in scene.beam
        for part in (part_beams if other.name == beam.name else (other,))
    )
    return SplitScene(
        with_tables(renamed, **tables), {**split.names, **moved},
        {**split.parts, **dict.fromkeys(parts, beam.name)},
    )  # fmt: skip


def _beam_part(beam: Beam, name: str, start: float, end: float, end_names: Collection[str]) -> Beam:
    """Part of a beam from x = `start` to `end` (m) with the ends of these names.

    Its shapes carry the loads of a weld.
    """
    ends = {
        key: {
            "position": [min(beam.end_x(key), end) - start, 0.0, 0.0],
            "orientation": beam.ends[key].orientation,
        }
        for key in end_names
        if key not in (ROOT, TIP)
    }
    sections = [
        {
            **section.model_dump(by_alias=True, exclude_none=True),
            "from": max(section.from_, start) - start, "to": min(section.to, end) - start,
        }
        for section in beam.sections
        if section.from_ < end and section.to > start
    ]  # fmt: skip
    kept = beam.model_dump(by_alias=True, exclude_none=True)
    for key in ("section", "ends", "shapes", "frame", "basis", "name", "length", "modes"):
        kept.pop(key, None)
    new = {
        "name": name, "length": end - start, "section": sections, "ends": ends, "frame": AUTO,
        "basis": AUTO, "modes": _part_modes(beam),
    }  # fmt: skip
    return Beam.model_validate(kept | new)


def _part_modes(beam: Beam) -> Modes:
    """Static shapes of a part: two per direction of bending (force and moment), else one.

    All parts together have more shapes than the whole beam.
    """
    assert beam.modes is not None
    counts = {"y": 2, "z": 2, "twist": 1, "axial": 1}
    return Modes(
        **{
            direction: count
            for direction, count in counts.items()
            if getattr(beam.modes, direction)
        }
    )


def _part_loads(load: Load, beam: Beam, parts: Sequence[str], part_length: float) -> Iterator[Load]:
    """Distribute a load per length over the parts that it covers; keep any other load."""
    if load.force_per_length is None or split_reference(load.on)[0] != beam.name:
        yield load
        return
    start, end = load.span or (0.0, beam.length)
    for k, part in enumerate(parts):
        low = max(start - k * part_length, 0.0)
        high = min(end - k * part_length, part_length)
        if low < high:
            name = f"{load.name}_{k + 1}" if k else load.name
            yield load.model_copy(update={"name": name, "on": part, "span": (low, high)})


def _unused_name(name: str, scene: Scene) -> str:
    """The name, changed until no body or hinge has it."""
    taken = {body.name for body in scene.skeleton.body} | {hinge.name for hinge in scene.hinge}
    return unused_name(name, taken)


def _without_none(value: Any) -> Any:
    """Plain tables without entries that are None, as in a scene file."""
    if isinstance(value, dict):
        return {key: _without_none(item) for key, item in value.items() if item is not None}
    return value


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
    remaining = change / TUNING.error_reduction
    state.reference_error += remaining
    if change > TUNING.max_change * state.request.error:
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
    changes = {}

    def splittable(beam: Beam) -> Beam:
        if beam.name not in steep:
            return beam
        changed, change = make_splittable(beam, evidence[beam.name].frequency)
        if change:
            changes[beam.name] = change
        return changed

    beams = tuple(map(splittable, base.scene.beam))
    scene = with_tables(base.scene, beam=beams) if changes else base.scene
    if not changes:
        return scene, state.runner.finer(scene, state.runner.names, base.name), ()
    run = state.runner.finer(scene, state.runner.names, "splittable beams")
    error = math.inf if run.numbers is None else state.runner.distance(state.runner.reference, run)
    if error <= TUNING.preparation_error * state.request.error:
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


def _refine_parts(
    state: AdviceState, whole: Scene, run: Trial, names: set[str]
) -> tuple[SplitScene, Trial, float]:
    """The scene with beams in enough parts, the finest run, and the change by the last halving."""
    split, change = SplitScene(whole, {}, {}), math.inf
    for count in TUNING.part_counts if names else ():
        parts = split_beams(whole, names, count)
        finer = state.runner.finer(parts.scene, parts.names, f"beams in {count} parts")
        if finer.numbers is None:
            state.notes.append(f"beams in {count} parts could not be simulated: {finer.failure}")
            break
        change = state.runner.distance(run, finer)
        if change <= TUNING.max_change * state.request.error:
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
