"""Scenes whose linear motion is known in closed form, or has been published."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mstmm.scene import Scene

#: A beam of length, mass per length and stiffness 1.
UNIT = {"length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 1.0}


def pendulum(angle: float = 0.0, **of_hinge: Any) -> Scene:
    """A point mass of 2 kg with 0.03 kg m2, 0.5 m below a pin about z; y is up."""
    return Scene(
        gravity=(0, -9.81, 0),
        body=[{"name": "bob", "mass": 2.0, "center_of_mass": [0, -0.5, 0],
               "inertia": [0.01, 0.02, 0.03], "ends": {"tip": [0, -1, 0]}}],
        hinge=[{"name": "pivot", "type": "pin", "inboard": "ground", "outboard": "bob",
                "axis": [0, 0, 1], "initial": {"q": [angle]}, **of_hinge}],
    )  # fmt: skip


def masses(count: int, mass: float, stiffness: float) -> Scene:
    """Masses in a row on springs, the first one to the ground."""
    body = {
        "mass": mass,
        "center_of_mass": [0, 0, 0],
        "inertia": [1, 1, 1],
        "ends": {"on": [0, 0, 0]},
    }
    hinge = {"type": "prismatic", "axis": [1, 0, 0], "law": {"stiffness": stiffness}}
    return Scene(
        gravity=(0, 0, 0),
        chain=[{"name": "row", "count": count, "inboard": "ground", "body": body, "hinge": hinge,
                "end": "on"}],
    )  # fmt: skip


def hanging(count: int, length: float = 1.0) -> Scene:
    """Thin rods that hang on pins in a row, 1 kg together."""
    rod = length / count
    across = rod**2 / count / 12
    body = {"mass": 1 / count, "center_of_mass": [0, -rod / 2, 0],
            "inertia": [across, across / 100, across], "ends": {"tip": [0, -rod, 0]}}  # fmt: skip
    return Scene(
        gravity=(0, -9.81, 0),
        chain=[{"name": "rope", "count": count, "inboard": "ground", "body": body,
                "hinge": {"type": "pin", "axis": [0, 0, 1]}, "end": "tip"}],
    )  # fmt: skip


def beads(count: int, spacing: float = 0.2) -> Scene:
    """Point masses of 1 kg in a row on rods without mass that hang on pins."""
    body = {"mass": 1.0, "center_of_mass": [0, -spacing, 0], "ends": {"on": [0, -spacing, 0]}}
    return Scene(
        gravity=(0, -9.81, 0),
        chain=[{"name": "string", "count": count, "inboard": "ground", "body": body,
                "hinge": {"type": "pin", "axis": [0, 0, 1]}, "end": "on"}],
    )  # fmt: skip


def column(load: float, axes: str, shapes: int) -> Scene:
    """A clamped beam under a compressing load at its tip."""
    return Scene(
        gravity=(0, 0, 0), beam=[{"name": "column", **UNIT, "modes": {"y": shapes}}],
        hinge=[{"name": "foot", "type": "fixed", "inboard": "ground", "outboard": "column"}],
        load=[{"on": "column.tip", "force": [-load, 0, 0], "axes": axes}],
    )  # fmt: skip


def hanging_beam(stiffness: float, shapes: int = 8) -> Scene:
    """A beam of length and mass 1 that hangs on a pin, along x."""
    beam = {"name": "beam", **UNIT, "bending_stiffness": stiffness, "basis": "clamped-free",
            "modes": {"y": shapes}}  # fmt: skip
    return Scene(
        gravity=(9.81, 0, 0), beam=[beam],
        hinge=[{"name": "pin", "type": "pin", "axis": [0, 0, 1], "inboard": "ground",
                "outboard": "beam"}],
    )  # fmt: skip


def rotor_blade(spin: float, hub: float = 0.0, shapes: int = 8) -> Scene:
    """A beam clamped to an axis that turns with `spin`, at a distance `hub` from it."""
    turning = {"type": "pin", "axis": [0, 0, 1], "inboard": "ground", "drive": f"{spin}*t"}
    rim = {"name": "rim", "mass": 1.0, "inertia": [1, 1, 1], "ends": {"blade": [hub, 0, 0]}}
    return Scene(
        gravity=(0, 0, 0), body=[rim],
        beam=[{"name": "blade", **UNIT, "modes": {"y": shapes, "z": shapes}}],
        hinge=[{"name": "axis", "outboard": "rim", **turning},
               {"name": "root", "type": "fixed", "inboard": "rim.blade", "outboard": "blade"}],
    )  # fmt: skip


def top(spin: float, height: float = 0.1) -> tuple[Scene, Sequence[float], Sequence[float]]:
    """A symmetric top that sleeps upright on its point, with its state."""
    scene = Scene(
        gravity=(0, 0, -9.81),
        body=[{"name": "top", "mass": 1.0, "center_of_mass": [0, 0, height],
               "inertia": [0.002, 0.002, 0.004]}],
        hinge=[{"name": "point", "type": "ball", "inboard": "ground", "outboard": "top"}],
    )  # fmt: skip
    return scene, [1, 0, 0, 0], [0, 0, spin]
