"""Reader and writer of URDF files.

The axes of a link are those of its inboard joint.  The axis of a joint is in these axes, its origin
in those of the parent.  <inertial> has its own frame, about whose origin the inertia is given.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree
from xml.etree.ElementTree import SubElement

from ...argument_validation import abbreviate
from ...errors import SceneError
from ...numerics.rotations import (
    IDENTITY_POSE,
    Matrix,
    Pose,
    Vector,
    from_rpy,
    perpendicular_vector,
    product,
    to_rpy,
    transpose,
)
from ..validators.rotations_and_inertia import negative_moment_message, without_rounding
from ..validators.validation_messages import did_you_mean
from .robot_model import FIXED, ZERO_MATRIX, ImportNote, Joint, Link, Mimic, Robot, Visual, color
from .xml_reader import Element, parse_xml


class _JointType(NamedTuple):
    """Type of joint: its hinge type, the key of its axis, and the unit of a single coordinate."""

    joint: str
    hinge: str
    axis: str = ""
    unit: str = ""


_JOINT_TYPES = {
    kind.joint: kind
    for kind in (
        _JointType("revolute", "pin", "axis", "rad"),
        _JointType("continuous", "pin", "axis", "rad"),
        _JointType("prismatic", "prismatic", "axis", "m"),
        _JointType("planar", "planar", "normal"),
        _JointType("fixed", FIXED),
        _JointType("floating", "free"),
        _JointType("spherical", "ball"),
    )
}
_UNLIMITED_TYPE = "continuous"
#: Limit of effort and velocity that means none: readers of URDF require a value.
NO_LIMIT = 1e9
#: Joint types without limits -> types with limits; and joint types by hinge type.
LIMITED_TYPES = {_UNLIMITED_TYPE: "revolute"}
JOINT_TYPES_BY_HINGE = {kind.hinge: kind for kind in _JOINT_TYPES.values()}
_SUPPORTED_TAGS = ("link", "joint", "material")


class _SupportedContent(NamedTuple):
    """Supported attributes of an element, and supported children: once, or any number of times."""

    attributes: tuple[str, ...]
    unique_tags: tuple[str, ...] = ()
    repeatable_tags: tuple[str, ...] = ()


#: Supported elements of a robot; elements with other tags are ignored with their content.
_SUPPORTED_CONTENT = {
    "link": _SupportedContent(("name", "type"), ("inertial",), ("visual", "collision")),
    "inertial": _SupportedContent((), ("origin", "mass", "inertia")),
    "mass": _SupportedContent(("value",)),
    "inertia": _SupportedContent(("ixx", "ixy", "ixz", "iyy", "iyz", "izz")),
    "visual": _SupportedContent(("name",), ("origin", "geometry", "material")),
    "joint": _SupportedContent(
        ("name", "type"), ("parent", "child", "origin", "axis", "dynamics", "limit", "mimic")
    ),
    "origin": _SupportedContent(("xyz", "rpy")),
    "parent": _SupportedContent(("link",)),
    "child": _SupportedContent(("link",)),
    "axis": _SupportedContent(("xyz",)),
    "dynamics": _SupportedContent(("damping", "friction")),
    "limit": _SupportedContent(("lower", "upper", "effort", "velocity")),
    "mimic": _SupportedContent(("joint", "multiplier", "offset")),
}
_MATERIAL_TAG = "material"


def read_urdf(content: bytes, where: str) -> Robot:
    """Read a robot from a URDF file; `where` is its name in messages.  Raises SceneError."""
    root = parse_xml(content, where)
    if root.tag != "robot":
        raise SceneError(f"{root.where}: expected <robot>, found <{root.tag[:40]}>")
    if any(child.tag.startswith("xacro:") for child in root.children):
        raise SceneError(f"{where}: this is a xacro file; expand it with xacro FILE > robot.urdf")
    reader = _UrdfReader(root)
    links = tuple(map(reader.link, root.children_with_tag("link")))
    joints = tuple(map(reader.joint, root.children_with_tag("joint")))
    tags = Counter(child.tag for child in root.children if child.tag not in _SUPPORTED_TAGS)
    for tag, count in tags.items():
        reader.note(root, f"<{tag}>", f"left out, {count} of them" if count > 1 else "left out")
    name = root.attributes.get("name", "")
    return Robot(
        name, where, links, joints, tuple(reader.mimics), tuple(reader.visuals), tuple(reader.notes)
    )


class _UrdfReader:
    """Reader of links and joints that also collects notes, visuals and mimics."""

    def __init__(self, root: Element) -> None:
        self.notes, self.visuals, self.mimics = list[ImportNote](), list[Visual](), list[Mimic]()
        self._colors = {
            material.attributes.get("name", ""): colour
            for material in root.children_with_tag(_MATERIAL_TAG)
            if (colour := _material_colour(material))
        }

    def note(self, at: Element, element: str, text: str) -> None:
        """Add a note about an element."""
        self.notes.append(ImportNote(at.where, element, text))

    def _note_unread(self, one: Element, owner: str) -> None:
        """Add notes about repeated elements, and unknown elements and attributes, of an owner."""
        supported = _SUPPORTED_CONTENT.get(one.tag)
        if supported is None:
            return
        unknown_keys = [key[:40] for key in one.attributes if key not in supported.attributes]
        if unknown_keys:
            more = f" and {len(unknown_keys) - 6} more" if len(unknown_keys) > 6 else ""
            names = ", ".join(unknown_keys[:6])
            self.note(one, owner, f"unknown attributes of <{one.tag}> left out: {names}{more}")
        for tag, count in Counter(child.tag for child in one.children).items():
            if tag not in (*supported.unique_tags, *supported.repeatable_tags):
                self.note(one, owner, f"<{tag[:40]}> in <{one.tag}> left out")
            elif count > 1 and tag in supported.unique_tags:
                text = f"<{tag}> is given {count} times; the first applies, the others are left out"
                self.note(one, owner, text)
        for child in one.children:
            self._note_unread(child, owner)

    def link(self, one: Element) -> Link:
        name = one.text("name")
        self._note_unread(one, f"link {name!r}")
        self._collect_visuals(one, name)
        inertial = one.first_with_tag("inertial")
        if inertial is None:
            return Link(name, where=one.where)
        frame, mass = _origin_pose(inertial), inertial.first_with_tag("mass")
        mass_value = 0.0 if mass is None else mass.number("value", 0.0, "kg")
        if mass_value < 0:
            raise SceneError(
                f"{inertial.where}: link {name!r}: expected a mass of 0 kg or more, found "
                f"{mass_value:g}"
            )
        given_inertia = _inertia_matrix(inertial.first_with_tag("inertia"))
        inertia = without_rounding(given_inertia, mass_value)
        if mass_value > 0 and inertial.first_with_tag("inertia") is None:
            self.note(one, f"link {name!r}", "a mass without <inertia>: a point mass")
        elif mass_value == 0 and inertia != ZERO_MATRIX:
            self.note(one, f"link {name!r}", "moments of inertia without a mass")
        if inertia != given_inertia:
            self.note(one, f"link {name!r}", "moments of inertia below 0 by rounding set to 0")
        rotated_inertia = product(product(frame.rotation, inertia), transpose(frame.rotation))
        link = Link(name, mass_value, frame.position, _symmetric_part(rotated_inertia), one.where)
        if negative_text := negative_moment_message(inertia):
            self.note(one, f"link {name!r}", f"accepted unchanged: {negative_text}")
        return link

    def joint(self, one: Element) -> Joint:
        name, type_name = one.text("name"), one.text("type")
        self._note_unread(one, f"joint {name!r}")
        joint_type = _JOINT_TYPES.get(type_name)
        if joint_type is None:
            hint = did_you_mean(type_name, _JOINT_TYPES)
            raise SceneError(f"{one.where}: joint {name!r}: unknown type {type_name!r}{hint}")
        ends = []
        for tag in ("parent", "child"):
            end = one.first_with_tag(tag)
            if end is None:
                raise SceneError(f"{one.where}: joint {name!r} has no <{tag} link=...>; add it")
            ends.append(end.text("link"))
        keys = dict[str, Any]()
        if joint_type.axis:
            axis = self._axis(one, name)
            keys[joint_type.axis] = axis
            if not joint_type.unit:
                keys["axis2"] = perpendicular_vector(axis)
        if joint_type.unit:
            keys |= self._law(one, name, joint_type.unit, limited=type_name != _UNLIMITED_TYPE)
        mimic = one.first_with_tag("mimic")
        if mimic is not None and not joint_type.unit:
            self.note(one, f"joint {name!r}", f"its <mimic> is left out: a {type_name} joint")
        elif mimic is not None:
            self.mimics.append(Mimic(
                name, mimic.text("joint"), mimic.number("multiplier", 1.0, "the other's unit"),
                mimic.number("offset", 0.0, joint_type.unit),
            ))  # fmt: skip
        return Joint(name, joint_type.hinge, ends[0], ends[1], _origin_pose(one), keys, one.where)

    def _axis(self, one: Element, name: str) -> Vector:
        axis = one.first_with_tag("axis")
        x, y, z = (1.0, 0.0, 0.0) if axis is None else axis.numbers("xyz", (1.0, 0.0, 0.0), "1")
        squared_length = x * x + y * y + z * z
        if squared_length == 0:
            raise SceneError(f"{one.where}: joint {name!r}: expected an axis that is not zero")
        if abs(squared_length - 1) > 1e-3:
            self.note(one, f"joint {name!r}", "its axis is normalised to length 1")
        return (x, y, z)

    def _law(self, one: Element, name: str, unit: str, limited: bool) -> dict[str, Any]:
        """Law keys of a joint from <dynamics> and <limit>; limits become stops only on request."""
        law: dict[str, Any] = {}
        if (dynamics := one.first_with_tag("dynamics")) is not None:
            for key, key_unit in (("damping", "N m s/rad or N s/m"), ("friction", "N m or N")):
                number = dynamics.number(key, 0.0, key_unit)
                if number < 0:
                    self.note(one, f"joint {name!r}", f"{key} below 0 left out")
                elif number > 0:
                    law[key] = number if key == "damping" else {"coulomb": number}
        limit = one.first_with_tag("limit")
        if limit is not None and limited:
            lower, upper = (limit.number(key, 0.0, unit) for key in ("lower", "upper"))
            if lower < upper:
                law["limits"] = {"lower": lower, "upper": upper}
            elif {"lower", "upper"} & set(limit.attributes):
                note_text = f"limits from {lower:g} to {upper:g} leave no range and are left out"
                self.note(one, f"joint {name!r}", note_text)
        rated = {**law.get("limits", {}), **({} if limit is None else self._rating(limit, name))}
        return ({"law": law} if law else {}) | ({"rated": rated} if rated else {})

    def _rating(self, limit: Element, name: str) -> dict[str, float]:
        """Largest effort and speed of a joint, kept as its rating."""
        given_limits, unread_texts = dict[str, float](), list[str]()
        for key, unit in (("effort", "N m or N"), ("velocity", "rad/s or m/s")):
            if key in limit.attributes:
                try:
                    given_limits[key] = limit.number(key, 0.0, unit)
                except SceneError:
                    unread_texts.append(f"{key} {abbreviate(limit.attributes[key])}")
        ratings = {key: x for key, x in given_limits.items() if x >= 0 and x != NO_LIMIT}
        if ratings:
            note_text = "limits of effort and velocity have no effect; they are kept as rated"
            self.note(limit, f"joint {name!r}", note_text)
        if unread_texts:
            note_text = f"limits that are not finite numbers left out: {', '.join(unread_texts)}"
            self.note(limit, f"joint {name!r}", note_text)
        if any(number < 0 for number in given_limits.values()):
            self.note(limit, f"joint {name!r}", "limits of effort or velocity below 0 left out")
        return ratings

    def _collect_visuals(self, element: Element, link: str) -> None:
        """Collect the visuals of a link, or its collision shapes where none can be drawn."""
        drawn = [self._collect_visual(link, one) for one in element.children_with_tag("visual")]
        if all(drawn):
            return
        collisions = () if any(drawn) else element.children_with_tag("collision")
        shapes = [self._collect_visual(link, collision) for collision in collisions]
        text = "drawn by its collision shapes" if any(shapes) else "not all of it is drawn"
        self.note(element, f"link {link!r}", text)

    def _collect_visual(self, link: str, visual: Element) -> bool:
        """Collect a visual; return whether it is drawn.

        Errors only add a note: visuals do not affect the motion.
        """
        try:
            return self._collect_shape(link, visual)
        except SceneError as error:
            self.notes.append(ImportNote(visual.where, f"link {link!r}", f"not drawn: {error}"))
            return False

    def _collect_shape(self, link: str, visual: Element) -> bool:
        geometry = visual.first_with_tag("geometry")
        if geometry is None or not geometry.children:
            return True
        keys = _shape_keys(geometry.children[0])
        if keys is None:
            return False
        if (material := visual.first_with_tag(_MATERIAL_TAG)) is not None:
            name = material.attributes.get("name", "")
            colour = _material_colour(material) or self._colors.get(name)
            keys |= {"color": colour} if colour else {}
        self.visuals.append(Visual(link, _origin_pose(visual), keys))
        return True


def _origin_pose(one: Element) -> Pose:
    origin = one.first_with_tag("origin")
    if origin is None:
        return IDENTITY_POSE
    x, y, z = origin.numbers("xyz", (0.0, 0.0, 0.0), "m")
    return Pose((x, y, z), from_rpy(origin.numbers("rpy", (0.0, 0.0, 0.0), "rad")))


def _inertia_matrix(one: Element | None) -> Matrix:
    keys = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    numbers = (0.0 if one is None else one.number(key, 0.0, "kg m^2") for key in keys)
    xx, xy, xz, yy, yz, zz = numbers
    return ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))


def _symmetric_part(m: Matrix) -> Matrix:
    """Symmetric part of a matrix, which removes differences by rounding."""
    xy, xz, yz = ((m[i][j] + m[j][i]) / 2 for i, j in ((0, 1), (0, 2), (1, 2)))
    return ((m[0][0], xy, xz), (xy, m[1][1], yz), (xz, yz, m[2][2]))


def _shape_keys(one: Element) -> dict[str, Any] | None:
    """Keys of a shape; None for one that is not drawn."""
    if one.tag == "box":
        size = one.numbers("size", (0.0, 0.0, 0.0), "m")
        return {"type": "box", "size": size} if min(size) > 0 else None
    if one.tag == "mesh":
        file = one.attributes.get("filename", "")
        return _mesh_keys(file, one.numbers("scale", (1.0, 1.0, 1.0), "1"))
    lengths: dict[str, float] = {
        key: one.number(key, 0.0, "m") for key in ("radius", "length") if key in one.attributes
    }
    required_keys = {"sphere": ("radius",), "cylinder": ("radius", "length")}.get(one.tag)
    if required_keys is None or set(required_keys) != set(lengths) or min(lengths.values()) <= 0:
        return None
    return {"type": one.tag, **lengths}


def _mesh_keys(file: str, scale: Vector | tuple[float, ...]) -> dict[str, Any] | None:
    """Keys of a mesh; None for an unsupported format or unequal scale factors."""
    is_readable = file.lower().endswith((".stl", ".obj")) and ".." not in file.split("/")
    if not is_readable or len(set(scale)) != 1 or scale[0] <= 0:
        return None
    return {"type": "mesh", "file": file} | ({"scale": scale[0]} if scale[0] != 1 else {})


def _material_colour(material: Element) -> str | None:
    one = material.first_with_tag("color")
    if one is None:
        return None
    return color(one.numbers("rgba", (0.5, 0.5, 0.5, 1.0), "0 to 1")[:3])


# --- writer ---------------------------------------------------------------------------------------


def as_urdf(robot: Robot) -> str:
    """Convert a robot to URDF text: links, then joints."""
    root = ElementTree.Element("robot", name=robot.name)
    visuals_by_link: dict[str, list[Visual]] = {}
    for visual in robot.visuals:
        visuals_by_link.setdefault(visual.link, []).append(visual)
    for link in robot.links:
        element = SubElement(root, "link", name=link.name)
        _fill_link(element, link, visuals_by_link.get(link.name, ()))
    mimics = {mimic.follower: mimic for mimic in robot.mimics}
    for joint in robot.joints:
        _add_joint(root, joint, mimics.get(joint.name))
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"


def _numbers_text(values: Iterable[float]) -> str:
    return " ".join(repr(float(x)) for x in values)


def _add_origin(parent: ElementTree.Element, pose: Pose) -> None:
    if pose == IDENTITY_POSE:
        return
    xyz, rpy = _numbers_text(pose.position), _numbers_text(to_rpy(pose.rotation))
    SubElement(parent, "origin", xyz=xyz, rpy=rpy)


def _fill_link(one: ElementTree.Element, link: Link, looks: Iterable[Visual]) -> None:
    if link.mass or link.inertia != ZERO_MATRIX:
        inertial = SubElement(one, "inertial")
        _add_origin(inertial, Pose(link.center))
        SubElement(inertial, "mass", value=repr(float(link.mass)))
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = link.inertia
        entries = {"ixx": xx, "ixy": xy, "ixz": xz, "iyy": yy, "iyz": yz, "izz": zz}
        SubElement(inertial, "inertia", {key: repr(float(x)) for key, x in entries.items()})
    for visual in looks:
        _fill_visual(SubElement(one, "visual"), visual)


def _fill_visual(one: ElementTree.Element, look: Visual) -> None:
    _add_origin(one, look.pose)
    keys, geometry = look.keys, SubElement(one, "geometry")
    shape_type = keys["type"]
    if shape_type == "mesh":
        file = Path(keys["file"])
        name = file.as_uri() if file.is_absolute() else file.as_posix()
        scale = {"scale": _numbers_text([keys["scale"]] * 3)} if "scale" in keys else {}
        SubElement(geometry, "mesh", {"filename": name, **scale})
    else:
        size = {"size": _numbers_text(keys["size"])} if "size" in keys else {}
        lengths = {key: repr(float(keys[key])) for key in ("radius", "length") if key in keys}
        SubElement(geometry, shape_type, {**size, **lengths})
    if "color" in keys:
        colour_parts = (int(keys["color"][k : k + 2], 16) / 255 for k in (1, 3, 5))
        material = SubElement(one, "material", name=keys["color"])
        SubElement(material, "color", rgba=_numbers_text([*colour_parts, 1.0]))


def _add_joint(root: ElementTree.Element, joint: Joint, mimic: Mimic | None) -> None:
    joint_type, law = JOINT_TYPES_BY_HINGE[joint.type], joint.keys.get("law", {})
    limits = joint.keys.get("rated", {})
    range_keys = {"lower", "upper"} & limits.keys()
    urdf_type = joint_type.joint
    if range_keys:
        urdf_type = LIMITED_TYPES.get(urdf_type, urdf_type)
    element = SubElement(root, "joint", name=joint.name, type=urdf_type)
    _add_origin(element, joint.pose)
    SubElement(element, "parent", link=joint.parent)
    SubElement(element, "child", link=joint.child)
    if joint_type.axis:
        SubElement(element, "axis", xyz=_numbers_text(joint.keys[joint_type.axis]))
    if joint_type.unit and (limits or urdf_type not in LIMITED_TYPES):
        _add_limit(element, limits, urdf_type not in LIMITED_TYPES)
    if law.get("damping") or law.get("friction"):
        friction = law.get("friction", {}).get("coulomb", 0.0)
        dynamics = {"damping": law.get("damping", 0.0), "friction": friction}
        SubElement(element, "dynamics", {key: repr(float(x)) for key, x in dynamics.items() if x})
    if mimic is not None:
        numbers = {"multiplier": repr(mimic.multiplier), "offset": repr(mimic.offset)}
        SubElement(element, "mimic", {"joint": mimic.leader, **numbers})


def _add_limit(one: ElementTree.Element, limits: Mapping[str, float], has_ends: bool) -> None:
    """Add <limit> with the range if there is one, and the attributes that readers require."""
    required_limits = {"effort": NO_LIMIT, "velocity": NO_LIMIT}
    if has_ends:
        required_limits = {"lower": -NO_LIMIT, "upper": NO_LIMIT, **required_limits}
    numbers = {key: repr(float(limits.get(key, number))) for key, number in required_limits.items()}
    SubElement(one, "limit", numbers)
