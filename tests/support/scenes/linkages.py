"""Linkages with closed loops as data: four bars, cranks side by side, Bricard's ring, six legs."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from tests.reference.algebra import orientation, to_quaternion

Scene = dict[str, Any]

#: Lengths of crank, coupler and rocker, and between their feet, m.
CRANK, COUPLER, ROCKER, FEET = 0.5, 1.1, 0.8, 1.2
#: An angle about each axis, rad: a plane that lies along no coordinate.
OBLIQUE = (0.4, -0.7, 1.1)


def rod(name: str, length: float, mass: float = 1.0) -> Scene:
    """A uniform rod along x with an end "tip"; thin but for the moment about its axis."""
    moment = mass * length**2 / 12
    return {
        "name": name, "mass": mass, "center_of_mass": [length / 2, 0, 0],
        "inertia": [1e-2 * moment, moment, moment], "ends": {"tip": [length, 0, 0]},
    }  # fmt: skip


def angles(crank: float) -> tuple[float, float]:
    """Angles of coupler and rocker against the ground, the coupler above the feet."""
    knee = CRANK * np.exp(1j * crank)
    across = FEET - knee
    distance = abs(across)
    corner = (COUPLER**2 + distance**2 - ROCKER**2) / (2 * COUPLER * distance)
    coupler = float(np.angle(across)) + math.acos(corner)
    return coupler, float(np.angle(knee + COUPLER * np.exp(1j * coupler) - FEET))


def four_bar(
    crank: float = 0.9,
    speed: float = 0.0,
    cut: str = "tip",
    laws: Mapping[str, Scene] | None = None,
    tilt: tuple[float, float, float] = (0.0, 0.0, 0.0),
    **changes: Scene,
) -> Scene:
    """Crank, coupler and rocker, each hinge but `cut` held by the tree.

    Hinges behind the cut one are written the other way round, from the rocker's foot.  `changes`
    are keys of hinges by their names.
    """
    coupler, rocker = angles(crank)
    start = {"foot": crank, "knee": coupler - crank, "tip": rocker - coupler, "end": rocker}
    sides = {
        "foot": ("ground", "crank"), "knee": ("crank.tip", "coupler"),
        "tip": ("coupler.tip", "rocker.tip"), "end": ("ground", "rocker"),
    }  # fmt: skip
    turn = orientation(tilt)
    laws = laws or {}
    hinges: list[Scene] = []
    for name, (inboard, outboard) in sides.items():
        around = (cut == "foot" and name == "knee") or (cut in ("foot", "knee") and name == "tip")
        one: Scene = {"name": name, "type": "pin", "inboard": inboard, "outboard": outboard}
        angle, law = start[name], dict(laws.get(name, {}))
        if around:
            one |= {"inboard": outboard, "outboard": inboard}
            angle = -angle
            law |= {key: -law[key] for key in ("rest", "effort") if key in law}
        if inboard == "ground":
            one["orientation"] = list(tilt)
        if name == "end":
            one["position"] = [float(x) for x in turn @ [FEET, 0, 0]]
        one |= {"initial": {"q": angle}, "cut": name == cut}
        if name == "foot" and speed:
            one["initial"]["u"] = speed
        hinges.append(one | ({"law": law} if law else {}) | changes.get(name, {}))
    bodies = [
        rod("crank", CRANK, 0.7), rod("coupler", COUPLER, 1.3), rod("rocker", ROCKER, 0.9)
    ]  # fmt: skip
    return {"gravity": [float(x) for x in turn @ [0, -9.81, 0]], "body": bodies, "hinge": hinges}


def cranks(
    tilt: tuple[float, float, float] = (0.0, 0.0, 0.0),
    angle: float = 0.8,
    places: Sequence[float] = (0.0, 0.7, 1.5),
) -> Scene:
    """Cranks side by side that carry one coupler, which two of them would hold."""
    turn = orientation(tilt)
    coupler = rod("coupler", places[-1])
    coupler["ends"] = {f"e{k}": [place, 0, 0] for k, place in enumerate(places)}
    hinges: list[Scene] = [
        {"name": f"foot{k}", "type": "pin", "inboard": "ground", "outboard": f"crank{k}",
         "position": [float(x) for x in turn @ [place, 0, 0]], "orientation": list(tilt),
         "initial": {"q": angle}}
        for k, place in enumerate(places)
    ]  # fmt: skip
    hinges += [
        {"name": f"top{k}", "type": "pin", "inboard": f"crank{k}.tip",
         "outboard": "coupler" if k == 0 else f"coupler.e{k}", "initial": {"q": -angle}}
        for k in range(len(places))
    ]  # fmt: skip
    bodies = [rod(f"crank{k}", 0.6) for k in range(len(places))]
    return {"gravity": [0, -9.81, 0], "body": [*bodies, coupler], "hinge": hinges}


def bricard(cut: int = 5) -> Scene:
    """Bricard's ring of six equal links on six pins, along edges of a cube; one link is the ground.

    F. Gonzalez, M. Gonzalez, J. Cuadrado, A benchmarking system for MBS simulation software, 2006:
    five rods of 1 m and 10 kg.  At the start all axes are those of the ground.  Rods behind the
    pin that is cut begin at their far ends.
    """
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, -1, 0], [1, -1, 1], [0, -1, 1], [0, 0, 1.0]])
    bodies: list[Scene] = []
    for k in range(5):
        along = corners[k + 1] - corners[k] if k < cut else corners[k] - corners[k + 1]
        bodies.append({
            "name": f"rod{k}", "mass": 10.0, "center_of_mass": [float(x) for x in along / 2],
            "inertia": [float(x) for x in 10 / 12 * (1 - along**2)],
            "ends": {"tip": [float(x) for x in along]},
        })  # fmt: skip
    hinges: list[Scene] = []
    for k, corner in enumerate(corners):
        near = "ground" if k == 0 else f"rod{k - 1}.tip"
        far = "ground" if k == 5 else f"rod{k}.tip"
        if k < cut:
            far = f"rod{k}"
        elif k > cut:
            near, far = far, f"rod{k - 1}"
        elif k == 5:
            near, far = far, near
        axis = [float(x) for x in np.roll([0, 1, 0], k)]
        hinge = {"name": f"pin{k}", "type": "pin", "inboard": near, "outboard": far, "axis": axis}
        if near == "ground":
            hinge["position"] = [float(x) for x in corner]
        hinges.append(hinge | {"cut": k == cut})
    return {"gravity": [0, -9.81, 0], "body": bodies, "hinge": hinges}


#: Lengths, m, and twist, rad, of a Bennett linkage: the sines of its twists go as its lengths.
BENNETT = 1.0, 0.7, 0.7


#: Entries of an inertia in the order of the scene.
PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


def bennett_ratio() -> float:
    """Product of the tangents of half the first two angles of the Bennett linkage."""
    a, b, alpha = BENNETT
    beta = math.asin(b / a * math.sin(alpha))
    return math.sin((alpha + beta) / 2) / math.sin((beta - alpha) / 2)


def bennett(angle: float, speed: float = 0.0, digits: int | None = None) -> Scene:
    """A Bennett linkage drawn where its first angle is `angle`, its numbers with so many digits
    behind the point.  G. T. Bennett, A new mechanism, Engineering 76 (1903) 777-778."""
    a, b, alpha = BENNETT
    beta = math.asin(b / a * math.sin(alpha))
    second = 2 * math.atan(bennett_ratio() / math.tan(angle / 2))
    places, axes = [np.zeros(3)], [np.array([0.0, 0, 1])]
    turn = np.eye(3)
    links = zip((angle, second, -angle), (a, b, a), (alpha, beta, alpha), strict=True)
    for theta, length, twist in links:
        (c, s), (ct, st) = (math.cos(theta), math.sin(theta)), (math.cos(twist), math.sin(twist))
        turn = turn @ np.array([[c, -s * ct, s * st], [s, c * ct, -c * st], [0, st, ct]])
        turned = turn @ np.array([[1, 0, 0], [0, ct, st], [0, -st, ct]])  # before the twist
        places.append(places[-1] + length * turned[:, 0])
        axes.append(turn[:, 2])

    def rounded_numbers(numbers: Iterable[float]) -> list[float]:
        return [float(x) if digits is None else round(float(x), digits) for x in numbers]

    bodies, hinges = [], []
    for k in range(3):
        half = (places[k + 1] - places[k]) / 2
        inertia = (1 + k / 5) * (half @ half * np.eye(3) - np.outer(half, half)) / 3
        inertia += 0.01 * np.eye(3)
        bodies.append({
            "name": f"link{k}", "mass": 1 + k / 5,
            "inertia": [float(inertia[pair]) for pair in PAIRS],
            "ends": {"near": rounded_numbers(-half), "far": rounded_numbers(half)},
        })  # fmt: skip
    sides = [("ground", "link0.near"), ("link0.far", "link1.near"), ("link1.far", "link2.near"),
             ("ground", "link2.far")]  # fmt: skip
    for k, (inboard, outboard) in enumerate(sides):
        hinges.append({
            "name": f"pin{k}", "type": "pin", "inboard": inboard, "outboard": outboard,
            "axis": rounded_numbers(axes[k]), "cut": k == 3,
        })  # fmt: skip
    hinges[0]["initial"] = {"u": [speed]}
    hinges[3]["position"] = rounded_numbers(places[3])
    return {"gravity": [0, 0, -9.81], "body": bodies, "hinge": hinges}


def legs(turned: tuple[float, float, float] = (0.05, -0.1, 0.2), law: float = 0.0) -> Scene:
    """Stewart's platform: six legs, each a cylinder on a universal hinge and a piston, on balls.

    `law` (N/m) is the stiffness of springs along the legs, slack at the start.
    """
    top, place = orientation(turned), np.array([0.03, -0.02, 0.9])
    about = np.radians([-20, 20, 100, 140, 220, 260])
    feet = 0.8 * np.stack([np.cos(about), np.sin(about), 0 * about], axis=-1)
    about = np.radians([-50, 50, 70, 170, 190, 290])
    heads = 0.45 * np.stack([np.cos(about), np.sin(about), 0 * about], axis=-1)
    bodies: list[Scene] = [{
        "name": "platform", "mass": 20.0, "inertia": [1.1, 1.2, 2.0],
        "ends": {f"head{k}": [float(x) for x in head] for k, head in enumerate(heads)},
    }]  # fmt: skip
    hinges: list[Scene] = []
    for k in range(6):
        along = place + top @ heads[k] - feet[k]
        length = float(np.linalg.norm(along))
        across = np.cross([0, 0, 1], along)
        across /= np.linalg.norm(across)
        leg = np.stack([along / length, across, np.cross(along / length, across)], axis=-1)
        bodies += [rod(f"cylinder{k}", 0.4, 3.0), rod(f"piston{k}", 0.6, 1.5)]
        slide: Scene = {"name": f"slide{k}", "type": "prismatic", "inboard": f"cylinder{k}",
                        "outboard": f"piston{k}", "axis": [1, 0, 0],
                        "initial": {"q": length - 0.6}}  # fmt: skip
        if law:
            slide["law"] = {"stiffness": law, "rest": length - 0.6, "damping": law / 50}
        hinges += [
            {"name": f"foot{k}", "type": "universal", "inboard": "ground",
             "outboard": f"cylinder{k}", "position": [float(x) for x in feet[k]],
             "orientation": [float(x) for x in to_quaternion(leg)], "axis": [0, 1, 0],
             "axis2": [0, 0, 1]},
            slide,
            {"name": f"head{k}", "type": "ball", "inboard": f"piston{k}.tip",
             "outboard": f"platform.head{k}",
             "initial": {"q": [float(x) for x in to_quaternion(leg.T @ top)]}},
        ]  # fmt: skip
    return {"gravity": [0, 0, -9.81], "body": bodies, "hinge": hinges}
