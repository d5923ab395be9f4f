"""Unit conversion of robots, and notes where sizes suggest other units than m and kg."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from statistics import median
from typing import Any, NamedTuple

from ...errors import SceneError
from ...ir.facts import builtin_hinges
from ...numbers.pose import Pose
from ...numbers.rotations import Matrix, Vector
from .robot import Joint, Link, Look, Mimic, Note, Robot
from .tree import Tree

#: Quantity -> unit -> its size in m or kg.
UNITS = {
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254},
    "mass": {"kg": 1.0, "g": 1e-3, "t": 1e3, "lb": 0.45359237},
}
#: Largest plausible reach of a robot, m.
_FAR = 100.0
#: Plausible mass over the cube of the radius of gyration (kg/m^3): a solid ball has about 9 times
#: its density, thin parts more.
_LIGHTEST, _HEAVIEST = 1e-1, 1e6
#: Plausible radii of gyration relative to the reach.
_SMALLEST, _LARGEST = 1e-4, 10.0


class Units(NamedTuple):
    """Size of the units of a file in m and kg."""

    length: float = 1.0
    mass: float = 1.0

    @classmethod
    def named(cls, given: Mapping[str, str] | None) -> Units:
        """Create from names such as {"length": "mm", "mass": "g"}; the default is m and kg.

        Raises SceneError.
        """
        if given is None:
            return cls()
        if not isinstance(given, Mapping) or set(given) - set(UNITS):
            raise SceneError(f'units: expected {{"length": ..., "mass": ...}}, found {given!r:.60}')
        for key, unit in given.items():
            if not isinstance(unit, str) or unit not in UNITS[key]:
                known = ", ".join(UNITS[key])
                raise SceneError(f"units: {key}: expected one of {known}, found {unit!r:.40}")
        return cls(**{key: UNITS[key][unit] for key, unit in given.items()})

    def of_law(self, power: float) -> float:
        """Factor of effort over speed (or acceleration), for speeds with `power` lengths."""
        return self.mass * self.length ** (2 - 2 * power)


def scaled(robot: Robot, units: Units, gravity: bool) -> Robot:
    """Convert a robot to m and kg; `gravity` is whether its gravity comes from the file."""
    if units == Units():
        return robot
    lengths = {
        joint.name: units.length for joint in robot.joints
        if [place.unit for place in builtin_hinges()[joint.type].coordinates] == ["m"]
    }  # fmt: skip
    return replace(
        robot,
        links=tuple(_link(link, units) for link in robot.links),
        joints=tuple(_joint(joint, units) for joint in robot.joints),
        mimics=tuple(_mimic(mimic, lengths) for mimic in robot.mimics),
        looks=tuple(_look(look, units.length) for look in robot.looks),
        gravity=_times(robot.gravity, units.length) if gravity else robot.gravity,
    )


def _link(link: Link, units: Units) -> Link:
    factor = units.mass * units.length**2
    a, b, c = link.inertia
    inertia: Matrix = (_times(a, factor), _times(b, factor), _times(c, factor))
    center = _times(link.center, units.length)
    return replace(link, mass=link.mass * units.mass, center=center, inertia=inertia)


def _joint(joint: Joint, units: Units) -> Joint:
    keys, facts = dict(joint.keys), builtin_hinges()[joint.type]
    if law := keys.get("law"):
        powers = tuple(int(speed.unit == "m/s") for speed in facts.speeds)
        keys["law"] = {key: _term(key, given, powers, units) for key, given in law.items()}
    if "rated" in keys:
        own = units.length ** int(facts.speeds[0].unit == "m/s")
        effort = units.mass * units.length**2 / own
        keys["rated"] = {
            key: x * (effort if key == "effort" else own) for key, x in keys["rated"].items()
        }
    if "initial" in keys:
        values = zip(keys["initial"]["q"], facts.coordinates, strict=True)
        q = [x * (units.length if place.unit == "m" else 1.0) for x, place in values]
        keys["initial"] = {"q": q}
    return replace(joint, pose=_pose(joint.pose, units.length), keys=keys)


def _term(key: str, given: Any, powers: tuple[int, ...], units: Units) -> Any:
    """Convert an entry of a law: a number, a table, or a list of these by speed."""
    if isinstance(given, list):
        each = powers if len(powers) == len(given) else powers[:1] * len(given)
        return [_term(key, one, (power,), units) for one, power in zip(given, each, strict=True)]
    power = powers[0]
    if isinstance(given, Mapping):
        own = units.length**power
        factor = own if key == "limits" else units.mass * units.length**2 / own
        return {name: x * factor for name, x in given.items()}
    return given * (units.length**power if key == "rest" else units.of_law(power))


def _mimic(mimic: Mimic, lengths: Mapping[str, float]) -> Mimic:
    """Convert a mimic relation; `lengths` are the factors of joints whose value is a length."""
    own, other = lengths.get(mimic.of, 1.0), lengths.get(mimic.other, 1.0)
    return replace(mimic, multiplier=mimic.multiplier * own / other, offset=mimic.offset * own)


def _look(look: Look, length: float) -> Look:
    keys = dict(look.keys)
    if keys["type"] == "mesh":
        keys["scale"] = keys.get("scale", 1.0) * length
    for key in ("radius", "length"):
        if key in keys:
            keys[key] *= length
    if "size" in keys:
        keys["size"] = [x * length for x in keys["size"]]
    return replace(look, pose=_pose(look.pose, length), keys=keys)


def _pose(pose: Pose, length: float) -> Pose:
    return Pose(_times(pose.position, length), pose.rotation)


def _times(given: Vector, factor: float) -> Vector:
    x, y, z = given
    return (x * factor, y * factor, z * factor)


def doubts(robot: Robot, tree: Tree) -> Iterator[Note]:
    """Notes about sizes of a robot that suggest other units than m and kg."""
    reach = _reach(tree)
    found = [
        (link.mass, math.sqrt(trace / (2 * link.mass))) for link in robot.links
        if link.mass > 0 and (trace := sum(link.inertia[i][i] for i in range(3))) > 0
    ]  # fmt: skip
    signs = list[str]()
    if reach > _FAR:
        signs.append(f"a reach of {reach:.3g} m")
    if found:
        size = median(radius for _, radius in found)
        dense = median(mass / radius**3 for mass, radius in found)
        if reach > 0 and not _SMALLEST < size / reach < _LARGEST:
            signs.append(f"radii of gyration of {size:.3g} m with a reach of {reach:.3g} m")
        if not _LIGHTEST < dense < _HEAVIEST:
            signs.append(f"mass over radius of gyration cubed of {dense:.3g} kg/m^3")
    if signs:
        text = f"probably not m and kg: {'; '.join(signs)}; convert them with `units`"
        yield Note(robot.where, "units", text)


def _reach(tree: Tree) -> float:
    """Longest path (m) from a root along the joints to a mass centre."""
    ways, longest = dict[str, float](), 0.0
    for link in tree.outward:
        joint = tree.holder.get(link.name)
        before = 0.0 if joint is None else ways[joint.parent] + math.hypot(*joint.pose.position)
        ways[link.name] = before
        longest = max(longest, before + (math.hypot(*link.center) if link.mass > 0 else 0.0))
    return longest
