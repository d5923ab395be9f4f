"""The built-in hinges: names and units of their coordinates and speeds, and the keys they use."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Coordinate:
    """One entry of q or u: its name within the hinge and its SI unit."""

    name: str
    unit: str


@dataclass(frozen=True)
class HingeType:
    """One built-in hinge type.

    `quaternion` is the place in q of its first quaternion entry (w), None where there is none.
    `keys` are the scene keys, besides the common ones, that this type reads.
    """

    name: str
    title: str
    coordinates: tuple[Coordinate, ...]
    speeds: tuple[Coordinate, ...]
    keys: tuple[str, ...] = ()
    quaternion: int | None = None

    @property
    def start(self) -> tuple[float, ...]:
        """The default q: zero, with the quaternion of no rotation."""
        return tuple(1.0 if i == self.quaternion else 0.0 for i in range(len(self.coordinates)))


def effort_unit(speed_unit: str) -> str:
    """Unit of the effort that does work on a speed: N for m/s, N*m for rad/s."""
    return {"m/s": "N", "rad/s": "N*m", "1/s": "J"}.get(speed_unit, f"W/({speed_unit or '1'})")


def _rates(coordinates: tuple[Coordinate, ...]) -> tuple[Coordinate, ...]:
    return tuple(Coordinate(f"{c.name}_rate", f"{c.unit}/s") for c in coordinates)


def _simple(name: str, title: str, coordinates: dict[str, str], *keys: str) -> HingeType:
    """A hinge whose speeds are the rates of its coordinates."""
    entries = tuple(Coordinate(n, unit) for n, unit in coordinates.items())
    return HingeType(name, title, entries, _rates(entries), keys)


_POSITION = (Coordinate("x", "m"), Coordinate("y", "m"), Coordinate("z", "m"))
_QUATERNION = tuple(Coordinate(n, "") for n in "wxyz")
_POSE = _POSITION + tuple(Coordinate(f"q{n}", "") for n in "wxyz")
_LINEAR = tuple(Coordinate(n, "m/s") for n in ("vx", "vy", "vz"))
_ANGULAR = tuple(Coordinate(n, "rad/s") for n in ("wx", "wy", "wz"))

#: Hinge types by name, in the order in which they are listed to users.
HINGE_TYPES: dict[str, HingeType] = {
    hinge.name: hinge
    for hinge in (
        _simple("fixed", "rigid connection", {}),
        _simple("pin", "rotation about one axis", {"angle": "rad"}, "axis"),
        _simple("prismatic", "translation along one axis", {"displacement": "m"}, "axis"),
        _simple("screw", "rotation with translation along its axis", {"angle": "rad"},
                "axis", "lead"),
        _simple("cylindrical", "rotation and translation along one axis",
                {"displacement": "m", "angle": "rad"}, "axis"),
        _simple("universal", "rotation about two axes in turn", {"angle1": "rad", "angle2": "rad"},
                "axis", "axis2"),
        HingeType("ball", "free rotation", _QUATERNION, _ANGULAR, ("axis",), 0),
        _simple("planar", "translation in a plane and rotation about its normal",
                {"x": "m", "y": "m", "angle": "rad"}, "axis", "axis2"),
        HingeType("free", "six degrees of freedom", _POSE, _LINEAR + _ANGULAR,
                  ("axis",), 3),
        _simple("gimbal", "three angles, R = Rz(angle3) Ry(angle2) Rx(angle1)",
                {"angle1": "rad", "angle2": "rad", "angle3": "rad"}),
        HingeType("elastic", "spring and damper in six directions", _POSE,
                  _LINEAR + _ANGULAR, ("axis",), 3),
    )
}  # fmt: skip
