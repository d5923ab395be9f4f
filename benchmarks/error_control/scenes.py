"""Random scenes: families used to set the rule, and others to test it.

Every family is a function of a random generator and gives a scene dictionary and the end of its run
(s).  Lengths in m, masses in kg, angles in rad.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

Scene = dict[str, Any]
Sample = tuple[Scene, float]
Family = Callable[[np.random.Generator], Sample]

_Z = [0.0, 0.0, 1.0]


def _scene(bodies: list[Scene], hinges: list[Scene], gravity: list[float], **more: Any) -> Scene:
    return {"schema_version": 1, "gravity": gravity, "body": bodies, "hinge": hinges, **more}


def _log(rng: np.random.Generator, low: float, high: float) -> float:
    """A number between two powers of ten."""
    return float(10 ** rng.uniform(low, high))


def _unit(rng: np.random.Generator) -> list[float]:
    axis = rng.normal(size=3)
    return [float(x) for x in axis / np.linalg.norm(axis)]


def _rod(name: str, length: float, mass: float) -> Scene:
    """A uniform rod along x with a little thickness."""
    inertia_t = mass * length**2 / 12
    return {
        "name": name, "mass": mass, "center_of_mass": [length / 2, 0.0, 0.0],
        "inertia": [0.02 * inertia_t, inertia_t, inertia_t], "ends": {"tip": [length, 0.0, 0.0]},
    }  # fmt: skip


def _lump(rng: np.random.Generator, name: str) -> Scene:
    """A body of any shape with two ends."""
    mass, size = _log(rng, -1, 1), float(rng.uniform(0.2, 0.8))
    i = np.sort(rng.uniform(0.3, 1.0, 3)) * mass * size**2 / 6
    i[2] = min(i[2], 0.95 * (i[0] + i[1]))
    return {
        "name": name, "mass": mass, "inertia": i.tolist(),
        "center_of_mass": (rng.uniform(-0.3, 0.5, 3) * size).tolist(),
        "ends": {e: (rng.uniform(-1, 1, 3) * size).tolist() for e in ("a", "b")},
    }  # fmt: skip


def _ball_start(rng: np.random.Generator, speed: float) -> Scene:
    q = rng.normal(size=4)
    return {
        "q": [float(x) for x in q / np.linalg.norm(q)],
        "u": rng.uniform(-speed, speed, 3).tolist(),
    }


def _pin_start(rng: np.random.Generator, speed: float) -> Scene:
    return {"q": [float(rng.uniform(-1.5, 1.5))], "u": [float(rng.uniform(-speed, speed))]}


def _tree(rng: np.random.Generator, count: int, kinds: list[str], laws: bool) -> Scene:
    """Lumps on hinges of these kinds, each on any earlier one."""
    bodies = [_lump(rng, f"body{i}") for i in range(count)]
    hinges = []
    for i in range(count):
        inboard = f"body{rng.integers(i)}.{rng.choice(['a', 'b'])}" if i else "ground"
        kind = str(rng.choice(kinds))
        hinge: Scene = {
            "name": f"hinge{i}",
            "type": kind,
            "inboard": inboard,
            "outboard": f"body{i}",
        }
        if kind == "ball":
            hinge["initial"] = _ball_start(rng, 2.0)
        elif kind == "pin":
            hinge |= {"axis": _unit(rng), "initial": _pin_start(rng, 2.0)}
        elif kind == "universal":
            hinge |= {"axis": [1.0, 0.0, 0.0], "axis2": [0.0, 1.0, 0.0]}
            hinge["initial"] = {"q": rng.uniform(-0.6, 0.6, 2).tolist(), "u": [0.5, -0.5]}
        elif kind == "cylindrical":
            hinge |= {"axis": _unit(rng)}
            hinge["law"] = {"stiffness": [_log(rng, 1.5, 3), 0.0], "damping": [0.5, 0.01]}
        elif kind == "prismatic":
            hinge |= {"axis": _unit(rng), "law": {"stiffness": _log(rng, 1.5, 3), "damping": 0.2}}
        if laws and kind in ("pin", "ball", "universal") and rng.random() < 0.6:
            stiffness = _log(rng, 0, 2) if kind == "pin" else 0.0
            hinge["law"] = {"stiffness": stiffness, "damping": _log(rng, -3, 0)}
        hinges.append(hinge)
    return _scene(bodies, hinges, [0.0, 0.0, -9.81])


def _row(
    rng: np.random.Generator, count: int, hinge: Callable[[int], Scene], mass: bool = True
) -> Scene:
    """Rods in a row along x from the ground, gravity along -y."""
    bodies, hinges = [], []
    for i in range(count):
        size = (float(rng.uniform(0.4, 1.2)), _log(rng, -0.7, 0.5)) if mass else (1.0, 1.0)
        bodies.append(_rod(f"rod{i}", *size))
        inboard = f"rod{i - 1}.tip" if i else "ground"
        hinges.append({"name": f"hinge{i}", "inboard": inboard, "outboard": f"rod{i}", **hinge(i)})
    return _scene(bodies, hinges, [0.0, -9.81, 0.0])


def _beam(name: str, length: float, density: float, ei: float, **more: Any) -> Scene:
    return {
        "name": name,
        "length": length,
        "mass_per_length": density,
        "bending_stiffness": ei,
        **more,
    }


# --- on which the rule was set --------------------------------------------------------------------


def rigid_trees(rng: np.random.Generator) -> Sample:
    """Pins and balls, half of them with springs and dampers."""
    laws = bool(rng.random() < 0.5)
    return _tree(rng, int(rng.integers(2, 6)), ["pin", "ball"], laws), float(rng.uniform(1, 3))


def planar_chains(rng: np.random.Generator) -> Sample:
    """Pendulum chains in a plane, let go at any angle."""

    def pin(_: int) -> Scene:
        return {"type": "pin", "axis": _Z, "initial": _pin_start(rng, 0.5)}

    return _row(rng, int(rng.integers(2, 6)), pin), float(rng.uniform(1.5, 4))


def bushing_rows(rng: np.random.Generator) -> Sample:
    """Rods on stiff bushings, slack at first."""
    k, zeta = _log(rng, 4, 8), float(rng.choice([0.0, 0.01, 0.1, 1.0]))
    c = 2 * zeta * math.sqrt(k)
    law = {"stiffness": [k, k, 0.0], "damping": [c, c, 0.0]}
    return _row(rng, int(rng.integers(2, 9)), lambda _: {"type": "planar", "law": law}, False), 1.0


def spinning_beams(rng: np.random.Generator) -> Sample:
    """A beam in a hub that a drive or a torque turns ever faster."""
    beam = _beam(
        "blade", 10.0, 1.2, _log(rng, 4, 5), modes={"y": int(rng.integers(1, 5))}, stiffening=True,
        damping=float(rng.choice([0.0, 0.01])),
    )  # fmt: skip
    t_end = float(rng.uniform(6, 15))
    torque = float(rng.uniform(100, 250))
    law = {"effort": f"where(t < 5, {torque:.6g}*(1 - cos(2*pi*t/5)), 0)"}
    hinge = {
        "name": "hub", "type": "pin", "axis": _Z, "inboard": "ground", "outboard": "blade",
        "law": law,
    }  # fmt: skip
    return {"schema_version": 1, "gravity": [0.0] * 3, "beam": [beam], "hinge": [hinge]}, t_end


def jerked_beams(rng: np.random.Generator) -> Sample:
    """A beam in a hub, a load on it or not, that a torque turns from one moment to the next."""
    beam = _beam(
        "boom", float(rng.uniform(1, 4)), float(rng.uniform(0.5, 3)), _log(rng, 1.5, 4.5),
        modes={"y": int(rng.integers(1, 5))}, stiffening=bool(rng.random() < 0.5),
        damping=float(rng.choice([0.0, 0.01, 0.05])),
    )  # fmt: skip
    law = {"effort": float(rng.uniform(2, 30)), "damping": float(rng.choice([0.0, 0.5]))}
    hinges = [{
        "name": "hub", "type": "pin", "axis": _Z, "inboard": "ground", "outboard": "boom",
        "law": law,
    }]  # fmt: skip
    bodies = []
    if rng.random() < 0.4:
        bodies = [_rod("load", 0.3, float(rng.uniform(0.1, 1)))]
        held = {"name": "grip", "type": "pin", "axis": _Z, "inboard": "boom.tip"}
        hinges.append({**held, "outboard": "load", "law": {"damping": 0.05}})
    return _scene(bodies, hinges, [0.0] * 3, beam=[beam]), float(rng.uniform(0.5, 3))


def beam_arms(rng: np.random.Generator) -> Sample:
    """A rigid link, a beam on its tip, and a load that the beam carries."""
    length = float(rng.uniform(0.5, 1.5))
    beam = _beam(
        "beam", length, float(rng.uniform(0.2, 1.0)), _log(rng, 0.5, 3),
        modes={"y": int(rng.integers(1, 4))}, damping=float(rng.choice([0.0, 0.01, 0.05])),
    )  # fmt: skip
    hinges = [
        {"name": n, "type": "pin", "axis": _Z, "inboard": a, "outboard": b, "initial": s}
        for n, a, b, s in (
            ("shoulder", "ground", "link", {"q": [float(rng.uniform(-1, 1))]}),
            ("elbow", "link.tip", "beam", {"q": [float(rng.uniform(-1, 1))]}),
            ("wrist", "beam.tip", "load", {"q": [float(rng.uniform(-1, 1))]}),
        )
    ]
    bodies = [_rod("link", 0.6, 2.0), _rod("load", 0.3, float(rng.uniform(0.1, 1)))]
    return _scene(bodies, hinges, [0.0, -9.81, 0.0], beam=[beam]), float(rng.uniform(1, 2))


def driven_arms(rng: np.random.Generator) -> Sample:
    """Three links, the first one driven, dampers in the others."""
    a, w = float(rng.uniform(0.2, 1.0)), float(rng.uniform(1, 8))

    def pin(i: int) -> Scene:
        if not i:
            return {"type": "pin", "axis": _Z, "drive": f"{a:.6g}*sin({w:.6g}*t)"}
        law = {"damping": _log(rng, -2, 0)}
        return {"type": "pin", "axis": _Z, "law": law, "initial": _pin_start(rng, 0.0)}

    return _row(rng, 3, pin), float(rng.uniform(5, 15))


def friction_rotors(rng: np.random.Generator) -> Sample:
    """A rotor kept turning by a torque, with friction, and a pendulum on its rim."""
    family = float(rng.uniform(0.2, 2.0))
    friction = {"coulomb": family, "regularisation_velocity": _log(rng, -2, -1)}

    def pin(i: int) -> Scene:
        if not i:
            start = {"q": [0.0], "u": [float(rng.uniform(6, 12))]}
            law = {"friction": friction, "effort": family + 1.0}
            return {"type": "pin", "axis": _Z, "law": law, "initial": start}
        return {"type": "pin", "axis": _Z, "law": {"damping": 0.05}}

    return {**_row(rng, 2, pin), "gravity": [0.0, 0.0, -9.81]}, float(rng.uniform(5, 12))


def stopped_arms(rng: np.random.Generator) -> Sample:
    """Two links that fall against stops of the second hinge."""
    stop = {"lower": -0.8, "upper": 0.8, "stiffness": _log(rng, 3, 5), "damping": _log(rng, 0, 1)}

    def pin(i: int) -> Scene:
        law = {"limits": stop} if i else {"damping": 0.1}
        start = {"q": [0.0 if i else float(rng.uniform(-0.5, 0.5))]}
        return {"type": "pin", "axis": _Z, "law": law, "initial": start}

    return _row(rng, 2, pin), float(rng.uniform(2, 6))


# --- on which it is judged ------------------------------------------------------------------------


def mixed_trees(rng: np.random.Generator) -> Sample:
    """All kinds of hinges, with and without laws."""
    kinds = ["pin", "ball", "universal", "cylindrical", "prismatic"]
    laws = bool(rng.random() < 0.6)
    return _tree(rng, int(rng.integers(3, 8)), kinds, laws), float(rng.uniform(0.8, 2))


def spatial_chains(rng: np.random.Generator) -> Sample:
    """Chains of rods on balls and on pins about any axis."""

    def hinge(_: int) -> Scene:
        if rng.random() < 0.5:
            return {"type": "ball", "initial": _ball_start(rng, 0.5)}
        return {"type": "pin", "axis": _unit(rng), "initial": _pin_start(rng, 1.0)}

    return _row(rng, int(rng.integers(2, 5)), hinge), float(rng.uniform(1, 3))


def spring_chains(rng: np.random.Generator) -> Sample:
    """Links on stiff torsion springs between free ones, damped or not."""
    zeta = float(rng.choice([0.0, 0.02, 0.3]))

    def pin(i: int) -> Scene:
        k = _log(rng, 4, 7) if i % 2 else 0.0
        law = {"stiffness": k, "damping": 2 * zeta * math.sqrt(k * 0.3)}
        return {"type": "pin", "axis": _Z, "law": law}

    return _row(rng, int(rng.integers(3, 8)), pin), float(rng.uniform(0.5, 1.5))


def falling_beams(rng: np.random.Generator) -> Sample:
    """Beams on a pin, in a chord or a tangent frame, that fall."""
    chord = rng.random() < 0.5
    frame = {"frame": "chord", "basis": "simply-supported"} if chord else {"frame": "tangent"}
    beam = _beam(
        "beam", float(rng.uniform(0.8, 2)), float(rng.uniform(0.5, 2)), _log(rng, 1, 4),
        modes={"y": int(rng.integers(2, 6))}, damping=float(rng.choice([0.0, 0.01, 0.03])),
        stiffening=True, **frame,
    )  # fmt: skip
    hinge = {
        "name": "pin", "type": "pin", "axis": _Z, "inboard": "ground", "outboard": "beam",
        "initial": {"q": [float(rng.uniform(-1, 1))]},
    }  # fmt: skip
    scene = {"schema_version": 1, "gravity": [0.0, -9.81, 0.0], "beam": [beam], "hinge": [hinge]}
    return scene, float(rng.uniform(0.6, 1.5))


def flexible_trees(rng: np.random.Generator) -> Sample:
    """One or two beams with other bodies between and behind them."""
    count = int(rng.integers(1, 3))
    beams, bodies, hinges, inboard = [], [], [], "ground"
    for i in range(count):
        for name in (f"beam{i}", f"rod{i}"):
            hinges.append({
                "name": f"to_{name}", "type": "pin", "axis": _Z, "inboard": inboard,
                "outboard": name, "initial": {"q": [float(rng.uniform(-0.8, 0.8))]},
                "law": {"damping": float(rng.choice([0.0, 0.1]))},
            })  # fmt: skip
            inboard = f"{name}.tip"
        length = float(rng.uniform(0.5, 1.2))
        beams.append(_beam(
            f"beam{i}", length, float(rng.uniform(0.3, 1)), _log(rng, 0.7, 3.5),
            modes={"y": int(rng.integers(1, 4))}, damping=float(rng.choice([0.0, 0.02])),
        ))  # fmt: skip
        bodies.append(_rod(f"rod{i}", 0.4, float(rng.uniform(0.2, 1))))
    return _scene(bodies, hinges, [0.0, -9.81, 0.0], beam=beams), float(rng.uniform(0.5, 1.5))


def base_excited_pendulums(rng: np.random.Generator) -> Sample:
    """A carriage that a drive moves to and fro, with pendulums below it."""
    a, w = float(rng.uniform(0.05, 0.3)), float(rng.uniform(2, 15))

    def hinge(i: int) -> Scene:
        if not i:
            drive = f"{a:.6g}*sin({w:.6g}*t)*(1 - exp(-t))"
            return {"type": "prismatic", "axis": [1.0, 0.0, 0.0], "drive": drive}
        law = {"damping": _log(rng, -3, -1)}
        return {"type": "pin", "axis": _Z, "law": law, "initial": _pin_start(rng, 0.0)}

    return _row(rng, int(rng.integers(2, 5)), hinge), float(rng.uniform(3, 10))


def friction_slides(rng: np.random.Generator) -> Sample:
    """A slide pulled along a rail that rubs, with Stribeck's fall, and a load swinging on it."""
    family = float(rng.uniform(1, 4))
    friction = {
        "coulomb": family, "static": 1.3 * family, "stribeck_velocity": 0.3,
        "regularisation_velocity": _log(rng, -2, -1),
    }  # fmt: skip

    def hinge(i: int) -> Scene:
        if not i:
            law = {"friction": friction, "effort": 1.5 * family + 2.0}
            start = {"q": [0.0], "u": [float(rng.uniform(3, 6))]}
            return {"type": "prismatic", "axis": [1.0, 0.0, 0.0], "law": law, "initial": start}
        start = {"q": [-math.pi / 2 + float(rng.uniform(-0.4, 0.4))]}
        return {"type": "pin", "axis": _Z, "initial": start}

    return _row(rng, 2, hinge), float(rng.uniform(5, 15))


def bouncing_weights(rng: np.random.Generator) -> Sample:
    """A weight that falls on a stop and bounces, a pendulum on it."""
    stop = {"lower": 0.0, "stiffness": _log(rng, 3, 5.5), "damping": float(rng.uniform(0, 5))}

    def hinge(i: int) -> Scene:
        if not i:
            start = {"q": [float(rng.uniform(0.1, 0.4))]}
            law = {"limits": stop}
            return {"type": "prismatic", "axis": [0.0, 1.0, 0.0], "law": law, "initial": start}
        return {"type": "pin", "axis": _Z, "initial": _pin_start(rng, 0.0)}

    return _row(rng, 2, hinge), float(rng.uniform(1, 3))


TUNING_FAMILIES: dict[str, Family] = {
    family.__name__: family
    for family in (
        rigid_trees, planar_chains, bushing_rows, spinning_beams, beam_arms, driven_arms,
        friction_rotors, stopped_arms, jerked_beams,
    )
}  # fmt: skip
TEST_FAMILIES: dict[str, Family] = {
    family.__name__: family
    for family in (
        mixed_trees, spatial_chains, spring_chains, flexible_trees, base_excited_pendulums,
        friction_slides, bouncing_weights, falling_beams,
    )
}  # fmt: skip


def draw_scenes(families: dict[str, Family], each: int, seed: int) -> dict[str, Sample]:
    """`each` scenes of every family, by name; the same ones for the same seed."""
    values = {}
    for place, (name, family) in enumerate(families.items()):
        for i in range(each):
            values[f"{name}{i}"] = family(np.random.default_rng([seed, place, i]))
    return values
