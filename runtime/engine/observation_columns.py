"""Columns of an observation by quantity name, with units and labels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class QuantityKind:
    """Vector quantity of a body or hinge: unit, long name, column labels and short names."""

    unit: str
    long_name: str
    labels: tuple[str, ...]
    short: tuple[str, ...]


XYZ, WXYZ = ("x", "y", "z"), ("w", "x", "y", "z")


#: Quantities of a body or an end, in the order of `Observation.points`.
BODY_QUANTITIES = {
    "position": QuantityKind("m", "position", XYZ, XYZ),
    "velocity": QuantityKind("m/s", "velocity", XYZ, ("vx", "vy", "vz")),
    "acceleration": QuantityKind("m/s2", "acceleration", XYZ, ("ax", "ay", "az")),
    "orientation": QuantityKind(
        "", "quaternion, body to inertial axes", WXYZ, ("qw", "qx", "qy", "qz")
    ),
    "angular_velocity": QuantityKind("rad/s", "angular velocity", XYZ, ("wx", "wy", "wz")),
    "angular_acceleration": QuantityKind(
        "rad/s2", "angular acceleration", XYZ, ("alphax", "alphay", "alphaz")
    ),
}

#: Loads that the inboard side of a hinge exerts on the outboard side.
HINGE_QUANTITIES = {
    "force": QuantityKind(
        "N", "force of the inboard on the outboard side", XYZ, ("fx", "fy", "fz")
    ),
    "moment": QuantityKind(
        "N*m", "moment of the inboard on the outboard side at P", XYZ, ("mx", "my", "mz")
    ),
}

#: Sums over the scene: unit, long name, columns of `Observation.sums`.
SUMS: dict[str, tuple[str, str, slice]] = {
    "energy": ("J", "total energy", slice(0, 3)),
    "energy.kinetic": ("J", "kinetic energy", slice(0, 1)),
    "energy.gravity": ("J", "potential energy of gravity", slice(1, 2)),
    "energy.springs": ("J", "energy of springs and of deformed bodies", slice(2, 3)),
    "power": ("W", "power of all non-conservative efforts", slice(3, 4)),
    "momentum": ("kg*m/s", "linear momentum", slice(4, 7)),
    "angular_momentum": ("kg*m2/s", "angular momentum about the inertial origin", slice(7, 10)),
}

#: Columns of `Observation.points`.
POINT_COLUMNS = {
    "position": slice(0, 3), "velocity": slice(3, 6), "acceleration": slice(6, 9),
    "angular_velocity": slice(9, 12), "angular_acceleration": slice(12, 15),
}  # fmt: skip


def effort_names(speeds: Sequence[str]) -> list[str]:
    """Names of the efforts of a hinge: effort for one speed, else effort_wx and so on."""
    if len(speeds) == 1:
        return ["effort"]
    return [f"effort_{name.removesuffix('_rate')}" for name in speeds]


def acceleration_name(speed: str) -> str:
    """Name of the derivative of a speed: angle_rate -> angle_acceleration, vx -> vx_dot."""
    stem = speed.removesuffix("_rate")
    return f"{stem}_acceleration" if stem != speed else f"{speed}_dot"


def rate_unit(unit: str) -> str:
    """Unit of the time derivative of a quantity: m/s -> m/s2."""
    return f"{unit}2" if unit.endswith("/s") else f"{unit or '1'}/s"
