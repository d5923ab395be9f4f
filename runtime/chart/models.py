"""Levels of model of a scene: rigid, one-way, linear and stiffened with 1 to n shapes.

A level is the scene with other tables; what a level leaves out is what its error tells.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from mstmm.scene import Scene
from mstmm.scene.tables.beam import Beam
from mstmm.scene.tables.beam_keys import DIRECTIONS, Modes, Shapes

from ..flexible.elastic.bodies import AUTO_MODES
from ..pack.flexible.rigidified import with_level

if TYPE_CHECKING:
    from mstmm.scene.tables.elastic import Elastic

    from ..engine.compiled import Compiled

#: Body -> names of its modal coordinates, in order.
Modal = Mapping[str, Sequence[str]]


@dataclass(frozen=True)
class Variant:
    """A level of model before it is compiled."""

    name: str
    scene: Scene


def ladder(model: Compiled) -> tuple[Variant, ...]:
    """Levels from the smallest to the richest, all flexible bodies on one level; a scene without
    flexible bodies has one.  The shapes of an elastic body are those beside its static ones."""
    scene, modes = model.scene, modes_of(model)
    most = max([0, *map(_count, modes.values()), *map(_free_modes, _soft(scene))])
    if not most:
        return (Variant("rigid", scene),)
    counts = range(1, most + 1)
    found = [Variant("rigid", with_level(scene, "rigid"))]
    for word, level, stiffening in (
        ("one-way", "one-way", True), ("linear", "coupled", False), ("stiffened", "coupled", True),
    ):  # fmt: skip
        for n in counts:
            cut = reduced(scene, modes, n, stiffening)
            found.append(
                Variant(f"{word}, {n} shape{'s' if n > 1 else ''}", with_level(cut, level))
            )
    return tuple(found)


def modes_of(model: Compiled) -> Modal:
    """Modal coordinates of the beams that deform, whether coupled or one way."""
    expanded = model.packed.expanded
    rigid = None if expanded is None else expanded.rigidified
    bodies = {**model.flexible, **({} if rigid is None else rigid.one_way)}
    beams = [beam.name for beam in model.scene.beam]
    return {name: body.modes for name, body in bodies.items() if name in beams}


def directions(modes: Modal) -> Iterator[tuple[str, tuple[str, ...]]]:
    """("blade.z", ("blade.z1", ...)) of every direction that can be left out alone."""
    for body, names in modes.items():
        for word in DIRECTIONS:
            own = tuple(f"{body}.{name}" for name in names if _direction(name) == word)
            if own:
                yield f"{body}.{word}", own


def reduced(scene: Scene, modes: Modal, n: int, stiffening: bool) -> Scene:
    """The scene with at most n shapes in each direction of its flexible bodies."""
    change = {"stiffening": stiffening}
    beams = tuple(
        with_shapes(beam, [m for m in modes.get(beam.name, ()) if _number(m) <= n], modes)
        .model_copy(update=change)
        for beam in scene.beam
    )  # fmt: skip
    bodies = tuple(
        body.model_copy(update=change | {"modes": min(n, _free_modes(body))})
        for body in scene.elastic
    )
    return with_tables(scene, beam=beams, elastic=bodies)


def with_shapes(beam: Beam, names: Sequence[str], modes: Modal) -> Beam:
    """A beam with these of its modal coordinates; what is given per shape goes along."""
    if beam.name not in modes:
        return beam
    counts = {word: sum(_direction(name) == word for name in names) for word in DIRECTIONS}
    update: dict[str, Any] = {"modes": Modes(**counts)}
    if beam.shapes is not None:
        kept = {word: getattr(beam.shapes, word)[: counts[word]] for word in DIRECTIONS}
        update["shapes"] = Shapes.model_construct(**kept)
    places = [i for i, name in enumerate(modes[beam.name]) if name in names]
    return beam.model_copy(update=update | _per_shape(beam, places))


def _per_shape(body: Beam, places: Sequence[int]) -> dict[str, Any]:
    """Damping ratios and start values of the shapes that are kept."""
    ratio, start = body.damping.ratio, body.initial
    if len(ratio) > 1:
        ratio = tuple(ratio[i] for i in places if i < len(ratio)) or ratio[:1]
    kept = {
        key: None if values is None else tuple(values[i] for i in places if i < len(values))
        for key, values in (("eta", start.eta), ("etad", start.etad))
    }
    return {
        "damping": body.damping.model_copy(update={"ratio": ratio}),
        "initial": start.model_copy(update=kept),
    }


def with_tables(scene: Scene, **tables: Any) -> Scene:
    """The scene with other tables, which need no check."""
    fields = {key: getattr(scene, key) for key in type(scene).model_fields}
    return Scene.model_construct(**(fields | tables))


def _soft(scene: Scene) -> list[Elastic]:
    return [body for body in scene.elastic if body.model != "rigid"]


def _free_modes(body: Elastic) -> int:
    return AUTO_MODES if body.modes is None else body.modes


def _direction(mode: str) -> str:
    return mode.rstrip("0123456789")


def _number(mode: str) -> int:
    return int(mode[len(_direction(mode)) :])


def _count(names: Sequence[str]) -> int:
    """Shapes in the direction that has most."""
    return max((_number(name) for name in names), default=0)
