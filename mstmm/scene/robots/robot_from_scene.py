"""Export of a scene to a robot file, with a note for everything that is left out."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from ...argument_validation import abbreviate
from ...errors import SceneError
from ...numerics.rotations import IDENTITY_POSE, Pose, perpendicular_vector, product, transpose
from ..checks.topology import build_topology
from ..scene import Scene
from ..validators.scalars_and_vectors import GROUND
from .robot_model import FIXED, ImportNote, Joint, Link, Mimic, Robot, Visual
from .urdf import JOINT_TYPES_BY_HINGE, as_urdf

if TYPE_CHECKING:
    from ..tables.body import Body
    from ..tables.closures import Coupling
    from ..tables.hinge import Hinge
    from ..tables.shape import Shape

#: Tables of a scene without counterpart in a robot file.
_UNSUPPORTED_TABLES = (
    "load", "spring", "bushing", "event", "input", "signal", "output", "controller",
)  # fmt: skip
#: Keys of a range.
_RANGE_KEYS = ("lower", "upper")
#: Types of shapes that URDF supports.
_SUPPORTED_SHAPES = ("box", "sphere", "cylinder", "mesh")
#: Gravity that importers of URDF assume, m/s^2.
_ASSUMED_GRAVITY = (0.0, 0.0, -9.81)


@dataclass(frozen=True)
class ExportedRobot:
    """Robot file as text, with notes on what is left out."""

    text: str
    notes: tuple[ImportNote, ...]
    links: int
    joints: int

    @property
    def summary(self) -> str:
        """Number of links and joints as text: "3 links, 2 joints"."""
        return f"{self.links} links, {self.joints} joints"


def export_robot(scene: Scene, name: str = "robot") -> ExportedRobot:
    """Export a scene as URDF: a tree of rigid bodies with the joints that URDF supports.

    Each body is a link with the axes of its outboard end at the hinge; each further end is a link
    on a fixed joint.  Damping, Coulomb friction, stops (without their stiffness), couplings of two
    joints and shapes are exported.  Everything else is left out, with a note.

    `name` is the name of the robot in the file.

    Raises SceneError for closed loops, flexible bodies, bodies of user-defined types and hinges
    that URDF does not support.
    """
    if not isinstance(scene, Scene):
        raise SceneError(f"{abbreviate(scene)}: expected a Scene; mstmm.load_scene reads a file")
    if not isinstance(name, str) or not name.isprintable():
        raise SceneError(f"name = {abbreviate(name)}: expected printable text")
    robot = _SceneReader(scene).robot(name)
    return ExportedRobot(as_urdf(robot), robot.notes, len(robot.links), len(robot.joints))


class _SceneReader:
    """Reader of the links and joints of a scene."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self.notes = scene, list[ImportNote]()
        _check_supported(scene)
        self.bodies = {body.name: body for body in scene.bodies}
        #: Names of a robot file by body, end or ground of the scene.
        self.link_names = _names_by_scene_name(scene.names.body)
        self.joints = {
            scene_name: names[0]
            for scene_name, names in _names_by_scene_name(scene.names.hinge).items()
        }
        links = [*map(self._link_name, self.bodies), *scene.names.body]
        self.world = self.link_names.get(GROUND, [GROUND if "world" in links else "world"])[0]
        outboard_ends = {hinge.outboard_body: hinge.outboard_end for hinge in scene.hinges}
        #: Frame of the link of each body in the axes of the body.
        self.frames = {
            name: _end_pose(body, outboard_ends.get(name, "")) for name, body in self.bodies.items()
        }
        #: Ends that are not only the position of a joint.
        self.ends = [
            (body.name, end) for body in scene.bodies for end in body.ends
            if f"{body.name}.{end}" in self.link_names
            or (end != outboard_ends.get(body.name) and not self._has_hinge_name(body.name, end))
        ]  # fmt: skip
        self._name_counts = Counter([*dict.fromkeys(links), *(end for _, end in self.ends)])
        self._used_names = {self.world, *self._name_counts}

    def robot(self, name: str) -> Robot:
        ends = [self._end_link(*fixed) for fixed in self._fixed_links()]
        bodies = map(self._link, self.bodies.values())
        links = (Link(self.world), *bodies, *(link for link, _ in ends))
        joints = (*map(self._joint, self.scene.hinges), *(joint for _, joint in ends))
        mimics = tuple(mimic for mimic in map(self._mimic, self.scene.coupling) if mimic)
        visuals = tuple(visual for visual in map(self._visual, self.scene.shape) if visual)
        for table in _UNSUPPORTED_TABLES:
            if count := len(getattr(self.scene, table)):
                text = f"left out, {count} of them" if count > 1 else "left out"
                self._note(f"[[{table}]]", text)
        if self.scene.gravity != _ASSUMED_GRAVITY:
            self._note("gravity", "left out; readers of URDF assume 9.81 m/s^2 along -z")
        return Robot(name, name, links, joints, mimics, visuals, tuple(self.notes))

    def _link_name(self, body: str) -> str:
        return self.world if body == GROUND else self.link_names.get(body, [body])[0]

    def _joint_name(self, hinge: str) -> str:
        return self.joints.get(hinge, hinge)

    def _fixed_links(self) -> Iterator[tuple[str, str, str]]:
        """Body, end and name of the links on fixed joints."""
        for body, end in self.ends:
            names = self.link_names.get(f"{body}.{end}") or [self._end_name(body, end)]
            yield from ((body, end, name) for name in names)
        for body in (GROUND, *self.bodies):
            yield from ((body, "", name) for name in self.link_names.get(body, ())[1:])

    def _end_name(self, body: str, end: str) -> str:
        if self._name_counts[end] == 1 and end != self.world:
            return end
        name = f"{self._link_name(body)}_{end}"
        while name in self._used_names:
            name += "_"
        self._used_names.add(name)
        return name

    def _note(self, element: str, text: str) -> None:
        self.notes.append(ImportNote("scene", element, text))

    def _has_hinge_name(self, body: str, end: str) -> bool:
        """Whether an end has the name of its hinge, as imported scenes have."""
        return any(h.name == end and h.inboard == f"{body}.{end}" for h in self.scene.hinges)

    def _to_link_axes(self, body: str, pose: Pose) -> Pose:
        """Convert a frame of a body to the axes of its link."""
        frame = self.frames[body]
        return pose if frame == IDENTITY_POSE else frame.inverse.compose(pose)

    def _link(self, body: Body) -> Link:
        frame, inertia = self.frames[body.name], body.inertia_matrix
        center = self._to_link_axes(body.name, Pose(body.center_of_mass)).position
        if frame.rotation != IDENTITY_POSE.rotation:
            inertia = product(product(transpose(frame.rotation), inertia), frame.rotation)
        return Link(self._link_name(body.name), body.mass, center, inertia)

    def _end_link(self, body: str, end: str, name: str) -> tuple[Link, Joint]:
        end_frame = IDENTITY_POSE
        if body != GROUND:
            end_frame = self._to_link_axes(body, _end_pose(self.bodies[body], end))
        joint, used_names = f"{name}_fixed", {self._joint_name(h.name) for h in self.scene.hinges}
        while joint in used_names:
            joint += "_"
        return Link(name), Joint(joint, FIXED, self._link_name(body), name, end_frame)

    def _joint(self, hinge: Hinge) -> Joint:
        hinge_pose = Pose(rotation=hinge.rotation)
        if hinge.inboard_body == GROUND:
            pose = Pose(hinge.position).compose(hinge_pose)
        else:
            holder = self.bodies[hinge.inboard_body]
            end_pose = self._to_link_axes(holder.name, _end_pose(holder, hinge.inboard_end))
            pose = end_pose.compose(hinge_pose)
        self._note_hinge_omissions(hinge)
        parent, child = map(self._link_name, (hinge.inboard_body, hinge.outboard_body))
        name = self._joint_name(hinge.name)
        return Joint(name, hinge.type, parent, child, pose, _joint_keys(hinge))

    def _note_hinge_omissions(self, hinge: Hinge) -> None:
        facts, element = hinge.facts, f"hinge {hinge.name!r}"
        assert facts is not None
        has_one_speed = len(facts.speeds) == 1
        laws = hinge.law.entries()
        unsupported = {
            "stiffness": any(law.stiffness for law in laws),
            "efforts": any(not law.effort.is_zero for law in laws),
            "inertia of its drive": any(law.inertia for law in laws),
            "drive": hinge.drive is not None,
            "release": hinge.release is not None,
            "damping": not has_one_speed and any(law.damping for law in laws),
            "friction": not has_one_speed and any(law.friction.acts for law in laws),
            "stiffness of its stops": any(law.limits.stiffness for law in laws),
            "restitution of its stops": any(law.limits.restitution for law in laws),
            "stops that its rated range contradicts": has_one_speed and not _given_values(
                laws[0].limits, *_RANGE_KEYS).items() <= _joint_range(hinge).items(),
            "start": hinge.initial is not None and (
                hinge.initial.q != facts.start or any(hinge.initial.u or ())
            ),
            "direction of x": hinge.unit_axis2 is not None
            and hinge.unit_axis2 != perpendicular_vector(hinge.unit_axis),
        }  # fmt: skip
        if names := [name for name, is_lost in unsupported.items() if is_lost]:
            self._note(element, f"left out: {', '.join(names)}")

    def _mimic(self, coupling: Coupling) -> Mimic | None:
        """Mimic relation of a coupling; None, with a note, for other couplings."""
        mimic = _linear_mimic(coupling)
        if mimic is None:
            self._note(f"coupling {coupling.name!r}", "left out: not a linear mimic of two joints")
            return None
        own_joint, other_joint = self._joint_name(mimic.follower), self._joint_name(mimic.leader)
        return replace(mimic, follower=own_joint, leader=other_joint)

    def _visual(self, shape: Shape) -> Visual | None:
        """Visual of a shape; None, with a note, for types that URDF does not have."""
        if shape.type not in _SUPPORTED_SHAPES:
            self._note(f"shape on {shape.on!r}", f"left out: URDF has no {shape.type}")
            return None
        pose = Pose(shape.position, shape.rotation)
        keys = {
            key: value for key in ("type", "size", "radius", "length", "file", "scale", "color")
            if (value := getattr(shape, key)) is not None
        }  # fmt: skip
        body, _, end = shape.on.partition(".")
        if body == GROUND:
            return Visual(self.world, pose, keys)
        link_pose = self._to_link_axes(body, _end_pose(self.bodies[body], end)).compose(pose)
        return Visual(self._link_name(body), link_pose, keys)


def _names_by_scene_name(names: Mapping[str, str]) -> dict[str, list[str]]:
    """Names in other programs by name in the scene."""
    external_names: dict[str, list[str]] = {}
    for name, scene_name in names.items():
        external_names.setdefault(scene_name, []).append(name)
    return external_names


def _check_supported(scene: Scene) -> None:
    """Reject scenes that URDF cannot describe.  Raises SceneError."""
    if scene.beam or scene.elastic:
        flexible_body = (*scene.beam, *scene.elastic)[0]
        raise SceneError(
            f'"{flexible_body.name}": URDF supports only rigid bodies; replace flexible bodies by '
            f"rigid ones"
        )
    for body in scene.bodies:
        if body.type != "rigid":
            raise SceneError(
                f'body "{body.name}": URDF has no body of type {body.type}; use a rigid body'
            )
    if scene.constraint:
        raise SceneError("[[constraint]]: URDF has no closed loops; remove the constraints")
    for hinge in scene.hinges:
        if hinge.type not in JOINT_TYPES_BY_HINGE:
            raise SceneError(
                f'hinge "{hinge.name}": URDF has no joint like a {hinge.type} hinge; use pins '
                "and slides in series, with massless bodies between them"
            )
    if cut := [scene.hinge[number] for number in build_topology(scene).cut_hinges]:
        raise SceneError(_loop_message(scene, cut))


def _loop_message(scene: Scene, cut: Sequence[Hinge]) -> str:
    """Message with the cut hinges and all inboard hinges of each of their outboard bodies."""
    names = ", ".join(f'"{hinge.name}"' for hinge in cut)
    loop_text = f"hinge {names} closes a loop" if len(cut) == 1 else f"hinges {names} close loops"
    hinges_by_body: dict[str, list[str]] = {hinge.outboard_body: [] for hinge in cut}
    for hinge in scene.hinge:
        if hinge.outboard_body in hinges_by_body:
            hinges_by_body[hinge.outboard_body].append(f'"{hinge.name}"')
    inboard_text = "; ".join(
        f'body "{body}" has the inboard hinges {" and ".join(hinges)}'
        for body, hinges in hinges_by_body.items()
    )
    return (
        f"{loop_text}, which URDF does not support: {inboard_text}; leave out hinges until each "
        "body has one inboard hinge, and keep the bodies"
    )


def _end_pose(body: Body, end: str) -> Pose:
    return Pose(body.end_position(end), body.end_rotation(end)) if end else IDENTITY_POSE


def _joint_keys(hinge: Hinge) -> dict[str, Any]:
    """Joint keys of a hinge: axis, and the parts of the law that URDF supports."""
    joint_type, facts = JOINT_TYPES_BY_HINGE[hinge.type], hinge.facts
    keys: dict[str, Any] = {joint_type.axis: hinge.unit_axis} if joint_type.axis else {}
    if facts is None or len(facts.speeds) != 1:
        return keys
    entry = hinge.law.entry(0)
    law: dict[str, Any] = {"damping": entry.damping} if entry.damping else {}
    if entry.friction.acts:
        law["friction"] = {"coulomb": entry.friction.coulomb}
    return keys | {
        "law": law,
        "rated": _joint_range(hinge) | _given_values(hinge.rated, "effort", "velocity"),
    }


def _joint_range(hinge: Hinge) -> dict[str, float]:
    """Range of a hinge with one coordinate (m or rad): its stops, else its rated range.

    Where these contradict each other, the one with both limits is used; none if neither has both.
    """
    stops, rated = (
        _given_values(source, *_RANGE_KEYS) for source in (hinge.law.entry(0).limits, hinge.rated)
    )
    combined = {**rated, **stops}
    if combined.get("lower", -math.inf) < combined.get("upper", math.inf):
        return combined
    return rated if len(rated) == len(_RANGE_KEYS) else {}


def _given_values(table: Any, *keys: str) -> dict[str, float]:
    """Values that a table gives for these keys."""
    values = {key: getattr(table, key, None) for key in keys}
    return {key: value for key, value in values.items() if value is not None}


def _linear_mimic(coupling: Coupling) -> Mimic | None:
    """Mimic q_1 = m q_2 + b of a row that is linear in two coordinates; None for others."""
    parts = (name.text.partition(".") for name in coupling.row.names)
    names = [hinge for hinge, _, quantity in parts if quantity == "q"]
    row, equals = coupling.expression, coupling.equals
    if row is None or len(names) != 2 or equals is None or equals.names:
        return None

    def row_value(a: float, b: float) -> float:
        values_by_hinge = dict(zip(names, (a, b), strict=True))
        return row.evaluate(lambda name: values_by_hinge[name.text.partition(".")[0]])

    offset = row_value(0.0, 0.0)
    a, b = row_value(1.0, 0.0) - offset, row_value(0.0, 1.0) - offset
    is_linear = all(
        abs(row_value(x, y) - (offset + a * x + b * y))
        <= 1e-12 * (abs(offset) + abs(a * x) + abs(b * y))
        for x, y in ((2.5, -1.25), (-0.7, 3.1), (11.0, 17.0))
    )
    if not is_linear or a == 0 or b == 0:
        return None
    return Mimic(names[0], names[1], -b / a, ((equals.constant or 0.0) - offset) / a)
