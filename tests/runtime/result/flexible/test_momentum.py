"""Momentum and equivalent motion of deformed beams against sums over their particles."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from mstmm.runtime.flexible.modal_body import ModalBody
from mstmm.runtime.result.flexible import motion as observe
from mstmm.runtime.result.flexible.momentum import (
    equivalent_momentum,
    frame_momentum,
    undeformed_inertia,
)
from mstmm.runtime.result.flexible.motion import Motion
from tests.support.flexible.beam_motions import LENGTH, MASS, beam, moving

Array = NDArray[np.float64]

#: Step of the central differences that give the particles their velocities.
STEP = 1e-4


def some_motion(body: ModalBody, size: float) -> dict[str, Any]:
    """A pose turned anyhow, velocities, and deflections of about this size."""
    random = np.random.default_rng(7)
    turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
    turn *= np.linalg.det(turn)
    return {
        "rotation": turn, "position": [0.4, -1.0, 2.0], "velocity": [1.0, 2.0, -0.5],
        "angular_velocity": [0.8, -1.1, 0.6], "eta": size * random.normal(size=body.n),
        "etad": size * random.normal(size=body.n),
    }  # fmt: skip


def particles(body: ModalBody, given: dict[str, Any]) -> tuple[Array, Array, Array]:
    """Masses (m,), places and velocities (m, 3) of the axis; velocities by differences in time."""
    assert body.shapes is not None
    x, weights = body.shapes.rule()

    def places(t: float) -> Array:
        small = observe.section_rotations(np.asarray(given["angular_velocity"]) * t)
        then = {
            "rotation": small @ given["rotation"],
            "position": np.asarray(given["position"]) + t * np.asarray(given["velocity"]),
            "eta": given["eta"] + t * given["etad"],
        }
        return observe.deflected_axis(moving(body, **then), x)[0]

    velocities = (8 * (places(STEP) - places(-STEP)) - places(2 * STEP) + places(-2 * STEP)) / (
        12 * STEP
    )
    return weights * MASS, places(0.0), velocities


def of_particles(body: ModalBody, given: dict[str, Any]) -> tuple[Array, Array, Array]:
    """Momentum, mass centre and angular momentum about it."""
    masses, places, velocities = particles(body, given)
    center = masses @ places / masses.sum()
    angular = masses @ np.cross(places - center, velocities)
    return masses @ velocities, center, angular


def kernel_momentum(motion: Motion) -> Any:
    linear, about_origin, first = frame_momentum(motion)
    return equivalent_momentum(motion, linear, about_origin, first / motion.body.mass)


@pytest.mark.parametrize(
    ("table", "tolerance"),
    [({"stiffening": False}, 1e-9), ({}, 1e-6), ({"frame": "chord"}, 1e-6),
     ({"frame": "mean", "basis": "free-free"}, 1e-6)],
)  # fmt: skip
def test_momentum_of_a_deformed_beam_is_that_of_its_particles(
    table: dict[str, Any], tolerance: float
) -> None:
    """The energy is of second order in eta: with the shortening there is a rest of third order."""
    body = beam(**table)
    given = some_motion(body, 0.003)
    linear, center, angular = of_particles(body, given)
    found = kernel_momentum(moving(body, **given))
    np.testing.assert_allclose(found.linear[0], linear, rtol=1e-9)
    np.testing.assert_allclose(found.center[0], center, rtol=1e-12)
    np.testing.assert_allclose(found.angular[0], angular, atol=tolerance * np.abs(angular).max())
    np.testing.assert_allclose(found.velocity[0], linear / (MASS * LENGTH), rtol=1e-9)


def test_equivalent_motion_is_that_of_the_frame_while_nothing_is_bent() -> None:
    body = beam(polar_inertia_per_length=0.02)
    given = some_motion(body, 0.0)
    found = kernel_momentum(moving(body, **given))
    arm = np.asarray(given["rotation"]) @ [LENGTH / 2, 0.0, 0.0]
    np.testing.assert_allclose(found.angular_velocity[0], given["angular_velocity"], rtol=1e-12)
    expected = np.asarray(given["velocity"]) + np.cross(given["angular_velocity"], arm)
    np.testing.assert_allclose(found.velocity[0], expected, rtol=1e-12)


def test_a_mean_frame_follows_the_equivalent_velocity_exactly() -> None:
    body = beam(frame="mean", basis="free-free", modes=3, stiffening=False)
    given = some_motion(body, 0.05)
    motion = moving(body, **given)
    arm = np.asarray(given["rotation"]) @ [LENGTH / 2, 0.0, 0.0]
    expected = np.asarray(given["velocity"]) + np.cross(given["angular_velocity"], arm)
    np.testing.assert_allclose(kernel_momentum(motion).velocity[0], expected, rtol=1e-12)


def test_undeformed_inertia_of_points_is_that_of_the_beam() -> None:
    table: dict[str, Any] = {"polar_inertia_per_length": 0.02}
    whole, points = (beam(**table, quadrature=on) for on in (False, True))
    assert points.points and not whole.points
    (mass, inertia), (sum_of_masses, sum_of_inertias) = (
        undeformed_inertia(whole),
        undeformed_inertia(points),
    )
    assert sum_of_masses == pytest.approx(mass)
    np.testing.assert_allclose(sum_of_inertias, inertia, rtol=1e-9, atol=1e-12)
