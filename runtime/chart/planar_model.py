"""Planar model level: constrains to a plane what a run shows to stay in it.

Beams lose the shapes of directions in which they do not deform, ball hinges that rotate about one
axis become pins, and free hinges that rotate about one axis and move normal to it become planar.
Hinges with laws or drives are not changed.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.ir.hinge_properties import builtin_hinges
from mstmm.numerics.rotations import perpendicular_vector
from mstmm.scene import Hinge
from mstmm.scene.tables.beam import DIRECTIONS, Beam, Modes
from mstmm.scene.tables.hinge import Initial

from .model_levels import Variant, beam_modes, with_mode_counts, with_tables

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene

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
    if hinge.law != lawless.law or axis is None or not _is_parallel(initial_u[-3:], axis):
        return None
    initial_q, rate = np.array(hinge.initial.q), float(initial_u[-3:] @ axis)
    angle = 2.0 * float(np.arctan2(initial_q[-3:] @ axis, initial_q[-4]))
    common = {"name": hinge.name, "inboard": hinge.inboard, "outboard": hinge.outboard,
              "orientation": hinge.orientation, "position": hinge.position}  # fmt: skip
    if not properties.free_body:
        planar = Hinge(
            **common, type=_pin_type(), axis=_float_triple(axis),
            initial=_initial_state([angle], [rate])
        )  # fmt: skip
    elif _is_in_plane(hinge_q[:, :3], axis):
        x = np.array(perpendicular_vector(_float_triple(axis)))
        y, velocity = np.cross(axis, x), _rotate(initial_u[:3], axis, angle)
        initial = _initial_state(
            [initial_q[:3] @ x, initial_q[:3] @ y, angle], [velocity @ x, velocity @ y, rate]
        )
        planar = Hinge(
            **common, type=_planar_hinge_type(), normal=_float_triple(axis),
            axis2=_float_triple(x), initial=initial
        )  # fmt: skip
    else:
        return None
    return planar.model_copy(update={"release": hinge.release})


@cache
def _pin_type() -> str:
    """Type of the hinge that only rotates about an axis."""
    hinges = builtin_hinges().items()
    return next(name for name, hinge in hinges if hinge.axial and hinge.turns and not hinge.slides)


@cache
def _planar_hinge_type() -> str:
    """Type of the hinge that moves in a plane and rotates about its normal."""
    return next(name for name, hinge in builtin_hinges().items() if hinge.frame == "plane")


def _is_parallel(vector: Array, axis: Array) -> bool:
    """Whether a vector is parallel to a unit axis."""
    normal = np.linalg.norm(vector - axis * (axis @ vector))
    return bool(normal <= _MOTION_TOLERANCE * np.linalg.norm(vector))


def _is_in_plane(positions: Array, axis: Array) -> bool:
    """Whether positions (n, 3) lie in the plane through the origin normal to the axis."""
    return bool(np.abs(positions @ axis).max() <= _MOTION_TOLERANCE * np.abs(positions).max())


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
