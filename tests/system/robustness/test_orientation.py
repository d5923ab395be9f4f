"""Three angles and quaternions on the way past the attitude at which three angles fail."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from tests.reference.algebra import attitude, orientation, to_quaternion
from tests.reference.closed_forms import free_top_attitude, top_scene
from tests.reference.jets import Array

#: Moments of inertia, and an angular velocity in body axes.
TRANSVERSE, AXIAL, OMEGA = 0.3, 0.5, np.array([0.4, 1.0, 0.7])


def passage(distance: float) -> Array:
    """An attitude that the free top reaches halfway, `distance` rad before pitch = 90 degrees."""
    halfway = orientation([0.3, np.pi / 2 - distance, -0.2])
    # Backwards in time is the mirror image: the same motion with the opposite angular velocity.
    return free_top_attitude(0.5, TRANSVERSE, AXIAL, halfway, -OMEGA)


def start_rates(time: float) -> Array:
    """Body-fixed angular velocity `time` before it is OMEGA."""
    phase = -(1 - AXIAL / TRANSVERSE) * OMEGA[2] * time
    c, s = np.cos(phase), np.sin(phase)
    return np.array([c * OMEGA[0] + s * OMEGA[1], c * OMEGA[1] - s * OMEGA[0], OMEGA[2]])


def scene_of(kind: str) -> dict[str, Any]:
    scene = top_scene(1.5, 0.0, TRANSVERSE, AXIAL, gravity=0.0)
    scene["hinge"][0]["type"] = kind
    return scene


def angles_of(rotation: Array) -> Array:
    """[roll, pitch, yaw]."""
    pitch = -np.arcsin(rotation[2, 0])
    return np.array([
        np.arctan2(rotation[2, 1], rotation[2, 2]), pitch,
        np.arctan2(rotation[1, 0], rotation[0, 0]),
    ])  # fmt: skip


def rates_of(angles: Array, omega: Array) -> Array:
    """Rates of [roll, pitch, yaw] from the angular velocity in body axes."""
    roll, pitch, _ = angles
    into = np.array([
        [1, 0, -np.sin(pitch)],
        [0, np.cos(roll), np.sin(roll) * np.cos(pitch)],
        [0, -np.sin(roll), np.cos(roll) * np.cos(pitch)],
    ])  # fmt: skip
    return np.asarray(np.linalg.solve(into, omega))


def run(kind: str, distance: float, step: float = 1e-3) -> tuple[float, mstmm.Result]:
    """Error of the attitude after 1 s of RK4, and the result."""
    before = start_rates(0.5)
    halfway = orientation([0.3, np.pi / 2 - distance, -0.2])
    start = _backwards(halfway)
    model = mstmm.compile(mstmm.Scene(**scene_of(kind)))
    q, u = to_quaternion(start), before
    if kind == "gimbal":
        q = angles_of(start)
        u = rates_of(q, before)
    result = model.simulate(1.0, "rk4", step=step, initial=(q, u))
    expected = free_top_attitude(1.0, TRANSVERSE, AXIAL, start, before)
    found = attitude(result.orientation("top")[-1])
    return float(np.abs(found - expected).max()), result


def _backwards(halfway: Array) -> Array:
    """The attitude half a second before `halfway`."""
    carried = free_top_attitude(0.5, TRANSVERSE, AXIAL, np.eye(3), start_rates(0.5))
    # attitude(t) = start carried(t) for a start at which the rates are those of `start_rates`.
    return np.asarray(halfway @ carried.T)


@pytest.mark.parametrize("distance", [0.3, 0.1, 1e-2, 1e-3, 1e-4, 0.0])
def test_the_quaternion_passes(distance: float) -> None:
    error, result = run("ball", distance)
    assert result.success
    assert error < 1e-12
    assert not result.warnings


@pytest.mark.parametrize(
    ("distance", "least", "most"),
    [(0.3, 0.0, 1e-8), (0.1, 1e-13, 1e-6), (1e-2, 1e-11, 1e-3), (1e-3, 1e-9, np.inf)],
)
def test_three_angles_lose_digits_on_the_way(distance: float, least: float, most: float) -> None:
    error, _ = run("gimbal", distance)
    assert least <= error < most


@pytest.mark.parametrize(("distance", "warns"), [(0.3, False), (1e-2, False), (3e-4, True)])
def test_three_angles_warn_when_they_come_near(distance: float, warns: bool) -> None:
    _, result = run("gimbal", distance)
    found = [text for text in result.warnings if "singularity of its coordinates" in text]
    assert bool(found) == warns
    if warns:
        assert '"foot"' in found[0]
        assert "ball hinge" in found[0]


def test_attitude_is_lost_without_a_warning_nowhere(rng: np.random.Generator) -> None:
    """Drawn distances: an attitude that is wrong by more than 1e-3 was announced."""
    for _ in range(5):
        error, result = run("gimbal", float(10 ** rng.uniform(-6, -2)))
        assert error < 1e-3 or result.warnings


@pytest.mark.slow
def test_quaternions_keep_their_length() -> None:
    """A million steps of a body that turns at 2 rad/s."""
    scene = scene_of("ball")
    scene["hinge"][0]["initial"] = {"q": [1.0, 0, 0, 0], "u": [1.0, 1.2, 1.2]}
    model = mstmm.compile(mstmm.Scene(**scene))
    result = model.simulate(5e3, "rk4", step=5e-3, output_times=np.linspace(0, 5e3, 11))
    assert result.success
    assert result.certificate.quaternion_drift < 1e-14
    momentum = result.angular_momentum()
    assert np.abs(momentum - momentum[0]).max() < 1e-6
