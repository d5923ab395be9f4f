"""Levels of model of a scene: rigid, one-way, linear and stiffened with 1 to n shapes.

A level is the scene with other tables; what a level leaves out is what its error tells.  Bodies
that the scene itself makes rigid stay rigid.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from mstmm.scene import Names, Scene
from mstmm.scene.tables.beam import Beam
from mstmm.scene.tables.beam_keys import DIRECTIONS, Modes, Shapes
from mstmm.scene.tables.elastic import Elastic

from ..engine.body_references import BodyReferences
from ..flexible.beam.modal_beams import BeamBodies
from ..flexible.elastic.modal_elastic import AUTO_MODES
from ..packing.flexible.rigid_substitution import LEVELS


@dataclass(frozen=True)
class Variant:
    """A level of model before it is compiled."""

    name: str
    scene: Scene


def ladder(scene: Scene) -> tuple[Variant, ...]:
    """Levels from the smallest to the richest, all flexible bodies on one level; a scene without
    flexible bodies has one.  The shapes of an elastic body are those beside its static ones."""
    modes = modes_of(scene)
    soft = [free_modes(body) for body in scene.elastic if body.model != "rigid"]
    most = max([0, *soft, *(max(counts.counts) for counts in modes.values())])
    if not most:
        return (Variant("rigid", scene),)
    found = [Variant("rigid", at_level(scene, "rigid"))]
    for word, level, stiffening in (
        ("one-way", "one-way", True), ("linear", "coupled", False), ("stiffened", "coupled", True),
    ):  # fmt: skip
        for n in range(1, most + 1):
            cut = at_level(limit_modes(scene, modes, n, stiffening), level)
            found.append(Variant(f"{word}, {n} shape{'s' if n > 1 else ''}", cut))
    return tuple(found)


def modes_of(scene: Scene) -> dict[str, Modes]:
    """Shapes by direction of the beams that deform, also where the scene leaves them open."""
    coupled = at_level(scene, "coupled")
    bodies = BeamBodies(coupled)
    return {beam.name: bodies.modes(beam) for beam in coupled.beam if beam.model != "rigid"}


def at_level(scene: Scene, level: str) -> Scene:
    """The scene with one level of model, a key of LEVELS, for all bodies that deform in it."""
    change = {"model": LEVELS[level]}

    def changed(body: Any) -> Any:
        return body if body.model == "rigid" else body.model_copy(update=change)

    return with_tables(
        scene, beam=tuple(map(changed, scene.beam)), elastic=tuple(map(changed, scene.elastic))
    )


def limit_modes(scene: Scene, modes: Mapping[str, Modes], n: int, stiffening: bool) -> Scene:
    """The scene with at most n shapes in each direction of its flexible bodies."""
    change: dict[str, Any] = {"stiffening": stiffening}
    beams = tuple(
        with_shapes(beam, modes[beam.name], _at_most(modes[beam.name], n)).model_copy(update=change)
        if beam.name in modes
        else beam
        for beam in scene.beam
    )
    bodies = tuple(
        body.model_copy(update=change | {"modes": min(n, free_modes(body))})
        for body in scene.elastic
    )
    return with_tables(scene, beam=beams, elastic=bodies)


def with_shapes(beam: Beam, whole: Modes, kept: Modes) -> Beam:
    """A beam of `whole` shapes with the first ones of each direction alone; what is given per
    shape goes along where there is one number for each."""
    update: dict[str, Any] = {"modes": kept}
    if beam.shapes is not None:
        cut = {word: getattr(beam.shapes, word)[: getattr(kept, word)] for word in DIRECTIONS}
        update["shapes"] = Shapes.model_construct(**cut)
    places = [i for i, name in enumerate(whole.names) if name in kept.names]

    def cut_to(values: tuple[float, ...] | None) -> tuple[float, ...] | None:
        one_each = values is not None and len(values) == whole.total
        return tuple(values[i] for i in places) if values is not None and one_each else values

    start = {"eta": cut_to(beam.initial.eta), "etad": cut_to(beam.initial.etad)}
    update["initial"] = beam.initial.model_copy(update=start)
    update["damping"] = beam.damping.model_copy(update={"ratio": cut_to(beam.damping.ratio)})
    return beam.model_copy(update=update)


def with_tables(scene: Scene, **tables: Any) -> Scene:
    """The scene with other tables, which need no check; of its names those of what is there."""
    fields = {key: getattr(scene, key) for key in type(scene).model_fields} | tables
    found = Scene.model_construct(**fields)
    if scene.names == Names():
        return found
    names = scene.names.among(BodyReferences(found.skeleton), found.hinges.by_name)
    return Scene.model_construct(**(fields | {"names": names}))


def _at_most(modes: Modes, n: int) -> Modes:
    return Modes(**{word: min(n, getattr(modes, word)) for word in DIRECTIONS})


def free_modes(body: Elastic) -> int:
    """Vibration shapes of an elastic body beside its static ones."""
    return AUTO_MODES if body.modes is None else body.modes
