"""Intermediate model of a robot: links connected by joints, their tree and merged inertia."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from ...errors import SceneError
from ...numerics.rotations import IDENTITY_POSE, ZERO, Matrix, Pose, Vector, product, transpose
from ..validators.rotations_and_inertia import is_rounding
from ..validators.validation_messages import did_you_mean

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


# --- tree of links --------------------------------------------------------------------------------


class LinkTree:
    """Tree of the links of a robot.

    `links` and `joints` are by name; `holder` is the inboard joint of a link, `outboard_joints` the
    outboard joints of a link; `roots` are the links without an inboard joint.
    """

    def __init__(self, robot: Robot) -> None:
        self.links: dict[str, Link] = {}
        for link in robot.links:
            _check_unique(self.links, link, "link")
            self.links[link.name] = link
        self.joints: dict[str, Joint] = {}
        self.holder: dict[str, Joint] = {}
        self.outboard_joints: defaultdict[str, list[Joint]] = defaultdict(list)
        for joint in robot.joints:
            _check_unique(self.joints, joint, "joint")
            self.joints[joint.name] = joint
            self._hang(joint)
        if not self.links:
            raise SceneError(f"{robot.where}: the robot has no link")
        self.roots = [name for name in self.links if name not in self.holder]
        self.outward = list(self._outward())
        if len(self.outward) < len(self.links):
            reached_names = {link.name for link in self.outward}
            name = next(name for name in self.links if name not in reached_names)
            raise SceneError(
                f"{self.holder[name].where}: the joints around link {name!r} form a cycle, which "
                "URDF does not allow; remove one of them, and close the loop in the scene"
            )

    def _hang(self, joint: Joint) -> None:
        for end in (joint.parent, joint.child):
            if end not in self.links:
                raise SceneError(
                    f"{joint.where}: joint {joint.name!r}: there is no link {end!r}"
                    + did_you_mean(end, self.links)
                )
        if joint.child in self.holder:
            raise SceneError(
                f"{joint.where}: link {joint.child!r} is the child of joint "
                f"{self.holder[joint.child].name!r} and of {joint.name!r}; a link has one parent"
            )
        self.holder[joint.child] = joint
        self.outboard_joints[joint.parent].append(joint)

    def _outward(self) -> Iterator[Link]:
        """Links in tree order, each after its parent."""
        stack = list(reversed(self.roots))
        while stack:
            name = stack.pop()
            yield self.links[name]
            stack += [joint.child for joint in reversed(self.outboard_joints[name])]

    def weightless(self) -> list[Joint]:
        """Moving joints without any mass or inertia outboard of them."""
        heavy_links = set[str]()
        for link in reversed(self.outward):
            has_heavy_child = any(
                joint.child in heavy_links for joint in self.outboard_joints[link.name]
            )
            if has_heavy_child or link.mass > 0 or link.inertia != ZERO_MATRIX:
                heavy_links.add(link.name)
        return [
            joint for joint in self.joints.values()
            if joint.type != FIXED and joint.child not in heavy_links
        ]  # fmt: skip


def _check_unique(known: Collection[str], one: Link | Joint, what: str) -> None:
    if one.name in known:
        raise SceneError(f"{one.where}: {what} {one.name!r} is defined twice; rename one of them")


# --- inertia --------------------------------------------------------------------------------------


def merge_inertia(parts: Sequence[tuple[Link, Pose]]) -> tuple[float, Vector, Matrix]:
    """Merge links to one body: mass (kg), mass centre (m) and inertia about it (kg m^2).

    Each link is given with its frame in the axes of the body; the results are in these axes.
    """
    if len(parts) == 1 and parts[0][1] == IDENTITY_POSE:
        link = parts[0][0]
        return link.mass, link.center, link.inertia
    mass = sum(link.mass for link, _ in parts)
    mass_centres = [pose.compose(Pose(link.center)).position for link, pose in parts]
    center = ZERO
    if mass > 0:
        masses = [link.mass for link, _ in parts]
        x, y, z = (
            sum(m * centre[i] for m, centre in zip(masses, mass_centres, strict=True)) / mass
            for i in range(3)
        )
        center = (x, y, z)
    inertia = ZERO_MATRIX
    for (link, pose), mass_centre in zip(parts, mass_centres, strict=True):
        rotated_inertia = product(product(pose.rotation, link.inertia), transpose(pose.rotation))
        arm = [mass_centre[i] - center[i] for i in range(3)]
        inertia = _add_inertia(inertia, rotated_inertia, link.mass, arm)
    return mass, center, inertia


def remove_rounding_inertia(robot: Robot) -> Robot:
    """Remove inertia of massless links that is rounding compared with the other links."""
    largest_entries = {
        link.name: max(abs(x) for row in link.inertia for x in row) for link in robot.links
    }
    largest = max(largest_entries.values(), default=0.0)
    mass = sum(link.mass for link in robot.links)
    affected_links = [
        link for link in robot.links
        if link.mass == 0 and largest_entries[link.name] > 0
        and is_rounding(largest_entries[link.name], largest, mass)
    ]  # fmt: skip
    if not affected_links:
        return robot
    note_text = "no mass, and an inertia that is rounding; both are treated as zero"
    notes = (ImportNote(link.where, f"link {link.name!r}", note_text) for link in affected_links)
    names = {link.name for link in affected_links}
    links = tuple(
        replace(link, inertia=ZERO_MATRIX) if link.name in names else link for link in robot.links
    )
    return replace(robot, links=links, notes=(*robot.notes, *notes))


def _add_inertia(total: Matrix, inertia: Matrix, mass: float, arm: Sequence[float]) -> Matrix:
    """Add an inertia by the parallel axis theorem: J + m (a.a 1 - a a^T)."""
    square = sum(a * a for a in arm)
    rows = [
        tuple(
            total[i][j]
            + (inertia[i][j] + inertia[j][i]) / 2
            + mass * ((square if i == j else 0.0) - arm[i] * arm[j])
            for j in range(3)
        )
        for i in range(3)
    ]
    a, b, c = rows
    return ((a[0], a[1], a[2]), (b[0], b[1], b[2]), (c[0], c[1], c[2]))
