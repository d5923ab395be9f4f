"""Model levels of a scene: rigid, one-way, linear and stiffened with 1 to n shapes.

A level is the scene with other tables of bodies; its error shows the effect that it neglects.
Bodies that are rigid in the scene stay rigid.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from mstmm.scene import Names, Scene
from mstmm.scene.tables.beam import DIRECTIONS, Beam, Modes, Shapes
from mstmm.scene.tables.elastic import Elastic

from ..engine.quantity_registry import BodyReferences
from ..flexible.beam.modal_beams import BeamBodies
from ..flexible.elastic.modal_elastic import AUTO_MODES
from ..packing.flexible.rigid_substitution import LEVELS


@dataclass(frozen=True)
class Variant:
    """Model level before compilation: name and scene."""

    name: str
    scene: Scene


def model_levels(scene: Scene) -> tuple[Variant, ...]:
    """Model levels from the smallest to the richest, all flexible bodies on the same level.

    A scene without flexible bodies has one level.  For an elastic body the number of shapes counts
    its vibration shapes; its static shapes are always kept.
    """
    modes = beam_modes(scene)
    elastic_counts = [vibration_mode_count(body) for body in scene.elastic if body.model != "rigid"]
    max_count = max([0, *elastic_counts, *(max(counts.counts) for counts in modes.values())])
    if not max_count:
        return (Variant("rigid", scene),)
    levels = [Variant("rigid", with_model_level(scene, "rigid"))]
    for word, level, stiffening in (
        ("one-way", "one-way", True), ("linear", "coupled", False), ("stiffened", "coupled", True),
    ):  # fmt: skip
        for n in range(1, max_count + 1):
            limited = with_model_level(limit_modes(scene, modes, n, stiffening), level)
            levels.append(Variant(f"{word}, {n} shape{'s' if n > 1 else ''}", limited))
    return tuple(levels)


def beam_modes(scene: Scene) -> dict[str, Modes]:
    """Number of shapes by direction of each flexible beam, also where the scene leaves it open."""
    coupled = with_model_level(scene, "coupled")
    bodies = BeamBodies(coupled)
    return {beam.name: bodies.modes(beam) for beam in coupled.beam if beam.model != "rigid"}


def with_model_level(scene: Scene, level: str) -> Scene:
    """The scene with one model level, a key of LEVELS, for all its flexible bodies."""
    change = {"model": LEVELS[level]}

    def at_level(body: Any) -> Any:
        return body if body.model == "rigid" else body.model_copy(update=change)

    return with_tables(
        scene, beam=tuple(map(at_level, scene.beam)), elastic=tuple(map(at_level, scene.elastic))
    )


def limit_modes(scene: Scene, modes: Mapping[str, Modes], n: int, stiffening: bool) -> Scene:
    """The scene with at most n shapes per direction in its flexible bodies."""
    change: dict[str, Any] = {"stiffening": stiffening}
    beams = tuple(
        with_mode_counts(beam, modes[beam.name], _limited_counts(modes[beam.name], n)).model_copy(
            update=change
        )
        if beam.name in modes
        else beam
        for beam in scene.beam
    )
    bodies = tuple(
        body.model_copy(update=change | {"modes": min(n, vibration_mode_count(body))})
        for body in scene.elastic
    )
    return with_tables(scene, beam=beams, elastic=bodies)


def with_mode_counts(beam: Beam, whole: Modes, kept: Modes) -> Beam:
    """A beam with only the first shapes of each direction.

    `whole` are the numbers of shapes of the beam, `kept` those of the result.  Initial values and
    damping ratios that are given per shape are cut accordingly.
    """
    update: dict[str, Any] = {"modes": kept}
    if beam.shapes is not None:
        shapes = {
            direction: getattr(beam.shapes, direction)[: getattr(kept, direction)]
            for direction in DIRECTIONS
        }
        update["shapes"] = Shapes.model_construct(**shapes)
    kept_indices = [i for i, name in enumerate(whole.names) if name in kept.names]

    def kept_values(values: tuple[float, ...] | None) -> tuple[float, ...] | None:
        if values is None or len(values) != whole.total:
            return values
        return tuple(values[i] for i in kept_indices)

    initial = {"eta": kept_values(beam.initial.eta), "etad": kept_values(beam.initial.etad)}
    update["initial"] = beam.initial.model_copy(update=initial)
    update["damping"] = beam.damping.model_copy(update={"ratio": kept_values(beam.damping.ratio)})
    return beam.model_copy(update=update)


def with_tables(scene: Scene, **tables: Any) -> Scene:
    """The scene with other tables, not validated; `names` keeps only existing elements."""
    fields = {key: getattr(scene, key) for key in type(scene).model_fields} | tables
    changed = Scene.model_construct(**fields)
    if scene.names == Names():
        return changed
    names = scene.names.among(BodyReferences(changed.skeleton), changed.hinges.by_name)
    return Scene.model_construct(**(fields | {"names": names}))


def _limited_counts(modes: Modes, n: int) -> Modes:
    return Modes(**{direction: min(n, getattr(modes, direction)) for direction in DIRECTIONS})


def vibration_mode_count(body: Elastic) -> int:
    """Number of vibration shapes of an elastic body, without its static shapes."""
    return AUTO_MODES if body.modes is None else body.modes
