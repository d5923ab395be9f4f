"""Bodies in closed loops that start in their static shapes: closed forms, runs that damping
settles, and the open tree under the forces that close it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure
from tests.support.models import looped_model
from tests.system.loops.test_flexible_against_tree import (
    Scene,
    hanging_bar,
    meshed_slider_crank,
    opened_tree,
    shackled_beam,
    slider_crank,
)

GRAVITY = 9.81


def set_static_start(scene: Scene, *names: str, **more: Any) -> Scene:
    """The scene with the static start for the bodies of some names, or all that bend."""
    for body in (*scene.get("beam", ()), *scene.get("elastic", ())):
        if not names or body["name"] in names:
            body |= {"initial": "static", **more}
    return scene


@pytest.mark.parametrize("last, sag", [("pin", 1 / 76.8), ("fixed", 1 / 192)])
def test_beams_on_two_supports_sag(last: str, sag: float) -> None:
    """By w L^4 / 76.8 EI in the middle between two hinges, 1 / 192 where an end is clamped."""
    bending = 200.0
    beam = {"name": "b", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": bending,
            "modes": {"y": 6}, "ends": {"mid": 0.5}}  # fmt: skip
    cart = {"name": "cart", "mass": 0.1, "inertia": [1e-3] * 3}
    hinges = [
        {"name": "foot", "type": "pin", "inboard": "ground", "outboard": "b"},
        {"name": "rail", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
         "outboard": "cart", "initial": {"q": 1.0}},
        {"name": "end", "type": last, "inboard": "b.tip", "outboard": "cart"},
    ]  # fmt: skip
    scene = {"gravity": [0, -GRAVITY, 0], "body": [cart], "beam": [beam], "hinge": hinges}
    model = looped_model(set_static_start(scene))
    seen = model.simulate(0.05, output_times=[0.0, 0.05])
    height = seen.position("b.mid")[:, 1]
    assert height[0] == pytest.approx(-sag * GRAVITY / bending, rel=2e-3)
    assert height[1] == pytest.approx(height[0], rel=1e-6)  # and stays: nothing is free but shapes


def test_a_run_that_damping_settles() -> None:
    """The crank is held by a drive that stands still."""
    scene = slider_crank()
    del scene["hinge"][0]["initial"]
    scene["hinge"][0]["drive"] = "0.6"
    scene["beam"][0]["damping"] = 0.7
    settled = looped_model(scene).simulate(0.4, rtol=1e-10, output_times=[0.4])
    q, u = looped_model(set_static_start(scene)).initial_state()
    assert not u.any()
    np.testing.assert_allclose(q, settled.q[-1], rtol=0, atol=1e-9)
    assert np.abs(q[-2:]).max() > 1e-5


SCENES = {"slider_crank": (slider_crank, ("bar.tip", "slider"), 2, [0]),
          "shackled": (shackled_beam, ("bar.tip", "far.tip"), 2, [0]),
          "hung": (hanging_bar, ("right.tip", "bar.tip"), 3, [0, 1, 2, 3, 5])}  # fmt: skip


@pytest.mark.parametrize("name", SCENES)
def test_forces_that_close_the_loop_hold_the_shapes(name: str) -> None:
    """The open tree needs efforts in as many hinges as the mechanism has freedoms with its shapes
    held, and nowhere else."""
    made, ends, rows, held = SCENES[name]
    scene = set_static_start(made())
    for hinge in scene["hinge"]:
        hinge.get("initial", {}).pop("u", None)
    model = looped_model(scene)
    q, u = model.initial_state()
    layout = model.coordinate_layout
    start = layout.hinges[scene["hinge"][0]["name"]].q_slice
    assert model.loop_start is not None
    np.testing.assert_allclose(q[start], model.loop_start.start[0][start], rtol=0, atol=1e-12)
    wrist = layout.hinges["wrist"]
    tree = opened_tree(scene, rows, ends)
    q, u = np.delete(q, wrist.q_slice), np.delete(u, wrist.u_slice)

    def required_efforts(forces: Array) -> Array:
        one = tree.with_inputs({f"pull{k}": float(x) for k, x in enumerate(forces)})
        return one.inverse_dynamics(q, u, 0 * u)

    none = required_efforts(np.zeros(rows))
    columns = np.array([required_efforts(unit) - none for unit in np.eye(rows)]).T
    free = np.delete(np.arange(len(u)), held)
    forces = np.linalg.lstsq(columns[free], -none[free], rcond=None)[0]
    left = none + columns @ forces
    assert np.abs(left[free]).max() < 1e-8 * np.abs(none).max()
    assert np.abs(left[held]).max() > 1e-2 * np.abs(none).max()
    assert np.abs(q[-2:]).max() > 1e-4


def test_a_crank_that_turns_stretches_and_bends_the_rod() -> None:
    """No shape moves or accelerates while the crank keeps its 8 rad/s."""
    scene = set_static_start(slider_crank())
    q, u = looped_model(scene).initial_state()
    at_rest = slider_crank()
    at_rest["hinge"][0]["initial"].pop("u")
    bent = looped_model(set_static_start(at_rest)).initial_state()[0]
    assert abs(u[0] - 8.0) < 1e-12 and not u[-2:].any()
    assert np.abs(q - bent)[-2:].max() > 0.3 * np.abs(bent[-2:]).max()
    scene["hinge"][0]["drive"] = "0.6 + 8*t"
    del scene["hinge"][0]["initial"]
    driven = looped_model(scene)
    np.testing.assert_allclose(driven.initial_state()[0], q, atol=1e-12)
    np.testing.assert_allclose(driven.initial_state()[1], u, atol=1e-9)
    rates = driven.accelerations(q, u)
    assert np.abs(rates[-2:]).max() < 1e-5 * np.abs(rates).max()


def test_given_shapes_and_held_hinges_stay() -> None:
    scene = hanging_bar()
    scene["beam"][0]["initial"] = {"eta": [0.01, 0.0, -0.004, 0.0]}
    scene["hinge"][2] |= {"hold": True, "initial": {"q": [0.02, -0.03]}}
    model = looped_model(set_static_start(scene, "right"))
    q, u = model.initial_state()
    assert model.loop_start is not None
    first, layout = model.loop_start.start[0], model.coordinate_layout
    for slots in (layout.modal["left"], layout.hinges["third"]):
        np.testing.assert_allclose(q[slots.q_slice], first[slots.q_slice], atol=1e-12)
    np.testing.assert_allclose(q[layout.hinges["third"].q_slice], [0.02, -0.03], atol=1e-12)
    right = layout.modal["right"]
    assert np.abs(q[right.q_slice]).max() > 1e-4 and not u[right.u_slice].any()
    again = model.assemble(q, u)
    np.testing.assert_allclose(again[0], q, atol=1e-9)


def test_a_mesh_starts_bent_too() -> None:
    model = looped_model(set_static_start(meshed_slider_crank()))
    q, _ = model.initial_state()
    assert model.loop_start is not None
    moved = model.coordinate_layout.modal["bar"].q_slice
    assert abs(q[0] - model.loop_start.start[0][0]) < 1e-12 and np.abs(q[moved]).max() > 1e-5


def test_what_is_too_soft_is_told() -> None:
    scene = set_static_start(slider_crank(stiffness=0.01))
    scene["hinge"][0]["initial"].pop("u")
    with pytest.raises(NumericalFailure, match='"bar": no static deformation found'):
        looped_model(scene).initial_state()
