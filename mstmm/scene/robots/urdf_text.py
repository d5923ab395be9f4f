"""Writer of URDF files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from ...numbers.pose import IN_PLACE, Pose
from ...numbers.rotations import to_rpy
from .robot import NOTHING, Joint, Link, Look, Mimic, Robot
from .urdf import BY_HINGE, LIMITED, NO_LIMIT


def as_urdf(robot: Robot) -> str:
    """Convert a robot to URDF text: links, then joints."""
    root = Element("robot", name=robot.name)
    looks: dict[str, list[Look]] = {}
    for look in robot.looks:
        looks.setdefault(look.link, []).append(look)
    for link in robot.links:
        _link(SubElement(root, "link", name=link.name), link, looks.get(link.name, ()))
    mimics = {mimic.of: mimic for mimic in robot.mimics}
    for joint in robot.joints:
        _joint(root, joint, mimics.get(joint.name))
    indent(root)
    return '<?xml version="1.0"?>\n' + tostring(root, encoding="unicode") + "\n"


def _numbers(values: Iterable[float]) -> str:
    return " ".join(repr(float(x)) for x in values)


def _origin(parent: Element, pose: Pose) -> None:
    if pose == IN_PLACE:
        return
    SubElement(parent, "origin", xyz=_numbers(pose.position), rpy=_numbers(to_rpy(pose.rotation)))


def _link(one: Element, link: Link, looks: Iterable[Look]) -> None:
    if link.mass or link.inertia != NOTHING:
        inertial = SubElement(one, "inertial")
        _origin(inertial, Pose(link.center))
        SubElement(inertial, "mass", value=repr(float(link.mass)))
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = link.inertia
        entries = {"ixx": xx, "ixy": xy, "ixz": xz, "iyy": yy, "iyz": yz, "izz": zz}
        SubElement(inertial, "inertia", {key: repr(float(x)) for key, x in entries.items()})
    for look in looks:
        _visual(SubElement(one, "visual"), look)


def _visual(one: Element, look: Look) -> None:
    _origin(one, look.pose)
    keys, geometry = look.keys, SubElement(one, "geometry")
    kind = keys["type"]
    if kind == "mesh":
        file = Path(keys["file"])
        name = file.as_uri() if file.is_absolute() else file.as_posix()
        scale = {"scale": _numbers([keys["scale"]] * 3)} if "scale" in keys else {}
        SubElement(geometry, "mesh", {"filename": name, **scale})
    else:
        size = {"size": _numbers(keys["size"])} if "size" in keys else {}
        lengths = {key: repr(float(keys[key])) for key in ("radius", "length") if key in keys}
        SubElement(geometry, kind, {**size, **lengths})
    if "color" in keys:
        parts = (int(keys["color"][k : k + 2], 16) / 255 for k in (1, 3, 5))
        material = SubElement(one, "material", name=keys["color"])
        SubElement(material, "color", rgba=_numbers([*parts, 1.0]))


def _joint(root: Element, joint: Joint, mimic: Mimic | None) -> None:
    kind, law = BY_HINGE[joint.type], joint.keys.get("law", {})
    limits = joint.keys.get("rated", {})
    ends = {"lower", "upper"} & limits.keys()
    type_ = LIMITED.get(kind.joint, kind.joint) if ends else kind.joint
    one = SubElement(root, "joint", name=joint.name, type=type_)
    _origin(one, joint.pose)
    SubElement(one, "parent", link=joint.parent)
    SubElement(one, "child", link=joint.child)
    if kind.axis:
        SubElement(one, "axis", xyz=_numbers(joint.keys[kind.axis]))
    if kind.unit and (limits or type_ not in LIMITED):
        _limit(one, limits, type_ not in LIMITED)
    if law.get("damping") or law.get("friction"):
        friction = law.get("friction", {}).get("coulomb", 0.0)
        given = {"damping": law.get("damping", 0.0), "friction": friction}
        SubElement(one, "dynamics", {key: repr(float(x)) for key, x in given.items() if x})
    if mimic is not None:
        numbers = {"multiplier": repr(mimic.multiplier), "offset": repr(mimic.offset)}
        SubElement(one, "mimic", {"joint": mimic.other, **numbers})


def _limit(one: Element, limits: Mapping[str, float], has_ends: bool) -> None:
    """Add <limit> with the range if there is one, and the attributes that readers require."""
    wanted = {"effort": NO_LIMIT, "velocity": NO_LIMIT}
    if has_ends:
        wanted = {"lower": -NO_LIMIT, "upper": NO_LIMIT, **wanted}
    numbers = {key: repr(float(limits.get(key, number))) for key, number in wanted.items()}
    SubElement(one, "limit", numbers)
