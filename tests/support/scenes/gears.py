"""Wheels on the ground that gears, belts and racks couple, as data."""

from __future__ import annotations

from typing import Any

import numpy as np

import mstmm

Scene = dict[str, Any]


def wheel(name: str, moment: float, mass: float = 1.0, **more: Any) -> Scene:
    """A round body with the same moment of inertia about all axes."""
    return {"name": name, "mass": mass, "inertia": [moment] * 3, **more}


def pin(name: str, body: str, **more: Any) -> Scene:
    """A pin about z on the ground."""
    return {"name": name, "type": "pin", "inboard": "ground", "outboard": body, **more}


def coupled_model(
    bodies: list[Scene], hinges: list[Scene], *rows: Scene, **more: Any
) -> mstmm.Model:
    """The model of bodies on hinges with couplings, without gravity if none is given."""
    scene = {"gravity": [0, 0, 0], "body": bodies, "hinge": hinges, "coupling": list(rows)}
    return mstmm.compile(mstmm.Scene(**scene | more))


def pair(*rows: Scene, a: Scene | None = None, b: Scene | None = None) -> mstmm.Model:
    """Two wheels of 0.02 and 0.3 kg m^2 on pins A and B; `a` and `b` are more keys of the pins."""
    hinges = [pin("A", "a", **(a or {})), pin("B", "b", position=[1, 0, 0], **(b or {}))]
    return coupled_model([wheel("a", 0.02), wheel("b", 0.3)], hinges, *rows)


#: Radii of sun, planets and ring, m; moments of sun, planet, ring and carrier, kg m^2; mass of a
#: planet, kg.
SUN, PLANET = 0.03, 0.02
RING, ORBIT = SUN + 2 * PLANET, SUN + PLANET
MOMENTS = {"sun": 2e-4, "planet": 5e-5, "ring": 3e-3, "carrier": 4e-4}
MASS = 0.2
#: Where planets sit on the carrier.
PLACES = [[ORBIT, 0, 0], [-ORBIT / 2, ORBIT * 3**0.5 / 2, 0], [-ORBIT / 2, -ORBIT * 3**0.5 / 2, 0]]


def planetary(efforts: dict[str, float], **laws: Scene) -> mstmm.Model:
    """A planetary gear whose planets mesh with sun and ring, each of them a row twice; `laws` are
    more keys of the laws of its shafts."""
    bodies = [wheel(name, MOMENTS[name]) for name in ("sun", "ring", "carrier")]
    bodies[2]["ends"] = {f"e{k}": place for k, place in enumerate(PLACES)}
    hinges = [
        pin(name, name, law={"effort": efforts.get(name, 0.0), **laws.get(name, {})})
        for name in ("sun", "ring", "carrier")
    ]
    rows: list[Scene] = []
    for k in range(3):
        bodies.append(wheel(f"planet{k}", MOMENTS["planet"], MASS))
        hinges.append({"name": f"p{k}", "type": "pin", "inboard": f"carrier.e{k}",
                       "outboard": f"planet{k}"})  # fmt: skip
        rows += [
            {"name": f"sun{k}", "expression": f"{SUN}*(sun.q - carrier.q) + {PLANET}*p{k}.q"},
            {"name": f"ring{k}", "expression": f"{RING}*(ring.q - carrier.q) - {PLANET}*p{k}.q"},
        ]
    return coupled_model(bodies, hinges, *rows)


def inertia(ratios: np.ndarray) -> np.ndarray:
    """Mass matrix (n, n) of that gear over n speeds, by which sun, ring and carrier turn as
    `ratios` (3, n) say."""
    moments = [MOMENTS["sun"], MOMENTS["ring"], MOMENTS["carrier"] + 3 * MASS * ORBIT**2]
    planet = ratios[2] - SUN / PLANET * (ratios[0] - ratios[2])
    turning = 3 * MOMENTS["planet"] * np.outer(planet, planet)
    return np.asarray(ratios.T @ np.diag(moments) @ ratios + turning)
