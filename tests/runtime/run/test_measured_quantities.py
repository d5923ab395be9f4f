"""Controllers of a scene: the closed loop at its samples, in every method and in sessions."""

from __future__ import annotations

import tomllib
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

import mstmm
from mstmm.errors import NumericalFailure, SceneError
from mstmm.runtime.model.model import Model
from mstmm.runtime.run.event_location import Equations
from tests.support.scenes.minimal import body

ENGINES = ["looped", "fused"]
MASS, STIFFNESS, DAMPING, TS = 2.0, 30.0, 0.4, 0.05
A = ((0.9, 0.04), (-0.3, 0.6))
B = ((0.5, 0.01), (0.2, 0.04))
C, D = ((-4.0, -1.0),), ((-6.0, -3.0),)
REFERENCE, OFFSET, INITIAL = (0.2, 0.0), (1.5,), (0.1, -0.2)
REGULATOR: dict[str, Any] = {
    "name": "regulator", "sample_time": TS, "inputs": ["place", "slide.velocity_shown"],
    "outputs": ["push"], "A": A, "B": B, "C": C, "D": D, "initial": INITIAL,
    "reference": REFERENCE, "offset": OFFSET,
}  # fmt: skip


def scene(*controllers: dict[str, Any], **tables: Any) -> mstmm.Scene:
    """A mass on a spring along a line, pushed by an input."""
    slide = {"name": "slide", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
             "outboard": "block", "initial": {"q": [0.3], "u": [-0.1]},
             "law": {"stiffness": STIFFNESS, "damping": DAMPING, "effort": "push"}}  # fmt: skip
    block = {"name": "block", "mass": MASS, "inertia": [1, 1, 1], "ends": {"tip": [0.5, 0, 0]}}
    outputs = [{"name": "place", "of": "slide.q"}, {"name": "tip", "of": "block.tip.position"},
               {"name": "quick", "of": "block.tip.vx"}]  # fmt: skip
    return mstmm.Scene(**{
        "gravity": (0, 0, 0), "body": [block], "hinge": [slide],
        "input": [{"name": "push", "value": 0.0}], "output": outputs, "controller": controllers,
        **tables,
    })  # fmt: skip


def regulator(**changes: Any) -> dict[str, Any]:
    return REGULATOR | {"inputs": ["place", "quick"]} | changes


@cache
def model(engine: str) -> Model:
    return mstmm.compile(scene(regulator()), engine=engine)


def closed_loop(count: int) -> tuple[Any, Any, Any]:
    """States (count + 1, 2) at the samples, what the controller holds and its states behind them:
    by the exact solution of the mass under a force that stands still."""
    plant = np.zeros((3, 3))
    plant[0, 1], plant[1] = 1.0, [-STIFFNESS / MASS, -DAMPING / MASS, 1 / MASS]
    step = expm(plant * TS)
    y, x = np.array([0.3, -0.1]), np.array(INITIAL)
    states, held, own = [y], [], []
    for _ in range(count):
        e = y - REFERENCE
        u = np.array(C) @ x + np.array(D) @ e + OFFSET
        x = np.array(A) @ x + np.array(B) @ e
        y = (step @ np.append(y, u))[:2]
        states.append(y)
        held.append(u[0])
        own.append(x)
    return np.array(states), np.array(held), np.array(own)


METHODS: dict[str, dict[str, Any]] = {
    "dop853": {"rtol": 1e-12, "atol": 1e-13},
    "dopri5": {"step": 0.0007},
    "rk4": {"step": 0.0005},
    "rodas5p": {"rtol": 1e-11, "atol": 1e-13},
    "auto": {"rtol": 1e-12, "atol": 1e-13},
    "scipy-DOP853": {"rtol": 1e-12, "atol": 1e-13},
}


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("engine", ENGINES)
def test_the_closed_loop_is_that_of_matrix_powers(engine: str, method: str) -> None:
    count = 30
    times = np.arange(count + 1) * TS
    run = model(engine).simulate(times[-1], method, output_times=times, **METHODS[method])
    states, held, own = closed_loop(count)
    assert run.success, run.message
    np.testing.assert_allclose(run.q[:, 0], states[:, 0], rtol=0, atol=1e-10)
    np.testing.assert_allclose(run.u[:, 0], states[:, 1], rtol=0, atol=1e-9)
    np.testing.assert_allclose(run.quantity("push").values[:-1], held, rtol=0, atol=1e-8)
    found = np.stack([run.quantity(f"regulator.x[{k}]").values for k in (0, 1)], axis=1)
    np.testing.assert_allclose(found[:-1], own, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    "method", ["scipy-Radau", "scipy-BDF", "scipy-LSODA", "sundials-BDF", "sundials-Adams"]
)
def test_methods_of_other_packages_with_a_jacobian_follow_the_closed_loop(method: str) -> None:
    count = 6
    times = np.arange(count + 1) * TS
    run = model("looped").simulate(times[-1], method, output_times=times, rtol=1e-8, atol=1e-10)
    states, held, own = closed_loop(count)
    assert run.success, run.message
    np.testing.assert_allclose(run.q[:, 0], states[:, 0], rtol=0, atol=1e-6)
    np.testing.assert_allclose(run.quantity("push").values[:-1], held, rtol=0, atol=1e-5)
    found = np.stack([run.quantity(f"regulator.x[{k}]").values for k in (0, 1)], axis=1)
    np.testing.assert_allclose(found[:-1], own, rtol=0, atol=1e-5)


def test_the_jacobian_of_a_run_contains_what_a_controller_holds() -> None:
    slide = {"name": "slide", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
             "outboard": "block", "law": {"effort": "push*sin(q) - 3*u"}}  # fmt: skip
    made = scene(regulator(), hinge=[slide])
    equations = Equations(mstmm.compile(made, engine="looped"))
    equations.scene.begin(0.0, [0.3], [-0.1])
    e = np.array([0.3, -0.1]) - REFERENCE
    push = (np.array(C) @ INITIAL + np.array(D) @ e + OFFSET)[0]
    q, u = 0.3, -0.1
    # d/dt of q, u and the work of the effort
    expected = [
        [0, 1, 0],
        [push * np.cos(q) / MASS, -3 / MASS, 0],
        [push * np.cos(q) * u, push * np.sin(q) - 6 * u, 0],
    ]
    found = equations.jacobian(0.0, np.array([q, u, 0.0]))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


def test_samples_are_step_ends_and_values_are_held_between() -> None:
    run = model("looped").simulate(0.5, "rk4", 0.01)
    times = np.arange(11) * TS
    assert set(times) <= set(run.t)
    inside = (run.t > 2 * TS) & (run.t < 3 * TS)
    push = run.quantity("push").values
    assert inside.any() and np.ptp(push[inside]) == 0
    assert push[inside][0] == push[run.t == 2 * TS][0] != push[run.t == TS][0]
    effort = run.quantity("slide.effort").values
    q, u = run.q[:, 0], run.u[:, 0]
    np.testing.assert_allclose(effort, push - STIFFNESS * q - DAMPING * u, atol=1e-12)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_session_has_the_controller_in_it(engine: str) -> None:
    session = model(engine).session(method="rk4", step=0.005)
    for _ in range(100):
        session.advance(0.01)
    run = model(engine).simulate(1.0, "rk4", 0.005)
    np.testing.assert_array_equal(session.q, run.q[-1])
    other = session.copy()
    session.advance(0.5)
    other.advance(0.5)
    np.testing.assert_array_equal(session.q, other.q)
    assert session.outputs()["place"] == session.q[0]
    with pytest.raises(SceneError, match=r'controller "regulator" sets this input'):
        session.advance(0.1, {"push": 1.0})


@pytest.mark.parametrize("engine", ENGINES)
def test_the_same_controller_in_python_by_ticks(engine: str) -> None:
    bare = mstmm.compile(scene(), engine=engine)
    session, x = bare.session(method="rk4", step=0.005), np.array(INITIAL)
    for _ in range(20):
        e = np.array([session.q[0], session.u[0]]) - REFERENCE
        u = np.array(C) @ x + np.array(D) @ e + OFFSET
        x = np.array(A) @ x + np.array(B) @ e
        session.advance(TS, {"push": u[0]})
    run = model(engine).simulate(1.0, "rk4", 0.005)
    np.testing.assert_allclose(session.q, run.q[-1], rtol=0, atol=1e-14)


def test_two_controllers_measure_before_either_acts() -> None:
    gain = {"sample_time": TS, "D": ((-2.0,),)}
    one = gain | {"name": "one", "inputs": ["slide.effort"], "outputs": ["push"]}
    two = gain | {"name": "two", "inputs": ["push"], "outputs": ["pull"]}
    inputs = [{"name": "push", "value": 0.7}, {"name": "pull"}]
    run, swapped = (
        mstmm.compile(scene(*both, input=inputs), engine="looped").simulate(0.2, "rk4", 0.01)
        for both in ((one, two), (two, one))
    )
    np.testing.assert_array_equal(run.q, swapped.q)
    push, pull = (run.quantity(name).values for name in ("push", "pull"))
    at = np.array([np.flatnonzero(run.t == k * TS)[-1] for k in range(4)])
    assert pull[at[0]] == -2 * 0.7
    np.testing.assert_array_equal(pull[at[1:]], -2 * push[at[:-1]])
    assert push[0] == pytest.approx(-2 * (0.7 - STIFFNESS * 0.3 + DAMPING * 0.1), rel=1e-12)


@pytest.mark.parametrize(
    "name",
    [
        "tip.x", "slide.displacement_rate", "block.ax", "slide.fx", "slide.effort",
        "slide.udot[0]", "energy", "momentum.x", "sum", "block.tip.wz", "slide.moment.z",
    ],
)  # fmt: skip
def test_what_is_measured_is_what_results_show(name: str) -> None:
    outputs = [{"name": "tip", "of": "block.tip.position"},
               {"name": "sum", "of": "slide.q*push + 2*t"}]  # fmt: skip
    watch = {"name": "watch", "sample_time": TS, "inputs": [name], "outputs": ["seen"],
             "D": ((1.0,),)}  # fmt: skip
    inputs = [{"name": "push", "value": 0.4}, {"name": "seen"}]
    watched = scene(watch, input=inputs, output=outputs)
    run = mstmm.compile(watched, engine="looped").simulate(0.3, "rk4", 0.01)
    at = np.array([np.flatnonzero(np.abs(run.t - k * TS) < 1e-9)[-1] for k in range(6)])
    shown = run.quantity(name).values
    np.testing.assert_allclose(run.quantity("seen").values[at], shown[at], rtol=1e-13, atol=1e-13)


def test_the_classical_method_refuses_it() -> None:
    with pytest.raises(SceneError, match=r'controller "regulator": method "dttmm-classical"'):
        model("looped").simulate(0.1, "dttmm-classical", 0.01)


def test_a_linear_model_leaves_it_out_and_says_so() -> None:
    linear = model("looped").linearize(inputs=["push"])
    assert any('controller "regulator" is left out' in text for text in linear.warnings)
    assert linear.K[0, 0] == pytest.approx(STIFFNESS) and linear.V[0, 0] == pytest.approx(1.0)


def test_a_loop_that_grows_beyond_numbers_is_named() -> None:
    wild = {"name": "wild", "sample_time": TS, "inputs": ["place"], "outputs": ["push"],
            "A": ((1e200,),), "B": ((1e200,),), "C": ((1.0,),)}  # fmt: skip
    run = mstmm.compile(scene(wild), engine="looped").simulate(1.0)
    assert not run.success and 'controller "wild" at t = 0.05 s: its measurement' in run.message
    with pytest.raises(NumericalFailure, match='controller "wild"'):
        mstmm.compile(scene(wild), engine="looped").session().advance(1.0)


def test_it_is_written_and_saved_with_the_scene() -> None:
    made = scene(regulator())
    assert mstmm.Scene(**tomllib.loads(made.to_toml())) == made


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"outputs": ["pull"]}, r'outputs\[0\]: there is no input "pull"'),
        (
            {"inputs": ["place", "block.orientation.w"]},
            'block.orientation.w": this quantity cannot be',
        ),
        ({"inputs": ["place", "blok.x"]}, 'controller "regulator": inputs: "blok.x"'),
        ({"inputs": ["plase", "quick"]}, '"plase": .*; did you mean "place"'),
        ({"inputs": ["place", "slide.displacment"]}, 'did you mean "slide.displacement"'),
        ({"inputs": ["place", "tip"]}, '"block.tip.position": this quantity cannot be measured'),
        ({"B": ((1.0,), (1.0,))}, "B: expected 2 rows of 2"),
        ({"A": ((1.0, 2.0), (3.0,))}, "rows of"),
        ({"C": ()}, "C: missing; expected 1 rows of 2"),
        ({"initial": (1.0,)}, "initial: expected 2 entries, found 1"),
        ({"sample_time": 0.0}, "sample_time: expected a number in s, more than 0"),
        ({"name": "slide"}, '"slide" is also the name of a hinge'),
        ({"outputs": ["push", "push"]}, "C: expected|stands twice"),
    ],
)
def test_bad_controllers(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        mstmm.compile(scene(regulator(**changes)), engine="looped")


def test_inputs_are_set_by_one_controller_and_drive_nothing() -> None:
    with pytest.raises(SceneError, match='"push" is set by controller "regulator" already'):
        scene(regulator(), regulator(name="other"))
    crank = {"name": "crank", "type": "pin", "inboard": "block.tip", "outboard": "rod",
             "drive": "angle"}  # fmt: skip
    made = scene()
    gain = {"name": "gain", "sample_time": TS, "inputs": ["place"], "outputs": ["angle"],
            "D": ((1.0,),)}  # fmt: skip
    with pytest.raises(SceneError, match='"angle" drives a hinge'):
        scene(gain, body=[*made.body, body("rod")], hinge=[*made.hinge, crank],
              input=[{"name": "angle", "rates": [0, 0]}, {"name": "push"}])  # fmt: skip


def test_an_input_is_not_named_like_a_hinge() -> None:
    with pytest.raises(SceneError, match='"slide" is also the name of a hinge; rename one'):
        scene(input=[{"name": "push"}, {"name": "slide"}])


@pytest.mark.parametrize("given", [1.0, ([0, 1], [2.0, 3.0])])
def test_an_input_that_a_controller_sets_is_set_by_nobody_else(given: Any) -> None:
    with pytest.raises(SceneError, match='controller "regulator" sets this input'):
        model("looped").simulate(0.1, inputs={"push": given})
    with pytest.raises(SceneError, match='controller "regulator" sets this input'):
        model("looped").with_inputs({"push": given})
