"""The planar level of model: what a run shows to stay in a plane is made to stay there.

Directions in which beams do not bend lose their shapes, ball hinges that turn about one axis alone
become pins, and free hinges that turn about one axis and move across it become planar ones.  Hinges
with laws or drives stay what they are.
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
from mstmm.scene.tables.beam import Beam
from mstmm.scene.tables.beam_keys import DIRECTIONS, Modes
from mstmm.scene.tables.hinge_keys import Initial

from .model_levels import Variant, modes_of, with_shapes, with_tables

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene

#: Coordinates below this part of the largest one beside them do not move.
_STILL = 1e-9

Vector = tuple[float, float, float]


def planar(richest: Variant, model: CompiledScene, q: Array) -> Variant | None:
    """The richest level without what does not move in a run of its model, whose coordinates at the
    samples are q (n, nq).

    None where there is nothing to leave out.
    """
    modes = modes_of(richest.scene)
    beams = tuple(
        _straight(model, beam, modes[beam.name], q) if beam.name in modes else beam
        for beam in richest.scene.beam
    )
    hinges = tuple(_flat(model, hinge, q) or hinge for hinge in richest.scene.hinge)
    if beams == richest.scene.beam and hinges == richest.scene.hinge:
        return None
    scene = with_tables(richest.scene, beam=beams, hinge=hinges)
    return Variant("planar, " + richest.name, scene)


def _straight(model: CompiledScene, beam: Beam, modes: Modes, q: Array) -> Beam:
    """A beam without shapes in the directions in which it stays straight; rigid without any."""
    slots = model.layout.modal[beam.name]
    sizes = np.abs(q[:, slots.q_slice]).max(axis=0)
    moving = {
        name.rstrip("0123456789")
        for name, size in zip(slots.q_names, sizes, strict=True)
        if size > _STILL * sizes.max()
    }
    kept = Modes(**{word: getattr(modes, word) for word in DIRECTIONS if word in moving})
    if kept == modes:
        return beam
    if not kept.total:
        return beam.model_copy(update={"model": "rigid"})
    return with_shapes(beam, modes, kept)


def _flat(model: CompiledScene, hinge: Hinge, q: Array) -> Hinge | None:
    """The hinge in a plane that moves as this one did; None where there is none."""
    facts = hinge.builtin
    if facts is None or facts.quaternion is None or facts.frame != "own":
        return None
    if hinge.drive is not None or hinge.initial is None or hinge.initial.q is None:
        return None
    plain = Hinge(name="plain", type=hinge.type, inboard="ground", outboard=hinge.outboard)
    own = q[:, model.layout.hinges[hinge.name].q_slice]
    axis = _axis(own[:, facts.quaternion + 1 :])
    speed = np.array(hinge.initial.u or (0.0,) * len(facts.speeds))
    if hinge.law != plain.law or axis is None or not _along(speed[-3:], axis):
        return None
    start, rate = np.array(hinge.initial.q), float(speed[-3:] @ axis)
    turn = 2.0 * float(np.arctan2(start[-3:] @ axis, start[-4]))
    common = {"name": hinge.name, "inboard": hinge.inboard, "outboard": hinge.outboard,
              "orientation": hinge.orientation, "position": hinge.position}  # fmt: skip
    if not facts.free_body:
        made = Hinge(
            **common, type=_turning(), axis=_vector(axis), initial=_start([turn], [rate])
        )  # fmt: skip
    elif _across(own[:, :3], axis):
        x = np.array(perpendicular_vector(_vector(axis)))
        y, moved = np.cross(axis, x), _rotated(speed[:3], axis, turn)
        initial = _start([start[:3] @ x, start[:3] @ y, turn], [moved @ x, moved @ y, rate])
        made = Hinge(
            **common, type=_flying(), normal=_vector(axis), axis2=_vector(x), initial=initial
        )  # fmt: skip
    else:
        return None
    return made.model_copy(update={"release": hinge.release})


@cache
def _turning() -> str:
    """The hinge that turns about its axis and does nothing else."""
    known = builtin_hinges().items()
    return next(name for name, f in known if f.axial and f.turns and not f.slides)


@cache
def _flying() -> str:
    """The hinge that moves in a plane, and turns about its normal."""
    return next(name for name, f in builtin_hinges().items() if f.frame == "plane")


def _along(vector: Array, axis: Array) -> bool:
    """Whether a vector has no part across the axis."""
    across = np.linalg.norm(vector - axis * (axis @ vector))
    return bool(across <= _STILL * np.linalg.norm(vector))


def _across(places: Array, axis: Array) -> bool:
    """Whether places (n, 3) lie in the plane across the axis through the origin."""
    return bool(np.abs(places @ axis).max() <= _STILL * np.abs(places).max())


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
