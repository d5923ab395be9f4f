"""Rotation helpers against SciPy, and their exactness at right angles."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mstmm.numerics import rotations as r


def test_roll_pitch_yaw_is_about_fixed_axes_in_turn(rng: np.random.Generator) -> None:
    for angles in rng.uniform(-4, 4, (20, 3)):
        expected = Rotation.from_euler("xyz", angles).as_matrix()
        assert np.allclose(r.from_rpy(angles.tolist()), expected, atol=1e-15)
        assert r.from_orientation(angles.tolist()) == r.from_rpy(angles.tolist())


def test_quaternions_there_and_back(rng: np.random.Generator) -> None:
    for q in rng.normal(size=(20, 4)):
        expected = Rotation.from_quat([q[1], q[2], q[3], q[0]]).as_matrix()
        matrix = r.from_orientation(q.tolist())
        assert np.allclose(matrix, expected, atol=1e-15)
        back = np.array(r.to_quaternion(matrix))
        assert np.allclose(back * np.sign(q[0]), q / np.linalg.norm(q), atol=1e-14)


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, -2, 3)])
def test_quaternion_of_half_turns(axis: tuple[float, float, float]) -> None:
    turned = r.rotation_about(axis, math.pi)
    assert np.allclose(r.from_quaternion(r.to_quaternion(turned)), turned, atol=1e-15)


def test_rotation_about_an_axis(rng: np.random.Generator) -> None:
    for axis, angle in zip(rng.normal(size=(20, 3)), rng.uniform(-7, 7, 20), strict=True):
        expected = Rotation.from_rotvec(axis / np.linalg.norm(axis) * angle).as_matrix()
        assert np.allclose(r.rotation_about(axis.tolist(), float(angle)), expected, atol=4e-15)


@pytest.mark.parametrize("quarter", range(-5, 6))
def test_right_angles_are_exact(quarter: int) -> None:
    angle = quarter * (math.pi / 2)
    makers: list[Callable[[float], r.Matrix]] = [
        lambda a: r.from_rpy((a, 0, 0)),
        lambda a: r.from_rpy((a, a, a)),
        lambda a: r.rotation_about((0, 3, 0), a),
    ]
    for make in makers:
        assert all(x in (-1, 0, 1) for row in make(angle) for x in row)


def test_products(rng: np.random.Generator) -> None:
    a, b = (r.from_rpy(x.tolist()) for x in rng.normal(size=(2, 3)))
    v = rng.normal(size=3)
    assert np.allclose(r.product(a, b), np.array(a) @ np.array(b), atol=1e-15)
    assert np.allclose(r.rotate(a, v.tolist()), np.array(a) @ v, atol=1e-15)
    assert np.allclose(r.product(a, r.transpose(a)), np.eye(3), atol=1e-15)
    assert np.allclose(r.cross((1, 2, 3), (-2, 0, 5)), np.cross((1, 2, 3), (-2, 0, 5)))


@pytest.mark.parametrize("scale", [1e-300, 1e-5, 1.0, 1e300])
def test_unit_at_any_size(scale: float) -> None:
    assert r.unit_vector((3 * scale, 0, -4 * scale)) == pytest.approx((0.6, 0, -0.8), abs=2e-16)


def test_unit_is_idempotent(rng: np.random.Generator) -> None:
    for v in rng.normal(size=(200, 4)):
        once = r.unit_vector(v.tolist())
        assert r.unit_vector(once) == pytest.approx(once, abs=2e-16)


@pytest.mark.parametrize("v", [(0.0, 0.0), (math.nan, 1.0), (1.0, math.nan), (math.inf, 1.0)])
def test_no_direction(v: tuple[float, float]) -> None:
    with pytest.raises(ValueError, match="without direction"):
        r.unit_vector(v)


def test_perpendicular_and_reject(rng: np.random.Generator) -> None:
    for v in [*rng.normal(size=(20, 3)).tolist(), [1, 0, 0], [0, -1, 0], [1, 1e-9, 0]]:
        p = r.perpendicular_vector(v)
        assert abs(np.dot(p, v)) < 1e-14 and r.norm(p) == pytest.approx(1)
    assert r.unit_rejection((1, 1, 0), (1, 0, 0)) == pytest.approx((0, 1, 0))
    with pytest.raises(ValueError, match="collinear"):
        r.unit_rejection((2, 0, 0), (1, 0, 0))
