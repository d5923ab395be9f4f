"""A robot as the formats of others have it: links joined by joints, in frames of their own."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from ...numbers.pose import IN_PLACE, ZERO, Pose
from ...numbers.rotations import Matrix, Vector

FIXED = "fixed"
NOTHING: Matrix = (ZERO, ZERO, ZERO)


@dataclass(frozen=True)
class Link:
    """A rigid body: mass (kg), mass centre (m) and inertia about it (kg m^2), in its own axes."""

    name: str
    mass: float = 0.0
    center: Vector = ZERO
    inertia: Matrix = NOTHING
    where: str = ""


@dataclass(frozen=True)
class Joint:
    """What joins two links, of a type of hinge: `pose` is the child's frame in the parent's at
    q = 0; `keys` are more of its [[hinge]], and "armature" (kg) of a free one the mass at its
    origin that accelerates and weighs nothing, which its law's inertia has besides."""

    name: str
    type: str
    parent: str
    child: str
    pose: Pose = IN_PLACE
    keys: Mapping[str, Any] = field(default_factory=dict)
    where: str = ""


@dataclass(frozen=True)
class Mimic:
    """The joint `of` goes with another one: q = multiplier q_other + offset."""

    of: str
    other: str
    multiplier: float
    offset: float


@dataclass(frozen=True)
class Look:
    """What a link looks like: a [[shape]] in its axes, without the names."""

    link: str
    pose: Pose
    keys: Mapping[str, Any]


def color(rgb: Iterable[float]) -> str:
    """Red, green and blue, 0 to 1, as a scene has them."""
    return "#" + "".join(f"{round(255 * min(max(float(x), 0.0), 1.0)):02x}" for x in rgb)


@dataclass(frozen=True)
class Note:
    """What became of something in the file that a scene has not, or has otherwise."""

    where: str
    element: str
    text: str

    def __str__(self) -> str:
        return f"{self.where}: {self.element}: {self.text}"


@dataclass(frozen=True)
class Robot:
    """Links, joints and looks in the order of the file."""

    name: str
    where: str
    links: tuple[Link, ...]
    joints: tuple[Joint, ...]
    mimics: tuple[Mimic, ...] = ()
    looks: tuple[Look, ...] = ()
    notes: tuple[Note, ...] = ()
    gravity: Vector = (0.0, 0.0, -9.81)
