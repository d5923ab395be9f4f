"""The planar four-bar by hand: three angles against the ground and two rows that close it.

With a, b, c the angles of crank, coupler and rocker: Lagrange's equations of the three rods and of
what acts in the four hinges, and  l1 e^(ia) + l2 e^(ib) = FEET + l3 e^(ic)  twice differentiated.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from tests.reference.jets import Array
from tests.support.scenes.linkages import COUPLER, CRANK, ROCKER, angles

MASSES = (0.7, 1.3, 0.9)
LENGTHS = np.array([CRANK, COUPLER, ROCKER])
SIGNS = np.array([1.0, 1.0, -1.0])
#: Coordinates of foot, knee, tip and end by the three angles.
HINGES = np.array([[1.0, 0, 0], [-1, 1, 0], [0, -1, 1], [0, 0, 1]])
NAMES = ("foot", "knee", "tip", "end")

Laws = Mapping[str, Mapping[str, Any]]


def start(crank: float, speed: float) -> tuple[Array, Array]:
    """The three angles and their rates."""
    found = np.array([crank, *angles(crank)])
    rows = closing(found)
    rates = np.linalg.solve(rows[:, 1:], -rows[:, 0] * speed)
    return found, np.array([speed, *rates])


def closing(found: Array) -> Array:
    """Rows (2, 3): velocity of the gap per unit rate of the angles."""
    turned = SIGNS * LENGTHS * 1j * np.exp(1j * found)
    return np.array([turned.real, turned.imag])


def efforts(found: Array, rates: Array, laws: Laws) -> Array:
    """Of the four hinges, N m."""
    out = np.zeros(4)
    for k, name in enumerate(NAMES):
        law, q, u = laws.get(name, {}), HINGES[k] @ found, HINGES[k] @ rates
        out[k] += law.get("effort", 0.0) - law.get("damping", 0.0) * u
        out[k] -= law.get("stiffness", 0.0) * (q - law.get("rest", 0.0))
        friction = law.get("friction")
        if friction:
            out[k] -= friction["coulomb"] * np.tanh(u / friction["regularisation_velocity"])
    return out


def matrix_and_load(found: Array, rates: Array, laws: Laws) -> tuple[Array, Array]:
    """M (3, 3) of the open rods and the load (3,) on the angles."""
    m, (l1, l2, l3) = MASSES, LENGTHS
    a, b, c = found
    both = m[1] * l1 * l2 / 2
    mass = np.diag([(m[0] / 3 + m[1]) * l1**2, m[1] / 3 * l2**2, m[2] / 3 * l3**2])
    mass[0, 1] = mass[1, 0] = both * np.cos(a - b)
    load = np.array([
        -both * np.sin(a - b) * rates[1] ** 2 - 9.81 * (m[0] / 2 + m[1]) * l1 * np.cos(a),
        both * np.sin(a - b) * rates[0] ** 2 - 9.81 * m[1] / 2 * l2 * np.cos(b),
        -9.81 * m[2] / 2 * l3 * np.cos(c),
    ])  # fmt: skip
    rotors = np.array([laws.get(name, {}).get("inertia", 0.0) for name in NAMES])
    load = load + HINGES.T @ efforts(found, rates, laws)
    return mass + HINGES.T @ (rotors[:, None] * HINGES), load


def accelerations(found: Array, rates: Array, laws: Laws) -> Array:
    """Of the three angles."""
    mass, load = matrix_and_load(found, rates, laws)
    rows = closing(found)
    turned = SIGNS * LENGTHS * np.exp(1j * found) * rates**2
    whole = np.block([[mass, rows.T], [rows, np.zeros((2, 2))]])
    return np.linalg.solve(whole, np.r_[load, turned.real.sum(), turned.imag.sum()])[:3]


def effort_of_crank(found: Array, rates: Array, turn: float, laws: Laws) -> float:
    """What turns the crank with the acceleration `turn` (rad/s^2), N m."""
    mass, load = matrix_and_load(found, rates, laws)
    rows = closing(found)
    turned = SIGNS * LENGTHS * np.exp(1j * found) * rates**2
    bias = np.array([turned.real.sum(), turned.imag.sum()])
    others = np.linalg.solve(rows[:, 1:], bias - rows[:, 0] * turn)
    lack = mass @ np.r_[turn, others] - load
    held = np.linalg.solve(rows[:, 1:].T, lack[1:])
    return float(lack[0] - rows[:, 0] @ held)


def motion(crank: float, speed: float, laws: Laws, times: Array) -> tuple[Array, Array]:
    """Angles and rates (times, 3), by tight tolerances and without any projection."""

    def rates(_: float, y: Array) -> Array:
        return np.r_[y[3:], accelerations(y[:3], y[3:], laws)]

    begin = np.concatenate(start(crank, speed))
    done = solve_ivp(rates, (0.0, times[-1]), begin, "DOP853", t_eval=times, rtol=1e-13, atol=1e-13)
    assert done.success, done.message
    return done.y[:3].T, done.y[3:].T
