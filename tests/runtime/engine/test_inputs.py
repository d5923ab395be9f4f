"""Inputs of a run: set to numbers, to signals and to what they are over time."""

from __future__ import annotations

import pickle
from functools import cache
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import SceneError
from mstmm.runtime.model.model import Model
from tests.support.scenes.minimal import body

ENGINES = ["looped", "fused"]
TIMES, VALUES = (0.0, 0.4, 1.0, 2.0), (0.0, 3.0, -1.0, 0.5)


def scene(motor: Any = 0.5, **tables: Any) -> mstmm.Scene:
    """A rod on a motor under a push, and one that is driven beside it."""
    hinges = [
        {"name": "shoulder", "type": "pin", "inboard": "ground", "outboard": "rod1",
         "law": {"effort": "motor - 0.1*u"}},
        {"name": "crank", "type": "pin", "inboard": "rod1.tip", "outboard": "rod2",
         "drive": ["sin(angle)"]},
    ]  # fmt: skip
    return mstmm.Scene(
        gravity=(0, -9.81, 0), body=[body("rod1"), body("rod2")], hinge=hinges,
        load=[{"on": "rod2.tip", "force": [0, "push", 0]}],
        input=[{"name": "motor", "unit": "N m", "value": motor}, {"name": "push", "value": "gust"},
               {"name": "angle", "value": 0.2, "rates": [0.3, 0.1]}],
        signal=[{"name": "gust", "times": [0, 1], "values": [0, 2]}], **tables,
    )  # fmt: skip


@cache
def model(engine: str) -> Model:
    return mstmm.compile(scene(), engine=engine)


def last(run: Any) -> Any:
    return np.concatenate([run.q[-1], run.u[-1]])


@pytest.mark.parametrize("engine", ENGINES)
def test_a_run_takes_numbers(engine: str) -> None:
    run = model(engine).simulate(2.0, inputs={"motor": 1.5, "push": np.float64(0.25)})
    expected = model("looped").with_parameters({"motor.value": 1.5})
    expected = expected.with_inputs({"push": 0.25})
    np.testing.assert_allclose(last(run), last(expected.simulate(2.0)), rtol=1e-7)
    assert run.model.engine == engine and run.model.scene.input[0].value == 1.5
    assert model(engine).scene.input[0].value == 0.5


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("interpolation", ["line", "cubic", "hold"])
def test_a_run_takes_what_an_input_is_over_time(interpolation: str, engine: str) -> None:
    signal = {"times": TIMES, "values": np.array(VALUES), "interpolation": interpolation}
    run = model(engine).simulate(2.0, inputs={"motor": signal})
    named = {"name": "gust", "times": TIMES, "values": VALUES, "interpolation": interpolation}
    other = mstmm.Scene(**{
        **{name: getattr(scene(), name) for name in ("gravity", "body", "hinge", "load")},
        "input": [{"name": "motor", "value": "tug"}, {"name": "push", "value": "gust"},
                  {"name": "angle", "value": 0.2, "rates": [0.3, 0.1]}],
        "signal": [scene().signal[0], named | {"name": "tug"}],
    })  # fmt: skip
    expected = mstmm.compile(other, engine="looped").simulate(2.0)
    np.testing.assert_allclose(last(run), last(expected), rtol=1e-7)
    assert set(TIMES) <= set(run.t) and run.warnings == expected.warnings
    if interpolation == "line":
        pair = model(engine).simulate(2.0, inputs={"motor": (TIMES, VALUES)})
        np.testing.assert_array_equal(pair.q, run.q)


def test_an_input_follows_another_signal_of_the_scene() -> None:
    run = model("looped").simulate(1.5, inputs={"motor": "gust"})
    given = model("looped").simulate(1.5, inputs={"motor": ([0, 1], [0, 2])})
    np.testing.assert_allclose(last(run), last(given), rtol=1e-9)


def test_a_drive_follows_what_is_given() -> None:
    t = np.linspace(0, 2, 9)
    signal = {"times": t, "values": 0.2 + 0.3 * t**3, "interpolation": "cubic"}
    run = model("looped").simulate(2.0, inputs={"angle": signal}, output_times=t)
    np.testing.assert_allclose(run.q[:, 1], np.sin(0.2 + 0.3 * t**3), rtol=0, atol=1e-13)
    with pytest.raises(SceneError, match="jumps in speed at t = 1 s"):
        model("looped").simulate(2.0, inputs={"angle": ([0, 1, 2], [0, 1, 0])})


def test_inputs_are_set_again_and_again() -> None:
    """What is over time takes the place of what was so before."""
    first = model("looped").with_inputs({"motor": (TIMES, VALUES)})
    second = first.with_inputs({"motor": (TIMES, VALUES[::-1])})
    assert [s.name for s in second.scene.signal] == ["gust", "motor_given"]
    assert second.scene.signal[1].values == VALUES[::-1]
    assert second.scene.signal[1].unit == "N m"
    third = second.with_inputs({"motor": 2.0}).with_inputs({"push": (TIMES, VALUES)})
    assert third.scene.input[0].value == 2.0 and third.scene.risks == ()
    shared = second.with_inputs({"push": "motor_given"}).with_inputs({"motor": (TIMES, VALUES)})
    assert [s.name for s in shared.scene.signal] == ["gust", "motor_given", "motor_given_"]


def test_compiled_code_serves_all_inputs(monkeypatch: pytest.MonkeyPatch) -> None:
    fused = model("fused")
    monkeypatch.setattr(type(fused.fusion), "build", lambda _: pytest.fail("compiled again"))
    for value in (0.0, 1.0, "gust", (TIMES, VALUES)):
        assert fused.with_inputs({"motor": value}).engine == "fused"


@pytest.mark.parametrize("engine", ENGINES)
def test_trajectories_of_a_batch_have_inputs_of_their_own(engine: str) -> None:
    fused = model(engine)
    q, u = fused.initial_state()
    values = np.array([0.5, 1.5, -1.0])
    batch = fused.simulate_batch((np.tile(q, (3, 1)), u), {"motor.value": values}, t_end=1.0)
    for k, value in enumerate(values):
        run = fused.simulate(1.0, inputs={"motor": value}, output_times=[1.0])
        np.testing.assert_allclose(batch.q[k, -1], run.q[-1], rtol=1e-7)


def test_accelerations_have_exact_derivatives_by_inputs() -> None:
    looped = model("looped")
    q, u = looped.initial_state()
    found = looped.derivatives(q, u, 0.3, parameters=["motor.value", "angle.rates[0]"]).parameters
    for name, step in (("motor.value", 1.0), ("angle.rates[0]", 1e-5)):
        now = looped.parameters[name]
        a, b = (looped.with_parameters({name: now + x}).accelerations(q, u, 0.3)
                for x in (-step, step))  # fmt: skip
        np.testing.assert_allclose(found[name], (b - a) / (2 * step), rtol=1e-6, atol=1e-10)


def test_a_model_with_inputs_can_be_pickled() -> None:
    given = model("looped").with_inputs({"motor": (TIMES, VALUES)})
    again = pickle.loads(pickle.dumps(given))
    np.testing.assert_array_equal(again.simulate(1.0).q, given.simulate(1.0).q)


@pytest.mark.parametrize(
    ("inputs", "says"),
    [
        (
            {"moter": 1.0},
            'inputs["moter"]: there is no such input in the scene; did you mean "motor"',
        ),
        (
            {"gust": 1.0},
            'inputs["gust"]: this is a signal of the scene and cannot be set; add an [[input]]',
        ),
        ({"motor": "gist"}, 'there is no signal "gist", and no constant; did you mean "gust"'),
        ({"motor": float("nan")}, 'inputs["motor"] = nan: expected a finite number'),
        ({"motor": None}, 'inputs["motor"] = None: expected a finite number'),
        ({"motor": [1.0, 2.0]}, "expected a number, the name of a signal, (times, values)"),
        ({"motor": ([0, 1, 1], [0, 1, 2])}, "times[1] and times[2] are both at 1 s"),
        ({"motor": ([0, 2, 1], [0, 1, 2])}, "times[2], 1 s, comes after times[1], 2 s"),
        ({"motor": ([0, 1], [0])}, "expected 2 entries, one for each of the times, found 1"),
        ({"motor": ([0, 1], [0, np.inf])}, 'inputs["motor"] values[1] = inf'),
        ({"motor": {"time": [0, 1]}}, 'unknown key; did you mean "times"'),
        ({"motor": {"file": "../a.csv"}}, "expected a file in the folder of the scene"),
        ({1: 2.0}, "there is no such input in the scene; use one of motor, push, angle"),
        (3.0, "inputs"),
    ],
)
def test_what_no_input_can_be(inputs: Any, says: str) -> None:
    with pytest.raises(SceneError) as error:
        model("looped").simulate(1.0, inputs=inputs)
    assert says in str(error.value)


def acted_on(name: str, **tables: Any) -> Model:
    """A rod on which this name acts by a law, a load that turns with it and a spring."""
    pin = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod1",
           "orientation": [0, 0, -1.5], "law": {"effort": f"{name}*cos(q)"}}  # fmt: skip
    spring = {"from": "ground", "position": [0.3, -2, 0], "to": "rod1.tip",
              "law": {"effort": f"2*(q - 0.5) + {name}"}}  # fmt: skip
    load = {"on": "rod1.tip", "axes": "body", "force": [0, f"0.5*{name}", 0]}
    data: dict[str, Any] = {"hinge": [pin], "spring": [spring], "load": [load]}
    return mstmm.compile(mstmm.Scene(gravity=(0, -9.81, 0), body=[body("rod1")], **data, **tables))


def test_linear_models_are_those_of_the_numbers_that_inputs_are() -> None:
    plain = acted_on("0.7").linearize()
    still = acted_on("motor", input=[{"name": "motor", "value": 0.7}])
    moving = acted_on("wind", signal=[{"name": "wind", "times": [0, 1], "values": [0.2, 1.2]}])
    for linear in (still.linearize(), moving.linearize(t=0.5)):
        for name in ("M", "C", "K", "K_load", "K_geometric", "K_elastic"):
            found, expected = getattr(linear, name), getattr(plain, name)
            np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)
    assert (
        not still.packed_scene.system.has_timed_loads and moving.packed_scene.system.has_timed_loads
    )


@pytest.mark.parametrize("t", [0.0, 0.5])
def test_linear_models_are_pushed_by_inputs(t: float) -> None:
    """By laws, loads and springs; also where the input follows a signal, at its value there."""
    gust = {"name": "gust", "times": [0, 1], "values": [0.2, 1.2]}
    still = acted_on("(motor^2 + t)", input=[{"name": "motor", "unit": "N", "value": 0.7}])
    moving = acted_on("(motor^2 + t)", input=[{"name": "motor", "value": "gust"}], signal=[gust])
    for given, value in ((still, 0.7), (moving, 0.2 + t)):
        linear = given.linearize([0.3], [0.2], t, inputs=["motor", "pin.effort"])
        state = linear.state

        def missing(number: float, given: Model = given, state: Any = state) -> Any:
            with_number = given.with_inputs({"motor": number})
            return with_number.inverse_dynamics(state.q, state.u, state.udot, state.t)

        slope = (missing(value - 1e-4) - missing(value + 1e-4)) / 2e-4
        np.testing.assert_allclose(linear.V[:, 0], slope, rtol=1e-8)
        np.testing.assert_allclose(linear.V[:, 1], 1.0, rtol=1e-14)
        assert linear.input_names == ("motor", "pin.effort")


def test_an_input_on_a_flexible_body_pushes_as_the_force_does() -> None:
    beam = {"name": "blade", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 40.0,
            "modes": {"y": 3}}  # fmt: skip
    pin = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "blade",
           "law": {"stiffness": 5.0}}  # fmt: skip
    load = {"on": "blade.tip", "force": [0, "2*push", 0]}
    blade = mstmm.compile(mstmm.Scene(gravity=(0, 0, 0), beam=[beam], hinge=[pin], load=[load],
                                      input=[{"name": "push"}]))  # fmt: skip
    linear = blade.linearize(inputs=["push", "blade.tip.force.y"])
    np.testing.assert_allclose(linear.V[:, 0], 2 * linear.V[:, 1], rtol=1e-12, atol=1e-14)
    assert np.abs(linear.V[:, 0]).min() > 0.1


def test_an_input_that_drives_is_no_push() -> None:
    with pytest.raises(SceneError, match='the drive of hinge "crank" depends on this input'):
        model("looped").linearize([0.1, 0.2], inputs=["angle"])


@pytest.mark.parametrize("engine", ENGINES)
def test_numbers_and_names_of_signals_are_not_validated_anew(
    engine: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beside a flexible body, whose scene of nodes has the inputs too."""
    beam = {"name": "arm", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 50.0,
            "modes": {"y": 1}}  # fmt: skip
    hinge = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "arm",
             "law": {"effort": "motor"}}  # fmt: skip
    bent = mstmm.compile(
        mstmm.Scene(
            gravity=(0, -9.81, 0), beam=[beam], hinge=[hinge], input=[{"name": "motor"}],
            load=[{"on": "arm.tip", "force": [0, "motor*t", 0]}],
            signal=[{"name": "gust", "times": [0, 0.1, 0.2], "values": [0, 3, 1]}],
        ),
        engine=engine,
    )  # fmt: skip
    expected = bent.with_parameters({"motor.value": 2.5}).simulate(0.3)
    signal = {"times": [0, 0.1, 0.2], "values": [0, 3, 1]}
    followed = bent.with_inputs({"motor": signal}).simulate(0.3)

    def refuse(*_: Any, **__: Any) -> Any:
        raise AssertionError("the scene is validated anew")

    monkeypatch.setattr(mstmm.Scene, "from_data", refuse)
    found = bent.with_inputs({"motor": 2.5}).simulate(0.3)
    np.testing.assert_array_equal(found.q, expected.q)
    assert found.model.parameters["motor.value"] == 2.5 and found.model.engine == bent.engine
    named = bent.with_inputs({"motor": 1.0}).with_inputs({"motor": "gust"}).simulate(0.3)
    np.testing.assert_array_equal(named.q, followed.q)
    assert named.model.scene.input[0].value == "gust" and {0.1, 0.2} & set(named.t)
