"""Writer of URDF files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from ...numerics.pose import IDENTITY_POSE, Pose
from ...numerics.rotations import to_rpy
from .robot_model import ZERO_MATRIX, Joint, Link, Mimic, Robot, Visual
from .urdf_reader import JOINT_TYPES_BY_HINGE, LIMITED_TYPES, NO_LIMIT


def as_urdf(robot: Robot) -> str:
    """Convert a robot to URDF text: links, then joints."""
    root = Element("robot", name=robot.name)
    visuals_by_link: dict[str, list[Visual]] = {}
    for visual in robot.visuals:
        visuals_by_link.setdefault(visual.link, []).append(visual)
    for link in robot.links:
        _fill_link(
            SubElement(root, "link", name=link.name), link, visuals_by_link.get(link.name, ())
        )
    mimics = {mimic.follower: mimic for mimic in robot.mimics}
    for joint in robot.joints:
        _add_joint(root, joint, mimics.get(joint.name))
    indent(root)
    return '<?xml version="1.0"?>\n' + tostring(root, encoding="unicode") + "\n"


def _numbers_text(values: Iterable[float]) -> str:
    return " ".join(repr(float(x)) for x in values)


def _add_origin(parent: Element, pose: Pose) -> None:
    if pose == IDENTITY_POSE:
        return
    SubElement(
        parent, "origin", xyz=_numbers_text(pose.position), rpy=_numbers_text(to_rpy(pose.rotation))
    )


def _fill_link(one: Element, link: Link, looks: Iterable[Visual]) -> None:
    if link.mass or link.inertia != ZERO_MATRIX:
        inertial = SubElement(one, "inertial")
        _add_origin(inertial, Pose(link.center))
        SubElement(inertial, "mass", value=repr(float(link.mass)))
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = link.inertia
        entries = {"ixx": xx, "ixy": xy, "ixz": xz, "iyy": yy, "iyz": yz, "izz": zz}
        SubElement(inertial, "inertia", {key: repr(float(x)) for key, x in entries.items()})
    for visual in looks:
        _fill_visual(SubElement(one, "visual"), visual)


def _fill_visual(one: Element, look: Visual) -> None:
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


def _add_joint(root: Element, joint: Joint, mimic: Mimic | None) -> None:
    joint_type, law = JOINT_TYPES_BY_HINGE[joint.type], joint.keys.get("law", {})
    limits = joint.keys.get("rated", {})
    range_keys = {"lower", "upper"} & limits.keys()
    urdf_type = (
        LIMITED_TYPES.get(joint_type.joint, joint_type.joint) if range_keys else joint_type.joint
    )
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


def _add_limit(one: Element, limits: Mapping[str, float], has_ends: bool) -> None:
    """Add <limit> with the range if there is one, and the attributes that readers require."""
    required_limits = {"effort": NO_LIMIT, "velocity": NO_LIMIT}
    if has_ends:
        required_limits = {"lower": -NO_LIMIT, "upper": NO_LIMIT, **required_limits}
    numbers = {key: repr(float(limits.get(key, number))) for key, number in required_limits.items()}
    SubElement(one, "limit", numbers)
