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

from mstmm.arrays import Array

from .known import BALL, FIXED, FREE, PIN, refused
from .parts import Bending, Part

#: Offsets in a motion, and its number of doubles (`mstmm_classical_motion`).
POSITION, SPEED, RATE, AUXILIARY, AXES, INBOARD, OUTBOARD = 0, 8, 16, 24, 32, 41, 47
MOTION = 54

#: Relative deviation of lengths, or rad, by which a planar scene may leave its plane.
_FLAT = 1e-10


@dataclass(frozen=True)
class Moving:
    """Movement of a part at n times, or at one time without the axis n.

    Position and velocity (n, 3) of its reference point in inertial axes, `spin` (n, 3) in its own
    axes, `axes` (n, 3, 3), modal coordinates and their rates (n, k).  Accelerations and loads are
    optional.
    """

    position: Array
    velocity: Array
    spin: Array
    axes: Array
    eta: Array
    etad: Array
    acceleration: Array | None = None
    spun: Array | None = None
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
    def places(self, bending: Bending) -> list[int]:
        """Indices of a beam's shapes among those of its matrix."""

    @abstractmethod
    def start(self, k: int, at: Moving) -> Array:
        """Initial motion (MOTION,) of a part."""

    @abstractmethod
    def moving(self, part: Part, k: int, motion: Array) -> Moving:
        """Movement of a part in space, from its motions (n, MOTION)."""

    def modal(self, part: Part, sign: float = 1.0) -> dict[str, Array]:
        """Modal parameters of a beam's record; `sign` is that of the direction of its shapes."""
        bending = part.bending
        if bending is None:
            return {}
        places, upper = self.places(bending), np.triu_indices(self.shapes)
        square, shift, moment = np.ix_(places, places), *np.zeros((2, self.shapes))
        shift[places], moment[places] = sign * bending.shift, sign * bending.moment
        mass = part.mass * np.eye(self.shapes)
        stiffness, damping = np.zeros((2, self.shapes, self.shapes))
        mass[square], stiffness[square] = bending.mass, bending.stiffness
        damping[square] = bending.damping
        return {
            "shift": shift, "moment": moment, "modal_mass": mass[upper],
            "stiffness": stiffness[upper], "damping": damping[upper],
        }  # fmt: skip

    def spread(self, part: Part | None, shapes: Array) -> Array:
        """Columns of a beam's shapes in the layout of its matrix, flat."""
        if part is None or part.bending is None:
            return np.zeros(0)
        found = np.zeros((len(shapes), self.shapes))
        found[:, self.places(part.bending)] = shapes
        return found.ravel()

    def modal_places(self, part: Part) -> list[int]:
        """Indices of a part's modal coordinates in the position of a motion."""
        if part.bending is None:
            return []
        return [self.first + place for place in self.places(part.bending)]


class Spatial(Form):
    """Spatial form: beams have one shape along y and one along z."""

    planar, shapes, first = False, 2, 6

    def __init__(self, parts: Sequence[Part], names: Sequence[str]) -> None:
        for part, name in zip(parts, names, strict=True):
            bending = part.bending
            if bending is not None and len(set(bending.directions)) < bending.n:
                raise refused(
                    f'"{name}"',
                    "in space its matrices have one shape along y and one along z; three in one "
                    "direction need a scene whose parts and motion are in a plane",
                )
        self.parts = parts

    def gravity(self, gravity: Array) -> Array:
        return gravity

    def places(self, bending: Bending) -> list[int]:
        return [direction - 1 for direction in bending.directions]

    def record(self, parts: Sequence[Part], k: int) -> dict[str, Array]:
        part, hung = parts[k], parts[k].hung
        parent = parts[hung.parent] if hung.parent >= 0 else None
        found = {
            "first": part.first, "inertia": part.inertia, "place": hung.point,
            "turn": hung.turn.ravel(), "end": part.end.ravel(),
            "shapes": self.spread(parent, hung.shapes), "slopes": self.spread(parent, hung.slopes),
            "held": self.spread(part, part.held),
        }  # fmt: skip
        if part.springs is not None:
            law = part.springs.law
            found |= {"law": np.array(law.p), "law_axes": np.array(law.axes)}
        return found | self.modal(part)

    def start(self, k: int, at: Moving) -> Array:
        found, modes = np.zeros(MOTION), np.array(self.modal_places(self.parts[k]), dtype=np.int64)
        assert at.acceleration is not None and at.spun is not None and at.etadd is not None
        for first, shift, turn, modal in (
            (POSITION, at.position, np.zeros(3), at.eta), (SPEED, at.velocity, at.spin, at.etad),
            (RATE, at.acceleration, at.spun, at.etadd),
            (AUXILIARY, at.acceleration, at.spun, at.etadd),
        ):  # fmt: skip
            found[first : first + 3], found[first + 3 : first + 6] = shift, turn
            found[first + modes] = modal
        found[AXES : AXES + 9] = at.axes.ravel()
        found[INBOARD : INBOARD + 6] = found[OUTBOARD : OUTBOARD + 6] = at.load
        return found

    def moving(self, part: Part, k: int, motion: Array) -> Moving:
        modes = np.array(self.modal_places(part), dtype=np.int64)
        return Moving(
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

    def places(self, bending: Bending) -> list[int]:
        return list(range(bending.n))

    def record(self, parts: Sequence[Part], k: int) -> dict[str, Array]:
        part, hung, own = parts[k], parts[k].hung, self.frames[k]
        parent = parts[hung.parent] if hung.parent >= 0 else None
        inner = self.frames[hung.parent] if hung.parent >= 0 else self.ground
        axes = inner.T @ hung.turn
        body = axes @ part.end.T @ own
        turn = [np.arctan2(body[1, 0], body[0, 0]), np.arctan2(axes[1, 0], axes[0, 0])]
        normal = own[:, 2]
        found = {
            "first": (own.T @ part.first)[:2],
            "inertia": np.array([normal @ full(part.inertia) @ normal]),
            "place": (inner.T @ hung.point)[:2], "turn": np.array(turn),
            "shapes": self.spread(parent, (inner.T @ hung.shapes)[:2]),
            "slopes": self.spread(parent, (inner.T @ hung.slopes)[2:]),
            "held": self.spread(part, (own.T @ part.held)[2:]),
        }  # fmt: skip
        if part.springs is not None:
            law = np.array(part.springs.law.p)
            law[4] *= np.sign(axes[2, 2])  # the hinge's y axis if its z axis opposes the normal
            found["law"] = law
        direction = part.bending.directions[0] if part.bending is not None else 1
        return found | self.modal(part, float(np.sign(own[direction, 1])))

    def start(self, k: int, at: Moving) -> Array:
        found, modes = np.zeros(MOTION), np.array(self.modal_places(self.parts[k]), dtype=np.int64)
        assert at.acceleration is not None and at.spun is not None and at.etadd is not None
        assert at.load is not None
        own, ground = self.frames[k], self.ground
        along = ground.T @ at.axes @ own
        angle = np.arctan2(along[1, 0], along[0, 0])
        normal = own[:, 2]
        for first, shift, turn, modal in (
            (POSITION, at.position, angle, at.eta), (SPEED, at.velocity, normal @ at.spin, at.etad),
            (RATE, at.acceleration, normal @ at.spun, at.etadd),
            (AUXILIARY, at.acceleration, normal @ at.spun, at.etadd),
        ):  # fmt: skip
            found[first : first + 2], found[first + 2] = (ground.T @ shift)[:2], turn
            found[first + modes] = modal
        for first in (INBOARD, OUTBOARD):
            found[first] = ground[:, 2] @ at.load[:3]
            found[first + 1 : first + 3] = (ground.T @ at.load[3:])[:2]
        return found

    def moving(self, part: Part, k: int, motion: Array) -> Moving:
        modes = np.array(self.modal_places(part), dtype=np.int64)
        ground, own, n = self.ground, self.frames[k], len(motion)
        cosine, sine = np.cos(motion[:, POSITION + 2]), np.sin(motion[:, POSITION + 2])
        turned = np.zeros((n, 3, 3))
        turned[:, 0, 0], turned[:, 0, 1], turned[:, 2, 2] = cosine, -sine, 1.0
        turned[:, 1, 0], turned[:, 1, 1] = sine, cosine
        plane = motion[:, POSITION : POSITION + 2] @ ground[:, :2].T
        return Moving(
            plane + self.height * ground[:, 2], motion[:, SPEED : SPEED + 2] @ ground[:, :2].T,
            motion[:, SPEED + 2 : SPEED + 3] * own[:, 2], ground @ turned @ own.T,
            motion[:, POSITION + modes], motion[:, SPEED + modes],
        )  # fmt: skip


def full(inertia: Array) -> Array:
    """Symmetric matrix (3, 3) from its entries xx xy xz yy yz zz."""
    found = np.zeros((3, 3))
    found[np.triu_indices(3)] = inertia
    return np.asarray(found + found.T - np.diag(np.diag(found)))


def form_of(
    parts: Sequence[Part],
    start: Sequence[Moving],
    gravity: Array,
    names: Sequence[str],
    size: float,
) -> Form:
    """Planar form of a scene if it has a plane, else the spatial form."""
    for normal in _normals(parts, start):
        plane = _plane(parts, start, gravity, normal, size)
        if plane is not None:
            return plane
    return Spatial(parts, names)


def _normals(parts: Sequence[Part], start: Sequence[Moving]) -> Iterator[Array]:
    """Candidates for the normal of the plane: the axis of a pin, the third direction of a beam."""
    for part, at in zip(parts, start, strict=True):
        if part.kind == PIN:
            yield at.axes @ part.end[:, 2]
            return
        if part.bending is not None and part.bending.n:
            yield at.axes[:, 3 - part.bending.directions[0]]
    yield from np.eye(3)


def _plane(
    parts: Sequence[Part], start: Sequence[Moving], gravity: Array, normal: Array, size: float
) -> Planar | None:
    """Planar form with the given normal, None if the scene does not stay in that plane."""
    frames = []
    height = float(start[0].position @ normal)
    if abs(gravity @ normal) > _FLAT * np.linalg.norm(gravity):
        return None
    for part, at in zip(parts, start, strict=True):
        own = at.axes.T @ normal
        if not _lies_in(part, at, normal, own, height, size):
            return None
        x = np.array([1.0, 0.0, 0.0]) if part.bending is not None else _across(own)
        frames.append(np.column_stack([x, np.cross(own, x), own]))
    x = _across(normal)
    return Planar(parts, np.column_stack([x, np.cross(normal, x), normal]), frames, height)


def _across(normal: Array) -> Array:
    """A unit vector perpendicular to the given one."""
    x = np.cross(np.eye(3)[np.argmin(np.abs(normal))], normal)
    return np.asarray(x / np.linalg.norm(x))


def _lies_in(part: Part, at: Moving, normal: Array, own: Array, height: float, size: float) -> bool:
    """True if a part is symmetric about the plane and moves in it."""
    speed = max(float(np.linalg.norm(at.velocity)), size * float(np.linalg.norm(at.spin)))
    turned = full(part.inertia) @ own
    flat = [
        abs(at.position @ normal - height) <= _FLAT * size,
        abs(part.first @ own) <= _FLAT * size * part.mass,
        np.linalg.norm(turned - own * (own @ turned)) <= _FLAT * np.abs(part.inertia).max(),
        abs(at.velocity @ normal) <= _FLAT * speed,
        size * np.linalg.norm(at.spin - own * (own @ at.spin)) <= _FLAT * speed,
        part.kind in (FREE, FIXED, BALL) or _about(part, own),
    ]
    if part.bending is not None and part.bending.n:
        directions = set(part.bending.directions)
        flat += [
            len(directions) == 1, part.bending.n <= Planar.shapes,
            abs(own[3 - part.bending.directions[0]]) >= 1 - _FLAT,
        ]  # fmt: skip
    return all(flat)


def _about(part: Part, own: Array) -> bool:
    """True if the hinge's z axis is the normal and no spring has a rest length along it."""
    rests = part.springs is None or part.springs.law.p[5] == 0
    return rests and bool(abs(part.end[:, 2] @ own) >= 1 - _FLAT)
