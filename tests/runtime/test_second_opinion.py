"""SciPy on the same call-backs says the same: breaks, events, releases, memory, output times."""

from __future__ import annotations

import numpy as np
import pytest
from support.result_scenes import motor, pins, rod, tree

import mstmm
from mstmm.runtime.integrate import Status

METHODS = ("scipy-DOP853", "scipy-RK45", "scipy-Radau", "scipy-BDF", "scipy-LSODA")


@pytest.mark.parametrize("method", METHODS)
def test_both_integrators_agree_on_a_scene_with_everything(method: str) -> None:
    model, t = mstmm.compile(tree()), np.linspace(0, 0.5, 11)
    ours = model.simulate(0.5, output_times=t, rtol=1e-11)
    run = model.simulate(0.5, method=method, output_times=t, rtol=1e-7, atol=1e-9)
    assert run.success and run.status is Status.FINISHED
    np.testing.assert_array_equal(run.t, t)
    np.testing.assert_allclose(run.q, ours.q, atol=1e-5)
    np.testing.assert_allclose(run.u, ours.u, atol=5e-5)
    np.testing.assert_allclose(run.work, ours.work, atol=1e-4)
    assert run.certificate.energy.relative < 1e-4
    assert run.statistics is not None and run.statistics.evaluations > 50


@pytest.mark.parametrize("method", ["scipy-DOP853", "scipy-Radau", "scipy-LSODA"])
def test_a_release_by_time_and_a_stop_by_place(method: str) -> None:
    hinge = {"name": "motor", "type": "pin", "inboard": "ground", "outboard": "rod",
             "drive": "0.5*sin(3*t)", "release": "t >= 1"}  # fmt: skip
    event = {"name": "deep", "when": "rod.tip.y < -0.999", "do": "stop"}
    scene = mstmm.Scene(gravity=(0, -9.81, 0), body=[rod("rod")], hinge=[hinge], event=[event])
    model = mstmm.compile(scene)
    ours = model.simulate(5.0, rtol=1e-11)
    run = model.simulate(5.0, method=method, rtol=1e-9, atol=1e-11)
    assert run.success and run.status is Status.STOPPED and '"deep"' in run.message
    assert run.t[-1] == pytest.approx(ours.t[-1], abs=1e-6)
    assert run.position("rod.tip")[-1, 1] == pytest.approx(-0.999, abs=1e-6)
    assert list(run.event[run.event != 0]) == list(ours.event[ours.event != 0])
    released = run.t[run.event == 2]
    np.testing.assert_allclose(released, 1.0, atol=1e-12)
    np.testing.assert_allclose(run.q[run.t < 1, 0], 0.5 * np.sin(3 * run.t[run.t < 1]), atol=1e-14)


def test_an_event_that_holds_from_the_start_fires_at_once() -> None:
    data = pins(1, [0.3]).model_dump(by_alias=True, exclude_unset=True)
    scene = mstmm.Scene.from_data(data | {"event": [{"when": "rod0.tip.x > 0", "do": "stop"}]})
    model = mstmm.compile(scene)
    for method in ("dop853", "scipy-RK45"):
        run = model.simulate(1.0, method=method)
        assert run.status is Status.STOPPED and run.t[-1] == 0.0


def test_a_jump_in_an_effort_is_a_break_in_time() -> None:
    """Constant torque in two pieces: exact for every method that stops at t = 0.3."""
    scene = motor("where(t < 0.3, 2, -1)")
    run = mstmm.compile(scene).simulate(1.0, method="scipy-RK45", rtol=1e-4, atol=1e-4)
    inertia = 1 / 3
    speed = (2 * 0.3 - 0.7) / inertia
    assert run.u[-1, 0] == pytest.approx(speed, abs=1e-12)
    assert 0.3 in run.t and len(run.t) < 25


def test_turns_of_a_ball_spring_are_counted_as_in_the_c_loop() -> None:
    hinge = {"name": "ball", "type": "ball", "inboard": "ground", "outboard": "rod",
             "axis": [1, 0, 0], "initial": {"u": [9.0, 0.1, 0.2]},
             "law": {"stiffness": [0.001, 0.001, 0.001]}}  # fmt: skip
    model = mstmm.compile(mstmm.Scene(gravity=(0, 0, 0), body=[rod("rod")], hinge=[hinge]))
    t = np.linspace(0, 2, 21)
    ours = model.simulate(2.0, output_times=t, rtol=1e-10)
    run = model.simulate(2.0, method="scipy-DOP853", output_times=t, rtol=1e-9)
    np.testing.assert_allclose(run.energies()["springs"], ours.energies()["springs"], atol=1e-7)
    np.testing.assert_allclose(run.q, ours.q, atol=1e-6)
    assert ours.trajectory.memory[-1].max() > 2 * np.pi


@pytest.mark.parametrize("method", METHODS)
def test_blowing_up_is_a_failure_with_everything_so_far(method: str) -> None:
    """u' = exp(3u) * 3 from u = 1 ends at t = exp(-3)/9."""
    run = mstmm.compile(motor("exp(u[0])^3", speed=1.0)).simulate(1.0, method=method, rtol=1e-6)
    assert not run.success and run.status in (Status.STEP_TOO_SMALL, Status.NOT_FINITE)
    assert run.last_state[0] == pytest.approx(np.exp(-3) / 9, rel=1e-3)
    assert "motor" in run.message and "last good state" in run.message
    assert len(run.t) > 5 and np.isfinite(run.q).all() and np.isfinite(run.energy()).all()


def test_settings_that_make_no_sense() -> None:
    model = mstmm.compile(pins(1, [0.3]))
    with pytest.raises(mstmm.SceneError, match="leave step out"):
        model.simulate(1.0, method="scipy-RK45", step=0.1)
    with pytest.raises(mstmm.SceneError, match="not known"):
        model.simulate(1.0, method="scipy-Euler")
    with pytest.raises(mstmm.SceneError, match="keeps no checkpoints"):
        model.simulate(1.0, method="scipy-RK45", checkpoint="run.npz")
