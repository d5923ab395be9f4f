"""Conversion of a robot to a scene, with a note for everything that differs or is left out."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ...argument_validation import abbreviate
from ...errors import SceneError
from ...numerics.rotations import IDENTITY, IDENTITY_POSE, Pose, to_quaternion
from ..files import as_toml
from ..scene import Scene
from ..validators.rotations_and_inertia import triangle_message
from ..validators.scalars_and_vectors import GROUND
from ..validators.validation_messages import did_you_mean
from .name_mapping import MeshFinder, NameRegistry, reference_names
from .robot_model import (
    FIXED,
    ZERO_MATRIX,
    ImportNote,
    Joint,
    Link,
    LinkTree,
    Mimic,
    Robot,
    merge_inertia,
    remove_rounding_inertia,
)
from .unit_conversion import unit_notes

BASES = (FIXED, "free")
COUPLED, HELD = MIMICS = ("coupled", "held")
#: Types of joints with one coordinate.
_SINGLE_COORDINATE_TYPES = ("pin", "prismatic")
#: Most names in a note.
_MAX_NAMES_IN_NOTE = 6
#: Owner of links that are part of the ground; no link has this name, but one may be named "ground".
_GROUND_OWNER = ""


@dataclass(frozen=True)
class ImportOptions:
    """Options of the conversion of a robot to a scene.

    base: "fixed" on the ground, or "free".  merge: links on fixed joints become part of their
    inboard body; their frames are ends of it.  stops: stiffness (N/m or N m/rad) of the stops at
    the limits of joints, None: no stops.  mimics: joints that mimic others are "coupled" to them,
    or "held" at their initial value.
    """

    base: str = FIXED
    merge: bool = True
    stop_stiffness: float | None = None
    mimics: str = COUPLED


@dataclass(frozen=True)
class ImportedRobot:
    """Scene of a robot file, with name mappings and notes.

    `links` gives for each link its body or end ("ground" for a part of the ground), and `joints`
    for each moving joint its hinge.
    """

    scene: Scene
    links: Mapping[str, str]
    joints: Mapping[str, str]
    notes: tuple[ImportNote, ...]
    tables: Mapping[str, Any]

    @property
    def names(self) -> Mapping[str, str]:
        """Mapping of links and joints together; a joint replaces a link of the same name."""
        return {**self.links, **self.joints}

    def to_toml(self) -> str:
        """Convert to TOML text without default values."""
        return as_toml(self.tables)


def scene_from_robot(
    robot: Robot, choices: ImportOptions, folder: Path | None = None
) -> ImportedRobot:
    """Convert a robot to a scene; its meshes are relative to `folder`.  Raises SceneError."""
    robot = remove_rounding_inertia(robot)
    tree = LinkTree(robot)
    robot = replace(robot, notes=(*robot.notes, *unit_notes(robot, tree)))
    writer = _SceneWriter(robot, tree, choices)
    if choices.merge and not writer.bodies():
        writer = _SceneWriter(robot, tree, replace(choices, merge=False))
    if not writer.bodies():
        urdf = robot.where.lower().endswith(".urdf")
        remedy = 'try base = "free"' if urdf else "give a body a <freejoint>"
        raise SceneError(f"{robot.where}: no link moves or has mass; {remedy}")
    data = writer.tables(folder)
    scene, notes = Scene.from_data(data, robot.where), tuple(writer.notes)
    return ImportedRobot(scene, writer.links, writer.joints, notes, data)


class _SceneWriter:
    """Writer of the scene tables of a robot."""

    def __init__(self, robot: Robot, tree: LinkTree, choices: ImportOptions) -> None:
        self.robot, self.tree, self.choices = robot, tree, choices
        self.notes = list(robot.notes)
        if len(tree.roots) > 1:
            roots = [*map(repr, tree.roots[:4]), *(["..."] if len(tree.roots) > 4 else [])]
            text = f"{len(tree.roots)} of them: {', '.join(roots)}; each has its own base"
            self.notes.append(ImportNote(robot.where, "trees", text))
        valid_mimics = list(self._valid_mimics())
        mimics = list({mimic.follower: mimic for mimic in valid_mimics}.values())
        for mimic in valid_mimics:
            if mimic not in mimics:
                note_text = f"several <mimic>: the last one applies, not {mimic.leader!r}"
                self._add_note(tree.joints[mimic.follower], f"joint {mimic.follower!r}", note_text)
        self.fixed_joints = {joint.name for joint in tree.weightless()}
        for name in sorted(self.fixed_joints, key=list(tree.joints).index):
            note_text = "fixed, because no link outboard of it has mass"
            self._add_note(tree.joints[name], f"joint {name!r}", note_text)
        #: Link -> the link whose body it is part of, or _STILL, and its frame in that body.
        self.body_frames = dict[str, tuple[str, Pose]]()
        for link in tree.outward:
            self.body_frames[link.name] = self._owner_and_pose(link)
        self._bodies = NameRegistry().register_all(self.bodies(), "link", tree.links)
        hinges = NameRegistry()
        moving_joints = [
            one.name for one in robot.joints if self.body_frames[one.child][0] == one.child
        ]
        self.joints = hinges.register_all(moving_joints, "joint")
        #: Position of the notes on names, which are written when all ends are defined.
        self._name_note_index = len(self.notes)
        self._add_link_notes()
        #: Mimic relations of the moving joints by name.
        self.mimics = {mimic.follower: mimic for mimic in mimics if self._is_moving(mimic.follower)}
        self._roots = {name: hinges.register(f"{name}_base", "link")
                       for name in tree.roots if name in self._bodies}  # fmt: skip
        self._ends: defaultdict[str, dict[str, Any]] = defaultdict(dict)
        self.links = {link.name: self._frame(link) for link in robot.links}

    def _add_name_notes(self, names: Mapping[str, Mapping[str, str]]) -> None:
        """Add notes about links and joints that are renamed in the scene.

        `names` are the original names that its [names] keeps.
        """
        renames: dict[bool, list[str]] = {False: [], True: []}
        for table, names_by_file in (("body", self._bodies), ("hinge", self.joints)):
            for file_name, scene_name in names_by_file.items():
                if file_name != scene_name:
                    is_kept = names.get(table, {}).get(file_name) == scene_name
                    renames[is_kept].append(f"{abbreviate(file_name)} is {scene_name}")
        for is_kept, listed in renames.items():
            if listed:
                description = (
                    "not allowed in a scene, kept in its [names]"
                    if is_kept
                    else "allowed neither in a scene nor in its [names]"
                )
                shown = listed[:_MAX_NAMES_IN_NOTE] + ["..."] * (len(listed) > _MAX_NAMES_IN_NOTE)
                text = f"{len(listed)} {description}: {', '.join(shown)}"
                note = ImportNote(self.robot.where, "names", text)
                self.notes.insert(self._name_note_index, note)

    def _add_link_notes(self) -> None:
        """Add notes about links that are no separate bodies, and about moving massless links."""
        for link in self.robot.links:
            joint, (owner, _) = self.tree.holder.get(link.name), self.body_frames[link.name]
            if joint is None:
                continue
            if owner == _GROUND_OWNER:
                self._add_note(joint, f"link {link.name!r}", "part of the ground")
            elif owner != link.name:
                note_text = "part of its inboard body; its name refers to its frame there"
                self._add_note(joint, f"link {link.name!r}", note_text)
            elif joint.type != FIXED and not link.mass and link.inertia == ZERO_MATRIX:
                self._add_note(link, f"link {link.name!r}", "moves without mass")

    def bodies(self) -> list[str]:
        """Names of links that are separate bodies, in the order of the file."""
        return [
            link.name for link in self.robot.links if self.body_frames[link.name][0] == link.name
        ]

    def tables(self, folder: Path | None) -> dict[str, Any]:
        """Keys of the scene."""
        scene_keys: dict[str, Any] = {"gravity": self.robot.gravity}
        roots = [
            {"name": hinge, "type": self.choices.base, "inboard": GROUND,
             "outboard": self._bodies[name]}
            for name, hinge in self._roots.items()
        ]  # fmt: skip
        scene_keys["hinge"] = [*roots, *self._joints()]
        parts_by_owner: defaultdict[str, list[tuple[Link, Pose]]] = defaultdict(list)
        for link in self.robot.links:
            owner, pose = self.body_frames[link.name]
            parts_by_owner[owner].append((link, pose))
        scene_keys["body"] = [self._body(name, parts_by_owner[name]) for name in self._bodies]
        if couplings := list(self._couplings()):
            scene_keys["coupling"] = couplings
        if shapes := list(self._shapes(folder)):
            scene_keys["shape"] = shapes
        ends = {f"{self._bodies[name]}.{end}" for name in self._ends for end in self._ends[name]}
        own_references = {GROUND, *self._bodies.values(), *ends}
        names = reference_names(self._named_links(), self.joints, own_references)
        self._add_name_notes(names)
        if names:
            scene_keys["names"] = names
        return scene_keys

    def _named_links(self) -> dict[str, str]:
        """Bodies and ends by link name, bodies first; on the ground only links at its origin."""
        bodies = dict.fromkeys((*self._bodies, *self.links))
        return {
            name: self.links[name]
            for name in bodies
            if self.body_frames[name] == (_GROUND_OWNER, IDENTITY_POSE)
            or self.links[name] != GROUND
        }

    def _add_note(self, one: Link | Joint, element: str, text: str) -> None:
        self.notes.append(ImportNote(one.where, element, text))

    def _owner_and_pose(self, link: Link) -> tuple[str, Pose]:
        joint = self.tree.holder.get(link.name)
        if joint is None:
            empty = link.mass == 0 and link.inertia == ZERO_MATRIX
            grounded = self.choices.base == FIXED and (empty or self.choices.merge)
            return (_GROUND_OWNER if grounded else link.name), IDENTITY_POSE
        if self.choices.merge and (joint.type == FIXED or joint.name in self.fixed_joints):
            owner, pose = self.body_frames[joint.parent]
            return owner, pose.compose(joint.pose)
        return link.name, IDENTITY_POSE

    def _frame(self, link: Link) -> str:
        """Reference of the body or end of a link."""
        owner, pose = self.body_frames[link.name]
        if owner == _GROUND_OWNER:
            return GROUND
        return self._end(owner, pose, link.name)

    def _end(self, owner: str, pose: Pose, name: str) -> str:
        """Reference of a frame of a body: the body, an existing end, or a new one."""
        body, ends = self._bodies[owner], self._ends[owner]
        if pose == IDENTITY_POSE:
            return body
        end = _pose_keys(pose)
        for end_name, end_keys in ends.items():
            if end_keys == end:
                return f"{body}.{end_name}"
        names = NameRegistry()
        for end_name in ends:
            names.register(end_name, "end")
        new_name = names.register(name, "end")
        ends[new_name] = end
        return f"{body}.{new_name}"

    def _body(self, name: str, parts: list[tuple[Link, Pose]]) -> dict[str, Any]:
        mass, center, inertia = merge_inertia(parts)
        table: dict[str, Any] = {"name": self._bodies[name], "mass": mass}
        if any(center):
            table["center_of_mass"] = center
        if inertia != ZERO_MATRIX:
            (xx, xy, xz), (_, yy, yz), (_, _, zz) = inertia
            table["inertia"] = (xx, yy, zz, xy, xz, yz)
            if message := triangle_message(inertia):
                table["allow_unphysical_inertia"] = True
                self._add_note(parts[0][0], f"link {name!r}", f"accepted unchanged: {message}")
        if self._ends[name]:
            table["ends"] = self._ends[name]
        return table

    def _joints(self) -> Iterator[dict[str, Any]]:
        start = self._initial_values()
        for name, hinge in self.joints.items():
            joint = self.tree.joints[name]
            is_held = joint.name in self.fixed_joints
            owner, frame = self.body_frames[joint.parent]
            pose, grounded = frame.compose(joint.pose), owner == _GROUND_OWNER
            yield {
                "name": hinge,
                "type": FIXED if is_held else joint.type,
                "inboard": GROUND if grounded else self._end(owner, pose, name),
                "outboard": self._bodies[joint.child],
                **(_pose_keys(pose) if grounded else {}),
                **({} if is_held else self._motion(joint, start.get(name))),
            }

    def _motion(self, joint: Joint, start: float | None) -> dict[str, Any]:
        keys = dict(joint.keys)
        law = dict(keys.pop("law", {}))
        if mass := keys.pop("armature", 0.0):
            law["effort"] = _inertial_mass_efforts(self.joints[joint.name], mass)
        if limits := law.pop("limits", None):
            if self.choices.stop_stiffness is None:
                text = "its limits are not stops; they are kept as rated"
                self._add_note(joint, f"joint {joint.name!r}", text)
            else:
                law["limits"] = {**limits, "stiffness": self.choices.stop_stiffness}
        if law:
            keys["law"] = law
        if start is not None and not self._is_coupled(joint.name):
            keys["drive"] = [start]
            keys.pop("initial", None)
            self._add_note(joint, f"joint {joint.name!r}", f"held at {start:g}; it mimics another")
        elif start is not None and (start or "initial" in keys):
            keys["initial"] = {"q": [start]}
        return keys

    def _valid_mimics(self) -> Iterator[Mimic]:
        for mimic in self.robot.mimics:
            other_joint = self.tree.joints.get(mimic.leader)
            if other_joint is not None and other_joint.type in (*_SINGLE_COORDINATE_TYPES, FIXED):
                yield mimic
                continue
            note_text = f"left free: it mimics {mimic.leader!r}, which "
            if other_joint is None:
                note_text += f"does not exist{did_you_mean(mimic.leader, self.tree.joints)}"
            else:
                note_text += "has more than one coordinate"
            self._add_note(self.tree.joints[mimic.follower], f"joint {mimic.follower!r}", note_text)

    def _couplings(self) -> Iterator[dict[str, Any]]:
        for name, mimic in self.mimics.items():
            if not self._is_coupled(name):
                continue
            own_hinge, other_hinge = self.joints[name], self.joints[mimic.leader]
            row = f"{own_hinge}.q - {mimic.multiplier!r}*{other_hinge}.q".replace("- -", "+ ")
            yield {"name": f"{own_hinge}_mimics", "expression": row, "equals": mimic.offset}
            note_text = f"mimics {mimic.leader!r}, by a coupling"
            self._add_note(self.tree.joints[name], f"joint {name!r}", note_text)

    def _is_moving(self, name: str) -> bool:
        is_fixed = self.tree.joints[name].type == FIXED
        return not is_fixed and name in self.joints and name not in self.fixed_joints

    def _is_coupled(self, name: str) -> bool:
        """Whether a joint that mimics another one is coupled to it; else it is held."""
        mimic = self.mimics[name]
        follows = mimic.multiplier != 0 and self._is_moving(mimic.leader)
        return self.choices.mimics == COUPLED and follows

    def _initial_values(self) -> dict[str, float]:
        """Initial values of the joints that mimic others.  Raises SceneError for cycles."""
        mimics, start_values = self.mimics, dict[str, float]()
        for name in mimics:
            mimic_path = dict[str, Mimic]()
            while name in mimics and name not in start_values:
                if name in mimic_path:
                    joint = self.tree.joints[name]
                    raise SceneError(
                        f"{joint.where}: joint {name!r} mimics itself through other joints; "
                        "remove one <mimic> of the cycle"
                    )
                mimic_path[name] = mimics[name]
                name = mimics[name].leader
            start_value = start_values[name] if name in start_values else self._initial_value(name)
            for joint_name, mimic in reversed(mimic_path.items()):
                start_value = mimic.multiplier * start_value + mimic.offset
                start_values[joint_name] = start_value
        return start_values

    def _initial_value(self, name: str) -> float:
        """Initial value of a joint that mimics no other."""
        given = self.tree.joints[name].keys.get("initial") if self._is_moving(name) else None
        return float(given["q"][0]) if given else 0.0

    def _shapes(self, folder: Path | None) -> Iterator[dict[str, Any]]:
        meshes = None if folder is None else MeshFinder(folder)
        for visual in self.robot.visuals:
            owner, frame = self.body_frames[visual.link]
            pose, keys = frame.compose(visual.pose), dict(visual.keys)
            if file := keys.get("file"):
                mesh_path = None if meshes is None else meshes.path(file)
                if mesh_path is None:
                    link, text = self.tree.links[visual.link], f"there is no mesh {file!r}"
                    self._add_note(link, f"link {link.name!r}", f"not drawn: {text}")
                    continue
                keys["file"] = mesh_path
            reference = GROUND if owner == _GROUND_OWNER else self._bodies[owner]
            yield {"on": reference, **_pose_keys(pose), **keys}


def _inertial_mass_efforts(hinge: str, mass: float) -> list[str | float]:
    """Efforts of a free hinge with an additional `mass` (kg) that accelerates in inertial axes.

    The `inertia` of a law multiplies udot in axes that rotate with the body and lacks -m w x v.
    """
    v, w = ([f"{hinge}.u[{k}]" for k in range(*index_range)] for index_range in ((0, 3), (3, 6)))
    cross = [((k + 1) % 3, (k + 2) % 3) for k in range(3)]
    return [*(f"{mass!r}*({w[j]}*{v[i]} - {w[i]}*{v[j]})" for i, j in cross), 0.0, 0.0, 0.0]


def _pose_keys(pose: Pose) -> dict[str, Any]:
    """Keys of a pose: position, and orientation if it is rotated."""
    if pose.rotation == IDENTITY:
        return {"position": pose.position}
    return {"position": pose.position, "orientation": to_quaternion(pose.rotation)}
