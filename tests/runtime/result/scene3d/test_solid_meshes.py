"""Solids are closed and seen from outside: their volumes by the divergence theorem are the closed
forms of the polyhedra that stand for them."""

from __future__ import annotations

import numpy as np
import pytest

from mstmm.runtime.result.scene3d import solid_meshes
from mstmm.runtime.result.scene3d.solid_meshes import Surface


def volume(surface: Surface) -> float:
    a, b, c = np.moveaxis(surface.vertices[surface.faces], 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def polygon(around: int) -> float:
    """Area of a regular polygon in a circle of radius 1."""
    return 0.5 * around * np.sin(2 * np.pi / around)


def ball(around: int) -> float:
    """Volume of a ball of radius 1 of frusta between polygons."""
    angles = np.linspace(-np.pi / 2, np.pi / 2, around // 2 + 1)
    r, z = np.cos(angles), np.sin(angles)
    return polygon(around) * float(
        np.sum((r[:-1] ** 2 + r[:-1] * r[1:] + r[1:] ** 2) / 3 * np.diff(z))
    )


def test_volumes() -> None:
    n = solid_meshes.CORNERS_AROUND
    assert volume(solid_meshes.box_surface((1.0, 2.0, 3.0))) == pytest.approx(6.0, rel=1e-14)
    assert volume(solid_meshes.cylinder_surface(0.5, 2.0)) == pytest.approx(
        polygon(n) / 2, rel=1e-14
    )
    assert volume(solid_meshes.ellipsoid_surface((1.0, 2.0, 3.0))) == pytest.approx(
        6 * ball(n), rel=1e-13
    )
    capsule = 0.25 * polygon(n) * 2.0 + 0.125 * ball(n)
    assert volume(solid_meshes.capsule_surface(0.5, 2.0)) == pytest.approx(capsule, rel=1e-13)


def test_a_bar_goes_from_point_to_point() -> None:
    start, end = np.array([1.0, -2.0, 0.5]), np.array([-1.0, 1.0, 2.0])
    bar = solid_meshes.bar_surface(start, end, 0.1, 12)
    long = np.linalg.norm(end - start)
    assert volume(bar) == pytest.approx(0.01 * polygon(12) * long, rel=1e-13)
    places = (bar.vertices - start) @ (end - start) / long
    assert places.min() == pytest.approx(0.0, abs=1e-14)
    assert places.max() == pytest.approx(long, rel=1e-14)


@pytest.mark.parametrize("direction", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (1, -2, 3)])
def test_axes_along_a_direction(direction: tuple[int, int, int]) -> None:
    axes = solid_meshes.axes_along(direction)
    assert axes @ axes.T == pytest.approx(np.eye(3), abs=1e-15)
    assert np.linalg.det(axes) == pytest.approx(1.0)
    assert axes[:, 2] == pytest.approx(np.array(direction) / np.linalg.norm(direction))


def test_joined_surfaces_keep_their_volumes() -> None:
    both = solid_meshes.join_surfaces(
        [
            solid_meshes.box_surface((1, 1, 1)),
            solid_meshes.cylinder_surface(1.0, 1.0).with_pose((5, 0, 0)),
        ]
    )
    assert volume(both) == pytest.approx(1.0 + polygon(solid_meshes.CORNERS_AROUND), rel=1e-13)
