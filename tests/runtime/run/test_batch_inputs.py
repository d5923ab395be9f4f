"""Inputs of batches: numbers and signals of each trajectory, side by side and one by one."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import SceneError
from mstmm.runtime.model.model import Model
from tests.support.scenes.minimal import body

ENGINES = ["looped", "fused"]
TIMES = np.array([0.0, 0.2, 0.5, 1.1])
RUN: dict[str, Any] = {"t_end": 1.0, "output_times": [0.4, 1.0], "rtol": 1e-9, "atol": 1e-11}


@cache
def arm(engine: str, effort: str = "motor - 0.3*u", drive: str | None = None) -> Model:
    hinges: list[dict[str, Any]] = [
        {"name": "shoulder", "type": "pin", "inboard": "ground", "outboard": "rod1",
         "law": {"effort": effort}},
        {"name": "elbow", "type": "pin", "inboard": "rod1.tip", "outboard": "rod2"},
    ]  # fmt: skip
    if drive:
        hinges[1]["drive"] = drive
    scene = mstmm.Scene(
        gravity=(0, -9.81, 0), body=[body("rod1"), body("rod2")], hinge=hinges,
        load=[{"on": "rod2.tip", "force": [0, "wind + push*sin(3*t)", 0]}],
        input=[{"name": "motor", "value": 0.5}, {"name": "push"},
               {"name": "turn", "rates": [0, 0]}],
        signal=[{"name": "wind", "times": [0, 0.4], "values": [0, 1]}],
    )  # fmt: skip
    return mstmm.compile(scene, engine=engine)


def starts(n: int) -> tuple[Any, Any]:
    rng = np.random.default_rng(3)
    return rng.uniform(-1, 1, (n, 2)), rng.uniform(-1, 1, (n, 2))


def batch_inputs(n: int, interpolation: str = "line") -> dict[str, Any]:
    rng = np.random.default_rng(4)
    signal = {"times": TIMES, "values": rng.normal(size=(n, 4)), "interpolation": interpolation}
    return {"motor": signal, "push": rng.normal(size=n)}


def row(inputs: dict[str, Any], k: int) -> dict[str, Any]:
    return {
        "motor": inputs["motor"] | {"values": inputs["motor"]["values"][k]},
        "push": float(inputs["push"][k]),
    }


@pytest.mark.parametrize("interpolation", ["line", "hold", "cubic"])
@pytest.mark.parametrize("engine", ENGINES)
def test_each_trajectory_is_the_run_under_its_inputs(engine: str, interpolation: str) -> None:
    model, (q, u), inputs = arm(engine), starts(7), batch_inputs(7, interpolation)
    batch = model.simulate_batch((q, u), inputs=inputs, **RUN)
    assert batch.success.all()
    assert ("side by side" in batch.engine) == (engine == "fused")
    for k in range(7):
        run = model.simulate(initial=(q[k], u[k]), inputs=row(inputs, k), **RUN)
        np.testing.assert_allclose(batch.q[k], run.q, rtol=0, atol=1e-8)
        np.testing.assert_allclose(batch.u[k], run.u, rtol=0, atol=1e-7)


@pytest.mark.parametrize("engine", ENGINES)
def test_neighbours_and_threads_change_nothing(engine: str) -> None:
    model, (q, u), inputs = arm(engine), starts(11), batch_inputs(11)
    whole = model.simulate_batch((q, u), inputs=inputs, threads=2, **RUN)
    some = np.array([8, 2, 5])
    part = inputs["motor"] | {"values": inputs["motor"]["values"][some]}
    found = model.simulate_batch(
        (q[some], u[some]), inputs={"motor": part, "push": inputs["push"][some]}, threads=1, **RUN
    )
    np.testing.assert_array_equal(found.q, whole.q[some])
    np.testing.assert_array_equal(found.evaluations, whole.evaluations[some])


@pytest.mark.parametrize("engine", ENGINES)
def test_numbers_are_those_of_the_parameter(engine: str) -> None:
    model, (q, u), motor = arm(engine), starts(5), np.linspace(-1, 1, 5)
    found = model.simulate_batch((q, u), {"rod1.mass": np.linspace(1, 2, 5)},
                                 inputs={"motor": motor, "push": 0.5}, **RUN)  # fmt: skip
    named: dict[str, Any] = {
        "rod1.mass": np.linspace(1, 2, 5),
        "motor.value": motor,
        "push.value": 0.5,
    }
    expected = model.simulate_batch((q, u), named, **RUN)
    np.testing.assert_array_equal(found.q, expected.q)


@pytest.mark.parametrize("engine", ENGINES)
def test_inputs_that_decide_when_something_switches(engine: str) -> None:
    model, (q, u) = arm(engine, "where(t > motor, 3, -1)"), starts(4)
    motor = np.linspace(0.2, 0.9, 4)
    batch = model.simulate_batch((q, u), inputs={"motor": motor}, **RUN)
    assert "one after the other" in batch.engine
    for k in range(4):
        run = model.simulate(initial=(q[k], u[k]), inputs={"motor": motor[k]}, **RUN)
        np.testing.assert_allclose(batch.q[k], run.q, rtol=0, atol=1e-8)


def test_signals_of_the_scene_and_one_for_all() -> None:
    model, (q, u) = arm("looped"), starts(3)
    inputs: dict[str, Any] = {"motor": "wind", "push": ([0, 1], [1, 2])}
    found = model.simulate_batch((q, u), inputs=inputs, **RUN)
    for k in range(3):
        run = model.simulate(initial=(q[k], u[k]), inputs=inputs, **RUN)
        np.testing.assert_allclose(found.q[k], run.q, rtol=0, atol=1e-8)


@pytest.mark.parametrize(
    ("inputs", "message"),
    [
        ({"moter": 1.0}, 'no such input in the scene; did you mean "motor"'),
        ({"motor": [1.0, 2.0, 3.0]}, r'inputs\["motor"\] has shape \(3,\), expected \(2,\)'),
        ({"motor": (TIMES, np.zeros((3, 4)))}, r"values have shape \(3, 4\), expected \(m,\)"),
        ({"motor": (TIMES, np.zeros((2, 3)))}, "expected 4 entries"),
        ({"motor": (TIMES[::-1], np.zeros((2, 4)))}, "sort them by time"),
        ({"motor": [np.nan, 1.0]}, "expected a finite number"),
        ({"motor": "storm"}, 'there is no signal "storm"'),
        ({"turn": 1.0}, r'drive of hinge "elbow" follows.*parameters=\{"turn.value"'),
    ],
)
def test_inputs_that_make_no_sense(inputs: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        arm("looped", drive="turn").simulate_batch(starts(2), inputs=inputs, **RUN)
