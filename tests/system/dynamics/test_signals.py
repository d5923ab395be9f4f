"""Runs under signals: steps end at their knots, whatever the method, the engine and the place."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.interpolate import CubicSpline

import mstmm
from mstmm.errors import SceneError
from mstmm.runtime.model.model import Model
from mstmm.runtime.run import integration_run
from tests.support.scenes.minimal import body

TIMES = (0.0, 0.5, 1.3, 2.0, 3.0)

#: A cubic, which a cubic signal is everywhere between its first and its last time.
CUBIC = "(0.3 + 1.1*t - 1.5*t^2 + 0.4*t^3)"
VALUES = tuple(0.3 + 1.1 * t - 1.5 * t**2 + 0.4 * t**3 for t in TIMES)

ENGINES = ["looped", "fused"]


def wind(interpolation: str = "cubic", times: Any = TIMES, values: Any = VALUES) -> dict[str, Any]:
    return {"name": "wind", "times": times, "values": values, "interpolation": interpolation}


@cache
def wheel(engine: str, interpolation: str, values: tuple[float, ...], effort: str) -> Model:
    """A body of 0.5 kg m2 on a pin, and nothing but this effort."""
    disc = {"name": "disc", "mass": 1.0, "inertia": [0.3, 0.3, 0.5]}
    pin = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "disc",
           "law": {"effort": effort}}  # fmt: skip
    scene = mstmm.Scene(gravity=(0, 0, 0), body=[disc], hinge=[pin],
                        signal=[wind(interpolation, values=values)])  # fmt: skip
    return mstmm.compile(scene, engine=engine)


@cache
def arm(engine: str, name: str) -> Model:
    """Two rods on which this name acts wherever an expression may, by a drive as well."""
    lower = {"name": "shoulder", "type": "pin", "inboard": "ground", "outboard": "rod1",
             "law": {"effort": f"-2*q - 0.3*u + {name}"}}  # fmt: skip
    upper = {"name": "elbow", "type": "pin", "inboard": "rod1.tip", "outboard": "rod2",
             "drive": [f"0.5*sin({name})"]}  # fmt: skip
    hand = {"name": "wrist", "type": "pin", "inboard": "rod2.tip", "outboard": "rod3",
            "law": {"stiffness": 3.0, "damping": 0.1}}  # fmt: skip
    scene = mstmm.Scene(
        gravity=(0, -9.81, 0), body=[body("rod1"), body("rod2"), body("rod3")],
        hinge=[lower, upper, hand], signal=[wind()] if name == "wind" else [],
        load=[{"on": "rod3.tip", "force": [0, f"2*{name}", 0]}],
        spring=[{"from": "ground", "position": [0, 2, 0], "to": "rod1.tip",
                 "law": {"effort": f"3*(q - 1) + {name}"}}],
    )  # fmt: skip
    return mstmm.compile(scene, engine=engine)


# --- what a run makes of it -----------------------------------------------------------------------


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(
    ("method", "settings"),
    [
        ("dop853", {}), ("rk4", {"step": 0.3}), ("auto", {}), ("rodas5p", {}), ("kvaerno5", {}),
        ("genalpha", {"step": 0.1}), ("dttmm", {"step": 0.1}), ("exprb32", {}), ("scipy-Radau", {}),
    ],
)  # fmt: skip
def test_what_is_held_is_integrated_exactly(
    method: str, settings: dict[str, Any], engine: str
) -> None:
    """Each stage must see the value of its own piece, at both ends of every step."""
    values = (0.0, 1.0, -2.0, 5.0, 0.25)
    run = wheel(engine, "hold", values, "wind").simulate(3.5, method, **settings)
    impulse = sum(np.diff([*TIMES, 3.5]) * values)
    assert run.u[-1, 0] == pytest.approx(impulse / 0.5, abs=1e-12)
    assert run.success and set(TIMES) <= set(run.t)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("interpolation", ["line", "cubic"])
def test_lines_and_splines_are_integrated_exactly(interpolation: str, engine: str) -> None:
    values = (0.0, 1.0, -2.0, 5.0, 0.25)
    run = wheel(engine, interpolation, values, "wind").simulate(4.0, "rk4", step=0.5)
    impulse = (
        CubicSpline(TIMES, values).integrate(0, 3) if interpolation == "cubic"
        else trapezoid(values, TIMES)
    ) + values[-1] * 1.0  # fmt: skip
    assert run.u[-1, 0] == pytest.approx(impulse / 0.5, abs=1e-12)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(
    ("method", "settings", "error"),
    [
        ("dop853", {}, 1e-8), ("pirk13", {"step": 0.05}, 1e-8), ("rodas5p", {}, 1e-7),
        ("ros34pw2", {"rtol": 1e-7}, 1e-5), ("esdirk436", {}, 1e-7),
        ("exprb32", {"rtol": 1e-7}, 1e-5), ("genalpha", {"step": 0.005}, 1e-3),
        ("scipy-DOP853", {}, 1e-7),
    ],
)  # fmt: skip
def test_a_signal_acts_as_the_cubic_that_it_is(
    method: str, settings: dict[str, Any], error: float, engine: str
) -> None:
    given: dict[str, Any] = {"output_times": [0.7, 1.3, 3.0]}
    reference = arm("looped", CUBIC).simulate(3.0, "dop853", rtol=1e-11, atol=1e-13, **given)
    run = arm(engine, "wind").simulate(3.0, method, **settings, **given)
    assert run.success
    np.testing.assert_allclose(run.q, reference.q, rtol=0, atol=error)
    np.testing.assert_allclose(run.u, reference.u, rtol=0, atol=10 * error)


def rope(name: str) -> dict[str, Any]:
    link = {"mass": 0.1, "center_of_mass": [0.1, 0, 0], "inertia": [1e-4, 1e-3, 1e-3],
            "ends": {"tip": [0.2, 0, 0]}}  # fmt: skip
    pin = {"type": "pin", "law": {"effort": f"0.1*{name} - 0.01*u"}}
    chain = {"name": "rope", "count": 5, "inboard": "ground", "body": [link], "hinge": [pin]}
    return {"gravity": [0, -9.81, 0], "chain": [chain]}


def blade(name: str) -> dict[str, Any]:
    beam = {"name": "blade", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 40.0,
            "modes": {"y": 2}}  # fmt: skip
    pin = {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "blade",
           "law": {"effort": name}}  # fmt: skip
    load = {"on": "blade", "force_per_length": [0, name, 0], "span": [0.5, 1.0]}
    return {"gravity": [0, 0, 0], "beam": [beam], "hinge": [pin], "load": [load]}


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("made", [rope, blade])
def test_signals_act_on_chains_and_flexible_bodies(
    made: Callable[[str], dict[str, Any]], engine: str
) -> None:
    times = [0.7, 1.3, 3.0]
    reference = mstmm.compile(mstmm.Scene(**made(CUBIC)), engine="looped")
    model = mstmm.compile(mstmm.Scene(**made("wind"), signal=[wind()]), engine=engine)
    for method in ("dop853", "rodas5p"):
        one, other = (m.simulate(3.0, method, output_times=times) for m in (model, reference))
        np.testing.assert_allclose(one.q, other.q, rtol=0, atol=1e-8)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_blow_that_lasts_a_moment_is_not_missed(engine: str) -> None:
    blow = {"name": "blow", "times": [0.0, 1.0, 1.0 + 1e-6], "values": [0.0, 1e6, 0.0],
            "interpolation": "hold"}  # fmt: skip
    scene = {"gravity": [0, 0, 0], "body": [body()], "signal": [blow],
             "hinge": [{"name": "pin", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
                        "outboard": "rod1", "law": {"effort": "blow"}}]}  # fmt: skip
    run = mstmm.compile(mstmm.Scene(**scene), engine=engine).simulate(10.0)
    assert run.u[-1, 0] == pytest.approx(1.0, rel=1e-9) and len(run.t) < 40


# --- drives, conditions ---------------------------------------------------------------------------


def driven_rail_scene(interpolation: str, drive: str = "wind") -> mstmm.Scene:
    rail = {"name": "rail", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
            "outboard": "rod1", "drive": [drive]}  # fmt: skip
    return mstmm.Scene(gravity=(0, 0, 0), body=[body()], hinge=[rail], signal=[wind(interpolation)])


@pytest.mark.parametrize("engine", ENGINES)
def test_a_drive_follows_a_spline_up_to_its_end(engine: str) -> None:
    run = mstmm.compile(driven_rail_scene("cubic"), engine=engine).simulate(
        3.0, output_times=[0, 0.5, 1.7, 3]
    )
    spline = CubicSpline(TIMES, VALUES)
    np.testing.assert_allclose(run.q[:, 0], spline(run.t), rtol=0, atol=1e-14)
    np.testing.assert_allclose(run.u[:, 0], spline(run.t, 1), rtol=0, atol=1e-13)
    np.testing.assert_allclose(run.udot[:, 0], spline(run.t, 2), rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("interpolation", "t_end", "says"),
    [
        ("hold", 3.0, "jumps in position at t = 0.5 s"),
        ("line", 3.0, "jumps in speed at t = 0.5 s"),
        ("cubic", 3.5, "jumps in speed at t = 3 s"),
    ],
)
def test_a_drive_cannot_jump(interpolation: str, t_end: float, says: str) -> None:
    model = mstmm.compile(driven_rail_scene(interpolation))
    with pytest.raises(SceneError) as error:
        model.simulate(t_end)
    assert 'drive of hinge "rail"' in str(error.value) and says in str(error.value)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("interpolation", ["hold", "line"])
def test_conditions_of_signals_are_met(interpolation: str, engine: str) -> None:
    values = (0.0, 1.0, -2.0, 5.0, 0.25)
    effort = "where(wind > 3.5, 1, 0)"
    run = wheel(engine, interpolation, values, effort).simulate(3.0)
    above = {"hold": 1.0, "line": 0.7 * 1.5 / 7 + 1.5 / 4.75}[interpolation]
    assert run.u[-1, 0] == pytest.approx(above / 0.5, abs=1e-9)
    table = {"gravity": [0, 0, 0], "body": [body()], "signal": [wind(interpolation, values=values)],
             "hinge": [{"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod1"}],
             "event": [{"when": "wind > 3.5", "do": "stop"}]}  # fmt: skip
    run = mstmm.compile(mstmm.Scene(**table), engine=engine).simulate(3.0)
    begins = {"hold": 2.0, "line": 1.3 + 0.7 * 5.5 / 7}[interpolation]
    assert run.t[-1] == pytest.approx(begins, abs=1e-9)


# --- many states, derivatives, failures -----------------------------------------------------------


@pytest.mark.parametrize("engine", ENGINES)
def test_many_times_at_once_are_each_by_itself(engine: str) -> None:
    model = arm(engine, "wind")
    t = np.linspace(-0.5, 4.0, 37)
    q, u = model.initial_state()
    together = model.accelerations(np.tile(q, (37, 1)), np.tile(u, (37, 1)), t)
    alone = [arm("looped", "wind").accelerations(q, u, at) for at in t]
    np.testing.assert_allclose(together, alone, rtol=1e-12, atol=1e-11)


@pytest.mark.parametrize("engine", ENGINES)
def test_trajectories_of_a_batch_follow_the_signal(engine: str) -> None:
    model = arm(engine, "wind")
    q, u = model.initial_state()
    starts = np.add(q, [[0.0, 0, 0], [0.1, 0, 0], [0.2, 0, 0]])
    batch = model.simulate_batch((starts, np.tile(u, (3, 1))), t_end=2.0)
    for k in range(3):
        run = model.simulate(2.0, initial=(starts[k], u), output_times=[2.0])
        np.testing.assert_allclose(batch.q[k, -1], run.q[-1], rtol=1e-7)


@pytest.mark.parametrize("t", [0.0, 0.7, 2.9])
def test_derivatives_by_time_are_those_of_the_cubic(t: float) -> None:
    q, u = np.array([0.2, 0.0, 0.4]), np.array([0.3, 0.0, -0.1])
    found, expected = (arm("looped", name).derivatives(q, u, t) for name in ("wind", CUBIC))
    np.testing.assert_allclose(found.t, expected.t, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(found.q, expected.q, rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("engine", ENGINES)
def test_an_interrupted_run_goes_on_bit_for_bit(
    engine: str, tmp_path: Path, heard: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        integration_run, "SLICE", 0.001
    )  # else a fast machine has done before Ctrl-C
    model = arm(engine, "wind")
    settings: dict[str, Any] = {
        "t_end": 3.0,
        "method": "rk4",
        "step": 2e-5,
        "output_times": [0.1, 1.0, 3.0],
    }
    path = tmp_path / "run.npz"
    whole = model.simulate(execution=mstmm.Execution(checkpoint=path), **settings)
    interrupting = mstmm.Execution(
        checkpoint=path, progress=lambda *_: os.kill(os.getpid(), signal.SIGINT)
    )
    cut = model.simulate(execution=interrupting, **settings)
    assert cut.status is None
    again = model.simulate(execution=mstmm.Execution(checkpoint=path, resume=True), **settings)
    for name in ("t", "q", "u", "work"):
        np.testing.assert_array_equal(getattr(again, name), getattr(whole, name))


def test_a_number_that_fails_is_shown_with_the_signal() -> None:
    model = wheel("looped", "line", VALUES, "log(wind)")
    run = model.simulate(3.0)
    assert not run.success and "log(wind)" in run.message
