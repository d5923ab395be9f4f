"""Sessions: the steps of one run, taken tick by tick, with inputs set in between."""

from __future__ import annotations

import copy
from functools import cache
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import NumericalFailure, SceneError
from mstmm.runtime.model import session
from mstmm.runtime.model.model import Model
from mstmm.runtime.run.step_stability import check_step
from tests.support.scenes.minimal import body

ENGINES = ["looped", "fused"]
FIXED = ["rk4", "dop853", "rodas4p2", "genalpha"]


@cache
def arm(engine: str, effort: str = "motor - 0.3*u", ends_below: float | None = None) -> Model:
    """A rod on a motor, and one that hangs on it under a load of time."""
    falls = {"name": "fell", "when": f"shoulder.q < {ends_below}", "do": "stop"}
    hinges = [
        {"name": "shoulder", "type": "pin", "inboard": "ground", "outboard": "rod1",
         "law": {"effort": effort}, "initial": {"q": [0.4]}},
        {"name": "wrist", "type": "ball", "inboard": "rod1.tip", "outboard": "rod2",
         "initial": {"u": [0.5, -0.4, 1.5]}},
    ]  # fmt: skip
    scene = mstmm.Scene(
        gravity=(0, -9.81, 0), body=[body("rod1"), body("rod2")], hinge=hinges,
        load=[{"on": "rod2.tip", "force": [0, "wind + push*sin(3*t)", 0]}],
        input=[{"name": "motor", "value": 0.5}, {"name": "push"}],
        signal=[{"name": "wind", "times": [0, 0.123, 0.4], "values": [0, 1, -1]}],
        output=[{"name": "hand", "of": "rod2.tip.position"},
                {"name": "turn", "of": "shoulder.angle/deg"}],
        event=[] if ends_below is None else [falls],
    )  # fmt: skip
    return mstmm.compile(scene, engine=engine)


def ticks(stepped: Any, dt: float, count: int, **inputs: float) -> Any:
    for _ in range(count):
        stepped.advance(dt, inputs or None)
    return stepped


@pytest.mark.parametrize("method", FIXED)
@pytest.mark.parametrize("engine", ENGINES)
def test_ticks_are_bit_for_bit_the_steps_of_one_run(engine: str, method: str) -> None:
    model = arm(engine)
    stepped = model.session(method=method, step=0.01)
    run = model.simulate(0.6, method, 0.01)
    ticks(stepped, 0.01, 25)
    stepped.advance(0.2)
    ticks(stepped, 0.03, 5)
    assert stepped.t == run.t[-1]
    np.testing.assert_array_equal(stepped.q, run.q[-1])
    np.testing.assert_array_equal(stepped.u, run.u[-1])
    for one, other in zip(stepped.state, (stepped.q, stepped.u), strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("engine", ENGINES)
def test_inputs_are_those_of_a_run_under_a_held_signal(engine: str) -> None:
    model, rng = arm(engine), np.random.default_rng(5)
    times, values = 0.05 * np.arange(12), rng.normal(size=12)
    stepped = model.session(method="rk4", step=0.01)
    for value in values:
        stepped.advance(0.05, {"motor": value, "push": 2.0})
    held = {"times": times, "values": values, "interpolation": "hold"}
    run = model.simulate(0.6, "rk4", 0.01, inputs={"motor": held, "push": 2.0})
    np.testing.assert_allclose(stepped.q, run.q[-1], rtol=0, atol=1e-13)
    np.testing.assert_allclose(stepped.u, run.u[-1], rtol=0, atol=1e-12)
    assert stepped.inputs == {"motor": values[-1], "push": 2.0}


@pytest.mark.parametrize("method", ["dop853", "rodas5p"])
def test_methods_that_choose_their_steps_agree_within_the_tolerance(method: str) -> None:
    model = arm("looped")
    stepped = ticks(model.session(method=method, rtol=1e-9, atol=1e-11), 0.05, 12, push=1.0)
    run = model.simulate(0.6, method, rtol=1e-11, atol=1e-13, inputs={"push": 1.0})
    np.testing.assert_allclose(stepped.q, run.q[-1], rtol=0, atol=1e-7)
    assert stepped.t == pytest.approx(0.6, abs=1e-15)


def test_a_tick_between_two_steps_cuts_one_and_the_grid_stays() -> None:
    model = arm("looped")
    stepped = ticks(model.session(method="rk4", step=0.01), 0.024, 25)
    fine = model.simulate(0.6, "rk4", 0.001)
    assert stepped.t == pytest.approx(0.6, abs=1e-15)
    np.testing.assert_allclose(stepped.q, fine.q[-1], rtol=0, atol=1e-7)
    cut = int(stepped._run.statistics.steps)
    assert cut == 60 + 1 + 20  # one at a time of the signal; 5 of 25 ticks end on the grid


@pytest.mark.parametrize("engine", ENGINES)
def test_a_copy_goes_on_alike_and_alone(engine: str) -> None:
    model = arm(engine)
    stepped = ticks(model.session(method="rk4", step=0.01), 0.01, 20, motor=1.0)
    other = copy.copy(stepped)
    assert other.inputs == stepped.inputs
    ticks(other, 0.01, 20, motor=-3.0)
    q = stepped.q
    ticks(stepped, 0.01, 20)
    again = ticks(model.session(method="rk4", step=0.01), 0.01, 40, motor=1.0)
    np.testing.assert_array_equal(stepped.q, again.q)
    assert np.abs(other.q - stepped.q).max() > 1e-3 and np.abs(q - stepped.q).max() > 1e-3


def test_outputs_are_those_of_a_result() -> None:
    model = arm("looped")
    stepped = ticks(model.session(method="rk4", step=0.01), 0.01, 30, motor=1.0)
    run = model.simulate(0.3, "rk4", 0.01, inputs={"motor": 1.0})
    found, expected = stepped.outputs(), run.outputs()
    np.testing.assert_allclose(found["hand"], expected["hand"][-1], rtol=1e-13)
    np.testing.assert_allclose(found["turn"], expected["turn"][-1], rtol=1e-13)
    effort = stepped.result().quantity("shoulder.effort").values[0]
    assert effort == pytest.approx(1.0 - 0.3 * stepped.u[0], rel=1e-10)


def test_a_switch_that_an_input_moves_is_met() -> None:
    """The time at which it switches is known to nobody before the input is set."""
    model = arm("looped", "where(t > motor, 4, 0) - 0.3*u")
    stepped = model.session(method="rk4", step=0.01)
    stepped.advance(0.2, {"motor": 0.355})
    stepped.advance(0.4)
    run = model.simulate(0.6, "rk4", 0.01, inputs={"motor": 0.355})
    np.testing.assert_allclose(stepped.q, run.q[-1], rtol=0, atol=1e-9)
    assert np.abs(run.q[-1] - model.simulate(0.6, "rk4", 0.01).q[-1]).max() > 1e-2


def test_an_event_ends_a_session() -> None:
    model = arm("looped", ends_below=-0.5)
    stepped = model.session(step=0.01)
    with pytest.raises(SceneError, match='stopped by event "fell" at t = 0'):
        ticks(stepped, 0.05, 40)
    run = model.simulate(2.0, step=0.01)
    assert stepped.t == run.t[-1] and "fell" in stepped.stop_reason
    np.testing.assert_array_equal(stepped.q, run.q[-1])


@pytest.mark.parametrize("when", ["t >= 0.25", "motor > 0.75"])
def test_a_release_is_met_inside_a_session(when: str) -> None:
    hinge = {"name": "clamp", "type": "pin", "inboard": "ground", "outboard": "rod1",
             "drive": "0.3*sin(t)", "release": when}  # fmt: skip
    scene = mstmm.Scene(gravity=(0, -9.81, 0), body=[body("rod1")], hinge=[hinge],
                        input=[{"name": "motor", "value": 0.5}])  # fmt: skip
    model = mstmm.compile(scene)
    stepped = ticks(model.session(step=0.01), 0.05, 5)
    ticks(stepped, 0.05, 5, motor=1.0)
    held = {"times": [0, 0.25], "values": [0.5, 1.0], "interpolation": "hold"}
    run = model.simulate(0.5, step=0.01, inputs={"motor": held})
    np.testing.assert_allclose(stepped.q, run.q[-1], rtol=0, atol=1e-12)
    assert abs(stepped.q[0] - 0.3 * np.sin(0.5)) > 0.05


@pytest.mark.parametrize("by_event", [False, True])
@pytest.mark.parametrize("method", ["dop853", "rodas4p2", "scipy-DOP853"])
def test_what_let_go_before_a_run_goes_on_from_what_is_given(by_event: bool, method: str) -> None:
    """A second run over the rest of the first: its drive is over, and does not fill the state."""
    hinge = {"name": "clamp", "type": "pin", "inboard": "ground", "outboard": "rod1",
             "drive": "0.2*t"}  # fmt: skip
    event = {"name": "go", "when": "t >= 1", "do": "release", "hinge": "clamp"}
    more = {"event": [event]} if by_event else {}
    hinges = [hinge if by_event else hinge | {"release": 1.0}]
    model = mstmm.compile(
        mstmm.Scene(gravity=(0, -9.81, 0), body=[body("rod1")], hinge=hinges, **more)
    )
    whole = model.simulate(3.0, method, output_times=[0.5, 2.0, 3.0])
    rest = model.simulate(3.0, method, t_start=2.0, initial=(whole.q[1], whole.u[1]))
    np.testing.assert_array_equal(rest.q[0], whole.q[1])
    np.testing.assert_allclose(rest.q[-1], whole.q[2], rtol=0, atol=1e-6)
    driven = model.simulate(0.9, method, t_start=0.5, initial=(whole.q[1], whole.u[1]))
    assert abs(driven.q[0, 0] - 0.1) < 1e-15
    stepped = model.session(whole.q[1], whole.u[1], 2.0)
    stepped.advance(1.0)
    np.testing.assert_allclose(stepped.q, whole.q[2], rtol=0, atol=1e-6)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_failure_leaves_the_last_good_state_from_which_it_goes_on(engine: str) -> None:
    model = arm(engine, "log(motor)")
    stepped = ticks(model.session(method="rk4", step=0.01), 0.01, 10, motor=1.0)
    q = stepped.q
    with pytest.raises(NumericalFailure, match=r"log\(motor\).*last good state at t = 0.1 s"):
        stepped.advance(0.01, {"motor": -1.0})
    assert stepped.t == 0.1
    np.testing.assert_array_equal(stepped.q, q)
    ticks(stepped, 0.01, 10, motor=1.0)
    again = ticks(model.session(method="rk4", step=0.01), 0.01, 20, motor=1.0)
    np.testing.assert_allclose(stepped.q, again.q, rtol=0, atol=1e-11)


@pytest.mark.parametrize(
    ("dt", "inputs", "message"),
    [
        (-0.01, {}, r"dt = -0.01: expected a time in s, 0 or more"),
        (float("nan"), {}, "dt = nan: expected a time"),
        ("soon", {"motor": 9.0}, "dt = 'soon': expected a time"),
        (0.01, {"moter": 1.0}, 'no such input in the scene; did you mean "motor"'),
        (0.01, {"motor": 9.0, "push": float("inf")}, 'push"] = inf: expected a finite'),
        (0.01, {"motor": "full"}, 'inputs."motor"'),
        (0.01, {"motor": 10**400}, 'inputs."motor"'),
        (0.01, [3.0], "inputs: expected numbers by their names"),
    ],
)
def test_what_makes_no_sense_changes_nothing(dt: Any, inputs: Any, message: str) -> None:
    model = arm("looped")
    stepped = model.session(method="rk4", step=0.01)
    with pytest.raises(SceneError, match=message):
        stepped.advance(dt, inputs)
    assert stepped.t == 0.0
    ticks(stepped, 0.01, 10)
    np.testing.assert_array_equal(stepped.q, model.simulate(0.1, "rk4", 0.01).q[-1])


def test_an_input_that_drives_is_refused() -> None:
    hinge = {"name": "crank", "type": "pin", "inboard": "ground", "outboard": "rod1",
             "drive": "angle"}  # fmt: skip
    scene = mstmm.Scene(gravity=(0, 0, 0), body=[body("rod1")], hinge=[hinge],
                        input=[{"name": "angle", "rates": [0, 0]}])  # fmt: skip
    stepped = mstmm.compile(scene).session()
    with pytest.raises(SceneError, match=r'drive of hinge "crank" follows this input.*impact'):
        stepped.advance(0.1, {"angle": 1.0})


def test_bodies_that_answer_to_whole_runs_are_refused() -> None:
    beam = {"name": "arm", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 50.0,
            "modes": {"y": 1}, "model": "one-way"}  # fmt: skip
    hinge = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "arm",
             "law": {"effort": "push"}}  # fmt: skip
    gain = {"name": "gain", "sample_time": 0.1, "inputs": ["arm.tip.x"], "outputs": ["push"],
            "D": [[1.0]]}  # fmt: skip
    tables: Any = {"gravity": (0, -9.81, 0), "beam": [beam], "hinge": [hinge],
                   "input": [{"name": "push"}]}  # fmt: skip
    with pytest.raises(SceneError, match='"arm": a session cannot use a body'):
        mstmm.compile(mstmm.Scene(**tables)).session()
    with pytest.raises(SceneError, match='"arm": controller "gain" cannot use'):
        mstmm.compile(mstmm.Scene(**tables, controller=[gain]))


@pytest.mark.parametrize("method", ["auto", "scipy-RK45", "dttmm-classical"])
def test_methods_of_whole_runs_are_refused(method: str) -> None:
    step = None if method == "auto" else 0.01
    with pytest.raises(SceneError, match="makes whole runs"):
        arm("looped").session(method=method, step=step)


def test_a_step_is_checked_once_per_model(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []

    def record_check(*given: Any) -> Any:
        calls.append(given)
        return check_step(*given)

    monkeypatch.setattr(session, "check_step", record_check)
    spring = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod1",
              "law": {"stiffness": 4e4}}  # fmt: skip
    model = mstmm.compile(mstmm.Scene(gravity=(0, 0, 0), body=[body("rod1")], hinge=[spring]))
    first = model.session(method="rk4", step=0.05)
    assert "too long for the fastest motion" in first.warnings[0]
    assert model.session(q=[0.1], method="rk4", step=0.05).warnings == first.warnings
    assert not model.session(method="rk4", step=1e-4).warnings and len(calls) == 2


def test_a_session_begins_where_it_is_told() -> None:
    model = arm("looped")
    q, u = model.initial_state()
    q[0], u[0] = 0.7, -0.2
    stepped = ticks(model.session(q, u, 0.3, method="rk4", step=0.01), 0.01, 20)
    run = model.simulate(stepped.t, "rk4", 0.01, t_start=0.3, initial=(q, u))
    np.testing.assert_array_equal(stepped.q, run.q[-1])
    with pytest.raises(SceneError, match="make a session for each"):
        model.session(np.tile(q, (2, 1)))


@pytest.mark.parametrize("given", [{"value": "ramp"}, {"value": 1.0, "rates": [2.0, 3.0]}])
def test_inputs_over_time_go_on(given: dict[str, Any]) -> None:
    """What a signal or rates say of an input holds in a session too, and nobody sets it."""
    rail = {
        "name": "rail", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
        "outboard": "block", "law": {"effort": "push"},
    }  # fmt: skip
    model = mstmm.compile(mstmm.Scene(
        gravity=[0, 0, 0], body=[body("block")], hinge=[rail], input=[{"name": "push"} | given],
        signal=[{"name": "ramp", "times": [0, 1], "values": [1, 5]}],
    ))  # fmt: skip
    run = model.session(method="dop853")
    run.advance(0.4)
    run.advance(0.55)
    assert run.q == pytest.approx(model.simulate(0.95).q[-1], rel=1e-9)
    with pytest.raises(SceneError, match="by a signal or by its rates"):
        run.advance(0.1, {"push": 2.0})
    numbers = model.with_inputs({"push": 2.0}).session(method="dop853")
    numbers.advance(0.5, {"push": 4.0})
    assert numbers.u == pytest.approx([2.0 / body("block")["mass"]], rel=1e-12)


@pytest.mark.parametrize("of", ["strut.length + 0", "strut.effort*2", "2 + strut.length"])
def test_outputs_that_c_does_not_give_are_those_of_results(of: str) -> None:
    block = body("block") | {"ends": {"tip": [1, 0, 0]}}
    model = mstmm.compile(mstmm.Scene(
        gravity=[0, 0, 0], body=[block],
        hinge=[{"name": "pin", "type": "pin", "inboard": "ground", "outboard": "block"}],
        spring=[{"name": "strut", "from": "ground", "position": [1, 1, 0], "to": "block.tip",
                 "law": {"stiffness": 2.0, "rest": 0.5}}],
        output=[{"name": "asked", "of": of}],
    ))  # fmt: skip
    found = model.session(method="rk4", step=0.01).outputs()["asked"]
    assert found == model.simulate(0.0, "rk4", 0.01).quantity("asked").values[0]
