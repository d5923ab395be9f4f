"""Scenes for model reduction: four of a hub with a beam, and random families.

A family is a function of a random generator and gives a scene dictionary and the end of its run
(s), as those of the wanted errors, of which the flexible ones are drawn here too.
"""

from __future__ import annotations

import math

import numpy as np

from ..error_control.scenes import (
    Family,
    Sample,
    Scene,
    beam_arms,
    falling_beams,
    flexible_trees,
    spinning_beams,
)

_Z = [0.0, 0.0, 1.0]

#: Hub's inertia, bending stiffness, period and torque of four scenes.
HUBS = {
    "A": (5.0, 400.0, 1.5, 20.0),
    "B": (5.0, 20.0, 1.2, 8.0),
    "C": (0.2, 20.0, 1.2, 1.0),
    "D": (0.5, 2.0, 3.0, 2.4),
}


def hub_scene(
    inertia: float, bending_stiffness: float, period: float, torque: float, shapes: int
) -> Sample:
    """A hub with a clamped beam, pushed by one period of a torque, over two."""
    beam = {
        "name": "arm", "length": 1.0, "mass_per_length": 1.0,
        "bending_stiffness": bending_stiffness,
        "modes": {"y": shapes}, "frame": "tangent", "basis": "clamped-free",
    }  # fmt: skip
    effort = f"where(t < {period:.6g}, {torque:.6g}*sin(2*pi*t/{period:.6g}), 0)"
    hinges = [
        {"name": "axle", "type": "pin", "inboard": "ground", "outboard": "hub",
         "law": {"effort": effort}},
        {"name": "root", "type": "fixed", "inboard": "hub", "outboard": "arm"},
    ]  # fmt: skip
    body = {"name": "hub", "mass": 1.0, "inertia": [inertia] * 3}
    scene = {"gravity": [0.0] * 3, "body": [body], "beam": [beam], "hinge": hinges}
    return scene, 2 * period


def _log(rng: np.random.Generator, low: float, high: float) -> float:
    return float(10 ** rng.uniform(low, high))


def hub_arms(rng: np.random.Generator) -> Sample:
    """Scenes like the four, between and around them."""
    inertia, bending_stiffness, period = (
        _log(rng, -1, 1),
        _log(rng, 0.3, 3),
        float(rng.uniform(0.8, 3)),
    )
    angle = float(rng.uniform(0.3, 3.0))
    torque = angle * (inertia + 1 / 3) * 2 * math.pi / period**2
    return hub_scene(inertia, bending_stiffness, period, torque, int(rng.integers(2, 5)))


def panels(rng: np.random.Generator) -> Sample:
    """A body that turns by a torque, with two panels of different stiffness on it."""
    beams: list[Scene] = []
    hinges: list[Scene] = []
    for name, angle in (("left", math.pi), ("right", 0.0)):
        beams.append({
            "name": name, "length": float(rng.uniform(1.0, 2.0)),
            "mass_per_length": float(rng.uniform(0.3, 1.0)), "bending_stiffness": _log(rng, 0.7, 4),
            "modes": {"y": int(rng.integers(1, 4)), "z": int(rng.integers(0, 2))},
            "damping": float(rng.choice([0.0, 0.01])),
        })  # fmt: skip
        hinges.append({
            "name": f"to_{name}", "type": "fixed", "inboard": "hub", "outboard": name,
            "orientation": [0.0, 0.0, angle],
        })  # fmt: skip
    period = float(rng.uniform(0.8, 2.5))
    torque = float(rng.uniform(1, 6))
    effort = f"where(t < {period:.6g}, {torque:.6g}*sin(2*pi*t/{period:.6g}), 0)"
    axle = {"name": "axle", "type": "pin", "axis": _Z, "inboard": "ground", "outboard": "hub",
            "law": {"effort": effort}}  # fmt: skip
    body = {"name": "hub", "mass": 2.0, "inertia": [float(rng.uniform(0.3, 3))] * 3}
    scene = {"gravity": [0.0] * 3, "body": [body], "beam": beams, "hinge": [axle, *hinges]}
    return scene, float(rng.uniform(1.5, 3)) * period


def booms(rng: np.random.Generator) -> Sample:
    """A beam that bends both ways and twists on a driven column, with a load on its tip."""
    beam = {
        "name": "boom", "length": float(rng.uniform(0.8, 2)), "mass_per_length": 0.8,
        "bending_stiffness": [_log(rng, 1.3, 4), _log(rng, 1.3, 4)],
        "torsional_stiffness": _log(rng, 1, 3), "polar_inertia_per_length": 1e-3,
        "modes": {"y": int(rng.integers(1, 3)), "z": int(rng.integers(1, 3)), "twist": 1},
        "damping": 0.01,
    }  # fmt: skip
    load = {
        "name": "load", "mass": float(rng.uniform(0.1, 1)), "inertia": [0.01, 0.02, 0.02],
        "center_of_mass": [0.1, float(rng.choice([0.0, 0.05])), 0.0],
    }  # fmt: skip
    angle, omega = float(rng.uniform(0.2, 1.0)), float(rng.uniform(1, 5))
    hinges = [
        {"name": "column", "type": "pin", "axis": _Z, "inboard": "ground", "outboard": "boom",
         "drive": f"{angle:.6g}*(1 - cos({omega:.6g}*t))"},
        {"name": "grip", "type": "fixed", "inboard": "boom.tip", "outboard": "load"},
    ]  # fmt: skip
    gravity = [0.0, 0.0, -9.81 if rng.random() < 0.5 else 0.0]
    scene = {"gravity": gravity, "body": [load], "beam": [beam], "hinge": hinges}
    return scene, float(rng.uniform(1, 2))


def spring_arms(rng: np.random.Generator) -> Sample:
    """A rod on a free pin, a rod and a beam behind it on sprung and damped pins, stiff or soft."""
    inertia_t = 1.0 / 12
    rods = [
        {"name": name, "mass": 1.0, "center_of_mass": [0.5, 0.0, 0.0],
         "inertia": [0.01, inertia_t, inertia_t], "ends": {"tip": [1.0, 0.0, 0.0]}}
        for name in ("upper", "lower")
    ]  # fmt: skip
    beam = {
        "name": "beam", "length": 0.8, "mass_per_length": 0.5, "bending_stiffness": _log(rng, 1, 4),
        "modes": {"y": int(rng.integers(1, 4))}, "damping": 0.01,
    }  # fmt: skip
    hinges = [
        {"name": name, "type": "pin", "axis": _Z, "inboard": inboard, "outboard": body, "law": law}
        for name, inboard, body, law in (
            ("shoulder", "ground", "upper", {"damping": _log(rng, -4, 0)}),
            ("elbow", "upper.tip", "lower", {"stiffness": _log(rng, 1.5, 6), "damping": 1.0}),
            ("wrist", "lower.tip", "beam", {"stiffness": _log(rng, 1.5, 6), "damping": 0.1}),
        )
    ]
    hinges[0]["initial"] = {"q": [float(rng.uniform(-1, 1))]}
    scene = {"gravity": [0.0, -9.81, 0.0], "body": rods, "beam": [beam], "hinge": hinges}
    return scene, float(rng.uniform(0.8, 1.5))


FAMILIES: dict[str, Family] = {
    family.__name__: family
    for family in (
        hub_arms, panels, booms, spring_arms, beam_arms, flexible_trees, falling_beams,
        spinning_beams,
    )
}  # fmt: skip


def hub_scenes() -> dict[str, Sample]:
    """Scenes A to D."""
    return {name: hub_scene(*numbers, 5) for name, numbers in HUBS.items()}
