"""The references against motions known in closed form and against published numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.reference import closed_forms as known
from tests.reference import dae
from tests.reference import newton_euler as dense
from tests.reference.algebra import quaternion_matrix, to_quaternion, turn
from tests.reference.histories import integrate
from tests.reference.jets import Array, as_jet


def end_of(
    scene: dict[str, Any], t_end: float, q: Array | None = None, u: Array | None = None
) -> tuple[Array, Array]:
    """End of a motion by the dense equations: q, u."""
    found_q, found_u = integrate(scene, [0.0, t_end], q, u)
    return found_q[-1], found_u[-1]


@pytest.mark.parametrize(("t", "x", "y"), known.A01_POSITIONS)
def test_elliptic_functions_give_the_printed_positions(t: float, x: float, y: float) -> None:
    angle = float(known.pendulum_angle(np.array(t), 1.0, 9.81, -np.pi / 2))
    assert np.sin(angle) == pytest.approx(x, abs=2e-14)
    assert -np.cos(angle) == pytest.approx(y, abs=2e-14)


def test_printed_period() -> None:
    assert known.pendulum_period(1.0, 9.81, np.pi / 2) == pytest.approx(known.A01_PERIOD, rel=1e-14)


def test_pendulum_of_the_dense_equations() -> None:
    q, _ = end_of(known.pendulum_scene(), 1.0)
    assert np.cos(q[0]) == pytest.approx(known.A01_POSITIONS[0][1], abs=1e-9)
    assert np.sin(q[0]) == pytest.approx(known.A01_POSITIONS[0][2], abs=1e-9)


def test_pendulum_of_the_absolute_coordinates() -> None:
    history = dae.simulate(known.pendulum_scene(), np.array([0.0, 1.0]), rtol=1e-10, atol=1e-10)
    place = history.rotation[-1, 0] @ [1.0, 0.0, 0.0]
    assert place[:2] == pytest.approx(known.A01_POSITIONS[0][1:], abs=1e-8)


def test_damped_oscillator() -> None:
    scene = known.pendulum_scene(gravity=0.0)
    scene["body"][0]["center_of_mass"] = [0, 0, 0]
    law = {"stiffness": 9.0, "damping": 0.8, "rest": 0.0}
    scene["hinge"][0] |= {"type": "prismatic", "law": law, "initial": {"q": [0.7], "u": [0.0]}}
    scene["body"][0]["inertia"] = [1.0, 1.0, 1.0]
    q, _ = end_of(scene, 2.0)
    assert q[0] == pytest.approx(
        known.damped_oscillator(np.array([2.0]), 1.0, 9.0, 0.8, 0.7)[0], abs=1e-9
    )


def test_screw_falls_at_the_rate_of_its_energy() -> None:
    scene = known.top_scene(2.0, 0.0, 0.3, 0.5)
    scene["hinge"][0] |= {"type": "screw", "lead": 0.4, "axis": [0, 0, 1]}
    udot = dense.solve(scene, np.zeros(1), np.zeros(1)).udot
    assert udot[0] == pytest.approx(known.screw_fall(2.0, 0.5, 0.4, 9.81), rel=1e-13)


def test_free_symmetric_body() -> None:
    transverse, axial = 0.3, 0.5
    start = turn([0.6, 0.0, 0.8], as_jet(0.9)).x
    omega = np.array([0.7, -0.4, 2.0])
    scene = known.top_scene(1.5, 0.0, transverse, axial, gravity=0.0)
    q, u = end_of(scene, 2.0, to_quaternion(start), omega)
    expected = known.free_top_attitude(2.0, transverse, axial, start, omega)
    assert np.abs(quaternion_matrix(as_jet(q)).x - expected).max() < 1e-8
    rates = known.free_top_rates(np.array([2.0]), transverse, axial, omega)[0]
    assert u == pytest.approx(rates, abs=1e-8)


@pytest.mark.parametrize("phi_rate", [0.0, 3.0, -1.0])
def test_heavy_top(phi_rate: float) -> None:
    mass, arm, theta, spin = 0.8, 0.25, 0.7, 30.0
    scene = known.top_scene(mass, arm, 0.02, 0.01)
    transverse = 0.02 + mass * arm**2
    top = known.HeavyTop(transverse, 0.01, mass * 9.81 * arm, theta, phi_rate, spin)
    start = turn([1.0, 0.0, 0.0], as_jet(theta)).x
    omega = np.array([0.0, phi_rate * np.sin(theta), spin])
    q, _ = end_of(scene, 0.5, to_quaternion(start), omega)
    assert np.abs(quaternion_matrix(as_jet(q)).x - top.attitude(0.5)).max() < 1e-7


def test_steady_precession_keeps_its_angle() -> None:
    mass, arm, theta, spin = 0.8, 0.25, 0.7, 80.0
    transverse = 0.02 + mass * arm**2
    for rate in known.steady_precession(transverse, 0.01, mass * 9.81 * arm, theta, spin):
        top = known.HeavyTop(transverse, 0.01, mass * 9.81 * arm, theta, rate, spin)
        assert np.abs(top.cosine(np.linspace(0, 2, 20)) - np.cos(theta)).max() < 1e-6
