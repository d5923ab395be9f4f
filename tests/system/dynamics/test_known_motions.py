"""The engine against closed forms and published numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from tests.reference import closed_forms as known
from tests.reference.algebra import quaternion_matrix, to_quaternion, turn
from tests.reference.jets import Array, as_jet


def run(scene: dict[str, Any], times: Any, q: Any = None, u: Any = None) -> mstmm.Result:
    model = mstmm.compile(mstmm.Scene(**scene))
    start = None if q is None else (q, np.zeros(model.nu) if u is None else u)
    result = model.simulate(
        float(times[-1]), rtol=1e-12, atol=1e-14, output_times=times, initial=start
    )
    assert result.success, result.message
    return result


def attitude(result: mstmm.Result, body: str) -> Array:
    return quaternion_matrix(as_jet(result.orientation(body)[-1])).x


def test_simple_pendulum_of_the_benchmark_library() -> None:
    scene = known.pendulum_scene()
    scene["body"][0]["ends"] = {"bob": [1.0, 0.0, 0.0]}
    times = [0.0] + [t for t, _, _ in known.A01_POSITIONS]
    place = run(scene, times).position("bob.bob")
    for row, (_, x, y) in zip(place[1:], known.A01_POSITIONS, strict=True):
        assert row == pytest.approx([x, y, 0.0], abs=1e-10)


def test_pendulum_returns_after_its_period() -> None:
    result = run(known.pendulum_scene(), [0.0, known.A01_PERIOD])
    assert result.q[-1] == pytest.approx([np.pi], abs=1e-9)
    assert result.u[-1] == pytest.approx([0.0], abs=1e-9)


def test_pendulum_by_elliptic_functions() -> None:
    times = np.linspace(0.0, 3.0, 31)
    scene = known.pendulum_scene(0.7, 3.3)
    result = run(scene, times, np.array([1.0]))
    expected = known.pendulum_angle(times, 0.7, 3.3, 1.0 + np.pi / 2) - np.pi / 2
    assert result.q[:, 0] == pytest.approx(expected, abs=1e-11)


def test_damped_oscillator() -> None:
    scene = known.top_scene(1.5, 0.0, 1.0, 1.0, gravity=0.0)
    law = {"stiffness": 9.0, "damping": 0.8}
    scene["hinge"][0] |= {"type": "prismatic", "law": law, "axis": [0.6, 0.0, 0.8]}
    times = np.linspace(0.0, 4.0, 9)
    result = run(scene, times, np.array([0.7]))
    expected = known.damped_oscillator(times, 1.5, 9.0, 0.8, 0.7)
    assert result.q[:, 0] == pytest.approx(expected, abs=1e-12)


def test_screw_falls_at_the_rate_of_its_energy() -> None:
    scene = known.top_scene(2.0, 0.0, 0.3, 0.5)
    scene["hinge"][0] |= {"type": "screw", "lead": 0.4, "axis": [0, 0, 1]}
    result = run(scene, [0.0, 1.0], np.zeros(1))
    rate = known.screw_fall(2.0, 0.5, 0.4, 9.81)
    assert result.q[-1, 0] == pytest.approx(rate / 2, rel=1e-11)
    assert result.u[-1, 0] == pytest.approx(rate, rel=1e-11)


@pytest.mark.parametrize("axial", [0.5, 0.1])
def test_free_symmetric_body(axial: float) -> None:
    start = turn([0.6, 0.0, 0.8], as_jet(0.9)).x
    omega = np.array([0.7, -0.4, 3.0])
    scene = known.top_scene(1.5, 0.0, 0.3, axial, gravity=0.0)
    result = run(scene, [0.0, 20.0], to_quaternion(start), omega)
    expected = known.free_top_attitude(20.0, 0.3, axial, start, omega)
    assert np.abs(attitude(result, "top") - expected).max() < 1e-10
    assert result.u[-1] == pytest.approx(
        known.free_top_rates(np.array([20.0]), 0.3, axial, omega)[0], abs=1e-10
    )


@pytest.mark.parametrize("phi_rate", [0.0, 3.0, -1.0])
def test_heavy_top(phi_rate: float) -> None:
    mass, arm, theta, spin = 0.8, 0.25, 0.7, 30.0
    scene = known.top_scene(mass, arm, 0.02, 0.01)
    moment = mass * 9.81 * arm
    top = known.HeavyTop(0.02 + mass * arm**2, 0.01, moment, theta, phi_rate, spin)
    start = turn([1.0, 0.0, 0.0], as_jet(theta)).x
    omega = np.array([0.0, phi_rate * np.sin(theta), spin])
    result = run(scene, [0.0, 2.0], to_quaternion(start), omega)
    assert np.abs(attitude(result, "top") - top.attitude(2.0)).max() < 1e-9


@pytest.mark.parametrize("branch", [0, 1], ids=["slow", "fast"])
def test_steady_precession_keeps_its_angle(branch: int) -> None:
    mass, arm, theta, spin = 0.8, 0.25, 0.7, 80.0
    transverse, moment = 0.02 + mass * arm**2, mass * 9.81 * arm
    rate = known.steady_precession(transverse, 0.01, moment, theta, spin)[branch]
    omega = np.array([0.0, rate * np.sin(theta), spin])
    start = to_quaternion(turn([1.0, 0.0, 0.0], as_jet(theta)).x)
    times = np.linspace(0.0, 2.0, 21)
    result = run(known.top_scene(mass, arm, 0.02, 0.01), times, start, omega)
    axes = np.array([quaternion_matrix(as_jet(e)).x[:, 2] for e in result.orientation("top")])
    turned = np.unwrap(np.arctan2(axes[:, 1], axes[:, 0]))
    assert axes[:, 2] == pytest.approx(np.cos(theta), abs=1e-10)
    assert turned - turned[0] == pytest.approx(rate * times, abs=1e-9)


def test_a_weld_that_lets_go_falls_freely() -> None:
    """Held to t = 0.5 with its weight and the moment of it, then y = -g (t - 1/2)^2 / 2."""
    g, arm = 9.81, 0.5
    body = {"name": "a", "mass": 2.0, "center_of_mass": [arm, 0, 0], "inertia": [0.1, 0.1, 0.1]}
    weld = {"name": "weld", "type": "fixed", "inboard": "ground", "outboard": "a"}
    scene = mstmm.Scene(gravity=[0, -g, 0], body=[body], hinge=[weld | {"release": "t >= 0.5"}])
    run = mstmm.compile(scene).simulate(1.0, output_times=[0.25, 0.75, 1.0])
    assert run.success
    assert run.position("a")[:, 1] == pytest.approx([0, -g / 32, -g / 8], abs=1e-12)
    assert run.force("weld")[:, 1] == pytest.approx([2 * g, 0, 0], abs=1e-11)
    assert run.moment("weld")[:, 2] == pytest.approx([2 * g * arm, 0, 0], abs=1e-11)
