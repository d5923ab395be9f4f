"""What must not matter: axes of the scene, cuts through a rigid body, the end a chain is read from;
and what must not change: momentum and energy of an isolated system."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from reference import newton_euler as dense
from reference import random_scenes
from reference.algebra import orientation, quaternion_matrix, quaternion_product, to_quaternion
from reference.compare import drawn, fresh, worst
from reference.jets import Array, as_jet

import mstmm

MOVING = ("pin", "prismatic", "screw", "cylindrical", "universal", "ball", "planar", "gimbal")


def compiled(scene: dict[str, Any]) -> mstmm.Model:
    return mstmm.compile(mstmm.Scene(**scene))


def turned(scene: dict[str, Any], e: Array) -> dict[str, Any]:
    """The whole scene turned by the quaternion e: ground positions, gravity, first hinges."""
    rotation = quaternion_matrix(as_jet(e)).x
    hinges = []
    for hinge in scene["hinge"]:
        if hinge["inboard"] == "ground":
            given = np.asarray(hinge["orientation"], float)
            if len(given) == 3:
                given = to_quaternion(orientation(given))
            place = (rotation @ hinge["position"]).tolist()
            hinge = hinge | {"position": place}
            hinge["orientation"] = quaternion_product(e, given).tolist()
        hinges.append(hinge)
    gravity = (rotation @ scene["gravity"]).tolist()
    return scene | {"hinge": hinges, "gravity": gravity}


@pytest.mark.parametrize("draw", range(8))
def test_turning_the_whole_scene_changes_no_coordinate(draw: int, rng: np.random.Generator) -> None:
    scene, q, u = fresh(rng, loads=False) if draw > 3 else drawn(draw, loads=False)
    e = rng.normal(size=4)
    other = turned(scene, e / np.linalg.norm(e))
    assert worst(compiled(other).accelerations(q, u), compiled(scene).accelerations(q, u)) < 1e-11


def halves(body: dict[str, Any], rng: np.random.Generator) -> tuple[dict[str, Any], ...]:
    """Two bodies which, welded at a skew end, are the given one."""
    share = 0.4
    offset = rng.uniform(-0.01, 0.01, 3)  # small beside the least radius of gyration
    center = np.array(body["center_of_mass"])
    mass = body["mass"]
    centers = center + offset / share, center - offset / (1 - share)
    masses = share * mass, (1 - share) * mass
    xx, yy, zz, xy, xz, yz = body["inertia"]
    whole = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    for m, c in zip(masses, centers, strict=True):
        d = c - center
        whole = whole - m * (d @ d * np.eye(3) - np.outer(d, d))
    first, second = 0.5 * whole, 0.5 * whole
    place, frame = rng.uniform(-1, 1, 3), rng.normal(size=4)
    frame /= np.linalg.norm(frame)
    rotation = quaternion_matrix(as_jet(frame)).x

    def entries(t: Array) -> list[float]:
        return [float(t[i]) for i in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]

    weld = {"position": place.tolist(), "orientation": frame.tolist()}
    one = body | {
        "mass": masses[0],
        "center_of_mass": centers[0].tolist(),
        "inertia": entries(first),
        "ends": body["ends"] | {"weld": weld},
    }
    two = {
        "name": f"{body['name']}b",
        "mass": masses[1],
        "center_of_mass": (rotation.T @ (centers[1] - place)).tolist(),
        "inertia": entries(rotation.T @ second @ rotation),
    }
    return one, two


@pytest.mark.parametrize("draw", range(6))
def test_two_welded_halves_are_one_body(draw: int, rng: np.random.Generator) -> None:
    scene, q, u = drawn(draw + 300, types=MOVING)
    bodies, welds = [], []
    for body in scene["body"]:
        one, two = halves(body, rng)
        bodies += [one, two]
        welds.append({"name": f"weld_{body['name']}", "type": "fixed",
                      "inboard": f"{body['name']}.weld", "outboard": two["name"]})  # fmt: skip
    other = scene | {
        "body": bodies,
        "hinge": scene["hinge"] + welds,
        "allow_unphysical_inertia": True,
    }
    expected = compiled(scene).accelerations(q, u, t=0.2)
    assert worst(compiled(other).accelerations(q, u, t=0.2), expected) < 1e-11


def floating_chain(reverse: bool) -> dict[str, Any]:
    """Three bodies on pins about z, floating; read from the first or from the last body."""
    inertia = [
        [0.2, 0.3, 0.25, 0.01, -0.02, 0.03],
        [0.4, 0.35, 0.3, 0.0, 0.05, 0.0],
        [0.1, 0.2, 0.15],
    ]
    bodies = [
        {"name": f"b{i}", "mass": 1.0 + i, "center_of_mass": [0.4, 0.1 * i, -0.05],
         "inertia": inertia[i], "ends": {"left": [0, 0, 0], "right": [1.0, 0.1, 0.2]}}
        for i in range(3)
    ]  # fmt: skip
    order = [2, 1, 0] if reverse else [0, 1, 2]
    near, far = ("right", "left") if reverse else ("left", "right")
    root = {"name": "root", "type": "free", "inboard": "ground", "outboard": f"b{order[0]}"}
    hinges: list[dict[str, Any]] = [root]
    for a, b in itertools.pairwise(order):
        hinges.append({"name": f"pin{a}{b}", "type": "pin", "inboard": f"b{a}.{far}",
                       "outboard": f"b{b}.{near}", "axis": [0, 0, 1],
                       "law": {"stiffness": 2.0, "damping": 0.3}})  # fmt: skip
    return {"schema_version": 1, "gravity": [0, 0, -1.0], "body": bodies, "hinge": hinges}


def test_a_chain_may_be_read_from_either_end() -> None:
    forward, backward = floating_chain(False), floating_chain(True)
    rng = np.random.default_rng(3)
    q, u = rng.uniform(-1, 1, 9), rng.uniform(-1, 1, 8)
    q[3:7] /= np.linalg.norm(q[3:7])
    at = dense.motion(forward, q, u)
    # The same motion seen from the last body: its pose and twist, the angles' signs turned.
    turned_axes = at.A[2]
    e = to_quaternion(turned_axes)
    other_q = np.concatenate([at.r[2], e, [-q[8], -q[7]]])
    twist = [turned_axes.T @ at.v[2], turned_axes.T @ at.w[2]]
    other_u = np.concatenate([*twist, [-u[7], -u[6]]])
    one = compiled(forward).simulate(0.5, rtol=1e-12, atol=1e-13, initial=(q, u))
    two = compiled(backward).simulate(0.5, rtol=1e-12, atol=1e-13, initial=(other_q, other_u))
    for name in ("b0", "b1", "b2"):
        assert worst(two.position(name)[0], one.position(name)[0]) < 1e-13
        assert worst(two.acceleration(name)[0], one.acceleration(name)[0]) < 1e-11
        assert two.position(name)[-1] == pytest.approx(one.position(name)[-1], abs=1e-9)
    assert two.coordinate("pin10")[-1] == pytest.approx(-one.coordinate("pin01")[-1], abs=1e-9)


@pytest.mark.parametrize("seed", [21, 22, 23])
def test_momentum_of_a_floating_tree_is_constant(seed: int) -> None:
    scene = random_scenes.floating_tree(seed)
    q, u = random_scenes.random_state(scene, 3)
    result = compiled(scene).simulate(1.0, rtol=1e-11, atol=1e-12, initial=(q, u))
    assert result.success, result.message
    linear, angular = dense.momentum(scene, q, u)
    for found, start in ((result.momentum(), linear), (result.angular_momentum(), angular)):
        assert worst(found, np.tile(start, (len(result.t), 1))) < 1e-8


@pytest.mark.parametrize("seed", [1, 3, 5])
def test_energy_is_constant_without_damping_and_loads(seed: int) -> None:
    scene, q, u = drawn(seed, types=("pin", "ball", "elastic", "cylindrical"), loads=False, most=5)
    for hinge in scene["hinge"]:
        law = hinge.get("law", {})
        for key in ("damping", "effort", "friction", "limits"):
            law.pop(key, None)
    result = compiled(scene).simulate(1.0, rtol=1e-11, atol=1e-12, initial=(q, u))
    assert result.success, result.message
    start = dense.energy(scene, q, u)
    assert worst(result.energy(), np.full(len(result.t), start), floor=1.0) < 1e-7
