"""Mechanisms with closed loops that others have published."""

from __future__ import annotations

import math
from typing import Any

Scene = dict[str, Any]


def rod(name: str, length: float = 1.0, mass: float = 1.0) -> Scene:
    """A uniform thin rod along x with an end "tip"."""
    moment = mass * length**2 / 12
    return {
        "name": name, "mass": mass, "center_of_mass": [length / 2, 0, 0],
        "inertia": [0.0, moment, moment], "ends": {"tip": [length, 0, 0]},
    }  # fmt: skip


def four_bars(count: int, angle: float = math.pi / 2, speed: float = -1.0) -> Scene:
    """N-four-bar of the IFToMM library: `count` windows of rods of 1 m and 1 kg, cranks at `angle`.

    F. Gonzalez, M. Gonzalez, J. Cuadrado, A benchmarking system for MBS simulation software, 2006.
    """
    cranks = [rod(f"crank{k}") for k in range(count + 1)]
    couplers = [rod(f"coupler{k}") for k in range(count)]
    hinges: list[Scene] = [
        {"name": f"foot{k}", "type": "pin", "inboard": "ground", "outboard": f"crank{k}",
         "position": [float(k), 0, 0], "initial": {"q": angle, "u": speed}}
        for k in range(count + 1)
    ]  # fmt: skip
    for k in range(count):
        hinges += [
            {"name": f"left{k}", "type": "pin", "inboard": f"crank{k}.tip",
             "outboard": f"coupler{k}", "initial": {"q": -angle, "u": -speed}},
            {"name": f"right{k}", "type": "pin", "inboard": f"coupler{k}.tip",
             "outboard": f"crank{k + 1}.tip", "initial": {"q": angle, "u": speed}},
        ]  # fmt: skip
    return {"gravity": [0, -9.81, 0], "body": [*cranks, *couplers], "hinge": hinges}


def andrews() -> Scene:
    """Andrews' squeezer: seven bodies, three loops that meet in one point, a spring and a motor.

    W. Schiehlen (ed.), Multibody Systems Handbook, 1990; data of the IVP test set (andrews.f).
    """
    bodies: list[tuple[str, float, float, list[float], dict[str, list[float]]]] = [
        ("K1", 0.04325, 2.194e-6, [0.00092, 0], {"F": [0.007, 0]}),
        ("K2", 0.00365, 4.410e-7, [-0.0115, 0], {"E": [-0.028, 0]}),
        ("K3", 0.02373, 5.255e-6, [0.01043, -0.01874], {"E": [0, -0.035], "D": [0.02, -0.018]}),
        ("K4", 0.00706, 5.667e-7, [0, -(0.02 - 0.01421)], {"E": [0, -0.02]}),
        ("K5", 0.07050, 1.169e-5, [0.02308, 0.00916], {"G": [0.04, 0]}),
        ("K6", 0.00706, 5.667e-7, [0.02 - 0.01421, 0], {"E": [0.02, 0]}),
        ("K7", 0.05498, 1.912e-5, [-0.00449, -0.01228], {"H": [0, -0.04]}),
    ]
    a, b = [-0.06934, -0.00227, 0], [-0.03635, 0.03273, 0]
    start = {
        "beta": -0.0617138900142764, "Theta": 0.0, "gamma": 0.455279819163070,
        "delta": 0.487364979543843, "Phi": 0.222668390165886, "eps": 1.23054744454982,
        "Omega": -0.222668390165886,
    }  # fmt: skip
    tree = [
        ("beta", "ground", "K1", [0, 0, 0]), ("Theta", "K1.F", "K2", None),
        ("gamma", "ground", "K3", b), ("delta", "ground", "K5", a), ("Phi", "K5.G", "K4", None),
        ("eps", "ground", "K7", a), ("Omega", "K7.H", "K6", None),
    ]  # fmt: skip
    hinges: list[Scene] = []
    for name, inboard, outboard, position in tree:
        hinge: Scene = {"name": name, "type": "pin", "inboard": inboard, "outboard": outboard,
                        "initial": {"q": start[name]}, "cut": False}  # fmt: skip
        hinges.append(hinge | ({} if position is None else {"position": position}))
    hinges[0]["law"] = {"effort": 0.033}
    hinges += [
        {"name": f"E{k}", "type": "pin", "inboard": "K2.E", "outboard": f"K{k}.E"}
        for k in (3, 4, 6)
    ]  # fmt: skip
    return {
        "gravity": [0, 0, 0],
        "body": [
            {"name": name, "mass": mass, "inertia": [0, 0, moment], "center_of_mass": [*center, 0],
             "ends": {end: [*place, 0] for end, place in ends.items()},
             "allow_unphysical_inertia": True}
            for name, mass, moment, center, ends in bodies
        ],
        "hinge": hinges,
        "spring": [{"from": "ground", "position": [0.014, 0.072, 0], "to": "K3.D",
                    "law": {"stiffness": 4530.0, "rest": 0.07785}}],
    }  # fmt: skip


def scissors(units: int, angle: float = 0.4) -> Scene:
    """A scissor mast: rods cross in their middles and stand on the tips of those below; the second
    foot is on a slide."""
    bodies: list[Scene] = [{"name": "shoe", "mass": 1.0}]
    hinges: list[Scene] = [
        {"name": "slide", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
         "outboard": "shoe", "initial": {"q": math.cos(angle)}, "hold": True},
    ]  # fmt: skip
    for k in range(units):
        for side in "ab":
            bodies.append(rod(f"{side}{k}"))
            bodies[-1]["ends"]["mid"] = [0.5, 0, 0]
        feet = (f"b{k - 1}.tip", f"a{k - 1}.tip") if k else ("ground", "shoe")
        starts = (2 * angle - math.pi, math.pi - 2 * angle) if k else (angle, math.pi - angle)
        hinges += [
            {"name": f"foot_{side}{k}", "type": "pin", "inboard": foot, "outboard": f"{side}{k}",
             "initial": {"q": start}}
            for side, foot, start in zip("ab", feet, starts, strict=True)
        ]  # fmt: skip
        hinges.append({"name": f"cross{k}", "type": "pin", "inboard": f"a{k}.mid",
                       "outboard": f"b{k}.mid", "initial": {"q": math.pi - 2 * angle}})  # fmt: skip
    return {"gravity": [0, -9.81, 0], "body": bodies, "hinge": hinges}
