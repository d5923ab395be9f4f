"""The planar level of model: what a run shows to stay in a plane is made to stay there.

Directions in which beams do not bend lose their shapes, ball hinges that turn about one axis alone
become pins, and free hinges that turn about one axis and move across it become planar ones.  Hinges
with laws or drives stay what they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.arrays import Array
from mstmm.numbers.rotations import perpendicular
from mstmm.scene import Hinge
from mstmm.scene.tables.hinge_keys import Initial

from .models import Variant, directions, modes_of, with_shapes, with_tables

if TYPE_CHECKING:
    from ..engine.compiled import Compiled

#: Coordinates below this part of the largest one beside them do not move.
_STILL = 1e-9

Vector = tuple[float, float, float]


def planar(richest: Variant, model: Compiled, q: Array) -> Variant | None:
    """The richest level without what does not move in a run of its model, whose coordinates at the
    samples are q (n, nq).

    None where there is nothing to leave out.
    """
    modes = modes_of(model)
    moving = [own for _, own in directions(modes) if _moves(model, q, own)]
    kept = {name for own in moving for name in own}
    beams = []
    for beam in richest.scene.beam:
        names = [name for name in modes.get(beam.name, ()) if f"{beam.name}.{name}" in kept]
        level = {} if names else {"model": "rigid"}
        beams.append(with_shapes(beam, names or modes[beam.name], modes).model_copy(update=level))
    hinges = tuple(_flat(model, hinge, q) or hinge for hinge in richest.scene.hinge)
    if tuple(beams) == richest.scene.beam and hinges == richest.scene.hinge:
        return None
    scene = with_tables(richest.scene, beam=tuple(beams), hinge=hinges)
    return Variant("planar, " + richest.name, scene)


def _moves(model: Compiled, q: Array, coordinates: Sequence[str]) -> bool:
    """Whether modal coordinates of one body, such as ("blade.z1",), move beside its others."""
    slots = model.layout.modal[coordinates[0].rpartition(".")[0]]
    sizes = np.abs(q[:, slots.q_slice]).max(axis=0)
    own = [f"{slots.name}.{name}" in coordinates for name in slots.q_names]
    return bool(sizes[own].max(initial=0.0) > _STILL * sizes.max(initial=0.0))


def _flat(model: Compiled, hinge: Hinge, q: Array) -> Hinge | None:
    """The pin or planar hinge that moves as this one did; None where there is none."""
    if hinge.type not in ("ball", "free") or hinge.drive is not None:
        return None
    plain = Hinge(name="plain", type=hinge.type, inboard="ground", outboard=hinge.outboard)
    if hinge.law != plain.law or hinge.initial is None or hinge.initial.q is None:
        return None
    own = q[:, model.layout.hinges[hinge.name].q_slice]
    axis = _axis(own[:, -3:])
    if axis is None:
        return None
    start = np.array(hinge.initial.q)
    speed = np.array(hinge.initial.u or (0.0,) * (3 if hinge.type == "ball" else 6))
    turn = 2.0 * float(np.arctan2(start[-3:] @ axis, start[-4]))
    rate = float(speed[-3:] @ axis)
    if not np.allclose(speed[-3:], rate * axis, rtol=0.0, atol=_STILL * max(1.0, abs(rate))):
        return None
    changed = {"name": hinge.name, "inboard": hinge.inboard, "outboard": hinge.outboard,
               "orientation": hinge.orientation, "position": hinge.position}  # fmt: skip
    if hinge.type == "ball":
        pin = Hinge(**changed, type="pin", axis=_vector(axis), initial=_start([turn], [rate]))
        return pin.model_copy(update={"release": hinge.release})
    across = np.abs(own[:, :3] @ axis).max()
    if across > _STILL * np.abs(own[:, :3]).max(initial=0.0):
        return None
    x = np.array(perpendicular(_vector(axis)))
    y = np.cross(axis, x)
    moved = _rotated(speed[:3], axis, turn)
    initial = _start([start[:3] @ x, start[:3] @ y, turn], [moved @ x, moved @ y, rate])
    flat = Hinge(**changed, type="planar", normal=_vector(axis), axis2=_vector(x), initial=initial)
    return flat.model_copy(update={"release": hinge.release})


def _axis(vectors: Array) -> Array | None:
    """The direction (3,) along which the vector parts (n, 3) of quaternions lie; None where they
    have more than one, or none."""
    _, sizes, rows = np.linalg.svd(vectors, full_matrices=False)
    if len(sizes) < 2 or not sizes[0] > _STILL or sizes[1] > _STILL * sizes[0]:
        return None
    axis = np.asarray(rows[0])
    return axis * np.sign(axis[np.argmax(np.abs(axis))])


def _rotated(vector: Array, axis: Array, turn: float) -> Array:
    """A vector turned about a unit axis (Rodrigues)."""
    along = axis * (axis @ vector)
    across = vector - along
    return np.asarray(along + np.cos(turn) * across + np.sin(turn) * np.cross(axis, across))


def _start(q: Sequence[Any], u: Sequence[Any]) -> Initial:
    return Initial(q=tuple(map(float, q)), u=tuple(map(float, u)))


def _vector(values: Array) -> Vector:
    x, y, z = map(float, values)
    return (x, y, z)
