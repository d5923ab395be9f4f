"""Events, releases, bounces and switches whose conditions hold for a moment only are met."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.integrate.c_loop import Status
from mstmm.runtime.result.result import Result
from mstmm.runtime.run.event_location import Equations

METHODS: dict[str, dict[str, Any]] = {
    "dop853": {}, "dopri5": {}, "pirk13": {}, "auto": {}, "rk4": {"step": 0.7},
    "rodas5p": {}, "kvaerno5": {}, "exprb32": {}, "genalpha": {"step": 0.7},
    "scipy-DOP853": {}, "scipy-RK45": {}, "scipy-Radau": {}, "scipy-BDF": {}, "scipy-LSODA": {},
    "sundials-BDF": {}, "sundials-Adams": {},
}  # fmt: skip
HALF = math.sqrt(math.log(2))  # exp(-x^2) is 1/2 there

BALL: dict[str, Any] = {"name": "b", "mass": 2.0, "inertia": [1, 1, 1]}


def sliding(when: str, do: str = "stop", u: float = 1.0, g: float = 0.0, **more: Any) -> Any:
    """A mass on a rail along x, at x = 0 with speed u."""
    rail = {"name": "h", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground",
            "outboard": "b", "initial": {"u": [u]}, **more.pop("hinge", {})}  # fmt: skip
    events = [{"name": "seen", "when": when, "do": do, **more}] if when else []
    return mstmm.Scene(gravity=(-g, 0, 0), body=[BALL], hinge=[rail], event=events)


def simulate_looped(
    scene: Any, method: str = "dop853", t_end: float = 10.0, **options: Any
) -> Result:
    return mstmm.compile(scene, engine="looped").simulate(t_end, method, **options)


@pytest.mark.parametrize("method", METHODS)
def test_a_stop_that_holds_for_a_moment(method: str) -> None:
    run = simulate_looped(sliding("exp(-((h.q-5)/0.01)^2) > 0.5"), method, **METHODS[method])
    assert run.status is Status.STOPPED
    assert run.t[-1] == pytest.approx(5 - 0.01 * HALF, abs=1e-11)


@pytest.mark.parametrize("method", METHODS)
def test_the_first_of_many_moments(method: str) -> None:
    run = simulate_looped(sliding("sin(20*h.q) > 0.999"), method, **METHODS[method])
    assert run.status is Status.STOPPED
    assert run.t[-1] == pytest.approx(math.asin(0.999) / 20, abs=1e-11)


@pytest.mark.parametrize("method", METHODS)
def test_a_narrow_bounce_lets_nothing_through(method: str) -> None:
    wall = sliding("exp(-((b.x-5)/0.01)^2) > 0.5", "bounce", restitution=1.0)
    run = simulate_looped(wall, method, **METHODS[method])
    assert run.success and run.u[-1, 0] == pytest.approx(-1.0, abs=1e-9)
    assert run.q[-1, 0] == pytest.approx(2 * (5 - 0.01 * HALF) - 10, abs=1e-9)


def time_at_height(x: float) -> float:
    """Time (s) at which the throw of the next test is at a height (m)."""
    return (20 - math.sqrt(400 - 19.62 * x)) / 9.81


@pytest.mark.parametrize("method", ["dop853", "pirk13", "rodas5p", "scipy-RK45"])
@pytest.mark.parametrize(
    ("when", "time"),
    [
        ("abs(b.vx + 7)^3 < 1e-12", (27 - 1e-4) / 9.81),
        ("exp(-((h.u - 3)/1e-3)^2) > 0.5", (17 - 1e-3 * HALF) / 9.81),
        ("b.vx < 0", 20 / 9.81),
        ("tanh(1e5*(b.x - 15)) - tanh(1e5*(b.x - 15.001)) > 1", time_at_height(15.0)),
        ("1/(1 + ((h.q - 20)/1e-5)^2) > 0.5", time_at_height(20 - 1e-5)),
        ("1/(h.q - 15) > 1e5", time_at_height(15.0)),
        ("sqrt((b.x - 15)^2 + b.y^2) < 1e-6", time_at_height(15 - 1e-6)),
        ("min(sin(400*h.q), cos(t)) > 0.9999", time_at_height(math.asin(0.9999) / 400)),
    ],
)
def test_conditions_on_a_throw(method: str, when: str, time: float) -> None:
    """x = 20 t - 9.81 t^2 / 2, upwards until t = 2.04 s."""
    run = simulate_looped(sliding(when, u=20.0, g=9.81), method)
    assert run.status is Status.STOPPED
    assert run.t[-1] == pytest.approx(time, abs=1e-9)


@pytest.mark.parametrize("method", ["dop853", "pirk13", "rodas5p", "scipy-DOP853"])
@pytest.mark.parametrize(
    ("when", "angle"),
    [
        ("rod.tip.x < -0.99999", math.acos(-0.99999)),
        ("rod.tip.y > 0.9999999", math.asin(0.9999999)),
        ("rod.tip.vy < -18.84955", math.acos(-18.84955 / (6 * math.pi))),
        ("rod.tip.x*rod.tip.y > 0.4999999", math.asin(0.9999998) / 2),
    ],
)
def test_a_point_that_turns_often_within_a_step(method: str, when: str, angle: float) -> None:
    """Three turns a second, and nothing that would keep a step below ten of them."""
    rod = {"name": "rod", "mass": 1.0, "inertia": [1, 1, 1], "ends": {"tip": [1, 0, 0]}}
    pin = {"name": "h", "type": "pin", "inboard": "ground", "outboard": "rod",
           "initial": {"u": [6 * math.pi]}}  # fmt: skip
    scene = mstmm.Scene(gravity=(0, 0, 0), body=[rod], hinge=[pin],
                        event=[{"when": when, "do": "stop"}])  # fmt: skip
    run = simulate_looped(scene, method)
    assert run.status is Status.STOPPED
    assert run.t[-1] == pytest.approx(angle / (6 * math.pi), abs=1e-9)


@pytest.mark.parametrize("method", ["dop853", "rodas5p", "scipy-RK45"])
def test_a_place_in_two_coordinates(method: str) -> None:
    hinge = {"name": "h", "type": "planar", "inboard": "ground", "outboard": "b",
             "initial": {"u": [1, 0.5, 0]}}  # fmt: skip
    for y, found in ((2.5, True), (2.6, False)):
        when = f"exp(-((b.x-5)^2+(b.y-{y})^2)/1e-6) > 0.5"
        scene = mstmm.Scene(gravity=(0, 0, 0), body=[BALL], hinge=[hinge],
                            event=[{"when": when, "do": "stop"}])  # fmt: skip
        run = simulate_looped(scene, method)
        assert (run.status is Status.STOPPED) is found and not run.risks
        if found:
            assert run.t[-1] == pytest.approx(5 - 1e-3 * HALF / math.sqrt(1.25), abs=1e-9)


@pytest.mark.parametrize("method", ["dop853", "scipy-RK45"])
def test_a_release_that_holds_for_a_moment(method: str) -> None:
    """What is driven goes on by itself behind the place where it is let go."""
    hinge = {"drive": "sin(t)", "release": "exp(-((h.q - 0.5)/1e-3)^2) > 0.5", "initial": {}}
    run = simulate_looped(sliding("", hinge=hinge), method, 4.0)
    q = 0.5 - 1e-3 * HALF
    time, speed = math.asin(q), math.sqrt(1 - q * q)
    assert run.success
    assert run.q[-1, 0] == pytest.approx(q + (4.0 - time) * speed, abs=1e-7)


@pytest.mark.parametrize("method", ["dop853", "rodas5p", "scipy-RK45"])
def test_a_switch_that_holds_for_a_moment(method: str) -> None:
    """A force of 300 N over 2 mm sqrt(log 2): the kinetic energy rises by its work."""
    law = {"law": {"effort": "where(exp(-((q - 5)/1e-3)^2) > 0.5, 300, 0)"}}
    run = simulate_looped(sliding("", hinge=law), method)
    assert run.u[-1, 0] == pytest.approx(math.sqrt(1 + 300 * 2e-3 * HALF), rel=1e-7)


def test_sessions_and_batches_meet_them() -> None:
    model = mstmm.compile(sliding("exp(-((h.q-5)/0.01)^2) > 0.5"), engine="looped")
    session = model.session()
    session.advance(20.0)
    assert session.t == pytest.approx(5 - 0.01 * HALF, abs=1e-11) and session.stop_reason
    start = np.zeros((2, 1)), np.array([[1.0], [-1.0]])
    batch = model.simulate_batch(start, t_end=10.0, output_times=[1.0, 10.0])
    assert "stopped by" in batch.messages[0] and "finished" in batch.messages[1]


@pytest.mark.parametrize("method", ["dop853", "scipy-DOP853"])
def test_what_changes_too_often_to_be_followed_is_a_doubt(method: str) -> None:
    run = simulate_looped(sliding("sin(2e5*h.q) + 0.5*sin(4e5*h.q) > 1.4"), method, 2.0)
    assert run.success and not run.trusted
    assert any(risk.name == "switches" and '"seen"' in risk.element for risk in run.risks)


def test_a_session_says_what_changes_too_often() -> None:
    model = mstmm.compile(sliding("sin(2e5*h.q) + 0.5*sin(4e5*h.q) > 1.4"), engine="looped")
    session = model.session()
    assert not session.risks
    session.advance(2.0)
    assert [risk.name for risk in session.risks] == ["switches"] and '"seen"' in session.warnings[0]


@pytest.mark.parametrize(
    "when",
    ["sin(h.q) > 1.0000001", "b.x < -1e-9", "cos(h.q - 4) > 1 + 1e-12", "h.q > 1e3",
     "exp(-(h.q - 5)^2) > 1.000001", "(h.q - 5)^2 < -1e-14", "abs(b.x) + abs(b.y) < -1e-9"],
)  # fmt: skip
def test_what_nearly_holds_is_none(when: str) -> None:
    for method in ("dop853", "scipy-RK45"):
        run = simulate_looped(sliding(when), method)
        assert run.status is Status.FINISHED and not run.risks


EXPRESSIONS = [
    "h.q*h.u", "sin(3*h.q)", "cos(h.q)^3", "tan(h.q/9)", "asin(h.q/9)", "acos(h.q/9)",
    "atan(h.q)", "atan2(h.q, b.vx)", "sinh(h.q/3)", "cosh(h.q - 1)", "tanh(h.q)", "exp(-h.q^2)",
    "log(h.q + 3)", "sqrt(h.q + 3)", "h.q^7", "(h.q + 3)^1.7", "(h.q + 3)^(-3)", "2^h.q",
    "abs(h.q - 1)", "sign(h.q - 1)", "min(h.q, 2 - h.q)", "max(h.q, b.vx)", "h.q/(h.q + 2)",
    "where(h.q > 1, h.q, 3)", "t*b.x", "(h.q - 2)^20", "(h.q + 3)^17.0", "1/(h.q - 1)",
]  # fmt: skip


@pytest.mark.parametrize("u", [3.0, 1.5, -0.5])
def test_bounds_hold_between_two_looks(u: float) -> None:
    """Values and slopes of every function along x = u t - 2 t^2, from what is seen at two times."""
    scene = sliding("", u=u).model_dump(by_alias=True, exclude_unset=True)
    events = [{"when": f"{text} > 0", "do": "stop"} for text in EXPRESSIONS]
    system = Equations(mstmm.compile(mstmm.Scene.from_data(scene | {"event": events}),
                                     engine="looped"))  # fmt: skip

    def state(t: float) -> Any:
        return np.array([u * t - 2 * t * t, u - 4 * t])

    def event_values(t: float) -> Any:
        return np.array(system.event_values(t, state(t)))

    def look(t: float) -> Any:
        event_values(t)
        return system.read_numbers(t, state(t), np.array([u - 4 * t, -4.0]))

    n = len(EXPRESSIONS)
    for start, end in ((0.0, 0.01), (0.1, 0.4), (0.3, 1.1), (0.0, 1.0), (0.74, 0.76)):
        bounds = system.enclose(start, look(start), end, look(end))[:n]
        times = np.linspace(start, end, 41)
        values = np.array([event_values(t)[:n] for t in times])
        slack = 1e-9 * (1 + np.abs(values))
        assert (values >= bounds[:, 0] - slack).all() and (values <= bounds[:, 1] + slack).all()
        slopes = np.diff(values, axis=0) / np.diff(times)[:, None]
        slack = 1e-6 * (1 + np.abs(slopes))
        assert (slopes >= bounds[:, 2] - slack).all() and (slopes <= bounds[:, 3] + slack).all()
