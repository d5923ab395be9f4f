"""Model levels of a scene: rigid, one-way, linear and stiffened with 1 to n shapes.

A level is the scene with other tables of bodies; its error shows the effect that it neglects.
Bodies that are rigid in the scene stay rigid.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.ir.hinge_properties import HingeProperties, builtin_hinges
from mstmm.numerics.rotations import perpendicular_vector
from mstmm.scene import Hinge, Names, Scene
from mstmm.scene.tables.beam import DIRECTIONS, EXACT, Beam, Modes, Shapes
from mstmm.scene.tables.elastic import Elastic
from mstmm.scene.tables.hinge import Initial

from ..engine.quantity_registry import BodyReferences
from ..flexible.beam.modal_beams import BeamBodies
from ..flexible.elastic.modal_elastic import AUTO_MODES
from ..packing.expansion import LEVELS

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene


@dataclass(frozen=True)
class Variant:
    """Model level before compilation: name and scene."""

    name: str
    scene: Scene


def model_levels(scene: Scene) -> tuple[Variant, ...]:
    """Model levels from the smallest to the richest, all flexible bodies on the same level.

    A scene without flexible bodies has one level.  For an elastic body the number of shapes counts
    its vibration shapes; its static shapes are always kept.  Exact beams have no linear levels.
    """
    modes = beam_modes(scene)
    elastic_counts = [vibration_mode_count(body) for body in scene.elastic if body.model != "rigid"]
    max_count = max([0, *elastic_counts, *(max(counts.counts) for counts in modes.values())])
    if not max_count:
        return (Variant("rigid", scene),)
    levels = [Variant("rigid", with_model_level(scene, "rigid"))]
    flexible = [("stiffened", "coupled", True)]
    if not exact_beam_names(scene):
        flexible = [("one-way", "one-way", True), ("linear", "coupled", False), *flexible]
    for word, level, stiffening in flexible:
        for n in range(1, max_count + 1):
            limited = with_model_level(limit_modes(scene, modes, n, stiffening), level)
            levels.append(Variant(f"{word}, {n} shape{'s' if n > 1 else ''}", limited))
    return tuple(levels)


def beam_modes(scene: Scene) -> dict[str, Modes]:
    """Number of shapes by direction of each flexible beam, also where the scene leaves it open."""
    coupled = with_model_level(scene, "coupled")
    bodies = BeamBodies(coupled)
    return {beam.name: bodies.modes(beam) for beam in coupled.beam if beam.model != "rigid"}


def exact_beam_names(scene: Scene) -> frozenset[str]:
    """Flexible beams with exact kinematics: they have no linear and no one-way model."""
    return frozenset(
        beam.name for beam in scene.beam if beam.kinematics == EXACT and beam.model != "rigid"
    )


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

    def limited(beam: Beam, whole: Modes) -> Beam:
        counts = {direction: min(n, getattr(whole, direction)) for direction in DIRECTIONS}
        return with_mode_counts(beam, whole, Modes(**counts)).model_copy(update=change)

    beams = tuple(
        limited(beam, modes[beam.name]) if beam.name in modes else beam for beam in scene.beam
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


def vibration_mode_count(body: Elastic) -> int:
    """Number of vibration shapes of an elastic body, without its static shapes."""
    return AUTO_MODES if body.modes is None else body.modes


#: Coordinates below this fraction of the largest comparable one do not move.
_MOTION_TOLERANCE = 1e-9

Vector = tuple[float, float, float]


def planar_level(richest: Variant, model: CompiledScene, q: Array) -> Variant | None:
    """Planar form of the richest level; None if there is nothing to simplify.

    q (n, nq) are the coordinates at the samples of a run of its model.
    """
    modes = beam_modes(richest.scene)
    beams = tuple(
        _planar_beam(model, beam, modes[beam.name], q) if beam.name in modes else beam
        for beam in richest.scene.beam
    )
    hinges = tuple(_planar_hinge(model, hinge, q) or hinge for hinge in richest.scene.hinge)
    if beams == richest.scene.beam and hinges == richest.scene.hinge:
        return None
    scene = with_tables(richest.scene, beam=beams, hinge=hinges)
    return Variant("planar, " + richest.name, scene)


def _planar_beam(model: CompiledScene, beam: Beam, modes: Modes, q: Array) -> Beam:
    """A beam without shapes in directions in which it stays undeformed; rigid if none is left."""
    slots = model.coordinate_layout.modal[beam.name]
    sizes = np.abs(q[:, slots.q_slice]).max(axis=0)
    moving_directions = {
        name.rstrip("0123456789")
        for name, size in zip(slots.q_names, sizes, strict=True)
        if size > _MOTION_TOLERANCE * sizes.max()
    }
    kept = Modes(
        **{
            direction: getattr(modes, direction)
            for direction in DIRECTIONS
            if direction in moving_directions
        }
    )
    if kept == modes:
        return beam
    if not kept.total:
        return beam.model_copy(update={"model": "rigid"})
    return with_mode_counts(beam, modes, kept)


def _planar_hinge(model: CompiledScene, hinge: Hinge, q: Array) -> Hinge | None:
    """Pin or planar hinge with the same motion as a hinge had; None if there is none."""
    properties = hinge.builtin
    if properties is None or properties.quaternion is None or properties.frame != "own":
        return None
    if hinge.drive is not None or hinge.initial is None or hinge.initial.q is None:
        return None
    lawless = Hinge(name="lawless", type=hinge.type, inboard="ground", outboard=hinge.outboard)
    hinge_q = q[:, model.coordinate_layout.hinges[hinge.name].q_slice]
    axis = _common_axis(hinge_q[:, properties.quaternion + 1 :])
    initial_u = np.array(hinge.initial.u or (0.0,) * len(properties.speeds))
    if hinge.law != lawless.law or axis is None:
        return None
    spin = initial_u[-3:]
    normal = np.linalg.norm(spin - axis * (axis @ spin))
    if not normal <= _MOTION_TOLERANCE * np.linalg.norm(spin):
        return None
    initial_q, rate = np.array(hinge.initial.q), float(initial_u[-3:] @ axis)
    angle = 2.0 * float(np.arctan2(initial_q[-3:] @ axis, initial_q[-4]))
    common = {"name": hinge.name, "inboard": hinge.inboard, "outboard": hinge.outboard,
              "orientation": hinge.orientation, "position": hinge.position}  # fmt: skip
    if not properties.free_body:
        planar = Hinge(
            **common, type=_hinge_type(lambda h: h.axial and h.turns and not h.slides),
            axis=_float_triple(axis), initial=_initial_state([angle], [rate])
        )  # fmt: skip
    elif np.abs(hinge_q[:, :3] @ axis).max() <= _MOTION_TOLERANCE * np.abs(hinge_q[:, :3]).max():
        x = np.array(perpendicular_vector(_float_triple(axis)))
        y, velocity = np.cross(axis, x), _rotate(initial_u[:3], axis, angle)
        initial = _initial_state(
            [initial_q[:3] @ x, initial_q[:3] @ y, angle], [velocity @ x, velocity @ y, rate]
        )
        planar = Hinge(
            **common, type=_hinge_type(lambda h: h.frame == "plane"), normal=_float_triple(axis),
            axis2=_float_triple(x), initial=initial
        )  # fmt: skip
    else:
        return None
    return planar.model_copy(update={"release": hinge.release})


def _hinge_type(has: Callable[[HingeProperties], object]) -> str:
    """Type of the built-in hinge with these properties."""
    return next(name for name, properties in builtin_hinges().items() if has(properties))


def _common_axis(vectors: Array) -> Array | None:
    """Common direction (3,) of the vector parts (n, 3) of quaternions; None without one."""
    _, singular_values, rows = np.linalg.svd(vectors, full_matrices=False)
    if len(singular_values) < 2 or not singular_values[0] > _MOTION_TOLERANCE:
        return None
    if singular_values[1] > _MOTION_TOLERANCE * singular_values[0]:
        return None
    axis = np.asarray(rows[0])
    return axis * np.sign(axis[np.argmax(np.abs(axis))])


def _rotate(vector: Array, axis: Array, angle: float) -> Array:
    """Rotate a vector about a unit axis by `angle` (rad), by Rodrigues' formula."""
    parallel = axis * (axis @ vector)
    normal = vector - parallel
    rotated = parallel + np.cos(angle) * normal + np.sin(angle) * np.cross(axis, normal)
    return np.asarray(rotated)


def _initial_state(q: Sequence[Any], u: Sequence[Any]) -> Initial:
    return Initial(q=tuple(map(float, q)), u=tuple(map(float, u)))


def _float_triple(values: Array) -> Vector:
    x, y, z = map(float, values)
    return (x, y, z)
