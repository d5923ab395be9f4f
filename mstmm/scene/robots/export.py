"""Export of a scene to a robot file, with a note for everything that is left out."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from ...arguments import short
from ...errors import SceneError
from ...numbers.pose import IN_PLACE, Pose
from ...numbers.rotations import perpendicular, product, transpose
from ..checks.topology import build
from ..rules.values import GROUND
from ..scene import Scene
from .robot import FIXED, Joint, Link, Look, Mimic, Note, Robot
from .urdf import BY_HINGE
from .urdf_text import as_urdf

if TYPE_CHECKING:
    from ..tables.body import Body
    from ..tables.closures import Coupling
    from ..tables.hinge import Hinge
    from ..tables.outside.shape import Shape

#: Tables of a scene without counterpart in a robot file.
_LEFT_OUT = (
    "load", "spring", "bushing", "event", "input", "signal", "output", "controller",
)  # fmt: skip
#: Keys of a range.
_ENDS = ("lower", "upper")
#: Types of shapes that URDF supports.
_DRAWN = ("box", "sphere", "cylinder", "mesh")
#: Gravity that importers of URDF assume, m/s^2.
_GRAVITY = (0.0, 0.0, -9.81)


@dataclass(frozen=True)
class Exported:
    """Robot file as text, with notes on what is left out."""

    text: str
    notes: tuple[Note, ...]
    links: int
    joints: int

    @property
    def summary(self) -> str:
        """Number of links and joints as text: "3 links, 2 joints"."""
        return f"{self.links} links, {self.joints} joints"


def export_robot(scene: Scene, name: str = "robot") -> Exported:
    """Export a scene as URDF: a tree of rigid bodies with the joints that URDF supports.

    Each body is a link with the axes of its outboard end at the hinge; each further end is a link
    on a fixed joint.  Damping, Coulomb friction, stops (without their stiffness), couplings of two
    joints and shapes are exported.  Everything else is left out, with a note.

    `name` is the name of the robot in the file.

    Raises SceneError for closed loops, flexible bodies, bodies of user-defined types and hinges
    that URDF does not support.
    """
    if not isinstance(scene, Scene):
        raise SceneError(f"{short(scene)}: expected a Scene; mstmm.load_scene reads a file")
    if not isinstance(name, str) or not name.isprintable():
        raise SceneError(f"name = {short(name)}: expected printable text")
    found = _Reader(scene).robot(name)
    return Exported(as_urdf(found), found.notes, len(found.links), len(found.joints))


class _Reader:
    """Reader of the links and joints of a scene."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self.notes = scene, list[Note]()
        _refuse(scene)
        self.bodies = {body.name: body for body in scene.bodies}
        #: Names of a robot file by body, end or ground of the scene.
        self.named = _others(scene.names.body)
        self.joints = {one: names[0] for one, names in _others(scene.names.hinge).items()}
        links = [*map(self._link_name, self.bodies), *scene.names.body]
        self.world = self.named.get(GROUND, [GROUND if "world" in links else "world"])[0]
        held = {hinge.outboard_body: hinge.outboard_end for hinge in scene.hinges}
        #: Frame of the link of each body in the axes of the body.
        self.frames = {name: _end(body, held.get(name, "")) for name, body in self.bodies.items()}
        #: Ends that are not only the position of a joint.
        self.ends = [
            (body.name, end) for body in scene.bodies for end in body.ends
            if f"{body.name}.{end}" in self.named
            or (end != held.get(body.name) and not self._is_of_joint(body.name, end))
        ]  # fmt: skip
        self._once = Counter([*dict.fromkeys(links), *(end for _, end in self.ends)])
        self._taken = {self.world, *self._once}

    def robot(self, name: str) -> Robot:
        ends = [self._end_link(*one) for one in self._fixed()]
        links = (Link(self.world), *map(self._link, self.bodies.values()), *(x for x, _ in ends))
        joints = (*map(self._joint, self.scene.hinges), *(joint for _, joint in ends))
        mimics = tuple(x for one in self.scene.coupling if (x := self._mimic(one)))
        looks = tuple(self._look(shape) for shape in self.scene.shape if self._is_drawn(shape))
        self._tell_rest()
        return Robot(name, name, links, joints, mimics, looks, tuple(self.notes))

    def _link_name(self, body: str) -> str:
        return self.world if body == GROUND else self.named.get(body, [body])[0]

    def _joint_name(self, hinge: str) -> str:
        return self.joints.get(hinge, hinge)

    def _fixed(self) -> Iterator[tuple[str, str, str]]:
        """Body, end and name of the links on fixed joints."""
        for body, end in self.ends:
            names = self.named.get(f"{body}.{end}") or [self._end_name(body, end)]
            yield from ((body, end, name) for name in names)
        for body in (GROUND, *self.bodies):
            yield from ((body, "", name) for name in self.named.get(body, ())[1:])

    def _end_name(self, body: str, end: str) -> str:
        if self._once[end] == 1 and end != self.world:
            return end
        name = f"{self._link_name(body)}_{end}"
        while name in self._taken:
            name += "_"
        self._taken.add(name)
        return name

    def _note(self, element: str, text: str) -> None:
        self.notes.append(Note("scene", element, text))

    def _is_of_joint(self, body: str, end: str) -> bool:
        """Whether an end has the name of its hinge, as imported scenes have."""
        return any(h.name == end and h.inboard == f"{body}.{end}" for h in self.scene.hinges)

    def _in_link(self, body: str, pose: Pose) -> Pose:
        """Convert a frame of a body to the axes of its link."""
        frame = self.frames[body]
        return pose if frame == IN_PLACE else frame.inverse.then(pose)

    def _link(self, body: Body) -> Link:
        frame, inertia = self.frames[body.name], body.inertia_matrix
        center = self._in_link(body.name, Pose(body.center_of_mass)).position
        if frame.rotation != IN_PLACE.rotation:
            inertia = product(product(transpose(frame.rotation), inertia), frame.rotation)
        return Link(self._link_name(body.name), body.mass, center, inertia)

    def _end_link(self, body: str, end: str, name: str) -> tuple[Link, Joint]:
        at = IN_PLACE
        if body != GROUND:
            at = self._in_link(body, _end(self.bodies[body], end))
        joint, holder = self._free_name(f"{name}_fixed"), self._link_name(body)
        return Link(name), Joint(joint, FIXED, holder, name, at)

    def _free_name(self, name: str) -> str:
        """Make a joint name unique by appending _."""
        taken = {self._joint_name(hinge.name) for hinge in self.scene.hinges}
        while name in taken:
            name += "_"
        return name

    def _joint(self, hinge: Hinge) -> Joint:
        turned = Pose(rotation=hinge.rotation)
        if hinge.inboard_body == GROUND:
            pose = Pose(hinge.position).then(turned)
        else:
            holder = self.bodies[hinge.inboard_body]
            pose = self._in_link(holder.name, _end(holder, hinge.inboard_end)).then(turned)
        self._tell_hinge(hinge)
        parent, child = map(self._link_name, (hinge.inboard_body, hinge.outboard_body))
        return Joint(self._joint_name(hinge.name), hinge.type, parent, child, pose, _keys(hinge))

    def _tell_hinge(self, hinge: Hinge) -> None:
        facts, element = hinge.facts, f"hinge {hinge.name!r}"
        assert facts is not None
        one = len(facts.speeds) == 1
        laws = hinge.law.entries()
        lost = {
            "stiffness": any(law.stiffness for law in laws),
            "efforts": any(not law.effort.is_zero for law in laws),
            "inertia of its drive": any(law.inertia for law in laws),
            "drive": hinge.drive is not None,
            "release": hinge.release is not None,
            "damping": not one and any(law.damping for law in laws),
            "friction": not one and any(law.friction.acts for law in laws),
            "stiffness of its stops": any(law.limits.stiffness for law in laws),
            "restitution of its stops": any(law.limits.restitution for law in laws),
            "stops that its rated range contradicts": one and not _said(
                laws[0].limits, *_ENDS).items() <= _range(hinge).items(),
            "start": hinge.initial is not None and (
                hinge.initial.q != facts.start or any(hinge.initial.u or ())
            ),
            "direction of x": hinge.unit_axis2 is not None
            and hinge.unit_axis2 != perpendicular(hinge.unit_axis),
        }  # fmt: skip
        if names := [name for name, is_lost in lost.items() if is_lost]:
            self._note(element, f"left out: {', '.join(names)}")

    def _mimic(self, coupling: Coupling) -> Mimic | None:
        """Mimic relation of a coupling; None, with a note, for other couplings."""
        found = _line(coupling)
        if found is None:
            self._note(f"coupling {coupling.name!r}", "left out: not a linear mimic of two joints")
            return None
        own, other = self._joint_name(found.of), self._joint_name(found.other)
        return replace(found, of=own, other=other)

    def _is_drawn(self, shape: Shape) -> bool:
        if shape.type not in _DRAWN:
            self._note(f"shape on {shape.on!r}", f"left out: URDF has no {shape.type}")
        return shape.type in _DRAWN

    def _look(self, shape: Shape) -> Look:
        pose = Pose(shape.position, shape.rotation)
        keys = {
            key: value for key in ("type", "size", "radius", "length", "file", "scale", "color")
            if (value := getattr(shape, key)) is not None
        }  # fmt: skip
        body, _, end = shape.on.partition(".")
        if body == GROUND:
            return Look(self.world, pose, keys)
        at = self._in_link(body, _end(self.bodies[body], end)).then(pose)
        return Look(self._link_name(body), at, keys)

    def _tell_rest(self) -> None:
        for table in _LEFT_OUT:
            if count := len(getattr(self.scene, table)):
                self._note(
                    f"[[{table}]]", f"left out, {count} of them" if count > 1 else "left out"
                )
        if self.scene.gravity != _GRAVITY:
            self._note("gravity", "left out; readers of URDF assume 9.81 m/s^2 along -z")


def _others(names: Mapping[str, str]) -> dict[str, list[str]]:
    """Names in other programs by name in the scene."""
    found: dict[str, list[str]] = {}
    for name, one in names.items():
        found.setdefault(one, []).append(name)
    return found


def _refuse(scene: Scene) -> None:
    """Reject scenes that URDF cannot describe.  Raises SceneError."""
    if scene.beam or scene.elastic:
        one = (*scene.beam, *scene.elastic)[0]
        raise SceneError(
            f'"{one.name}": URDF supports only rigid bodies; replace flexible bodies by rigid ones'
        )
    for body in scene.bodies:
        if body.type != "rigid":
            raise SceneError(
                f'body "{body.name}": URDF has no body of type {body.type}; use a rigid body'
            )
    if scene.constraint:
        raise SceneError("[[constraint]]: URDF has no closed loops; remove the constraints")
    for hinge in scene.hinges:
        if hinge.type not in BY_HINGE:
            raise SceneError(
                f'hinge "{hinge.name}": URDF has no joint like a {hinge.type} hinge; use pins '
                "and slides in series, with massless bodies between them"
            )
    if cut := [scene.hinge[number] for number in build(scene).cut]:
        raise SceneError(_refusal_of_loops(scene, cut))


def _refusal_of_loops(scene: Scene, cut: Sequence[Hinge]) -> str:
    """Message with the cut hinges and all inboard hinges of each of their outboard bodies."""
    names = ", ".join(f'"{hinge.name}"' for hinge in cut)
    closing = f"hinge {names} closes a loop" if len(cut) == 1 else f"hinges {names} close loops"
    holders: dict[str, list[str]] = {hinge.outboard_body: [] for hinge in cut}
    for hinge in scene.hinge:
        if hinge.outboard_body in holders:
            holders[hinge.outboard_body].append(f'"{hinge.name}"')
    held = "; ".join(
        f'body "{body}" has the inboard hinges {" and ".join(hinges)}'
        for body, hinges in holders.items()
    )
    return (
        f"{closing}, which URDF does not support: {held}; leave out hinges until each body has "
        "one inboard hinge, and keep the bodies"
    )


def _end(body: Body, end: str) -> Pose:
    return Pose(body.end_position(end), body.end_rotation(end)) if end else IN_PLACE


def _keys(hinge: Hinge) -> dict[str, Any]:
    """Joint keys of a hinge: axis, and the parts of the law that URDF supports."""
    kind, facts = BY_HINGE[hinge.type], hinge.facts
    keys: dict[str, Any] = {kind.axis: hinge.unit_axis} if kind.axis else {}
    if facts is None or len(facts.speeds) != 1:
        return keys
    entry = hinge.law.entry(0)
    law: dict[str, Any] = {"damping": entry.damping} if entry.damping else {}
    if entry.friction.acts:
        law["friction"] = {"coulomb": entry.friction.coulomb}
    return keys | {"law": law, "rated": _range(hinge) | _said(hinge.rated, "effort", "velocity")}


def _range(hinge: Hinge) -> dict[str, float]:
    """Range of a hinge with one coordinate (m or rad): its stops, else its rated range.

    Where these contradict each other, the one with both limits is used; none if neither has both.
    """
    stops, rated = (_said(one, *_ENDS) for one in (hinge.law.entry(0).limits, hinge.rated))
    both = {**rated, **stops}
    if both.get("lower", -math.inf) < both.get("upper", math.inf):
        return both
    return rated if len(rated) == len(_ENDS) else {}


def _said(table: Any, *keys: str) -> dict[str, float]:
    """Values that a table gives for these keys."""
    values = {key: getattr(table, key, None) for key in keys}
    return {key: value for key, value in values.items() if value is not None}


def _line(coupling: Coupling) -> Mimic | None:
    """Mimic q_1 = m q_2 + b of a row that is linear in two coordinates; None for others."""
    names, equals = list(_coordinates(coupling)), coupling.equals
    if coupling.expression is None or len(names) != 2 or (equals is not None and equals.names):
        return None
    if equals is None:
        return None
    row = coupling.expression

    def at(a: float, b: float) -> float:
        given = dict(zip(names, (a, b), strict=True))
        return row.evaluate(lambda name: given[name.text.partition(".")[0]])

    zero = at(0.0, 0.0)
    a, b = at(1.0, 0.0) - zero, at(0.0, 1.0) - zero
    straight = all(
        abs(at(x, y) - (zero + a * x + b * y)) <= 1e-12 * (abs(zero) + abs(a * x) + abs(b * y))
        for x, y in ((2.5, -1.25), (-0.7, 3.1), (11.0, 17.0))
    )
    if not straight or a == 0 or b == 0:
        return None
    return Mimic(names[0], names[1], -b / a, ((equals.constant or 0.0) - zero) / a)


def _coordinates(coupling: Coupling) -> Iterator[str]:
    """Names of hinges whose q is in a row."""
    for name in coupling.row.names:
        hinge, _, what = name.text.partition(".")
        if what == "q":
            yield hinge
