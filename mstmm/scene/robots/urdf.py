"""Reader of URDF files.

The axes of a link are those of its inboard joint.  The axis of a joint is in these axes, its origin
in those of the parent.  <inertial> has its own frame, about whose origin the inertia is given.
"""

from __future__ import annotations

from collections import Counter
from typing import Any, NamedTuple

from ...arguments import short
from ...errors import SceneError
from ...numbers.pose import IN_PLACE, Pose
from ...numbers.rotations import Matrix, Vector, from_rpy, perpendicular, product, transpose
from ..rules.inertia import negative_moment, without_dust
from ..rules.messages import near
from .markup import Element, parsed
from .robot import FIXED, NOTHING, Joint, Link, Look, Mimic, Note, Robot, color


class _Kind(NamedTuple):
    """Type of joint: its hinge type, the key of its axis, and the unit of a single coordinate."""

    joint: str
    hinge: str
    axis: str = ""
    unit: str = ""


_KINDS = {
    kind.joint: kind
    for kind in (
        _Kind("revolute", "pin", "axis", "rad"), _Kind("continuous", "pin", "axis", "rad"),
        _Kind("prismatic", "prismatic", "axis", "m"), _Kind("planar", "planar", "normal"),
        _Kind("fixed", FIXED), _Kind("floating", "free"), _Kind("spherical", "ball"),
    )
}  # fmt: skip
_UNLIMITED = "continuous"
#: Limit of effort and velocity that means none: readers of URDF require a value.
NO_LIMIT = 1e9
#: Joint types without limits -> types with limits; and joint types by hinge type.
LIMITED = {_UNLIMITED: "revolute"}
BY_HINGE = {kind.hinge: kind for kind in _KINDS.values()}
_READ = ("link", "joint", "material")


class _Known(NamedTuple):
    """Supported attributes of an element, and supported children: once, or any number of times."""

    attributes: tuple[str, ...]
    once: tuple[str, ...] = ()
    often: tuple[str, ...] = ()


#: Supported elements of a robot; elements with other tags are ignored with their content.
_KNOWN = {
    "link": _Known(("name", "type"), ("inertial",), ("visual", "collision")),
    "inertial": _Known((), ("origin", "mass", "inertia")),
    "mass": _Known(("value",)),
    "inertia": _Known(("ixx", "ixy", "ixz", "iyy", "iyz", "izz")),
    "visual": _Known(("name",), ("origin", "geometry", "material")),
    "joint": _Known(
        ("name", "type"), ("parent", "child", "origin", "axis", "dynamics", "limit", "mimic")
    ),
    "origin": _Known(("xyz", "rpy")),
    "parent": _Known(("link",)),
    "child": _Known(("link",)),
    "axis": _Known(("xyz",)),
    "dynamics": _Known(("damping", "friction")),
    "limit": _Known(("lower", "upper", "effort", "velocity")),
    "mimic": _Known(("joint", "multiplier", "offset")),
}
_MATERIAL = "material"


def read_urdf(content: bytes, where: str) -> Robot:
    """Read a robot from a URDF file; `where` is its name in messages.  Raises SceneError."""
    root = parsed(content, where)
    if root.tag != "robot":
        raise SceneError(f"{root.where}: expected <robot>, found <{root.tag[:40]}>")
    if any(child.tag.startswith("xacro:") for child in root.children):
        raise SceneError(f"{where}: this is a xacro file; expand it with xacro FILE > robot.urdf")
    reader = _Reader(root)
    links = tuple(map(reader.link, root.all("link")))
    joints = tuple(map(reader.joint, root.all("joint")))
    left = Counter(child.tag for child in root.children if child.tag not in _READ)
    for tag, count in left.items():
        reader.note(root, f"<{tag}>", f"left out, {count} of them" if count > 1 else "left out")
    name = root.attributes.get("name", "")
    return Robot(
        name, where, links, joints, tuple(reader.mimics), tuple(reader.looks), tuple(reader.notes)
    )


class _Reader:
    """Reader of links and joints that also collects notes, visuals and mimics."""

    def __init__(self, root: Element) -> None:
        self.notes, self.looks, self.mimics = list[Note](), list[Look](), list[Mimic]()
        self._colors = {
            one.attributes.get("name", ""): found
            for one in root.all(_MATERIAL) if (found := _color(one))
        }  # fmt: skip

    def note(self, at: Element, element: str, text: str) -> None:
        """Add a note about an element."""
        self.notes.append(Note(at.where, element, text))

    def _note_unread(self, one: Element, owner: str) -> None:
        """Add notes about repeated elements, and unknown elements and attributes, of an owner."""
        known = _KNOWN.get(one.tag)
        if known is None:
            return
        unknown = [key[:40] for key in one.attributes if key not in known.attributes]
        if unknown:
            more = f" and {len(unknown) - 6} more" if len(unknown) > 6 else ""
            what = f"unknown attributes of <{one.tag}> left out: {', '.join(unknown[:6])}{more}"
            self.note(one, owner, what)
        for tag, count in Counter(child.tag for child in one.children).items():
            if tag not in (*known.once, *known.often):
                self.note(one, owner, f"<{tag[:40]}> in <{one.tag}> left out")
            elif count > 1 and tag in known.once:
                what = f"<{tag}> is given {count} times; the first applies, the others are left out"
                self.note(one, owner, what)
        for child in one.children:
            self._note_unread(child, owner)

    def link(self, one: Element) -> Link:
        name = one.text("name")
        self._note_unread(one, f"link {name!r}")
        self._looks_of(one, name)
        inertial = one.first("inertial")
        if inertial is None:
            return Link(name, where=one.where)
        frame, mass = _pose(inertial), inertial.first("mass")
        kg = 0.0 if mass is None else mass.number("value", 0.0, "kg")
        if kg < 0:
            raise SceneError(
                f"{inertial.where}: link {name!r}: expected a mass of 0 kg or more, found {kg:g}"
            )
        given = _inertia(inertial.first("inertia"))
        inertia = without_dust(given, kg)
        if kg > 0 and inertial.first("inertia") is None:
            self.note(one, f"link {name!r}", "a mass without <inertia>: a point mass")
        elif kg == 0 and inertia != NOTHING:
            self.note(one, f"link {name!r}", "moments of inertia without a mass")
        if inertia != given:
            self.note(one, f"link {name!r}", "moments of inertia below 0 by rounding set to 0")
        turned = product(product(frame.rotation, inertia), transpose(frame.rotation))
        link = Link(name, kg, frame.position, _symmetric(turned), one.where)
        if negative := negative_moment(inertia):
            self.note(one, f"link {name!r}", f"accepted unchanged: {negative}")
        return link

    def joint(self, one: Element) -> Joint:
        name, given = one.text("name"), one.text("type")
        self._note_unread(one, f"joint {name!r}")
        kind = _KINDS.get(given)
        if kind is None:
            hint = near(given, _KINDS)
            raise SceneError(f"{one.where}: joint {name!r}: unknown type {given!r}{hint}")
        ends = []
        for tag in ("parent", "child"):
            end = one.first(tag)
            if end is None:
                raise SceneError(f"{one.where}: joint {name!r} has no <{tag} link=...>; add it")
            ends.append(end.text("link"))
        keys = dict[str, Any]()
        if kind.axis:
            axis = self._axis(one, name)
            keys = {kind.axis: axis} | ({} if kind.unit else {"axis2": perpendicular(axis)})
        if kind.unit:
            keys |= self._law(one, name, kind.unit, limited=given != _UNLIMITED)
        mimic = one.first("mimic")
        if mimic is not None and not kind.unit:
            self.note(one, f"joint {name!r}", f"its <mimic> is left out: a {given} joint")
        elif mimic is not None:
            self.mimics.append(Mimic(
                name, mimic.text("joint"), mimic.number("multiplier", 1.0, "the other's unit"),
                mimic.number("offset", 0.0, kind.unit),
            ))  # fmt: skip
        return Joint(name, kind.hinge, ends[0], ends[1], _pose(one), keys, one.where)

    def _axis(self, one: Element, name: str) -> Vector:
        axis = one.first("axis")
        x, y, z = (1.0, 0.0, 0.0) if axis is None else axis.numbers("xyz", (1.0, 0.0, 0.0), "1")
        size = x * x + y * y + z * z
        if size == 0:
            raise SceneError(f"{one.where}: joint {name!r}: expected an axis that is not zero")
        if abs(size - 1) > 1e-3:
            self.note(one, f"joint {name!r}", "its axis is normalised to length 1")
        return (x, y, z)

    def _law(self, one: Element, name: str, unit: str, limited: bool) -> dict[str, Any]:
        """Law keys of a joint from <dynamics> and <limit>; limits become stops only on request."""
        law: dict[str, Any] = {}
        if (dynamics := one.first("dynamics")) is not None:
            for key, its_unit in (("damping", "N m s/rad or N s/m"), ("friction", "N m or N")):
                number = dynamics.number(key, 0.0, its_unit)
                if number < 0:
                    self.note(one, f"joint {name!r}", f"{key} below 0 left out")
                elif number > 0:
                    law[key] = number if key == "damping" else {"coulomb": number}
        limit = one.first("limit")
        if limit is not None and limited:
            lower, upper = (limit.number(key, 0.0, unit) for key in ("lower", "upper"))
            if lower < upper:
                law["limits"] = {"lower": lower, "upper": upper}
            elif {"lower", "upper"} & set(limit.attributes):
                what = f"limits from {lower:g} to {upper:g} leave no range and are left out"
                self.note(one, f"joint {name!r}", what)
        rated = {**law.get("limits", {}), **({} if limit is None else self._rated(limit, name))}
        return ({"law": law} if law else {}) | ({"rated": rated} if rated else {})

    def _rated(self, limit: Element, name: str) -> dict[str, float]:
        """Largest effort and speed of a joint, kept as its rating."""
        given, unread = dict[str, float](), list[str]()
        for key, unit in (("effort", "N m or N"), ("velocity", "rad/s or m/s")):
            if key in limit.attributes:
                try:
                    given[key] = limit.number(key, 0.0, unit)
                except SceneError:
                    unread.append(f"{key} {short(limit.attributes[key])}")
        kept = {key: number for key, number in given.items() if number >= 0 and number != NO_LIMIT}
        if kept:
            what = "limits of effort and velocity have no effect; they are kept as rated"
            self.note(limit, f"joint {name!r}", what)
        if unread:
            what = f"limits that are not finite numbers left out: {', '.join(unread)}"
            self.note(limit, f"joint {name!r}", what)
        if any(number < 0 for number in given.values()):
            self.note(limit, f"joint {name!r}", "limits of effort or velocity below 0 left out")
        return kept

    def _looks_of(self, one: Element, link: str) -> None:
        """Collect the visuals of a link, or its collision shapes where none can be drawn."""
        drawn = [self._look(link, visual) for visual in one.all("visual")]
        if all(drawn):
            return
        instead = [] if any(drawn) else [self._look(link, two) for two in one.all("collision")]
        what = "drawn by its collision shapes" if any(instead) else "not all of it is drawn"
        self.note(one, f"link {link!r}", what)

    def _look(self, link: str, visual: Element) -> bool:
        """Collect a visual; return whether it is drawn.

        Errors only add a note: visuals do not affect the motion.
        """
        try:
            return self._shape(link, visual)
        except SceneError as error:
            self.notes.append(Note(visual.where, f"link {link!r}", f"not drawn: {error}"))
            return False

    def _shape(self, link: str, visual: Element) -> bool:
        geometry = visual.first("geometry")
        if geometry is None or not geometry.children:
            return True
        keys = _solid(geometry.children[0])
        if keys is None:
            return False
        if (material := visual.first(_MATERIAL)) is not None:
            found = _color(material) or self._colors.get(material.attributes.get("name", ""))
            keys |= {"color": found} if found else {}
        self.looks.append(Look(link, _pose(visual), keys))
        return True


def _pose(one: Element) -> Pose:
    origin = one.first("origin")
    if origin is None:
        return IN_PLACE
    x, y, z = origin.numbers("xyz", (0.0, 0.0, 0.0), "m")
    return Pose((x, y, z), from_rpy(origin.numbers("rpy", (0.0, 0.0, 0.0), "rad")))


def _inertia(one: Element | None) -> Matrix:
    keys = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    numbers = (0.0 if one is None else one.number(key, 0.0, "kg m^2") for key in keys)
    xx, xy, xz, yy, yz, zz = numbers
    return ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))


def _symmetric(m: Matrix) -> Matrix:
    """Symmetric part of a matrix, which removes differences by rounding."""
    xy, xz, yz = ((m[i][j] + m[j][i]) / 2 for i, j in ((0, 1), (0, 2), (1, 2)))
    return ((m[0][0], xy, xz), (xy, m[1][1], yz), (xz, yz, m[2][2]))


def _solid(one: Element) -> dict[str, Any] | None:
    """Keys of a shape; None for one that is not drawn."""
    if one.tag == "box":
        size = one.numbers("size", (0.0, 0.0, 0.0), "m")
        return {"type": "box", "size": size} if min(size) > 0 else None
    if one.tag == "mesh":
        file = one.attributes.get("filename", "")
        return _mesh(file, one.numbers("scale", (1.0, 1.0, 1.0), "1"))
    lengths: dict[str, float] = {
        key: one.number(key, 0.0, "m") for key in ("radius", "length") if key in one.attributes
    }
    known = {"sphere": ("radius",), "cylinder": ("radius", "length")}.get(one.tag)
    if known is None or set(known) != set(lengths) or min(lengths.values()) <= 0:
        return None
    return {"type": one.tag, **lengths}


def _mesh(file: str, scale: Vector | tuple[float, ...]) -> dict[str, Any] | None:
    """Keys of a mesh; None for an unsupported format or unequal scale factors."""
    readable = file.lower().endswith((".stl", ".obj")) and ".." not in file.split("/")
    if not readable or len(set(scale)) != 1 or scale[0] <= 0:
        return None
    return {"type": "mesh", "file": file} | ({"scale": scale[0]} if scale[0] != 1 else {})


def _color(material: Element) -> str | None:
    one = material.first("color")
    return None if one is None else color(one.numbers("rgba", (0.5, 0.5, 0.5, 1.0), "0 to 1")[:3])
