"""Unit conversion of robots, and notes where sizes suggest other units than m and kg."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from statistics import median
from typing import Any, NamedTuple

from ...errors import SceneError
from ...ir.hinge_properties import builtin_hinges
from ...numerics.rotations import Matrix, Pose, Vector
from .robot_model import ImportNote, Joint, Link, LinkTree, Mimic, Robot, Visual

#: Quantity -> unit -> its size in m or kg.
UNIT_SIZES = {
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254},
    "mass": {"kg": 1.0, "g": 1e-3, "t": 1e3, "lb": 0.45359237},
}
#: Largest plausible reach of a robot, m.
_MAX_REACH = 100.0
#: Plausible mass over the cube of the radius of gyration (kg/m^3): a solid ball has about 9 times
#: its density, thin parts more.
_MIN_MASS_RATIO, _MAX_MASS_RATIO = 1e-1, 1e6
#: Plausible radii of gyration relative to the reach.
_MIN_GYRATION_RATIO, _MAX_GYRATION_RATIO = 1e-4, 10.0


class Units(NamedTuple):
    """Size of the units of a file in m and kg."""

    length: float = 1.0
    mass: float = 1.0

    @classmethod
    def from_names(cls, given: Mapping[str, str] | None) -> Units:
        """Create from names such as {"length": "mm", "mass": "g"}; the default is m and kg.

        Raises SceneError.
        """
        if given is None:
            return cls()
        if not isinstance(given, Mapping) or set(given) - set(UNIT_SIZES):
            raise SceneError(f'units: expected {{"length": ..., "mass": ...}}, found {given!r:.60}')
        for key, unit in given.items():
            if not isinstance(unit, str) or unit not in UNIT_SIZES[key]:
                known_units = ", ".join(UNIT_SIZES[key])
                raise SceneError(f"units: {key}: expected one of {known_units}, found {unit!r:.40}")
        return cls(**{key: UNIT_SIZES[key][unit] for key, unit in given.items()})

    def law_factor(self, power: float) -> float:
        """Factor of effort over speed (or acceleration), for speeds with `power` lengths."""
        return self.mass * self.length ** (2 - 2 * power)


def convert_units(robot: Robot, units: Units, gravity: bool) -> Robot:
    """Convert a robot to m and kg; `gravity` is whether its gravity comes from the file."""
    if units == Units():
        return robot
    lengths = {
        joint.name: units.length for joint in robot.joints
        if [coordinate.unit for coordinate in builtin_hinges()[joint.type].coordinates] == ["m"]
    }  # fmt: skip
    return replace(
        robot,
        links=tuple(_convert_link(link, units) for link in robot.links),
        joints=tuple(_convert_joint(joint, units) for joint in robot.joints),
        mimics=tuple(_convert_mimic(mimic, lengths) for mimic in robot.mimics),
        visuals=tuple(_convert_visual(visual, units.length) for visual in robot.visuals),
        gravity=_scale_vector(robot.gravity, units.length) if gravity else robot.gravity,
    )


def _convert_link(link: Link, units: Units) -> Link:
    factor = units.mass * units.length**2
    a, b, c = link.inertia
    inertia: Matrix = (_scale_vector(a, factor), _scale_vector(b, factor), _scale_vector(c, factor))
    center = _scale_vector(link.center, units.length)
    return replace(link, mass=link.mass * units.mass, center=center, inertia=inertia)


def _convert_joint(joint: Joint, units: Units) -> Joint:
    keys, facts = dict(joint.keys), builtin_hinges()[joint.type]
    if law := keys.get("law"):
        powers = tuple(int(speed.unit == "m/s") for speed in facts.speeds)
        keys["law"] = {key: _convert_law_entry(key, x, powers, units) for key, x in law.items()}
    if "rated" in keys:
        length_factor = units.length ** int(facts.speeds[0].unit == "m/s")
        effort = units.mass * units.length**2 / length_factor
        keys["rated"] = {
            key: x * (effort if key == "effort" else length_factor)
            for key, x in keys["rated"].items()
        }
    if "initial" in keys:
        values = zip(keys["initial"]["q"], facts.coordinates, strict=True)
        q = [x * (units.length if coordinate.unit == "m" else 1.0) for x, coordinate in values]
        keys["initial"] = {"q": q}
    return replace(joint, pose=_convert_pose(joint.pose, units.length), keys=keys)


def _convert_law_entry(key: str, given: Any, powers: tuple[int, ...], units: Units) -> Any:
    """Convert an entry of a law: a number, a table, or a list of these by speed."""
    if isinstance(given, list):
        speed_powers = powers if len(powers) == len(given) else powers[:1] * len(given)
        pairs = zip(given, speed_powers, strict=True)
        return [_convert_law_entry(key, entry, (power,), units) for entry, power in pairs]
    power = powers[0]
    if isinstance(given, Mapping):
        length_factor = units.length**power
        factor = length_factor if key == "limits" else units.mass * units.length**2 / length_factor
        return {name: x * factor for name, x in given.items()}
    return given * (units.length**power if key == "rest" else units.law_factor(power))


def _convert_mimic(mimic: Mimic, lengths: Mapping[str, float]) -> Mimic:
    """Convert a mimic relation; `lengths` are the factors of joints whose value is a length."""
    own, other = lengths.get(mimic.follower, 1.0), lengths.get(mimic.leader, 1.0)
    return replace(mimic, multiplier=mimic.multiplier * own / other, offset=mimic.offset * own)


def _convert_visual(look: Visual, length: float) -> Visual:
    keys = dict(look.keys)
    if keys["type"] == "mesh":
        keys["scale"] = keys.get("scale", 1.0) * length
    for key in ("radius", "length"):
        if key in keys:
            keys[key] *= length
    if "size" in keys:
        keys["size"] = [x * length for x in keys["size"]]
    return replace(look, pose=_convert_pose(look.pose, length), keys=keys)


def _convert_pose(pose: Pose, length: float) -> Pose:
    return Pose(_scale_vector(pose.position, length), pose.rotation)


def _scale_vector(given: Vector, factor: float) -> Vector:
    x, y, z = given
    return (x * factor, y * factor, z * factor)


def unit_notes(robot: Robot, tree: LinkTree) -> Iterator[ImportNote]:
    """Notes about sizes of a robot that suggest other units than m and kg."""
    reach = _largest_reach(tree)
    masses_and_radii = [
        (link.mass, math.sqrt(trace / (2 * link.mass))) for link in robot.links
        if link.mass > 0 and (trace := sum(link.inertia[i][i] for i in range(3))) > 0
    ]  # fmt: skip
    evidence = list[str]()
    if reach > _MAX_REACH:
        evidence.append(f"a reach of {reach:.3g} m")
    if masses_and_radii:
        typical_radius = median(radius for _, radius in masses_and_radii)
        mass_ratio = median(mass / radius**3 for mass, radius in masses_and_radii)
        if reach > 0 and not _MIN_GYRATION_RATIO < typical_radius / reach < _MAX_GYRATION_RATIO:
            radii = f"radii of gyration of {typical_radius:.3g} m"
            evidence.append(f"{radii} with a reach of {reach:.3g} m")
        if not _MIN_MASS_RATIO < mass_ratio < _MAX_MASS_RATIO:
            evidence.append(f"mass over radius of gyration cubed of {mass_ratio:.3g} kg/m^3")
    if evidence:
        text = f"probably not m and kg: {'; '.join(evidence)}; convert them with `units`"
        yield ImportNote(robot.where, "units", text)


def _largest_reach(tree: LinkTree) -> float:
    """Longest path (m) from a root along the joints to a mass centre."""
    path_lengths, longest = dict[str, float](), 0.0
    for link in tree.outward:
        joint = tree.holder.get(link.name)
        length = 0.0
        if joint is not None:
            length = path_lengths[joint.parent] + math.hypot(*joint.pose.position)
        path_lengths[link.name] = length
        longest = max(longest, length + (math.hypot(*link.center) if link.mass > 0 else 0.0))
    return longest
