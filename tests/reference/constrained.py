"""Dense equations of a tree with constraints: accelerations from M and rows, by points in space.

The accelerations without constraints and M are those of the dense Newton-Euler equations; a row is
a function of what two bodies do, written down in inertial axes, and its columns are what it is at
unit speeds.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import newton_euler as dense
from .jets import Array
from .tree import Tree, read


@dataclass(frozen=True)
class Point:
    """A point of a body and its body, inertial axes: place, velocity, acceleration; axes, angular
    velocity and acceleration."""

    x: Array
    v: Array
    a: Array
    A: Array
    w: Array
    wd: Array


#: (point A, point B) -> (rates, accelerations) of the rows.
Rows = Callable[[Point, Point], tuple[list[Any], list[Any]]]


def turning(w: Array, wd: Array, fixed: Array) -> tuple[Array, Array]:
    """First and second rate of a vector that turns with a body."""
    rate = np.cross(w, fixed)
    return rate, np.cross(wd, fixed) + np.cross(w, rate)


def distance(a: Point, b: Point) -> tuple[list[Any], list[Any]]:
    """The rate of |x_B - x_A|."""
    d, v, acc = b.x - a.x, b.v - a.v, b.a - a.a
    size = np.linalg.norm(d)
    rate = d @ v / size
    return [rate], [(d @ acc + v @ v - rate**2) / size]


def plane(normal: Array) -> Rows:
    """The height of B over a plane that is fixed in A."""

    def rows(a: Point, b: Point) -> tuple[list[Any], list[Any]]:
        n, d = a.A @ normal, b.x - a.x
        first, second = turning(a.w, a.wd, n)
        v, acc = b.v - a.v, b.a - a.a
        return [n @ v + first @ d], [n @ acc + 2 * first @ v + second @ d]

    return rows


def curve(place: Array, slope: Array, bend: Array, speed: float) -> Rows:
    """B across a curve that is fixed in A, at the parameter where it is, whose rate is `speed`."""
    across = np.linalg.svd(slope[None])[2][1:]

    def rows(a: Point, b: Point) -> tuple[list[Any], list[Any]]:
        d, v, acc = b.x - a.x, b.v - a.v, b.a - a.a
        spin, spin_rate = a.A.T @ a.w, a.A.T @ a.wd
        local, rate = a.A.T @ d, a.A.T @ v
        rate = rate - np.cross(spin, local)
        second = a.A.T @ acc - np.cross(spin_rate, local) - 2 * np.cross(spin, rate)
        second = second - np.cross(spin, np.cross(spin, local)) - bend * speed**2
        return list(across @ rate), list(across @ second)

    return rows


def rolling(normal: Array, radius: float, axis: Array) -> Rows:
    """The velocity of B against A where a disc touches a plane that is fixed in A."""
    frame = np.linalg.svd(normal[None])[2]

    def rows(a: Point, b: Point) -> tuple[list[Any], list[Any]]:
        n, e = a.A @ normal, b.A @ axis
        n_rate, e_rate = np.cross(a.w, n), np.cross(b.w, e)
        m = n - (n @ e) * e
        m_rate = n_rate - (n_rate @ e + n @ e_rate) * e - (n @ e) * e_rate
        size = np.linalg.norm(m)
        rho = -radius * m / size
        rho_rate = -radius * (m_rate / size - m * (m @ m_rate) / size**3)
        arm, arm_rate = b.x + rho - a.x, b.v + rho_rate - a.v
        slip = b.v + np.cross(b.w, rho) - a.v - np.cross(a.w, arm)
        rate = b.a + np.cross(b.wd, rho) + np.cross(b.w, rho_rate)
        rate = rate - a.a - np.cross(a.wd, arm) - np.cross(a.w, arm_rate)
        found, second = [], []
        for t in frame:
            along = a.A @ t
            found.append(along @ slip)
            second.append(along @ rate + np.cross(a.w, along) @ slip)
        return found, second

    return rows


def accelerations(
    scene: Mapping[str, Any], q: Array, u: Array, asked: list[tuple[int, int, Rows]]
) -> Array:
    """udot of the tree with rows between the mass centres of bodies, -1: the ground's origin."""
    tree = read(scene)
    free, mass = dense.solve(tree, q, u), dense.mass_matrix(tree, q)
    wanted = _rows(tree, q, u, asked, free)[1]
    matrix = columns(tree, q, asked)
    moved = np.linalg.solve(mass, matrix.T)
    return np.asarray(free.udot - moved @ np.linalg.solve(matrix @ moved, wanted))


def columns(tree: Tree, q: Array, asked: list[tuple[int, int, Rows]]) -> Array:
    """What every row (below each other) is at unit speeds."""
    return np.array([_rows(tree, q, unit, asked, None)[0] for unit in np.eye(tree.nu)]).T


def _rows(
    tree: Tree, q: Array, u: Array, asked: list[tuple[int, int, Rows]],
    free: dense.Accelerations | None,
) -> tuple[Array, Array]:  # fmt: skip
    at, rates, seconds = dense.motion(tree, q, u), list[float](), list[float]()
    none = np.zeros(3)

    def point(body: int) -> Point:
        if body < 0:
            return Point(none, none, none, np.eye(3), none, none)
        center = tree.bodies[body].center
        return Point(
            at.point(body, center), at.velocity(body, center),
            none if free is None else free.center[body], at.A[body], at.w[body],
            none if free is None else free.angular[body],
        )  # fmt: skip

    for a, b, rows in asked:
        rate, second = rows(point(a), point(b))
        rates += rate
        seconds += second
    return np.array(rates), np.array(seconds)
