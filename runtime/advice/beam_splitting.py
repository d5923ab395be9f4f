"""Split a beam into welded beams of equal length, each with its own floating frame.

"arm" becomes "arm", "arm_2" and so on; its tip is the tip of the last part.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from mstmm.scene import Damping, Hinge, Load, Scene, split_reference
from mstmm.scene.tables.beam import GIVEN, ROOT, TIP, Beam, Modes
from mstmm.scene.tables.flexible_keys import AUTO

from ..chart.model_levels import with_tables
from .scene_edits.reference_renaming import with_references


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
        update["damping"] = Damping(stiffness=beam.damping.stiffness + time)
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
    welds = [_part_weld(scene, *pair, k < inboard_part) for k, pair in enumerate(pairwise(parts))]
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


def _part_weld(scene: Scene, near: str, far: str, inward: bool) -> Hinge:
    """Weld between two parts; `inward` if the root of the tree is at the far part."""
    ends = (f"{near}.{TIP}", f"{far}.{ROOT}")
    inboard, outboard = reversed(ends) if inward else ends
    name = _unused_name(f"{near}_to_{far}", scene)
    return Hinge(name=name, type="fixed", inboard=inboard, outboard=outboard)


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
    """The name, with underscores appended until no body or hinge has it."""
    taken = {body.name for body in scene.skeleton.body} | {hinge.name for hinge in scene.hinge}
    while name in taken:
        name += "_"
    return name


def _without_none(value: Any) -> Any:
    """Plain tables without entries that are None, as in a scene file."""
    if isinstance(value, dict):
        return {key: _without_none(item) for key, item in value.items() if item is not None}
    return value
