"""Conversion of a robot to a scene, with a note for everything that differs or is left out."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ...arguments import short
from ...errors import SceneError
from ...numbers.pose import IN_PLACE, Pose
from ...numbers.rotations import IDENTITY, to_quaternion
from ..files.write import as_toml
from ..rules.inertia import triangle_excess
from ..rules.messages import near
from ..rules.values import GROUND
from ..scene import Scene
from .masses import joined, without_dust
from .meshes import Meshes
from .names import Names, kept
from .robot import FIXED, NOTHING, Joint, Link, Mimic, Note, Robot
from .tree import Tree
from .units import doubts

BASES = (FIXED, "free")
COUPLED, HELD = MIMICS = ("coupled", "held")
#: Types of joints with one coordinate.
_OF_ONE = ("pin", "prismatic")
#: Most names in a note.
_NAMED = 6
#: Owner of links that are part of the ground; no link has this name, but one may be named "ground".
_STILL = ""


@dataclass(frozen=True)
class Choices:
    """Options of the conversion of a robot to a scene.

    base: "fixed" on the ground, or "free".  merge: links on fixed joints become part of their
    inboard body; their frames are ends of it.  stops: stiffness (N/m or N m/rad) of the stops at
    the limits of joints, None: no stops.  mimics: joints that mimic others are "coupled" to them,
    or "held" at their initial value.
    """

    base: str = FIXED
    merge: bool = True
    stops: float | None = None
    mimics: str = COUPLED


@dataclass(frozen=True)
class Imported:
    """Scene of a robot file, with name mappings and notes.

    `links` gives for each link its body or end ("ground" for a part of the ground), and `joints`
    for each moving joint its hinge.
    """

    scene: Scene
    links: Mapping[str, str]
    joints: Mapping[str, str]
    notes: tuple[Note, ...]
    tables: Mapping[str, Any]

    @property
    def names(self) -> Mapping[str, str]:
        """Mapping of links and joints together; a joint replaces a link of the same name."""
        return {**self.links, **self.joints}

    def to_toml(self) -> str:
        """Convert to TOML text without default values."""
        return as_toml(self.tables)


def converted(robot: Robot, choices: Choices, folder: Path | None = None) -> Imported:
    """Convert a robot to a scene; its meshes are relative to `folder`.  Raises SceneError."""
    robot = without_dust(robot)
    tree = Tree(robot)
    robot = replace(robot, notes=(*robot.notes, *doubts(robot, tree)))
    writer = _Writer(robot, tree, choices)
    if choices.merge and not writer.bodies():
        writer = _Writer(robot, tree, replace(choices, merge=False))
    if not writer.bodies():
        urdf = robot.where.lower().endswith(".urdf")
        way_out = 'try base = "free"' if urdf else "give a body a <freejoint>"
        raise SceneError(f"{robot.where}: no link moves or has mass; {way_out}")
    data = writer.tables(folder)
    scene, notes = Scene.from_data(data, robot.where), tuple(writer.notes)
    return Imported(scene, writer.links, writer.joints, notes, data)


class _Writer:
    """Writer of the scene tables of a robot."""

    def __init__(self, robot: Robot, tree: Tree, choices: Choices) -> None:
        self.robot, self.tree, self.choices = robot, tree, choices
        self.notes = list(robot.notes)
        if len(tree.roots) > 1:
            some = ", ".join(map(repr, tree.roots[:4])) + (", ..." if len(tree.roots) > 4 else "")
            text = f"{len(tree.roots)} of them: {some}; each has its own base"
            self.notes.append(Note(robot.where, "trees", text))
        known = list(self._known_mimics())
        mimics = list({mimic.of: mimic for mimic in known}.values())
        for mimic in known:
            if mimic not in mimics:
                what = f"several <mimic>: the last one applies, not {mimic.other!r}"
                self._tell(tree.joints[mimic.of], f"joint {mimic.of!r}", what)
        self.held = {joint.name for joint in tree.weightless()}
        for name in sorted(self.held, key=list(tree.joints).index):
            what = "fixed, because no link outboard of it has mass"
            self._tell(tree.joints[name], f"joint {name!r}", what)
        #: Link -> the link whose body it is part of, or _STILL, and its frame in that body.
        self.place = dict[str, tuple[str, Pose]]()
        for link in tree.outward:
            self.place[link.name] = self._placed(link)
        self._names = Names()
        self._bodies = self._names.take_all(self.bodies(), "link", tree.links)
        hinges = Names()
        moving = [one.name for one in robot.joints if self.place[one.child][0] == one.child]
        self.joints = hinges.take_all(moving, "joint")
        #: Position of the notes on names, which are written when all ends are defined.
        self._told = len(self.notes)
        self._tell_links()
        #: Mimic relations of the moving joints by name.
        self.mimics = {mimic.of: mimic for mimic in mimics if self._moves(mimic.of)}
        self._roots = {name: hinges.take(f"{name}_base", "link")
                       for name in tree.roots if name in self._bodies}  # fmt: skip
        self._ends: defaultdict[str, dict[str, Any]] = defaultdict(dict)
        self.links = {link.name: self._frame(link) for link in robot.links}

    def _tell_names(self, names: Mapping[str, Mapping[str, str]]) -> None:
        """Add notes about links and joints that are renamed in the scene.

        `names` are the original names that its [names] keeps.
        """
        kept_, rest = list[str](), list[str]()
        for table, named in (("body", self._bodies), ("hinge", self.joints)):
            for old, new in named.items():
                if old != new:
                    known = names.get(table, {}).get(old) == new
                    (kept_ if known else rest).append(f"{short(old)} is {new}")
        told = (
            (kept_, "not allowed in a scene, kept in its [names]"),
            (rest, "allowed neither in a scene nor in its [names]"),
        )
        for others, what in reversed(told):
            if others:
                some = ", ".join(others[:_NAMED]) + (", ..." if others[_NAMED:] else "")
                text = f"{len(others)} {what}: {some}"
                self.notes.insert(self._told, Note(self.robot.where, "names", text))

    def _tell_links(self) -> None:
        """Add notes about links that are no separate bodies, and about moving massless links."""
        for link in self.robot.links:
            joint, (owner, _) = self.tree.holder.get(link.name), self.place[link.name]
            if joint is None:
                continue
            if owner == _STILL:
                self._tell(joint, f"link {link.name!r}", "part of the ground")
            elif owner != link.name:
                what = "part of its inboard body; its name refers to its frame there"
                self._tell(joint, f"link {link.name!r}", what)
            elif joint.type != FIXED and not link.mass and link.inertia == NOTHING:
                self._tell(link, f"link {link.name!r}", "moves without mass")

    def bodies(self) -> list[str]:
        """Names of links that are separate bodies, in the order of the file."""
        return [link.name for link in self.robot.links if self.place[link.name][0] == link.name]

    def tables(self, folder: Path | None) -> dict[str, Any]:
        """Keys of the scene."""
        found: dict[str, Any] = {"gravity": self.robot.gravity}
        found["hinge"] = [*map(self._root, self._roots), *self._joints()]
        parts: defaultdict[str, list[tuple[Link, Pose]]] = defaultdict(list)
        for link in self.robot.links:
            owner, pose = self.place[link.name]
            parts[owner].append((link, pose))
        found["body"] = [self._body(name, parts[name]) for name in self._bodies]
        if couplings := list(self._couplings()):
            found["coupling"] = couplings
        if shapes := list(self._shapes(folder)):
            found["shape"] = shapes
        ends = {f"{self._bodies[name]}.{end}" for name in self._ends for end in self._ends[name]}
        own = {GROUND, *self._bodies.values(), *ends}
        names = kept(self._named_links(), self.joints, own)
        self._tell_names(names)
        if names:
            found["names"] = names
        return found

    def _named_links(self) -> dict[str, str]:
        """Bodies and ends by link name, bodies first; on the ground only links at its origin."""
        bodies = dict.fromkeys((*self._bodies, *self.links))
        return {
            name: self.links[name] for name in bodies
            if self.place[name] == (_STILL, IN_PLACE) or self.links[name] != GROUND
        }  # fmt: skip

    def _tell(self, one: Link | Joint, element: str, text: str) -> None:
        self.notes.append(Note(one.where, element, text))

    def _placed(self, link: Link) -> tuple[str, Pose]:
        joint = self.tree.holder.get(link.name)
        if joint is None:
            empty = link.mass == 0 and link.inertia == NOTHING
            grounded = self.choices.base == FIXED and (empty or self.choices.merge)
            return (_STILL if grounded else link.name), IN_PLACE
        if self.choices.merge and (joint.type == FIXED or joint.name in self.held):
            owner, pose = self.place[joint.parent]
            return owner, pose.then(joint.pose)
        return link.name, IN_PLACE

    def _frame(self, link: Link) -> str:
        """Reference of the body or end of a link."""
        owner, pose = self.place[link.name]
        if owner == _STILL:
            return GROUND
        return self._end(owner, pose, link.name)

    def _end(self, owner: str, pose: Pose, name: str) -> str:
        """Reference of a frame of a body: the body, an existing end, or a new one."""
        body, ends = self._bodies[owner], self._ends[owner]
        if pose == IN_PLACE:
            return body
        end = _keys(pose)
        for known, other in ends.items():
            if other == end:
                return f"{body}.{known}"
        names = Names()
        for known in ends:
            names.take(known, "end")
        taken = names.take(name, "end")
        ends[taken] = end
        return f"{body}.{taken}"

    def _body(self, name: str, parts: list[tuple[Link, Pose]]) -> dict[str, Any]:
        mass, center, m = joined(parts)
        table: dict[str, Any] = {"name": self._bodies[name], "mass": mass}
        if any(center):
            table["center_of_mass"] = center
        if m != NOTHING:
            table["inertia"] = (m[0][0], m[1][1], m[2][2], m[0][1], m[0][2], m[1][2])
            if why := triangle_excess(m):
                table["allow_unphysical_inertia"] = True
                self._tell(parts[0][0], f"link {name!r}", f"accepted unchanged: {why}")
        if self._ends[name]:
            table["ends"] = self._ends[name]
        return table

    def _root(self, name: str) -> dict[str, Any]:
        body, hinge = self._bodies[name], self._roots[name]
        return {"name": hinge, "type": self.choices.base, "inboard": GROUND, "outboard": body}

    def _joints(self) -> Iterator[dict[str, Any]]:
        start = self._starts()
        for name, hinge in self.joints.items():
            joint = self.tree.joints[name]
            still = joint.name in self.held
            owner, frame = self.place[joint.parent]
            pose, grounded = frame.then(joint.pose), owner == _STILL
            yield {
                "name": hinge,
                "type": FIXED if still else joint.type,
                "inboard": GROUND if grounded else self._end(owner, pose, name),
                "outboard": self._bodies[joint.child],
                **(_keys(pose) if grounded else {}),
                **({} if still else self._motion(joint, start.get(name))),
            }

    def _motion(self, joint: Joint, start: float | None) -> dict[str, Any]:
        keys = dict(joint.keys)
        law = dict(keys.pop("law", {}))
        if mass := keys.pop("armature", 0.0):
            law["effort"] = _turning_with_body(self.joints[joint.name], mass)
        if limits := law.pop("limits", None):
            if self.choices.stops is None:
                self._tell(
                    joint,
                    f"joint {joint.name!r}",
                    "its limits are not stops; they are kept as rated",
                )
            else:
                law["limits"] = {**limits, "stiffness": self.choices.stops}
        if law:
            keys["law"] = law
        if start is not None and not self._is_coupled(joint.name):
            keys["drive"] = [start]
            keys.pop("initial", None)
            self._tell(joint, f"joint {joint.name!r}", f"held at {start:g}; it mimics another")
        elif start is not None and (start or "initial" in keys):
            keys["initial"] = {"q": [start]}
        return keys

    def _known_mimics(self) -> Iterator[Mimic]:
        for mimic in self.robot.mimics:
            other = self.tree.joints.get(mimic.other)
            if other is not None and other.type in (*_OF_ONE, FIXED):
                yield mimic
                continue
            what = f"left free: it mimics {mimic.other!r}, which "
            if other is None:
                what += f"does not exist{near(mimic.other, self.tree.joints)}"
            else:
                what += "has more than one coordinate"
            self._tell(self.tree.joints[mimic.of], f"joint {mimic.of!r}", what)

    def _couplings(self) -> Iterator[dict[str, Any]]:
        for name, mimic in self.mimics.items():
            if not self._is_coupled(name):
                continue
            own, other = self.joints[name], self.joints[mimic.other]
            row = f"{own}.q - {mimic.multiplier!r}*{other}.q".replace("- -", "+ ")
            yield {"name": f"{own}_mimics", "expression": row, "equals": mimic.offset}
            what = f"mimics {mimic.other!r}, by a coupling"
            self._tell(self.tree.joints[name], f"joint {name!r}", what)

    def _moves(self, name: str) -> bool:
        fixed = self.tree.joints[name].type == FIXED
        return not fixed and name in self.joints and name not in self.held

    def _is_coupled(self, name: str) -> bool:
        """Whether a joint that mimics another one is coupled to it; else it is held."""
        mimic = self.mimics[name]
        follows = mimic.multiplier != 0 and self._moves(mimic.other)
        return self.choices.mimics == COUPLED and follows

    def _starts(self) -> dict[str, float]:
        """Initial values of the joints that mimic others.  Raises SceneError for cycles."""
        mimics, found = self.mimics, dict[str, float]()
        for name in mimics:
            way = dict[str, Mimic]()
            while name in mimics and name not in found:
                if name in way:
                    joint = self.tree.joints[name]
                    raise SceneError(
                        f"{joint.where}: joint {name!r} mimics itself through other joints; "
                        "remove one <mimic> of the cycle"
                    )
                way[name] = mimics[name]
                name = mimics[name].other
            at = found[name] if name in found else self._start(name)
            for one, mimic in reversed(way.items()):
                at = found[one] = mimic.multiplier * at + mimic.offset
        return found

    def _start(self, name: str) -> float:
        """Initial value of a joint that mimics no other."""
        given = self.tree.joints[name].keys.get("initial") if self._moves(name) else None
        return float(given["q"][0]) if given else 0.0

    def _shapes(self, folder: Path | None) -> Iterator[dict[str, Any]]:
        meshes = None if folder is None else Meshes(folder)
        for look in self.robot.looks:
            owner, frame = self.place[look.link]
            pose, keys = frame.then(look.pose), dict(look.keys)
            if file := keys.get("file"):
                found = None if meshes is None else meshes.path(file)
                if found is None:
                    link = self.tree.links[look.link]
                    self._tell(link, f"link {look.link!r}", f"not drawn: there is no mesh {file!r}")
                    continue
                keys["file"] = found
            on = GROUND if owner == _STILL else self._bodies[owner]
            yield {"on": on, **_keys(pose), **keys}


def _turning_with_body(hinge: str, mass: float) -> list[str | float]:
    """Efforts of a free hinge with an additional `mass` (kg) that accelerates in inertial axes.

    The `inertia` of a law multiplies udot in axes that rotate with the body and lacks -m w x v.
    """
    v, w = ([f"{hinge}.u[{k}]" for k in range(*of)] for of in ((0, 3), (3, 6)))
    cross = [((k + 1) % 3, (k + 2) % 3) for k in range(3)]
    return [*(f"{mass!r}*({w[j]}*{v[i]} - {w[i]}*{v[j]})" for i, j in cross), 0.0, 0.0, 0.0]


def _keys(pose: Pose) -> dict[str, Any]:
    """Keys of a pose: position, and orientation if it is rotated."""
    turned = pose.rotation != IDENTITY
    return {"position": pose.position} | (
        {"orientation": to_quaternion(pose.rotation)} if turned else {}
    )
