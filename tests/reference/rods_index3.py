"""Rods on balls in absolute coordinates by converged generalised-alpha steps, dense and by itself.

Unknown are the accelerations of every rod's reference point and turn, and the forces of the balls;
the closures of the balls stand at position level (index 3).  Newton's method with a differenced
Jacobian solves each step: no element, matrix or elimination of the method that is checked.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .jets import Array

MASS, LENGTH, CENTRAL = 1.0, 1.0, np.diag([0.01, 0.09, 0.09])
GRAVITY = np.array([0.0, 0.0, -9.81])
SPINS = np.array([[2.0, 0.0, 1.5], [-1.0, 1.0, 0.5]])


@dataclass
class Rods:
    """Positions, velocities, accelerations and auxiliary ones; rows are rods, turns in rod axes."""

    r: Array
    v: Array
    a: Array
    a_aux: Array
    axes: Array
    w: Array
    wd: Array
    w_aux: Array


def tip(h: float, t_end: float, reference: float, alpha_m: float, alpha_f: float) -> Array:
    """Tip of the second rod at t_end; `reference` is how far the rods' own points lie from their
    input ends."""
    points = _Points(reference)
    rods = _start(points)
    for _ in range(round(t_end / h)):
        rods = _step(points, rods, h, alpha_m, alpha_f)
    return rods.r[1] + rods.axes[1] @ points.output


class _Points:
    """Where ends and mass centre lie from the reference point, and the inertia about it."""

    def __init__(self, reference: float) -> None:
        x = np.array([1.0, 0.0, 0.0])
        self.input, self.output = -reference * x, (LENGTH - reference) * x
        self.centre = (LENGTH / 2 - reference) * x
        square = self.centre @ self.centre * np.eye(3) - np.outer(self.centre, self.centre)
        self.inertia = CENTRAL + MASS * square


def _exponential(v: Array) -> Array:
    angle = np.linalg.norm(v)
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    half = np.sinc(angle / 2 / np.pi)
    return np.eye(3) + np.sinc(angle / np.pi) * cross + half**2 / 2 * cross @ cross


def _balance(at: _Points, axes: Array, w: Array, a: Array, wd: Array, forces: Array) -> Array:
    rows = []
    for i in range(2):
        felt = axes[i].T @ (a[i] - GRAVITY)
        first = MASS * at.centre
        force = MASS * felt + np.cross(wd[i], first) + np.cross(w[i], np.cross(w[i], first))
        moment = at.inertia @ wd[i] + np.cross(w[i], at.inertia @ w[i]) + np.cross(first, felt)
        held = axes[i].T @ forces[i]
        given = axes[i].T @ forces[i + 1] if i == 0 else np.zeros(3)
        rows += [force - held + given]
        rows += [moment - np.cross(at.input, held) + np.cross(at.output, given)]
    return np.concatenate(rows)


def _closure(at: _Points, r: Array, axes: Array) -> Array:
    first = r[0] + axes[0] @ at.input
    return np.concatenate([first, r[1] + axes[1] @ at.input - r[0] - axes[0] @ at.output])


def _start(at: _Points) -> Rods:
    axes, w = np.array([np.eye(3), np.eye(3)]), SPINS.copy()
    r = np.array([-at.input, -at.input + [LENGTH, 0, 0]])
    inner = np.cross(w[0], at.output - at.input)
    v = np.array([np.cross(w[0], -at.input), inner + np.cross(w[1], -at.input)])

    def residual(x: Array) -> Array:
        a, wd = x[:6].reshape(2, 3), x[6:12].reshape(2, 3)

        def point(i: int, p: Array) -> Array:
            return a[i] + np.cross(wd[i], p) + np.cross(w[i], np.cross(w[i], p))

        closed = [point(0, at.input), point(1, at.input) - point(0, at.output)]
        return np.concatenate([_balance(at, axes, w, a, wd, x[12:].reshape(2, 3)), *closed])

    x = _newton_solution(residual, np.zeros(18))
    a, wd = x[:6].reshape(2, 3), x[6:12].reshape(2, 3)
    return Rods(r, v, a, a, axes, w, wd, wd)


def _newton_solution(residual: Callable[[Array], Array], x: Array) -> Array:
    for _ in range(12):
        jacobian = np.array(
            [(residual(x + d) - residual(x - d)) / 2e-6 for d in 1e-6 * np.eye(len(x))]
        ).T
        change = np.linalg.solve(jacobian, -residual(x))
        x = x + change
        if np.abs(change).max() < 1e-9:
            return x
    raise AssertionError("the reference's own iteration does not converge")


def _step(at: _Points, now: Rods, h: float, alpha_m: float, alpha_f: float) -> Rods:
    gamma = 0.5 + alpha_f - alpha_m
    beta = (gamma + 0.5) ** 2 / 4

    def advanced_rods(x: Array) -> Rods:
        aux = [x[:6].reshape(2, 3), x[6:12].reshape(2, 3)]
        rates = [
            ((1 - alpha_m) * new + alpha_m * old - alpha_f * rate) / (1 - alpha_f)
            for new, old, rate in zip(aux, (now.a_aux, now.w_aux), (now.a, now.wd), strict=True)
        ]
        shifts = [
            h * speed + h * h * ((0.5 - beta) * old + beta * new)
            for speed, old, new in zip((now.v, now.w), (now.a_aux, now.w_aux), aux, strict=True)
        ]
        speeds = [
            speed + h * ((1 - gamma) * old + gamma * new)
            for speed, old, new in zip((now.v, now.w), (now.a_aux, now.w_aux), aux, strict=True)
        ]
        axes = np.array([now.axes[i] @ _exponential(shifts[1][i]) for i in range(2)])
        return Rods(
            now.r + shifts[0], speeds[0], rates[0], aux[0], axes, speeds[1], rates[1], aux[1]
        )

    def residual(x: Array) -> Array:
        then = advanced_rods(x)
        forces = x[12:].reshape(2, 3)
        balance = _balance(at, then.axes, then.w, then.a, then.wd, forces)
        return np.concatenate([balance, _closure(at, then.r, then.axes) / (beta * h * h)])

    start = np.concatenate([now.a.ravel(), now.wd.ravel(), np.zeros(6)])
    return advanced_rods(_newton_solution(residual, start))
