"""Stiff motions as scene dictionaries, for any size and stiffness; every number with its unit.

Planar scenes lie in x-y, gravity along -y.  `zeta` is a damping ratio: of bushings relative to one
rod on one of them (1 is critical), of beams that of every shape.
"""

from __future__ import annotations

import math
from typing import Any

Scene = dict[str, Any]

GRAVITY = [0.0, -9.81, 0.0]  # m/s2
LENGTH, MASS = 1.0, 1.0  # m, kg, of every rod
ROD = [1e-3, 1 / 12, 1 / 12]  # kg m2, about the mass centre


def _scene(bodies: list[Scene], hinges: list[Scene], **more: Any) -> Scene:
    return {"schema_version": 1, "gravity": GRAVITY, "body": bodies, "hinge": hinges, **more}


def _rod(name: str) -> Scene:
    """A uniform rod along x."""
    return {
        "name": name, "mass": MASS, "center_of_mass": [LENGTH / 2, 0.0, 0.0], "inertia": ROD,
        "ends": {"tip": [LENGTH, 0.0, 0.0]},
    }  # fmt: skip


def _row(count: int, hinge: Scene) -> Scene:
    """Rods in a row along x from the ground, the same hinge inboard of each."""
    hinges = [
        {
            "name": f"hinge{i}", "inboard": f"rod{i - 1}.tip" if i else "ground",
            "outboard": f"rod{i}", **hinge,
        }
        for i in range(count)
    ]  # fmt: skip
    return _scene([_rod(f"rod{i}") for i in range(count)], hinges)


def bushed_rods(count: int, k: float, zeta: float) -> Scene:
    """Rods in a row on bushings (k in N/m along x and y, free to turn), slack and at rest."""
    c = 2 * zeta * math.sqrt(k * MASS)  # N s/m
    law = {"stiffness": [k, k, 0.0], "damping": [c, c, 0.0]}
    return _row(count, {"type": "planar", "law": law})


def damped_rods(count: int, c: float) -> Scene:
    """Rods in a row on pins with dampers (c in N m s/rad), at rest."""
    return _row(count, {"type": "pin", "law": {"damping": c}})


def falling_beam(shapes: int, stiffness: float, zeta: float) -> Scene:
    """A beam of 1 m and 1 kg/m on a pin, let go straight and horizontal; EI in N m2."""
    return _pinned_beam(1.0, 1.0, shapes, stiffness, zeta, GRAVITY, {})


def spun_beam(shapes: int, stiffness: float, zeta: float) -> Scene:
    """A beam of 10 m and 1.2 kg/m on a pin, without weight, turned to 3 rad/s within 6 s by a
    torque of up to 400 N m; EI in N m2."""
    law = {"effort": "where(t < 6, 200*(1 - cos(pi*t/3)), 0)"}
    return _pinned_beam(10.0, 1.2, shapes, stiffness, zeta, [0.0, 0.0, 0.0], law)


def _pinned_beam(
    length: float, density: float, shapes: int, stiffness: float, zeta: float,
    gravity: list[float], law: Scene,
) -> Scene:  # fmt: skip
    beam = {
        "name": "beam", "length": length, "mass_per_length": density,
        "bending_stiffness": stiffness, "modes": {"y": shapes}, "frame": "chord",
        "basis": "simply-supported", "stiffening": True, "damping": zeta,
    }  # fmt: skip
    pin = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "beam", "law": law}
    return {"schema_version": 1, "gravity": gravity, "beam": [beam], "hinge": [pin]}


def loaded_arm(friction: bool = True, stop: bool = True) -> Scene:
    """Three links in a vertical plane, the elbow a drive of 1e6 N m/rad with 1 % damping; friction
    smoothed over 1e-4 rad/s in shoulder and wrist, a stop of 1e7 N m/rad in the wrist."""
    lengths, masses = (0.5, 0.4, 0.2), (4.0, 2.0, 0.5)  # m, kg
    names = ("upper", "fore", "hand")
    bodies = [
        {
            "name": name, "mass": m, "center_of_mass": [length / 2, 0.0, 0.0],
            "inertia": [1e-3 * m * length**2, m * length**2 / 12, m * length**2 / 12],
            "ends": {"tip": [length, 0.0, 0.0]},
        }
        for name, length, m in zip(names, lengths, masses, strict=True)
    ]  # fmt: skip
    carried = 2.0 * 0.4**2 / 3 + 0.5 * (0.2**2 / 12 + 0.5**2)  # kg m2, stretched, about the elbow
    damping = 2 * 0.01 * math.sqrt(1e6 * carried)  # N m s/rad
    rubbing = {"regularisation_velocity": 1e-4, "stribeck_velocity": 0.05}
    laws: list[Scene] = [
        {"effort": "25*cos(4*t)"}, {"stiffness": 1e6, "damping": damping}, {},
    ]  # fmt: skip
    if friction:
        laws[0]["friction"] = {"coulomb": 3.0, "static": 4.0, **rubbing}  # N m
        laws[2]["friction"] = {"coulomb": 0.1, "static": 0.12, **rubbing}
    if stop:
        laws[2]["limits"] = {"lower": -1.0, "upper": 1.0, "stiffness": 1e7, "damping": 500.0}
    hinges = [
        {
            "name": joint, "type": "pin", "inboard": inboard, "outboard": name, "law": law,
            "initial": {"q": [angle]},
        }
        for joint, inboard, name, law, angle in zip(
            ("shoulder", "elbow", "wrist"), ("ground", "upper.tip", "fore.tip"), names, laws,
            (0.3, 0.0, 0.4), strict=True,
        )
    ]  # fmt: skip
    return _scene(bodies, hinges)


def rigid_arm() -> Scene:
    """Six links on pins about z, y, y, x, y, x, that fall from a bent start: not stiff at all."""
    lengths = (0.3, 0.5, 0.4, 0.2, 0.1, 0.08)  # m
    masses = (8.0, 6.0, 4.0, 1.5, 0.8, 0.4)  # kg
    angles = (0.2, -0.5, 1.0, 0.3, -0.8, 0.5)  # rad
    axes = ("z", "y", "y", "x", "y", "x")
    unit = {"x": [1.0, 0.0, 0.0], "y": [0.0, 1.0, 0.0], "z": [0.0, 0.0, 1.0]}
    bodies, hinges = [], []
    for i, (length, mass, angle, axis) in enumerate(
        zip(lengths, masses, angles, axes, strict=True)
    ):
        across = mass * (length**2 + 3 * 0.05**2) / 12  # kg m2, a cylinder of 0.1 m
        bodies.append({
            "name": f"link{i}", "mass": mass, "center_of_mass": [length / 2, 0.01, 0.005],
            "inertia": [mass * 0.05**2 / 2, across, across], "ends": {"tip": [length, 0.0, 0.0]},
        })  # fmt: skip
        hinges.append({
            "name": f"joint{i}", "type": "pin", "axis": unit[axis],
            "inboard": f"link{i - 1}.tip" if i else "ground", "outboard": f"link{i}",
            "initial": {"q": [angle]}, "law": {"damping": 0.05},
        })  # fmt: skip
    return {**_scene(bodies, hinges), "gravity": [0.0, 0.0, -9.81]}


#: Quarter car, from the road to the body: mass (kg) and what carries it (N/m, N s/m).
QUARTER: dict[str, tuple[float, tuple[float, float]]] = {
    "wheel": (40.0, (2e5, 200.0)), "plate": (1.0, (2e4, 1500.0)), "car": (300.0, (5e6, 1000.0)),
}  # fmt: skip


def road(delay: float = 0.0) -> str:
    """Its height in m over t in s: waves of 4 cm at 1.5 Hz and of 2 mm at 12 Hz."""
    t = f"(t - {delay:g})"
    return f"0.02*(1 - cos(3*pi*{t})) + 0.001*(1 - cos(24*pi*{t}))"


def quarter_car(height: str | None = None) -> Scene:
    """Wheel, the plate of 1 kg below the mount of 5e6 N/m, and the body of a car, above a road
    that is a driven platform (`height` in m, else `road`).  All move along y; q = 0 is slack."""
    bodies = [_block("road", 1.0), *(_block(name, mass) for name, (mass, _) in QUARTER.items())]
    hinges: list[Scene] = [_slide("road", "ground", drive=height or road())]
    below = "road"
    for name, (_, (k, c)) in QUARTER.items():
        hinges.append(_slide(name, below, law={"stiffness": k, "damping": c}))
        below = name
    return _scene(bodies, hinges)


def _block(name: str, mass: float) -> Scene:
    return {"name": name, "mass": mass, "inertia": [1.0, 1.0, 1.0]}


def _slide(name: str, inboard: str, **more: Any) -> Scene:
    return {
        "name": f"{name}_slide", "type": "prismatic", "axis": [0.0, 1.0, 0.0], "inboard": inboard,
        "outboard": name, **more,
    }  # fmt: skip


#: Half car: places of the arms' bushings (m from the mass centre), the way they point, and what
#: the waves under each wheel lag (s).
WHEELS = {"front": (1.0, 0.0, 0.0), "rear": (-1.2, math.pi, 0.15)}
CAR: dict[str, Any] = {
    "mass": 600.0, "inertia": 900.0,  # kg, kg m2
    "arm": (30.0, 0.35, 0.4, 0.5),  # kg with its wheel, m to the mass centre and the hub, kg m2
    "spring": (4000.0, 250.0, 0.3),  # N m/rad, N m s/rad, rad that the weight takes
    "tyre": (2e5, 200.0, 0.3, 0.316),  # N/m, N s/m, m at the start, m slack
}  # fmt: skip


def half_car(k: float = 1e7, zeta: float = 0.01) -> Scene:
    """A body that heaves and pitches on two arms with wheels; the arms sit on bushings (k in N/m,
    `zeta` relative to one arm on them) with torsion springs.  Tyres are long springs to the
    ground, whose efforts stand for the road."""
    mass, center, hub, inertia = CAR["arm"]
    turning, turning_damping, weight = CAR["spring"]
    tyre, tyre_damping, height, slack = CAR["tyre"]
    c = 2 * zeta * math.sqrt(k * mass)
    ends = {name: [x, 0.0, 0.0] for name, (x, _, _) in WHEELS.items()}
    bodies = [{"name": "car", "mass": CAR["mass"], "inertia": [200.0, 900.0, CAR["inertia"]],
               "ends": ends}]  # fmt: skip
    hinges: list[Scene] = [{
        "name": "heave", "type": "planar", "inboard": "ground", "outboard": "car",
        "drive": ["0", "free", "free"],
    }]  # fmt: skip
    springs = []
    for name, (x, yaw, delay) in WHEELS.items():
        way = 1.0 if yaw == 0 else -1.0
        bodies.append({
            "name": name, "mass": mass, "center_of_mass": [center, 0.0, 0.0],
            "inertia": [0.1, inertia, inertia], "ends": {"tip": [hub, 0.0, 0.0]},
        })  # fmt: skip
        law = {"stiffness": [k, k, turning], "damping": [c, c, turning_damping],
               "rest": [0.0, 0.0, -way * weight]}  # fmt: skip
        hinges.append({
            "name": f"{name}_bushing", "type": "planar", "inboard": f"car.{name}",
            "outboard": name, "orientation": [0.0, 0.0, yaw], "law": law,
        })  # fmt: skip
        springs.append({
            "name": f"{name}_tyre", "from": "ground", "to": f"{name}.tip",
            "position": [x + way * hub, -height, 0.0],
            "law": {"stiffness": tyre, "damping": tyre_damping, "rest": slack,
                    "effort": f"{tyre:g}*({road(delay)})"},
        })  # fmt: skip
    return _scene(bodies, hinges, spring=springs)
