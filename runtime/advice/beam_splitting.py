"""A beam as several welded ones of the same length, each with a frame of its own.

"arm" becomes "arm", "arm_2" and so on; its tip is the tip of the last one.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from mstmm.scene import Damping, Hinge, Load, Scene, split_reference
from mstmm.scene.tables.beam import Beam
from mstmm.scene.tables.beam_keys import GIVEN, ROOT, TIP, Modes
from mstmm.scene.tables.flexible_keys import AUTO

from ..chart.model_levels import with_tables
from .scene_edits.reference_renaming import with_names


@dataclass(frozen=True)
class SplitScene:
    """A scene with beams in parts.

    Attributes:
        scene: the new one.
        names: places of the former scene that have other names -> these names.
        parts: name of a new beam -> the beam that it is a part of.
    """

    scene: Scene
    names: Mapping[str, str]
    parts: Mapping[str, str]


def unfit(beam: Beam) -> str:
    """Why an advice cannot split a beam; "" where it can."""
    if beam.modes is None:
        return "its number of shapes is left open"
    if beam.initial.eta is not None or beam.initial.etad is not None:
        return "its start is given by shapes of the whole"
    return ""


def divisible(beam: Beam, frequency: float) -> tuple[Beam, str]:
    """A beam without what belongs to shapes of the whole, and what was changed in words, "" for
    nothing.

    Modal damping becomes what its stiffness damps its first shape alike, of `frequency` (rad/s):
    2 zeta omega m = s k with k = omega^2 m.
    """
    update: dict[str, Any] = {}
    words = []
    if any(beam.damping.ratio):
        time = 2 * beam.damping.ratio[0] / frequency
        update["damping"] = Damping(stiffness=beam.damping.stiffness + time)
        words.append(f"damped by {time:.3g} s times its stiffness instead of by its modes")
    if beam.basis == GIVEN:
        update |= {"basis": AUTO, "shapes": None}
        words.append("with shapes of our own choice instead of the given ones")
    return beam.model_copy(update=update) if update else beam, " and ".join(words)


def in_parts(scene: Scene, names: Collection[str], count: int) -> SplitScene:
    """The scene with each of these beams as so many.  SceneError where the result is no scene."""
    found = SplitScene(scene, {}, {})
    for name in names:
        found = _cut(found, next(one for one in scene.beam if one.name == name), count)
    data = found.scene.model_dump(by_alias=True)
    return SplitScene(Scene.from_data(_without_nothing(data)), found.names, found.parts)


def _cut(found: SplitScene, beam: Beam, count: int) -> SplitScene:
    scene, size = found.scene, beam.length / count
    parts = [beam.name, *(_unused(f"{beam.name}_{k}", scene) for k in range(2, count + 1))]
    last = count - 1
    place = {
        end: 0 if end == ROOT else last if end == TIP
        else min(max(math.ceil(beam.end_x(end) / size) - 1, 0), last)
        for end in beam.ends
    }  # fmt: skip
    moved = {f"{beam.name}.{end}": f"{parts[k]}.{end}" for end, k in place.items() if k}
    holder = next((h for h in scene.hinge if h.outboard_body == beam.name), None)
    held = 0 if holder is None else place[holder.outboard_end or ROOT]
    named = with_names(scene, moved)
    welds = [_weld(scene, *pair, k < held) for k, pair in enumerate(pairwise(parts))]
    tables: dict[str, Any] = {
        "load": tuple(part for load in named.load for part in _loads(load, beam, parts, size)),
        "hinge": (*named.hinge, *welds),
    }
    own = [
        _part(beam, name, k * size, beam.length if k == last else (k + 1) * size,
              {end for end, at in place.items() if at == k})
        for k, name in enumerate(parts)
    ]  # fmt: skip
    tables["beam"] = tuple(
        part for one in scene.beam for part in (own if one.name == beam.name else (one,))
    )
    return SplitScene(
        with_tables(named, **tables), {**found.names, **moved},
        {**found.parts, **dict.fromkeys(parts, beam.name)},
    )  # fmt: skip


def _weld(scene: Scene, near: str, far: str, inward: bool) -> Hinge:
    """Between two parts; `inward` where the root of the tree is on the far side."""
    ends = (f"{near}.{TIP}", f"{far}.{ROOT}")
    inboard, outboard = reversed(ends) if inward else ends
    name = _unused(f"{near}_to_{far}", scene)
    return Hinge(name=name, type="fixed", inboard=inboard, outboard=outboard)


def _part(beam: Beam, name: str, start: float, end: float, own: Collection[str]) -> Beam:
    """The beam from one x to another with its own ends, and shapes that carry the load of a
    weld."""
    ends = {
        key: {
            "position": [min(beam.end_x(key), end) - start, 0.0, 0.0],
            "orientation": beam.ends[key].orientation,
        }
        for key in own
        if key not in (ROOT, TIP)
    }
    pieces = [
        {
            **piece.model_dump(by_alias=True, exclude_none=True),
            "from": max(piece.from_, start) - start, "to": min(piece.to, end) - start,
        }
        for piece in beam.sections
        if piece.from_ < end and piece.to > start
    ]  # fmt: skip
    kept = beam.model_dump(by_alias=True, exclude_none=True)
    for key in ("section", "ends", "shapes", "frame", "basis", "name", "length", "modes"):
        kept.pop(key, None)
    made = {
        "name": name, "length": end - start, "section": pieces, "ends": ends, "frame": AUTO,
        "basis": AUTO, "modes": _modes(beam),
    }  # fmt: skip
    return Beam.model_validate(kept | made)


def _modes(beam: Beam) -> Modes:
    """The static shapes of a part: by a force and a moment where it bends, one else; the parts
    together have more than the whole had."""
    assert beam.modes is not None
    bends, others = ("y", "z"), ("twist", "axial")
    counts = {word: 2 for word in bends if getattr(beam.modes, word)}
    return Modes(**counts, **{word: 1 for word in others if getattr(beam.modes, word)})


def _loads(load: Load, beam: Beam, parts: Sequence[str], size: float) -> Iterator[Load]:
    """A load per length on each part that it reaches; any other as it is."""
    if load.force_per_length is None or split_reference(load.on)[0] != beam.name:
        yield load
        return
    start, end = load.span or (0.0, beam.length)
    for k, part in enumerate(parts):
        low, high = max(start - k * size, 0.0), min(end - k * size, size)
        if low < high:
            name = f"{load.name}_{k + 1}" if k else load.name
            yield load.model_copy(update={"name": name, "on": part, "span": (low, high)})


def _unused(name: str, scene: Scene) -> str:
    """A name that no body and no hinge has."""
    taken = {one.name for one in scene.skeleton.body} | {one.name for one in scene.hinge}
    while name in taken:
        name += "_"
    return name


def _without_nothing(value: Any) -> Any:
    """Plain tables without entries that say nothing, as a file has them."""
    if isinstance(value, dict):
        return {key: _without_nothing(one) for key, one in value.items() if one is not None}
    return value
