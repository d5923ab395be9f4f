"""SciPy on the same call-backs says the same: breaks, events, releases, memory, output times."""

from __future__ import annotations

import signal
import sys
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
import scipy.integrate
from numpy.typing import NDArray

import mstmm
from mstmm.errors import SceneError
from mstmm.runtime.integrate.c_loop import Status
from mstmm.runtime.run import external_integrators
from mstmm.runtime.run.event_location import Equations
from tests.support.scenes.results import motor, pins, rod, tree

Array = NDArray[np.float64]

METHODS = (
    "scipy-DOP853", "scipy-RK45", "scipy-Radau", "scipy-BDF", "scipy-LSODA", "sundials-BDF",
    "sundials-Adams",
)  # fmt: skip


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


@pytest.mark.parametrize("method", ["scipy-DOP853", "scipy-Radau", "scipy-LSODA", "sundials-BDF"])
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


def test_runs_of_lsoda_side_by_side() -> None:
    """Before SciPy 1.17 it keeps its state in one place: two at once end in errors, or worse."""
    models = [mstmm.compile(pins(n, [0.3] * n)) for n in (1, 3)]

    def run(n: int) -> Array:
        return np.array(models[n].simulate(0.5, method="scipy-LSODA", certify=False).q[-1])

    alone = [run(0), run(1)]
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(4) as pool:
            found = list(pool.map(run, [0, 1] * 4))
    finally:
        sys.setswitchinterval(before)
    for k, q in enumerate(found):
        np.testing.assert_array_equal(q, alone[k % 2])


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
    np.testing.assert_allclose(
        run.energy_components()["springs"], ours.energy_components()["springs"], atol=1e-7
    )
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


@pytest.mark.parametrize("method", METHODS)
def test_no_output_times_and_a_last_one_that_a_coarse_run_does_not_reach(method: str) -> None:
    """A result without samples is a result: its state is the last good one."""
    model = mstmm.compile(motor("exp(u[0])^3", speed=1.0))
    for times in ([], [1.0]):
        run = model.simulate(1.0, method=method, rtol=1e-2, output_times=times)
        assert run.t.shape == (0,) and run.q.shape == (0, 1) and not run.success
        assert 0 < run.last_state[0] < 0.01 and str(run.certificate)
    assert len(mstmm.compile(pins(1, [0.3])).simulate(1.0, method=method, output_times=[]).t) == 0


@pytest.mark.parametrize("method", METHODS)
def test_a_largest_number_of_steps(method: str) -> None:
    run = mstmm.compile(pins(2, [0.3, 0.4])).simulate(
        5.0, method=mstmm.methods.Method(method, max_steps=7)
    )
    assert run.status is Status.TOO_MANY_STEPS and "more steps than allowed" in run.message
    assert run.statistics is not None and run.statistics.steps == 7 and len(run.t) == 8


def test_a_trial_that_failed_and_recovered_is_not_blamed_for_the_end(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    class Stumbling(Equations):
        def rates(self, t: float, y: Array) -> Array:
            if 0.01 < t < 0.1:
                self.failure = 'spring "band" at t = 0.05 s'
            return super().rates(t, y)

    monkeypatch.setattr(external_integrators, "Equations", Stumbling)
    model = mstmm.compile(motor("1/max(0.5 - t, 0)^2", speed=1.0))
    run = model.simulate(1.0, method="scipy-RK45", rtol=1e-6)
    assert not run.success and "band" not in run.message and "0.5" in run.message


def test_ctrl_c_ends_a_step_of_endless_trials(heard: None, monkeypatch: pytest.MonkeyPatch) -> None:
    class Endless(scipy.integrate.RK45):
        def _step_impl(self) -> Any:
            for _ in range(1000):
                self.fun(self.t, self.y)
                signal.raise_signal(signal.SIGINT)
            raise AssertionError("nobody has ended it")

    monkeypatch.setattr(scipy.integrate, "RK45", Endless)
    run = mstmm.compile(pins(2, [0.3, 0.4])).simulate(5.0, method="scipy-RK45")
    assert run.status is None and "interrupted at t = 0 s" in run.message and len(run.t) == 1


def test_without_the_package_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "sksundae.cvode", None)
    model = mstmm.compile(pins(1, [0.3]))
    with pytest.raises(mstmm.EnvironmentFailure, match=r"pip install 'mstmm\[stiff\]'"):
        model.simulate(1.0, method="sundials-BDF")


def test_a_stiff_chain_takes_few_steps_of_bdf() -> None:
    """Springs of 1e6 N m/rad in the hinges of an arm: explicit steps are held by stability."""
    data = pins(3, [0.2, 0.1, 0.1]).model_dump(by_alias=True, exclude_unset=True)
    for hinge in data["hinge"]:
        hinge["law"] = {"stiffness": 1e6, "damping": 2e3}
    model = mstmm.compile(mstmm.Scene.from_data(data), engine="looped")
    exact = model.simulate(0.5, "dop853", rtol=1e-10, atol=1e-12)
    run = model.simulate(0.5, method="sundials-BDF", rtol=1e-6, atol=1e-9)
    assert run.success and exact.statistics is not None and run.statistics is not None
    np.testing.assert_allclose(run.q[-1], exact.q[-1], atol=1e-7)
    assert run.statistics.evaluations < exact.statistics.evaluations / 20


def test_settings_that_make_no_sense() -> None:
    model = mstmm.compile(pins(1, [0.3]))
    with pytest.raises(mstmm.SceneError, match="leave step out"):
        model.simulate(1.0, method="scipy-RK45", step=0.1)
    with pytest.raises(mstmm.SceneError, match="not known"):
        model.simulate(1.0, method="scipy-Euler")
    with pytest.raises(mstmm.SceneError, match="writes no checkpoints"):
        model.simulate(1.0, method="scipy-RK45", execution=mstmm.Execution(checkpoint="run.npz"))


def test_cvode_refuses_a_scene_in_which_nothing_moves() -> None:
    still = mstmm.Scene(
        gravity=[0, 0, 0],
        body=[{"name": "block", "mass": 1.0, "inertia": [1.0, 1.0, 1.0]}],
        hinge=[{"name": "weld", "type": "fixed", "inboard": "ground", "outboard": "block"}],
    )
    with pytest.raises(SceneError, match="without coordinates"):
        mstmm.compile(still).simulate(1.0, method="sundials-BDF")
