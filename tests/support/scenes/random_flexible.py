"""Random flexible scenes with everything that may act on them, for comparisons between engines."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.reference.flexible import random_beams
from tests.reference.jets import Array
from tests.reference.random_scenes import random_hinge, random_law
from tests.reference.tree import SIZES

Scene = dict[str, Any]
Generator = np.random.Generator


def varied_scene(seed: int, planar: bool = False, most: int = 4) -> Scene:
    """A tree of `random_system` with hinges of every type and their laws, drag, points of
    quadrature, loads on sections and along beams, springs, and a driven hinge."""
    rng = np.random.default_rng([seed, 7])
    scene = random_beams.random_system(seed, planar=planar, most=most)
    for beam in scene["beam"]:
        if rng.random() < 0.4:
            beam["viscous_drag"] = float(rng.uniform(0.1, 1.0))
        if rng.random() < 0.3:
            beam["quadrature"] = True
    if not planar:
        scene["hinge"] = [_any_hinge(rng, hinge) for hinge in scene["hinge"]]
    scene["load"] += _loads(rng, scene["beam"], planar)
    scene["spring"] = [_spring(rng, scene) for _ in range(int(rng.integers(0, 3)))]
    if planar:
        for spring in scene["spring"]:
            spring["position"] = [1.0, -2.0, 0.0]
    _drive(rng, scene)
    return scene


def _any_hinge(rng: Generator, hinge: Scene) -> Scene:
    """The hinge itself, or one of any type in its place, with a law."""
    if rng.random() < 0.4:
        return hinge
    kind = str(rng.choice(list(SIZES)))
    other = random_hinge(rng, hinge["name"], kind, hinge["inboard"], hinge["outboard"])
    if kind == "free":
        other.pop("axis", None)
    if kind != "fixed" and rng.random() < 0.7:
        other["law"] = random_law(rng, kind)
    return other


def _loads(rng: Generator, beams: list[Scene], planar: bool) -> list[Scene]:
    loads: list[Scene] = []
    for beam in beams:
        force = [float(v) for v in rng.uniform(-4, 4, 3) * ([1, 1, 0] if planar else 1)]
        force[0] = f"{force[0]!r}*sin(2*t)"  # type: ignore[call-overload]
        axes = str(rng.choice(["inertial", "body", beams[0]["name"]]))
        if rng.random() < 0.5:
            span = [0.2 * beam["length"], 0.9 * beam["length"]]
            loads.append({"on": beam["name"], "force_per_length": force, "axes": axes})
            loads[-1] |= {"span": span} if rng.random() < 0.5 else {}
        else:
            end = str(rng.choice(["mid", "tip", "skew"]))
            loads.append({"on": f"{beam['name']}.{end}", "force": force, "axes": axes})
    return loads


def _spring(rng: Generator, scene: Scene) -> Scene:
    """Between the ground and a section: two sections of one beam would be a spring too."""
    beam = scene["beam"][int(rng.integers(len(scene["beam"])))]["name"]
    law = {"stiffness": float(rng.uniform(5, 30)), "rest": 0.4, "damping": float(rng.uniform(0, 2))}
    return {
        "from": "ground", "to": f"{beam}.{rng.choice(['tip', 'mid', 'root'])}", "law": law,
        "position": [float(v) for v in rng.uniform(-3, 3, 3)],
    }  # fmt: skip


def _drive(rng: Generator, scene: Scene) -> None:
    for hinge in scene["hinge"]:
        if hinge["type"] in ("pin", "prismatic", "universal") and rng.random() < 0.4:
            count = SIZES[hinge["type"]][1]
            hinge["drive"] = ["0.4*sin(2*t)"] * count
            if count == 2:
                hinge["drive"][0] = "free"
            hinge.pop("law", None)
            return


def seeded_scene(seed: int, planar: bool = False, most: int = 4) -> tuple[Scene, Array, Array]:
    """Scene and a state of a seed, which is printed for a failing test."""
    print(f"engine_scenes seed = {seed}")
    scene = varied_scene(seed, planar, most)
    bare = {**scene, "load": [], "spring": []}
    return scene, *random_beams.random_state(bare, seed + 1, 0.03)
