"""Deflections and section loads of beams against closed forms, from given motions."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.result.flexible import motion as observe
from mstmm.runtime.result.flexible.section_loads import LineLoad, PointLoad, section_loads
from tests.support.flexible.beam_motions import (
    EI_Y,
    EI_Z,
    LENGTH,
    MASS,
    beam,
    moving,
    under_tip_load,
)

X = np.linspace(0.0, LENGTH, 7)
STILL = np.zeros(3)


def test_cantilever_under_a_tip_load() -> None:
    force = 1e-4 * np.array([0.0, 700.0, -400.0])
    motion = under_tip_load(beam(), force)
    deflected = observe.deflection(motion, X)[0]
    for axis, stiffness in ((1, EI_Z), (2, EI_Y)):
        exact = force[axis] * X**2 * (3 * LENGTH - X) / (6 * stiffness)
        np.testing.assert_allclose(deflected[:, axis], exact, atol=1e-15)
        slope = force[axis] * X * (2 * LENGTH - X) / (2 * stiffness)
        np.testing.assert_allclose(observe.slope(motion, X)[0, :, axis - 1], slope, atol=1e-15)
    squares = force[1] ** 2 / EI_Z**2 + force[2] ** 2 / EI_Y**2
    np.testing.assert_allclose(deflected[-1, 0], -squares * LENGTH**5 / 15, rtol=1e-12)
    np.testing.assert_allclose(
        observe.curvature(motion, X)[0],
        np.outer(LENGTH - X, [-force[2] / EI_Y, force[1] / EI_Z]), atol=1e-15,
    )  # fmt: skip


@pytest.mark.parametrize("stiffening", [True, False])
def test_moment_of_a_tip_load_from_equilibrium_and_from_the_shapes(stiffening: bool) -> None:
    force = 1e-4 * np.array([0.0, 700.0, -400.0])
    motion = under_tip_load(beam(stiffening=stiffening), force)
    load = PointLoad(LENGTH, force[None], np.zeros((1, 3)))
    inner, moment = section_loads(motion, X, STILL, 0.0, [load])
    exact = np.outer(LENGTH - X, [-force[2], force[1]])
    np.testing.assert_allclose(observe.elastic_moment(motion, X)[0], exact, atol=1e-15)
    np.testing.assert_allclose(moment[0, :, 1:], exact, atol=5e-6 * np.abs(exact).max())
    np.testing.assert_allclose(inner[0, :, 1:], np.tile(force[1:], (7, 1)), rtol=1e-5)
    slopes = observe.slope(motion, X)[0]
    np.testing.assert_allclose(inner[0, :, 0], slopes @ force[1:], rtol=1e-5, atol=1e-12)


def test_weight_that_the_shapes_cannot_follow() -> None:
    """No shape of this basis has the parabola of a uniform load; equilibrium has."""
    motion = moving(beam(modes=1))
    _, moment = section_loads(motion, X, np.array([0.0, -9.81, 0.0]), 0.0)
    exact = -MASS * 9.81 * (LENGTH - X) ** 2 / 2
    np.testing.assert_allclose(moment[0, :, 2], exact, rtol=1e-12)
    assert observe.elastic_moment(motion, X)[0, 0, 1] == 0.0


def test_axial_force_of_a_spinning_beam() -> None:
    motion = moving(beam(), angular_velocity=[0.0, 3.0, 4.0])
    inner, _ = section_loads(motion, X, STILL, 0.0)
    exact = MASS * 25.0 * (LENGTH**2 - X**2) / 2
    np.testing.assert_allclose(inner[0, :, 0], exact, rtol=1e-12, atol=1e-12)


def test_axial_force_from_shapes_where_the_axis_stretches() -> None:
    body = beam(axial_stiffness=4e3, modes={"y": 1, "axial": 3})
    force = np.array([0.6, 0.0, 0.0])
    motion = under_tip_load(body, force)
    np.testing.assert_allclose(observe.elastic_force(motion, X)[0], 0.6, rtol=1e-9)
    with pytest.raises(mstmm.SceneError, match=r"no axial modes.*equilibrium"):
        observe.elastic_force(moving(beam()), X)


def test_the_free_side_is_added_up_wherever_the_beam_is_held() -> None:
    """Held in the middle: shear changes its sign there, and each side carries its own weight."""
    weight = np.array([0.0, -9.81, 0.0])
    inner, moment = section_loads(moving(beam()), X, weight, LENGTH / 2)
    per_length = MASS * 9.81
    right = LENGTH / 2 <= X
    arm = np.where(right, LENGTH - X, X)
    shear = np.where(right, -1.0, 1.0) * per_length * arm
    np.testing.assert_allclose(inner[0, :, 1], shear, atol=1e-12)
    np.testing.assert_allclose(moment[0, :, 2], -per_length * arm**2 / 2, atol=1e-12)


def test_loads_within_the_beam() -> None:
    """A force at x = 1.5 m counts for sections up to there; a load per length where it is."""
    up, none = np.array([[0.0, 2.0, 0.0]]), np.zeros((1, 3))
    points, lines = [PointLoad(1.5, up, none)], [LineLoad(0.5, 1.0, up, none)]
    x = np.array([0.0, 0.75, 1.25, 1.5, 1.6])
    inner, moment = section_loads(moving(beam()), x, STILL, 0.0, points, lines)
    np.testing.assert_allclose(inner[0, :, 1], [4.0, 3.0, 2.0, 2.0, 0.0], atol=1e-12)
    exact = [1.5 * 2 + 0.75 * 2, 0.75 * 2 + 1.0 * 0.125, 0.25 * 2, 0.0, 0.0]
    np.testing.assert_allclose(moment[0, :, 2], exact, atol=1e-12)


def test_drag_and_inertia_balance_a_beam_that_is_slowed_by_its_drag_alone() -> None:
    body = beam(viscous_drag=0.6)
    motion = moving(body, velocity=[0.0, 3.0, 0.0], acceleration=[0.0, -0.6 / MASS * 3.0, 0.0])
    inner, moment = section_loads(motion, X, STILL, 0.0)
    assert np.abs(inner).max() < 1e-13 and np.abs(moment).max() < 1e-13


def test_a_twisted_beam_carries_the_torque_of_its_polar_inertia() -> None:
    body = beam(polar_inertia_per_length=0.03, torsional_stiffness=20.0, modes={"y": 1, "twist": 2})
    spun = moving(body, angular_acceleration=[5.0, 0.0, 0.0])
    _, moment = section_loads(spun, X, STILL, 0.0)
    np.testing.assert_allclose(moment[0, :, 0], -0.03 * 5.0 * (LENGTH - X), atol=1e-12)
    twist = [k for k, name in enumerate(body.modes) if name.startswith("twist")]
    etadd = np.zeros(body.n)
    etadd[twist[0]] = 5.0
    _, moment = section_loads(moving(body, etadd=etadd), X, STILL, 0.0)
    fine = np.linspace(0.0, LENGTH, 20001)
    theta = body.shapes.values_at(fine).theta[:, 0, twist[0]] if body.shapes else fine
    exact = -0.03 * 5.0 * np.trapezoid(theta, fine)
    np.testing.assert_allclose(moment[0, 0, 0], exact, rtol=1e-7)


def test_shape_in_inertial_axes() -> None:
    body = beam()
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    bent = under_tip_load(body, np.array([0.0, 0.07, 0.0]))
    motion = replace(bent, rotation=turn[None], position=np.array([[1.0, 2.0, 3.0]]))
    drawn = observe.deflected_axis(motion, X)[0]
    deflected = observe.deflection(motion, X)[0]
    np.testing.assert_allclose(drawn[:, 0], 1.0 - deflected[:, 1], atol=1e-15)
    np.testing.assert_allclose(drawn[:, 1], 2.0 + X + deflected[:, 0], atol=1e-15)


@pytest.mark.parametrize(
    ("x", "words"),
    [(2.1, r"x = 2\.1 m is not on the beam; expected 0 to 2 m"), (np.nan, "x = nan"),
     ([[0.0]], r"shape \(1, 1\), expected one number or \(m,\)")],
)  # fmt: skip
def test_places_off_the_beam_are_refused(x: Any, words: str) -> None:
    with pytest.raises(mstmm.SceneError, match=words):
        observe.checked_stations(beam(), x, "deflection")


def test_rotations_of_sections_are_exact_at_any_angle() -> None:
    vectors = np.array([[0.0, 0.0, 0.0], [1e-9, 0.0, 0.0], [0.3, -0.8, 1.1], [0.0, np.pi, 0.0]])
    turns = observe.section_rotations(vectors)
    np.testing.assert_allclose(turns @ np.swapaxes(turns, 1, 2), np.tile(np.eye(3), (4, 1, 1)),
                               atol=1e-15)  # fmt: skip
    np.testing.assert_allclose(np.einsum("mij,mj->mi", turns, vectors), vectors, atol=1e-15)
    angle = np.linalg.norm(vectors, axis=1)
    np.testing.assert_allclose(np.trace(turns, axis1=1, axis2=2), 1 + 2 * np.cos(angle))
    assert turns[1, 2, 1] == pytest.approx(1e-9, rel=1e-12)
