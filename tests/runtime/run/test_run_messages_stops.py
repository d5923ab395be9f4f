"""Runs that fail end with a status, a time, the last good state and the name of a hinge."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import NumericalFailure
from mstmm.runtime.integrate.c_loop import Status
from mstmm.runtime.result.result import Result
from tests.support.paths import ROOT
from tests.support.scenes.results import motor, pins, rod


def check_remains(run: Result) -> None:
    """What was computed before a failure is all there and finite."""
    assert not run.success and len(run.t) >= 1
    assert np.isfinite(run.q).all() and np.isfinite(run.u).all()
    t, q, u = run.last_state
    assert np.isfinite(t) and np.isfinite(q).all() and np.isfinite(u).all()
    assert t == pytest.approx(run.t[-1]) and f"{t:.6g}"[:6] in run.message
    assert str(run.certificate) and run.table() and len(run.quantity_names()) > 10


@pytest.mark.parametrize("method, step", [("dop853", None), ("dopri5", None), ("rk4", 1e-3)])
def test_a_motor_that_blows_up(method: str, step: float | None) -> None:
    """u' = 3 exp(3u) from u = 1 is infinite at t = exp(-3)/9."""
    run = mstmm.compile(motor("exp(u[0])^3", speed=1.0)).simulate(1.0, method=method, step=step)
    assert run.status in (Status.STEP_TOO_SMALL, Status.NOT_FINITE)
    assert run.last_state[0] == pytest.approx(np.exp(-3) / 9, rel=0.3 if step else 1e-6)
    assert "motor.angle_rate" in run.message
    check_remains(run)


def test_an_effort_outside_its_domain() -> None:
    run = mstmm.compile(motor("log(q[0])", speed=-1.0)).simulate(5.0)
    assert run.status in (Status.NOT_FINITE, Status.STEP_TOO_SMALL, Status.RHS_FAILED)
    assert "motor" in run.message or "expression" in run.message
    check_remains(run)


CHOICE = "where(sqrt(0.5 - q[0]) > 9, 1, 2)"


@pytest.mark.parametrize("method", ["dop853", "pirk13", "rodas5p", "genalpha", "scipy-RK45"])
@pytest.mark.parametrize("engine", ["looped", "fused"])
def test_a_comparison_that_is_no_number_ends_the_run(engine: str, method: str) -> None:
    """The comparison reads the root of a negative number from q = 0.5 on."""
    run = mstmm.compile(motor(CHOICE, speed=1.0), engine=engine).simulate(1.0, method=method)
    assert f'hinge "motor": law.effort[0] = "{CHOICE}" is nan' in run.message
    assert run.last_state[1][0] == pytest.approx(0.5, abs=1e-3) and not run.trusted
    check_remains(run)


@pytest.mark.parametrize("engine", ["looped", "fused"])
def test_a_comparison_that_is_no_number_ends_one_trajectory_of_a_batch(engine: str) -> None:
    model = mstmm.compile(motor(CHOICE, speed=1.0), engine=engine)
    q, u = np.full((9, 1), -5.0), np.ones((9, 1))
    q[4] = 0.0
    batch = model.simulate_batch((q, u), t_end=0.5, output_times=[0.0, 0.5], threads=1)
    assert np.flatnonzero(~batch.success).tolist() == [4]
    assert "motor" in batch.messages[4]
    with pytest.raises(NumericalFailure, match=r'state 4: .*"where\(sqrt.* is nan'):
        model.accelerations(np.where(q > -1, 0.6, q), u)


def test_too_many_steps() -> None:
    run = mstmm.compile(pins(2, [0.3, 0.4])).simulate(5.0, mstmm.methods.Method(max_steps=7))
    assert run.status is Status.TOO_MANY_STEPS and "more steps than allowed" in run.message
    assert run.statistics is not None and run.statistics.steps == 7 and len(run.t) == 8
    check_remains(run)


def test_output_times_do_not_hide_the_last_good_state() -> None:
    model = mstmm.compile(pins(2, [0.3, 0.4]))
    run = model.simulate(5.0, mstmm.methods.Method(max_steps=7), output_times=[0.0, 2.5, 5.0])
    t, q, u = run.last_state
    assert list(run.t) == [0.0] and 0 < t < 2.5
    np.testing.assert_array_equal(q, model.simulate(5.0, mstmm.methods.Method(max_steps=7)).q[-1])
    assert u.shape == (2,)


def singular() -> mstmm.Scene:
    """A massless carriage on a pin about x, a rod without inertia about its own axis hung from it.

    With the rod along x nothing resists the first pin.
    """
    thin = rod("rod") | {"inertia": [0, 1 / 12, 1 / 12]}
    carriage = {"name": "carriage", "mass": 0.0}
    roll = {"name": "roll", "type": "pin", "axis": [1, 0, 0], "inboard": "ground",
            "outboard": "carriage"}  # fmt: skip
    fold = {"name": "fold", "type": "pin", "inboard": "carriage", "outboard": "rod",
            "initial": {"q": [0.5]}}  # fmt: skip
    return mstmm.Scene(gravity=(0, 0, 0), body=[carriage, thin], hinge=[roll, fold])


@pytest.mark.parametrize("method", ["dop853", "scipy-RK45"])
def test_a_state_in_which_a_motion_is_undetermined(method: str) -> None:
    model = mstmm.compile(singular())
    run = model.simulate(1.0, method=method, initial=([0.0, 0.0], [0.0, 0.0]))
    assert run.status in (Status.RHS_FAILED, Status.STEP_TOO_SMALL)
    assert 'hinge "roll"' in run.message and "undetermined" in run.message
    assert not run.success and run.last_state[0] == 0.0
    assert np.isnan(run.energy()).all() and any("roll" in text for text in run.warnings)
    assert str(run.certificate)


def test_a_run_into_a_state_in_which_a_motion_is_undetermined() -> None:
    """The rod is driven along x at t = 0.5, slowing down towards it."""
    data = singular().model_dump(by_alias=True, exclude_unset=True)
    data["hinge"][1].pop("initial")
    data["hinge"][1]["drive"] = ["0.5*max(1 - 2*t, 0)^2"]
    run = mstmm.compile(mstmm.Scene.from_data(data)).simulate(1.0)
    assert run.status is Status.RHS_FAILED and 'hinge "roll"' in run.message
    assert run.last_state[0] == pytest.approx(0.5, abs=1e-3)
    assert not run.success and len(run.t) > 2 and np.isfinite(run.u).all()


@pytest.mark.parametrize("method", ["dop853", "rk4", "scipy-DOP853", "scipy-RK45", "scipy-Radau"])
def test_a_spring_whose_ends_coincide_at_the_start_is_named(method: str) -> None:
    spring = {"name": "band", "from": "ground", "to": "rod0", "law": {"stiffness": 100.0}}
    data = pins(1, [0.3]).model_dump(by_alias=True, exclude_unset=True) | {"spring": [spring]}
    model = mstmm.compile(mstmm.Scene.from_data(data))
    run = model.simulate(1.0, method=method, step=0.01 if method == "rk4" else None)
    assert not run.success and run.status is Status.RHS_FAILED
    assert 'spring "band" at t = 0 s' in run.message and "coincide; move one" in run.message
    assert str(run.certificate) and len(run.t) == 1


def bent_blade_scene(**more: Any) -> mstmm.Scene:
    """A blade bent so far that its tip turns by more than a section may."""
    beam = {"name": "blade", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 1.0,
            "modes": {"y": 1}, "initial": {"eta": [2.0]}, "damping": 0.1}  # fmt: skip
    root = {"name": "root", "type": "fixed", "inboard": "ground", "outboard": "blade.root"}
    return mstmm.Scene(gravity=(0, 0, -9.81), beam=[beam], hinge=[root], **more)


def test_a_start_that_cannot_be_shown_is_refused_by_its_own_reason() -> None:
    """The modes move by themselves, but where the tip is nobody knows: no matter of tolerances."""
    with pytest.raises(
        mstmm.NumericalFailure, match=r'"blade\.tip" at t = 0 s: a section rotates by'
    ):
        mstmm.compile(bent_blade_scene()).simulate(0.1)


def test_a_start_beyond_the_model_s_range_has_a_certificate_all_the_same() -> None:
    run = mstmm.compile(
        bent_blade_scene(load=[{"on": "blade.tip", "force": [0, 0.1, 0]}])
    ).simulate(0.1)
    assert run.status is Status.RHS_FAILED and '"blade.tip" at t = 0 s' in run.message
    assert str(run.certificate) and any("blade.tip" in text for text in run.warnings)


def test_success_is_never_said_of_numbers_that_are_not_finite() -> None:
    from dataclasses import replace

    run = mstmm.compile(pins(1, [0.3])).simulate(1.0)
    u = run.u.copy()
    u[3, 0] = np.nan
    spoilt = Result(run.model, replace(run.trajectory, u=u))
    assert run.success and not spoilt.success
    assert any("not finite" in text for text in spoilt.warnings)


@pytest.mark.parametrize("t_end", [-1.0, np.nan, np.inf])
def test_times_that_make_no_sense(t_end: float) -> None:
    with pytest.raises(mstmm.SceneError, match="t_end"):
        mstmm.compile(pins(1, [0.3])).simulate(t_end)


def test_a_step_too_long_is_named_before_what_it_leads_to() -> None:
    """The run goes through, its samples bend beyond all measure: no fault of the body's model."""
    scene = ROOT / "examples/javelin/scene.toml"
    run = mstmm.compile(mstmm.load_scene(scene), engine="looped").simulate(0.06, "rk4", step=0.02)
    assert run.trajectory.success and not run.success
    assert run.message.startswith("step = 0.02 s is too long for the fastest motion at the start")
    assert '(flexible body "javelin"' in run.message
    assert "2 of 4 samples cannot be evaluated" in run.message
    assert "split the body" not in run.message
