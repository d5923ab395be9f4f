"""Motions of scene families against absolute coordinates with multipliers, run by SciPy; springs
that turn beyond a full turn against closed forms and balances."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

import mstmm
from tests.reference import dae
from tests.reference.algebra import attitude
from tests.reference.jets import Array
from tests.reference.random_scenes import random_state
from tests.reference.tree import read
from tests.support.models import compile_scene
from tests.support.scenes.rods import ROD, chain

SPAN = 0.25


def _oblique(scene: dict[str, Any]) -> dict[str, Any]:
    """Skew axes, skew mass centres and full inertia."""
    for number, body in enumerate(scene["body"]):
        body["center_of_mass"] = [0.5, 0.1 * number - 0.05, 0.15]
        body["inertia"] = [0.09, 0.12, 0.14, 0.01, -0.02, 0.03]
    for number, hinge in enumerate(scene["hinge"]):
        if hinge["type"] in ("pin", "prismatic", "screw", "cylindrical", "planar", "universal"):
            hinge["axis"] = [0.3, 0.2 - 0.3 * number, 0.9]
        if hinge["type"] == "universal":
            hinge["axis2"] = [0.1, 0.9, 0.2]
        if hinge["type"] == "screw":
            hinge["lead"] = 0.6
    return scene


def _springs() -> dict[str, Any]:
    scene = _oblique(chain(["pin", "ball", "pin"], 0.3))
    scene["hinge"][1]["law"] = {"stiffness": [6.0, 5.0, 4.0], "damping": [0.1, 0.2, 0.3]}
    scene["spring"] = [
        {
            "from": "rod0", "to": "rod2.tip",
            "law": {"stiffness": 40.0, "rest": 1.2, "damping": 0.5},
        },
        {
            "from": "ground", "position": [1.0, -2.0, 0.5], "to": "rod1.tip",
            "law": {"stiffness": 20.0, "effort": "3*cos(9*t)"},
        },
    ]  # fmt: skip
    return scene


def _elastic() -> dict[str, Any]:
    scene = _oblique(chain(["elastic", "pin"]))
    scene["hinge"][0]["law"] = {
        "stiffness": [80.0, 60.0, 90.0, 20.0, 30.0, 25.0], "damping": [0.5] * 3 + [0.2] * 3,
    }  # fmt: skip
    return scene


def _loads() -> dict[str, Any]:
    scene = _oblique(chain(["universal", "pin"]))
    scene["load"] = [
        {"on": "rod1.tip", "force": ["5*sin(8*t)", 1.0, 0.0], "axes": "body"},
        {"on": "rod0", "moment": [0.0, "t^2", 0.4], "axes": "rod1"},
    ]
    return scene


FAMILIES: dict[str, Any] = {
    "pins": _oblique(chain(["pin"] * 3, 0.4)),
    "balls": _oblique(chain(["ball"] * 2)),
    "universal": _oblique(chain(["universal", "universal"])),
    "planar": _oblique(chain(["planar", "pin"])),
    "sliders": _oblique(chain(["prismatic", "cylindrical"], 0.4)),
    "screw": _oblique(chain(["screw", "pin"], 0.4)),
    "free root": _oblique(chain(["free", "pin", "pin"], 0.8)),
    "gimbal": _oblique(chain(["gimbal", "pin"])),
    "springs": _springs(),
    "elastic": _elastic(),
    "loads": _loads(),
}


@pytest.mark.parametrize("name", FAMILIES)
def test_families(name: str) -> None:
    scene = FAMILIES[name]
    q, u = random_state(scene, 12)
    times = np.linspace(0.0, SPAN, 4)
    other = dae.simulate(scene, times, q, u, rtol=1e-9, atol=1e-10)
    found = compile_scene(scene).simulate(
        SPAN, rtol=1e-11, atol=1e-13, output_times=times, initial=(q, u)
    )
    assert found.success, found.message
    agree(found, other, scene)


def agree(found: mstmm.Result, other: dae.History, scene: dict[str, Any]) -> None:
    """Coordinates, speeds and poses of all samples."""
    size = max(1.0, float(np.abs(other.u).max()))
    assert np.abs(found.q - other.q).max() < 1e-7 * size
    assert np.abs(found.u - other.u).max() < 1e-6 * size
    for number, body in enumerate(read(scene).bodies):
        assert np.abs(found.position(body.name) - other.position[:, number]).max() < 1e-7 * size
        turned = np.array([attitude(e) for e in found.orientation(body.name)])
        assert np.abs(turned - other.rotation[:, number]).max() < 1e-7 * size


def test_driven_then_released() -> None:
    """Two histories of the reference, with and without the drive, are one run with a release."""
    scene, at = _oblique(chain(["pin", "universal"], 0.4)), 0.15
    scene["hinge"][1]["drive"] = ["0.4*sin(6*t)", "free"]
    released = copy.deepcopy(scene)
    released["hinge"][1]["release"] = f"t >= {at}"
    q, u = random_state(scene, 3)
    held = dae.simulate(scene, np.linspace(0, at, 3), q, u, rtol=1e-10, atol=1e-11)
    bare = copy.deepcopy(scene)
    del bare["hinge"][1]["drive"]
    later = np.linspace(at, 0.3, 3)
    free = dae.simulate(bare, later, held.q[-1], held.u[-1], rtol=1e-10, atol=1e-11)
    times = np.concatenate([held.t[:-1], free.t])
    found = compile_scene(released).simulate(
        0.3, rtol=1e-11, atol=1e-13, output_times=times, initial=(q, u)
    )
    assert found.success, found.message
    assert np.abs(found.q - np.vstack([held.q[:-1], free.q])).max() < 1e-7
    assert np.abs(found.u - np.vstack([held.u[:-1], free.u])).max() < 1e-6


def test_a_fixed_hinge_that_lets_go() -> None:
    """Held as one body with the others until then, in free flight afterwards."""
    scene, at = _oblique(chain(["pin", "fixed"])), 0.1
    q, u = np.array([0.4]), np.array([1.5])
    held = dae.simulate(scene, np.linspace(0, at, 3), q, u, rtol=1e-10, atol=1e-11)
    scene["hinge"][1]["release"] = f"t >= {at}"
    model = compile_scene(scene)
    model_q, model_u = model.initial_state()
    model_q[0], model_u[0] = 0.4, 1.5
    found = model.simulate(
        0.3, rtol=1e-11, atol=1e-13, output_times=[0.0, at / 2, at, 0.2, 0.3],
        initial=(model_q, model_u),
    )  # fmt: skip
    assert found.success, found.message
    assert np.abs(found.q[:3, 0] - held.q[:, 0]).max() < 1e-8
    center = scene["body"][1]["center_of_mass"]
    falls = []
    for k in (2, 3, 4):
        turned = attitude(found.orientation("rod1")[k])
        falls.append(found.position("rod1")[k] + turned @ center)
    turned = attitude(found.orientation("rod1")[2])
    spin = np.cross(found.angular_velocity("rod1")[2], turned @ center)
    start = found.velocity("rod1")[2] + spin
    for fall, time in zip(falls, (0.0, 0.1, 0.2), strict=True):
        expected = falls[0] + start * time + np.array(scene["gravity"]) * time**2 / 2
        assert np.abs(fall - expected).max() < 1e-9


# --- springs beyond a full turn ---------------------------------------------------------------


def two_bodies(kind: str, stiffness: list[float], inertia: Any = (0.2, 0.2, 0.3)) -> Any:
    """Two equal bodies in free flight, joined at their mass centres' common axis z."""
    bodies = [
        {
            "name": name, "mass": 1.0, "center_of_mass": [0, 0, 0.0], "inertia": list(inertia),
            "ends": {"face": [0, 0, 0.1]},
        }
        for name in ("low", "high")
    ]  # fmt: skip
    hinges = [
        {"name": "root", "type": "free", "inboard": "ground", "outboard": "low"},
        {
            "name": "joint", "type": kind, "inboard": "low.face", "outboard": "high",
            "law": {"stiffness": stiffness},
        },
    ]  # fmt: skip
    return {"schema_version": 1, "gravity": [0, 0, 0], "body": bodies, "hinge": hinges}


JOINTS = {"ball": [0.5, 0.5, 0.02], "elastic": [900.0] * 3 + [0.5, 0.5, 0.02]}


@pytest.mark.parametrize("kind", JOINTS)
def test_twist_of_several_turns_is_an_oscillator(kind: str) -> None:
    """Relative twist u0/w sin(w t), w^2 = k / (J/2): more than three turns and back again."""
    model, speed = compile_scene(two_bodies(kind, JOINTS[kind])), 8.0
    rate = np.sqrt(JOINTS[kind][-1] * 2 / 0.3)
    assert speed / rate > 3 * 2 * np.pi
    q, u = model.initial_state()
    u[-1], times = speed, np.linspace(0, 2 * np.pi / rate, 60)
    result = model.simulate(times[-1], rtol=1e-12, atol=1e-13, output_times=times, initial=(q, u))
    assert result.success, result.message
    twist = speed / rate * np.sin(rate * times)
    assert np.abs(result.u[:, -1] - speed * np.cos(rate * times)).max() < 1e-8
    assert np.abs(result.effort("joint")[:, -1] + JOINTS[kind][-1] * twist).max() < 1e-9
    stored = 0.5 * JOINTS[kind][-1] * twist**2
    assert np.abs(result.energy_components()["springs"] - stored).max() < 1e-9


@pytest.mark.parametrize("kind", JOINTS)
def test_twist_with_swing_keeps_energy_and_momentum(kind: str) -> None:
    """Skew bodies, wide swings and three turns of twist: the springs come from a potential."""
    scene = two_bodies(kind, JOINTS[kind], (0.2, 0.25, 0.3))
    scene["body"][0]["center_of_mass"] = [0.05, -0.02, 0.0]
    scene["body"][1]["center_of_mass"] = [0.02, 0.03, 0.1]
    model = compile_scene(scene)
    q, u = model.initial_state()
    u[-3:] = [0.4, -0.3, 8.0]
    times = np.linspace(0, 12.0, 241)
    result = model.simulate(12.0, rtol=1e-11, atol=1e-12, output_times=times, initial=(q, u))
    assert result.success, result.message
    twist = np.abs(unwrapped_twist(result.coordinates("joint")[:, -4:])).max()
    assert twist > 2 * 2 * np.pi
    energy, turning = result.energy(), result.angular_momentum()
    assert np.abs(energy - energy[0]).max() < 1e-8 * energy[0]
    assert np.abs(turning - turning[0]).max() < 1e-8 * np.abs(turning).max()
    assert result.energy_components()["springs"].max() > 0.3 * energy[0]


def unwrapped_twist(quaternions: Array) -> Array:
    """Twist about z, followed continuously."""
    half = np.unwrap(np.arctan2(quaternions[:, 3], quaternions[:, 0]))
    return 2 * (half - half[0])


def test_swing_of_a_ball_past_the_horizontal_keeps_its_energy() -> None:
    scene = chain(["ball", "ball"], inertia=(0.05, ROD, ROD))
    for hinge in scene["hinge"]:
        hinge |= {"axis": [1, 0, 0], "law": {"stiffness": [2.0, 2.0, 2.0]}}
    model = compile_scene(scene)
    q, u = model.initial_state()
    q[4:8] = [np.cos(0.95), 0, np.sin(0.95), 0]
    u[:] = [0.5, 0.3, -0.4, 2.0, 3.0, -2.0]
    result = model.simulate(1.5, rtol=1e-11, atol=1e-12, initial=(q, u))
    assert result.success, result.message
    energy = result.energy()
    assert np.abs(energy - energy[0]).max() < 1e-8 * result.energy_components()["kinetic"].max()
    tilt = [attitude(e)[0, 0] for e in result.coordinates("hinge1")]
    assert min(tilt) < 0
