"""Intermediate model of a robot: links connected by joints, with their frames."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from ...numerics.pose import IDENTITY_POSE, ZERO, Pose
from ...numerics.rotations import Matrix, Vector

FIXED = "fixed"
ZERO_MATRIX: Matrix = (ZERO, ZERO, ZERO)


@dataclass(frozen=True)
class Link:
    """Rigid body: mass (kg), mass centre (m) and inertia about it (kg m^2), in link axes."""

    name: str
    mass: float = 0.0
    center: Vector = ZERO
    inertia: Matrix = ZERO_MATRIX
    where: str = ""


@dataclass(frozen=True)
class Joint:
    """Joint between two links, with the type of its hinge.

    `pose` is the frame of the child in the parent at q = 0; `keys` are further keys of its
    [[hinge]].  "armature" (kg) of a free joint is a mass at its origin that has inertia but no
    weight; it is also part of the inertia in its law.
    """

    name: str
    type: str
    parent: str
    child: str
    pose: Pose = IDENTITY_POSE
    keys: Mapping[str, Any] = field(default_factory=dict)
    where: str = ""


@dataclass(frozen=True)
class Mimic:
    """Mimic relation of the joint `follower` to another one: q = multiplier q_other + offset."""

    follower: str
    leader: str
    multiplier: float
    offset: float


@dataclass(frozen=True)
class Visual:
    """Visual geometry of a link: a [[shape]] in its axes, without names."""

    link: str
    pose: Pose
    keys: Mapping[str, Any]


def color(rgb: Iterable[float]) -> str:
    """Convert red, green and blue (0 to 1) to the colour format of a scene."""
    return "#" + "".join(f"{round(255 * min(max(float(x), 0.0), 1.0)):02x}" for x in rgb)


@dataclass(frozen=True)
class ImportNote:
    """Note on an element of a robot file that is left out or converted differently."""

    where: str
    element: str
    text: str

    def __str__(self) -> str:
        return f"{self.where}: {self.element}: {self.text}"


@dataclass(frozen=True)
class Robot:
    """Links, joints and visual geometry of a robot, in the order of the file."""

    name: str
    where: str
    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    mimics: tuple[Mimic, ...] = ()
    visuals: tuple[Visual, ...] = ()
    notes: tuple[ImportNote, ...] = ()
    gravity: Vector = (0.0, 0.0, -9.81)
