"""Loads and gravity as arrows: where they are, how long, and which way."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.result.result import Result
from mstmm.runtime.result.scene3d.scene_builder import build_scene_graph
from mstmm.runtime.result.scene3d.solid_meshes import circular_arrows, straight_arrows

ROD = {
    "name": "rod", "mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.001, 0.084, 0.084],
    "ends": {"tip": [1, 0, 0]},
}  # fmt: skip
PIN = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod"}


def run_of(t_end: float = 1.0, **tables: Any) -> Result:
    scene = mstmm.Scene(**{"gravity": [0, -9.81, 0], "body": [ROD], "hinge": [PIN], **tables})
    times = np.linspace(0.0, t_end, 11)
    return mstmm.compile(scene, engine="looped").simulate(t_end, output_times=times)


@pytest.fixture(scope="module")
def run() -> Result:
    loads = [
        {"name": "jet", "on": "rod.tip", "force": ["1 + t", 2.0, 0], "axes": "body"},
        {"name": "motor", "on": "rod", "moment": [0, 0, "-4*t"]},
    ]
    return run_of(load=loads)


def test_loads_are_quantities(run: Result) -> None:
    angle = run.coordinates("pin")[:, 0]
    along, across = 1 + run.t, 2.0
    expected = np.stack([
        along * np.cos(angle) - across * np.sin(angle),
        along * np.sin(angle) + across * np.cos(angle), 0 * angle,
    ], axis=1)  # fmt: skip
    assert run.quantity("jet.force").values == pytest.approx(expected, abs=1e-12)
    assert run.quantity("motor.moment.z").values == pytest.approx(-4 * run.t)


def test_arrows_go_with_their_loads(run: Result) -> None:
    stage = build_scene_graph(run, "loads", most=11)
    force, moment = (
        next(b for b in stage.deforming_surfaces if b.name.startswith(x)) for x in ("forc", "mom")
    )
    tail, tip = run.position("rod.tip"), force.vertices[:, -1]
    loads = run.quantity("jet.force").values
    unit = np.linalg.norm(tip[-1] - tail[-1]) / np.linalg.norm(loads[-1])
    assert tip - tail == pytest.approx(unit * loads, abs=1e-9)
    away = np.linalg.norm(moment.vertices - np.array([0.0, 0.0, 0.0]), axis=2)
    assert away[0] == pytest.approx(np.zeros(len(away[0])), abs=1e-12)  # no moment yet
    assert away[-1, -1] == pytest.approx(2 * away[5, -1], rel=1e-9)
    told = stage.labels["loads/jet"]
    assert told.labels[:2] == (("force x", "N"), ("force y", "N"))


def test_a_force_at_a_mass_center_is_drawn_there() -> None:
    push = {"on": "rod", "at": "center_of_mass", "force": [0, 2.0, 0]}
    run = run_of(load=[push])
    stage = build_scene_graph(run, "loads", most=11)
    (force,) = (one for one in stage.deforming_surfaces if one.name.startswith("forces"))
    away = force.vertices[:, -1] - run.position("rod.tip") / 2
    assert np.abs(away[:, [0, 2]]).max() < 1e-9 and (away[:, 1] > 0).all()


def test_turned_arrows_are_right_handed() -> None:
    vertices, faces = circular_arrows(np.zeros((1, 3)), np.array([[0.0, 0.0, 2.0]]), 0.01)
    middles = vertices[0].reshape(-1, 10, 3).mean(axis=1)
    angles = np.unwrap(np.arctan2(middles[:, 1], middles[:, 0]))
    assert np.all(np.diff(angles) >= -1e-12)
    assert angles[-1] - angles[0] == pytest.approx(1.5 * np.pi)
    assert np.linalg.norm(middles, axis=1) == pytest.approx(2.0)
    assert _volume(vertices[0], faces) > 0


def test_straight_arrows_are_closed_and_seen_from_outside() -> None:
    vertices, faces = straight_arrows(np.zeros((1, 3)), np.array([[1.0, -2.0, 2.0]]), 0.05)
    assert vertices[0, -1] == pytest.approx([1, -2, 2])
    area = 0.5 * 10 * np.sin(2 * np.pi / 10) * 0.05**2
    neck = 3.0 - 6 * 0.05
    assert _volume(vertices[0], faces) == pytest.approx(area * (neck + 2.4**2 * 0.3 / 3))


def _volume(vertices: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def test_a_load_per_length_is_a_comb() -> None:
    beam = {"name": "blade", "length": 2.0, "mass_per_length": 1.0, "bending_stiffness": 40.0,
            "modes": {"y": 1}}  # fmt: skip
    pin = {**PIN, "outboard": "blade"}
    wind = {"name": "wind", "on": "blade", "force_per_length": [0, "3*t", 0], "span": [0.5, 2.0]}
    run = run_of(body=[], beam=[beam], hinge=[pin], load=[wind])
    assert run.quantity("wind.force.y").values == pytest.approx(1.5 * 3 * run.t)
    stage = build_scene_graph(run, "comb", most=11)
    [comb] = [bent for bent in stage.deforming_surfaces if bent.name == "forces/wind"]
    tips = comb.vertices[-1].reshape(7, -1, 3)[:, -1]
    tails = comb.vertices[-1].reshape(7, -1, 3)[:, 0]
    assert tails[-1] == pytest.approx(run.position("blade.tip")[-1], abs=1e-9)
    assert tips - tails == pytest.approx(np.tile([0, tips[0, 1] - tails[0, 1], 0], (7, 1)))
    assert tips[0, 1] > tails[0, 1]


def test_gravity_is_beside_everything_and_points_down(run: Result) -> None:
    stage = build_scene_graph(run, "down", most=11)
    [arrow] = [solid for solid in stage.solids if solid.owner == "gravity"]
    tail, tip = arrow.surface.vertices[0], arrow.surface.vertices[-1]
    assert tip - tail == pytest.approx([0, -np.linalg.norm(tip - tail), 0], abs=1e-12)
    rest = [solid for solid in stage.solids if solid is not arrow]
    assert arrow.surface.vertices[:, 0].max() < min(s.surface.vertices[:, 0].min() for s in rest)
    assert stage.labels["gravity"].text == ("9.81 m/s2",)
    floating = build_scene_graph(run_of(gravity=[0, 0, 0]), "floating", most=2)
    assert not [solid for solid in floating.solids if solid.owner == "gravity"]


def test_loads_that_controllers_set_are_what_they_set() -> None:
    """The last output of a controller holds until its next sample."""
    tables: dict[str, Any] = {
        "input": [{"name": "push", "unit": "N"}],
        "load": [{"name": "hand", "on": "rod.tip", "force": [0, "2*push", 0]}],
        "controller": [{
            "name": "keeper", "inputs": ["pin.angle"], "outputs": ["push"], "sample_time": 0.1,
            "D": [[-3.0]],
        }],
    }  # fmt: skip
    run = run_of(**tables)
    push = run.quantity("push").values
    assert np.ptp(push) > 0.5
    assert run.quantity("hand.force.y").values == pytest.approx(2 * push)
