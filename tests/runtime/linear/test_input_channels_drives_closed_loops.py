"""Motions of drives as inputs of linear models of mechanisms: roads, shakers, platforms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from tests.runtime.model.test_equilibrium_closed_loops import five_bar
from tests.support.models import compile_scene
from tests.support.scenes.linkages import angles, four_bar

OMEGA = np.array([0.7, 3.0, 11.0, 40.0])


def sprung_four_bar(cut: str) -> dict[str, Any]:
    """A four-bar on springs and dampers."""
    law = {"foot": {"stiffness": 30.0, "rest": 0.4, "damping": 0.3}, "end": {"damping": 0.05}}
    return four_bar(0.6, cut=cut, laws=law)


def on_a_platform(cut: str) -> dict[str, Any]:
    """The same on a platform that a drive moves up."""
    scene = sprung_four_bar(cut)
    scene["body"].append({"name": "platform", "mass": 5.0, "inertia": [1, 1, 1],
                          "ends": {"foot": [0, 0, 0], "end": [1.2, 0, 0]}})  # fmt: skip
    for hinge in scene["hinge"]:
        if hinge["inboard"] == "ground":
            hinge["inboard"] = f"platform.{hinge['name']}"
            hinge.pop("position", None)
    lift = {"name": "lift", "type": "prismatic", "axis": [0, 1, 0], "inboard": "ground",
            "outboard": "platform", "drive": "road"}  # fmt: skip
    scene["hinge"].insert(0, lift)
    return scene | {"input": [{"name": "road", "unit": "m", "rates": [0, 0]}]}


@pytest.mark.parametrize("cut", ["tip", "knee"])
def test_a_platform_that_moves_is_a_ground_that_moves(cut: str) -> None:
    """Coordinates answer to a motion as to the acceleration of the ground that it is."""
    outputs = ["foot.angle", "tip.angle_rate", "end.angle_acceleration"]
    moved, still = compile_scene(on_a_platform(cut)), compile_scene(sprung_four_bar(cut))
    found = moved.frequency_response(OMEGA, ["road"], outputs).response
    pushed = still.frequency_response(OMEGA, ["ground.acceleration.y"], outputs).response
    wanted = -(OMEGA**2)[:, None, None] * pushed
    assert np.abs(found - wanted).max() < 1e-10 * np.abs(wanted).max()


def driven_five_bar(value: float, *rates: float, cut: str = "top") -> mstmm.Model:
    """A five-bar whose second crank a drive turns: all hinges go along with it."""
    scene = five_bar({})
    laws: dict[int, dict[str, Any]] = {
        0: {"stiffness": 60.0, "rest": 1.0, "damping": 1.5},
        1: {"stiffness": 2.0, "damping": 0.4},
        4: {"stiffness": 5.0, "damping": 0.2},
    }
    for place, law in laws.items():
        scene["hinge"][place]["law"] = law
    scene["hinge"][2] |= {"drive": "turn", "initial": {}}
    if cut == "foot1":  # the crank hangs on its link, which hangs on the other one
        crank, link, top = scene["hinge"][2:]
        ends = {"knee1": ("link1", "crank1.tip"), "top": ("link0.tip", "link1.tip")}
        for hinge in (link, top):
            hinge["inboard"], hinge["outboard"] = ends[hinge["name"]]
        link["initial"] = {"q": -link["initial"]["q"]}
        crank["cut"] = True
    turn = {"name": "turn", "unit": "rad", "value": value, "rates": list(rates)}
    return compile_scene(scene | {"input": [turn]})


@pytest.fixture(scope="module")
def five_bar_model() -> mstmm.Model:
    return driven_five_bar(1.0, 0, 0)


def test_equilibria_follow_the_drive(five_bar_model: mstmm.Model) -> None:
    """K x = - K_d d, by central differences between equilibria."""
    linear = five_bar_model.linearize(inputs=["foot1.angle_acceleration"])
    q, size, place = np.asarray(linear.state.q), 1e-4, linear.free_speed_indices[0]
    ends = [driven_five_bar(1.0 + s * size, 0, 0).equilibrium(q) for s in (1, -1)]
    slope = (ends[0] - ends[1])[place] / (2 * size)
    wanted = -np.linalg.solve(linear.K, linear.K_prescribed)[0, 0]
    assert abs(slope / wanted - 1) < 1e-6
    slow = five_bar_model.frequency_response(
        [1e-6], ["turn"], [linear.coordinate_names[0]]
    ).response[0, 0, 0]
    assert abs(slow.real / wanted - 1) < 1e-9


def test_accelerations_follow_the_drive(five_bar_model: mstmm.Model) -> None:
    """M x'' = - M_d d'' - C_d d', the second by central differences."""
    linear = five_bar_model.linearize(inputs=["foot1.angle_acceleration"])
    q, place = np.asarray(linear.state.q), linear.free_speed_indices[0]
    mechanism = linear.constrained_motion
    assert mechanism is not None
    still = np.zeros(five_bar_model.nu)
    pushed = driven_five_bar(1.0, 0, 1.0).accelerations(q, still)[place]
    assert abs(pushed / np.linalg.solve(linear.M, linear.V)[0, 0] - 1) < 1e-9
    rows = mechanism.rows(linear.state, {0: np.eye(five_bar_model.nu)}, [linear.drive_indices[0]])[
        0
    ]
    along = rows[:, linear.drive_indices[0]]
    size = 1e-4
    going = [driven_five_bar(1.0, s * size, 0).accelerations(q, s * size * along)[place]
             for s in (1, -1)]  # fmt: skip
    slope = (going[0] - going[1]) / (2 * size)
    wanted = -np.linalg.solve(linear.M, linear.C_prescribed)[0, 0]
    assert abs(slope / wanted - 1) < 1e-6


def test_states_and_frequencies_agree(five_bar_model: mstmm.Model) -> None:
    """Outputs of hinges, bodies and accelerations, which go along with the drive themselves."""
    outputs = ["top.angle", "link1.tip.position.x", "crank1.tip.velocity.y",
               "knee0.angle_acceleration", "foot1.angle"]  # fmt: skip
    linear = five_bar_model.linearize(inputs=["foot1.angle_acceleration"])
    c, d = linear.output_matrices(outputs)
    found = five_bar_model.frequency_response(OMEGA, ["turn"], outputs).response
    for k, s in enumerate(1j * OMEGA):
        states = np.linalg.solve(s * np.eye(len(linear.A)) - linear.A, linear.B)
        wanted = (c @ states + d) * s**2
        assert np.abs(found[k] - wanted).max() < 1e-9 * np.abs(wanted).max()
    assert np.abs(found[:, 4] - 1).max() < 1e-9


def test_a_driven_hinge_may_be_the_cut_one(five_bar_model: mstmm.Model) -> None:
    other = driven_five_bar(1.0, 0, 0, cut="foot1")
    assert "foot1" in other.loops.cut_hinges
    outputs = ["foot0.angle", "link1.tip.velocity.y"]
    here, there = (
        one.frequency_response(OMEGA, ["turn"], outputs) for one in (five_bar_model, other)
    )
    assert np.abs(here.response - there.response).max() < 1e-8 * np.abs(here.response).max()


def test_a_driven_crank_leaves_nothing_but_kinematics() -> None:
    scene = four_bar(0.6)
    scene["hinge"][0] |= {"drive": "turn", "initial": {}}
    turn = {"name": "turn", "unit": "rad", "value": 0.6, "rates": [0, 0]}
    found = compile_scene(scene | {"input": [turn]}).frequency_response(
        [2.0], ["turn"], ["end.angle"]
    )
    slope = (angles(0.6 + 1e-4)[1] - angles(0.6 - 1e-4)[1]) / 2e-4
    assert abs(found.response[0, 0, 0] - slope) < 1e-7
