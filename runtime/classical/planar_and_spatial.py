"""Spatial and planar form of the classical method.

A form converts parts to C records and the initial state to motions, and it converts motions to the
movement of parts in space.  The matrices of beams have a fixed number of shapes.  Shapes that a
beam does not use have a mass, but no stiffness and no coupling.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from mstmm.array_validation import Array

from .body_parts import Bending, Part
from .supported_elements import BALL, FIXED, FREE, PIN, unsupported_error

#: Offsets in a motion, and its number of doubles (`mstmm_classical_motion`).
POSITION, SPEED, RATE, AUXILIARY, AXES, INBOARD, OUTBOARD = 0, 8, 16, 24, 32, 41, 47
MOTION = 54

#: Relative deviation of lengths, or rad, by which a planar scene may leave its plane.
_PLANE_TOLERANCE = 1e-10


@dataclass(frozen=True)
class PartMovement:
    """Movement of a part at n times, or at one time without the axis n.

    Position and velocity (n, 3) of its reference point in inertial axes, `angular_velocity` (n, 3)
    in its own axes, `axes` (n, 3, 3), modal coordinates and their rates (n, k).  Accelerations and
    loads are optional.
    """

    position: Array
    velocity: Array
    angular_velocity: Array
    axes: Array
    eta: Array
    etad: Array
    acceleration: Array | None = None
    angular_acceleration: Array | None = None
    etadd: Array | None = None
    load: Array | None = None


class Form(ABC):
    """Conversion of parts to C records, and of motions to movement in space."""

    planar: bool
    #: Maximum number of shapes of a beam, and index of the first modal coordinate in a motion.
    shapes: int
    first: int

    @abstractmethod
    def gravity(self, gravity: Array) -> Array:
        """Gravity (3,), m/s^2, in the coordinates of the records."""

    @abstractmethod
    def record(self, parts: Sequence[Part], k: int) -> dict[str, Array]:
        """Fields of a part's record, each flat; omitted fields are zero."""

    @abstractmethod
    def shape_indices(self, bending: Bending) -> list[int]:
        """Indices of a beam's shapes among those of its matrix."""

    @abstractmethod
    def initial_motion(self, k: int, at: PartMovement) -> Array:
        """Initial motion (MOTION,) of a part."""

    @abstractmethod
    def part_movement(self, part: Part, k: int, motion: Array) -> PartMovement:
        """Movement of a part in space, from its motions (n, MOTION)."""

    def modal(self, part: Part, sign: float = 1.0) -> dict[str, Array]:
        """Modal parameters of a beam's record; `sign` is that of the direction of its shapes."""
        bending = part.bending
        if bending is None:
            return {}
        indices, upper_triangle = self.shape_indices(bending), np.triu_indices(self.shapes)
        block, shift, moment = np.ix_(indices, indices), *np.zeros((2, self.shapes))
        shift[indices], moment[indices] = sign * bending.shift, sign * bending.moment
        mass = part.mass * np.eye(self.shapes)
        stiffness, damping = np.zeros((2, self.shapes, self.shapes))
        mass[block], stiffness[block] = bending.mass, bending.stiffness
        damping[block] = bending.damping
        return {
            "shift": shift, "moment": moment, "modal_mass": mass[upper_triangle],
            "stiffness": stiffness[upper_triangle], "damping": damping[upper_triangle],
        }  # fmt: skip

    def flatten_shapes(self, part: Part | None, shapes: Array) -> Array:
        """Columns of a beam's shapes in the layout of its matrix, flat."""
        if part is None or part.bending is None:
            return np.zeros(0)
        spread = np.zeros((len(shapes), self.shapes))
        spread[:, self.shape_indices(part.bending)] = shapes
        return spread.ravel()

    def modal_indices(self, part: Part) -> list[int]:
        """Indices of a part's modal coordinates in the position of a motion."""
        if part.bending is None:
            return []
        return [self.first + place for place in self.shape_indices(part.bending)]


class Spatial(Form):
    """Spatial form: beams have one shape along y and one along z."""

    planar, shapes, first = False, 2, 6

    def __init__(self, parts: Sequence[Part], names: Sequence[str]) -> None:
        for part, name in zip(parts, names, strict=True):
            bending = part.bending
            if bending is not None and len(set(bending.directions)) < bending.n:
                raise unsupported_error(
                    f'"{name}"',
                    "in space its matrices have one shape along y and one along z; three in one "
                    "direction need a scene whose parts and motion are in a plane",
                )
        self.parts = parts

    def gravity(self, gravity: Array) -> Array:
        return gravity

    def shape_indices(self, bending: Bending) -> list[int]:
        return [direction - 1 for direction in bending.directions]

    def record(self, parts: Sequence[Part], k: int) -> dict[str, Array]:
        part, attachment = parts[k], parts[k].attachment
        parent = parts[attachment.parent] if attachment.parent >= 0 else None
        fields = {
            "first": part.first,
            "inertia": part.inertia,
            "place": attachment.point,
            "turn": attachment.rotation.ravel(),
            "end": part.end.ravel(),
            "shapes": self.flatten_shapes(parent, attachment.shapes),
            "slopes": self.flatten_shapes(parent, attachment.slopes),
            "held": self.flatten_shapes(part, part.section_rotation),
        }
        if part.springs is not None:
            law = part.springs.law
            fields |= {"law": np.array(law.p), "law_axes": np.array(law.axes)}
        return fields | self.modal(part)

    def initial_motion(self, k: int, at: PartMovement) -> Array:
        motion, modes = (
            np.zeros(MOTION),
            np.array(self.modal_indices(self.parts[k]), dtype=np.int64),
        )
        assert (
            at.acceleration is not None
            and at.angular_acceleration is not None
            and at.etadd is not None
        )
        for offset, translation, rotation, modal in (
            (POSITION, at.position, np.zeros(3), at.eta), (SPEED, at.velocity, at.angular_velocity,
            at.etad), (RATE, at.acceleration, at.angular_acceleration, at.etadd), (AUXILIARY,
            at.acceleration, at.angular_acceleration, at.etadd),
        ):  # fmt: skip
            motion[offset : offset + 3], motion[offset + 3 : offset + 6] = translation, rotation
            motion[offset + modes] = modal
        motion[AXES : AXES + 9] = at.axes.ravel()
        motion[INBOARD : INBOARD + 6] = motion[OUTBOARD : OUTBOARD + 6] = at.load
        return motion

    def part_movement(self, part: Part, k: int, motion: Array) -> PartMovement:
        modes = np.array(self.modal_indices(part), dtype=np.int64)
        return PartMovement(
            motion[:, POSITION : POSITION + 3], motion[:, SPEED : SPEED + 3],
            motion[:, SPEED + 3 : SPEED + 6], motion[:, AXES : AXES + 9].reshape(-1, 3, 3),
            motion[:, POSITION + modes], motion[:, SPEED + modes],
        )  # fmt: skip


class Planar(Form):
    """Planar form: a scene that is symmetric about a plane and moves in it.

    The columns of `ground` (3, 3) are the plane's axes and its normal in inertial axes; `frames`
    are the same in the axes of each part.  `height` (m) is the position of the plane along the
    normal.
    """

    planar, shapes, first = True, 3, 3

    def __init__(
        self, parts: Sequence[Part], ground: Array, frames: list[Array], height: float
    ) -> None:
        self.parts, self.ground, self.frames, self.height = parts, ground, frames, height

    def gravity(self, gravity: Array) -> Array:
        return np.append((self.ground.T @ gravity)[:2], 0.0)

    def shape_indices(self, bending: Bending) -> list[int]:
        return list(range(bending.n))

    def record(self, parts: Sequence[Part], k: int) -> dict[str, Array]:
        part, attachment, own_frame = parts[k], parts[k].attachment, self.frames[k]
        parent = parts[attachment.parent] if attachment.parent >= 0 else None
        parent_frame = self.frames[attachment.parent] if attachment.parent >= 0 else self.ground
        axes = parent_frame.T @ attachment.rotation
        body = axes @ part.end.T @ own_frame
        turn = [np.arctan2(body[1, 0], body[0, 0]), np.arctan2(axes[1, 0], axes[0, 0])]
        normal = own_frame[:, 2]
        fields = {
            "first": (own_frame.T @ part.first)[:2],
            "inertia": np.array([normal @ full_inertia(part.inertia) @ normal]),
            "place": (parent_frame.T @ attachment.point)[:2], "turn": np.array(turn),
            "shapes": self.flatten_shapes(parent, (parent_frame.T @ attachment.shapes)[:2]),
            "slopes": self.flatten_shapes(parent, (parent_frame.T @ attachment.slopes)[2:]),
            "held": self.flatten_shapes(part, (own_frame.T @ part.section_rotation)[2:]),
        }  # fmt: skip
        if part.springs is not None:
            law = np.array(part.springs.law.p)
            law[4] *= np.sign(axes[2, 2])  # the hinge's y axis if its z axis opposes the normal
            fields["law"] = law
        direction = part.bending.directions[0] if part.bending is not None else 1
        return fields | self.modal(part, float(np.sign(own_frame[direction, 1])))

    def initial_motion(self, k: int, at: PartMovement) -> Array:
        motion, modes = (
            np.zeros(MOTION),
            np.array(self.modal_indices(self.parts[k]), dtype=np.int64),
        )
        assert (
            at.acceleration is not None
            and at.angular_acceleration is not None
            and at.etadd is not None
        )
        assert at.load is not None
        own_frame, ground = self.frames[k], self.ground
        relative_axes = ground.T @ at.axes @ own_frame
        angle = np.arctan2(relative_axes[1, 0], relative_axes[0, 0])
        normal = own_frame[:, 2]
        for offset, translation, rotation, modal in (
            (POSITION, at.position, angle, at.eta), (SPEED, at.velocity, normal @
            at.angular_velocity, at.etad), (RATE, at.acceleration, normal @ at.angular_acceleration,
            at.etadd), (AUXILIARY, at.acceleration, normal @ at.angular_acceleration, at.etadd),
        ):  # fmt: skip
            motion[offset : offset + 2], motion[offset + 2] = (ground.T @ translation)[:2], rotation
            motion[offset + modes] = modal
        for offset in (INBOARD, OUTBOARD):
            motion[offset] = ground[:, 2] @ at.load[:3]
            motion[offset + 1 : offset + 3] = (ground.T @ at.load[3:])[:2]
        return motion

    def part_movement(self, part: Part, k: int, motion: Array) -> PartMovement:
        modes = np.array(self.modal_indices(part), dtype=np.int64)
        ground, own_frame, n = self.ground, self.frames[k], len(motion)
        cosine, sine = np.cos(motion[:, POSITION + 2]), np.sin(motion[:, POSITION + 2])
        rotation = np.zeros((n, 3, 3))
        rotation[:, 0, 0], rotation[:, 0, 1], rotation[:, 2, 2] = cosine, -sine, 1.0
        rotation[:, 1, 0], rotation[:, 1, 1] = sine, cosine
        plane_position = motion[:, POSITION : POSITION + 2] @ ground[:, :2].T
        return PartMovement(
            plane_position + self.height * ground[:, 2],
            motion[:, SPEED : SPEED + 2] @ ground[:, :2].T,
            motion[:, SPEED + 2 : SPEED + 3] * own_frame[:, 2],
            ground @ rotation @ own_frame.T,
            motion[:, POSITION + modes],
            motion[:, SPEED + modes],
        )


def full_inertia(inertia: Array) -> Array:
    """Symmetric matrix (3, 3) from its entries xx xy xz yy yz zz."""
    matrix = np.zeros((3, 3))
    matrix[np.triu_indices(3)] = inertia
    return np.asarray(matrix + matrix.T - np.diag(np.diag(matrix)))


def select_form(
    parts: Sequence[Part],
    start: Sequence[PartMovement],
    gravity: Array,
    names: Sequence[str],
    size: float,
) -> Form:
    """Planar form of a scene if it has a plane, else the spatial form."""
    for normal in _normal_candidates(parts, start):
        plane = _planar_form(parts, start, gravity, normal, size)
        if plane is not None:
            return plane
    return Spatial(parts, names)


def _normal_candidates(parts: Sequence[Part], start: Sequence[PartMovement]) -> Iterator[Array]:
    """Candidates for the normal of the plane: the axis of a pin, the third direction of a beam."""
    for part, movement_at_start in zip(parts, start, strict=True):
        if part.kind == PIN:
            yield movement_at_start.axes @ part.end[:, 2]
            return
        if part.bending is not None and part.bending.n:
            yield movement_at_start.axes[:, 3 - part.bending.directions[0]]
    yield from np.eye(3)


def _planar_form(
    parts: Sequence[Part], start: Sequence[PartMovement], gravity: Array, normal: Array, size: float
) -> Planar | None:
    """Planar form with the given normal, None if the scene does not stay in that plane."""
    frames = []
    height = float(start[0].position @ normal)
    if abs(gravity @ normal) > _PLANE_TOLERANCE * np.linalg.norm(gravity):
        return None
    for part, movement_at_start in zip(parts, start, strict=True):
        own_normal = movement_at_start.axes.T @ normal
        if not _moves_in_plane(part, movement_at_start, normal, own_normal, height, size):
            return None
        x = np.array([1.0, 0.0, 0.0]) if part.bending is not None else _perpendicular(own_normal)
        frames.append(np.column_stack([x, np.cross(own_normal, x), own_normal]))
    x = _perpendicular(normal)
    return Planar(parts, np.column_stack([x, np.cross(normal, x), normal]), frames, height)


def _perpendicular(normal: Array) -> Array:
    """A unit vector perpendicular to the given one."""
    x = np.cross(np.eye(3)[np.argmin(np.abs(normal))], normal)
    return np.asarray(x / np.linalg.norm(x))


def _moves_in_plane(
    part: Part, at: PartMovement, normal: Array, own: Array, height: float, size: float
) -> bool:
    """True if a part is symmetric about the plane and moves in it."""
    speed = max(
        float(np.linalg.norm(at.velocity)), size * float(np.linalg.norm(at.angular_velocity))
    )
    inertia_of_normal = full_inertia(part.inertia) @ own
    conditions = [
        abs(at.position @ normal - height) <= _PLANE_TOLERANCE * size,
        abs(part.first @ own) <= _PLANE_TOLERANCE * size * part.mass,
        np.linalg.norm(inertia_of_normal - own * (own @ inertia_of_normal))
        <= _PLANE_TOLERANCE * np.abs(part.inertia).max(),
        abs(at.velocity @ normal) <= _PLANE_TOLERANCE * speed,
        size * np.linalg.norm(at.angular_velocity - own * (own @ at.angular_velocity))
        <= _PLANE_TOLERANCE * speed,
        part.kind in (FREE, FIXED, BALL) or _rotates_about_normal(part, own),
    ]
    if part.bending is not None and part.bending.n:
        directions = set(part.bending.directions)
        conditions += [
            len(directions) == 1, part.bending.n <= Planar.shapes,
            abs(own[3 - part.bending.directions[0]]) >= 1 - _PLANE_TOLERANCE,
        ]  # fmt: skip
    return all(conditions)


def _rotates_about_normal(part: Part, own: Array) -> bool:
    """True if the hinge's z axis is the normal and no spring has a rest length along it."""
    has_no_rest_length = part.springs is None or part.springs.law.p[5] == 0
    return has_no_rest_length and bool(abs(part.end[:, 2] @ own) >= 1 - _PLANE_TOLERANCE)
