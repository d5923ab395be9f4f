"""Where a motion is not a number because an expression is none, the expression is named."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import UndeterminedMotionError
from mstmm.runtime.integrate.c_loop import Status
from tests.support.scenes.results import motor, pins, rod


def pair(**more: Any) -> mstmm.Scene:
    data = pins(2, [0.3, 0.4]).model_dump(by_alias=True, exclude_unset=True)
    return mstmm.Scene.from_data(data | more)


def driven_pins() -> mstmm.Scene:
    data = pins(2, [0.3, 0.4]).model_dump(by_alias=True, exclude_unset=True)
    data["hinge"][0].pop("initial")
    data["hinge"][0]["drive"] = ["sqrt(1 - t)"]
    return mstmm.Scene.from_data(data)


def rope() -> mstmm.Scene:
    """The effort of the third member reads its own angle."""
    link, hinge = rod("link"), {"type": "pin", "law": {"effort": "sqrt(0.5 + q[0])"}}
    del link["name"]
    chain = {"name": "rope", "count": 3, "inboard": "ground", "body": [link], "hinge": [hinge]}
    return mstmm.Scene.from_data({"gravity": (0, -9.81, 0), "chain": [chain]})


BAND = {"name": "band", "from": "ground", "to": "rod1.tip", "law": {"effort": "sqrt(q - 1.9)"}}
WIND = {"name": "wind", "on": "rod1.tip", "force": [0, "sqrt(1 - t)", 0]}
SCENES = {
    "an effort": (motor("log(q[0])", speed=-1.0), 'hinge "motor": law.effort[0] = "log(q[0])" is'),
    "a load": (pair(load=[WIND]), 'load "wind": force[1] = "sqrt(1 - t)" is nan at t = 1'),
    "a drive": (driven_pins(), 'hinge "pin0": drive[0]'),
    "a spring": (pair(spring=[BAND]), 'spring "band": law.effort = "sqrt(q - 1.9)" is nan'),
    "a chain": (rope(), '"sqrt(0.5 + q[0])" is nan'),
}


@pytest.mark.parametrize("method", ["dop853", "rk4", "scipy-RK45", "scipy-Radau"])
@pytest.mark.parametrize("name", SCENES)
def test_a_run_ends_with_the_name_of_the_expression(name: str, method: str) -> None:
    scene, words = SCENES[name]
    step = 0.013 if method == "rk4" else None
    run = mstmm.compile(scene, engine="looped").simulate(5.0, method=method, step=step, rtol=1e-6)
    assert not run.success and words in run.message, run.message
    assert "inertia" not in run.message and "may help" not in run.message
    assert "last good state" in run.message and np.isfinite(run.last_state[0])


CALLS: dict[str, Any] = {
    "accelerations": lambda m, q, u: m.accelerations(q, u),
    "a batch": lambda m, q, u: m.accelerations([q, q], u),
    "inverse dynamics": lambda m, q, u: m.inverse_dynamics(q, u, [0.0]),
    "equilibrium": lambda m, q, u: m.equilibrium(q),
}


@pytest.mark.parametrize("call", CALLS)
def test_a_state_is_refused_with_the_name_of_the_expression(call: str) -> None:
    model = mstmm.compile(motor("log(q[0])"), engine="looped")
    words = 'law.effort[0] = "log(q[0])" is nan at t = 0 s'
    with pytest.raises(mstmm.NumericalFailure, match=re.escape(words)):
        CALLS[call](model, [-0.3], [0.1])


def test_nan_is_not_taken_for_missing_inertia() -> None:
    """With nan speeds every pivot is nan; that is not the masses' fault."""
    scene = pair(load=[{"name": "wind", "on": "rod0.tip", "force": [0, "log(-1 - t)", 0]}])
    model = mstmm.compile(scene, engine="looped")
    with pytest.raises(mstmm.NumericalFailure, match='load "wind"') as refused:
        model.accelerations(*model.initial_state())
    assert "inertia" not in str(refused.value)
    model.check_start_determined()


@pytest.mark.parametrize("method", ["dop853", "scipy-RK45"])
def test_a_condition_that_is_not_a_number_ends_the_run_by_name(method: str) -> None:
    event = {"name": "late", "when": "sqrt(1 - t) < -1", "do": "stop"}
    run = mstmm.compile(pair(event=[event])).simulate(5.0, method=method)
    assert run.status is Status.EVENT_FAILED and not run.success
    assert 'the condition of event "late" is not a number at t = 1' in run.message
    assert "last good state at t = " in run.message


def test_a_state_of_a_batch_is_named_and_keeps_what_is_known_of_its_failure() -> None:
    """A massless carriage, its rod without inertia about the axis of both: in line in state 1."""
    thin = rod("rod") | {"inertia": [0, 1 / 12, 1 / 12]}
    roll = {"name": "roll", "type": "pin", "axis": [1, 0, 0], "inboard": "ground",
            "outboard": "carriage"}  # fmt: skip
    fold = {"name": "fold", "type": "pin", "inboard": "carriage", "outboard": "rod",
            "initial": {"q": [0.5]}}  # fmt: skip
    bodies = [{"name": "carriage", "mass": 0.0}, thin]
    scene = mstmm.Scene(gravity=(0, 0, 0), body=bodies, hinge=[roll, fold])
    model = mstmm.compile(scene, engine="looped")
    with pytest.raises(UndeterminedMotionError, match='state 1: hinge "roll"') as refused:
        model.accelerations(np.array([[0.0, 0.5], [0.0, 0.0]]), np.zeros(2))
    assert refused.value.place == 0


def test_a_quaternion_of_zeros_is_named() -> None:
    ball = {"name": "ball", "type": "ball", "inboard": "ground", "outboard": "rod"}
    model = mstmm.compile(mstmm.Scene(gravity=(0, 0, 0), body=[rod("rod")], hinge=[ball]))
    words = "starting at ball.w has zero length at t = 0 s; the identity rotation is 1, 0"
    with pytest.raises(mstmm.NumericalFailure, match=words):
        model.accelerations(np.zeros(4), np.zeros(3))
    for method in ("dop853", "scipy-RK45"):
        run = model.simulate(0.1, method=method, initial=(np.zeros(4), np.zeros(3)))
        assert not run.success and words in run.message


def test_a_motion_that_really_is_undetermined_blames_no_expression() -> None:
    thin = rod("rod") | {"inertia": [0, 1 / 12, 1 / 12]}
    ball = {"name": "ball", "type": "ball", "inboard": "ground", "outboard": "rod",
            "law": {"effort": ["sin(t)", 0, 0]}}  # fmt: skip
    with pytest.raises(mstmm.SceneError, match=r'hinge "ball".*undetermined.*inertia along it'):
        mstmm.compile(mstmm.Scene(gravity=(0, 0, 0), body=[thin], hinge=[ball]))
