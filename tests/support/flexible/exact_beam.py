"""An exact beam with drawn strains, and its equations of motion by Lagrange from 4 x 4 matrices.

The beam is supported at a pin about z, has stations on both sides of it, an end behind the last
station, and a body on a second pin at that end.  Poses are products of matrix exponentials; rates
come from complex steps, so that nothing of the product's kinematics is used.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.random import Generator
from scipy.linalg import expm

from mstmm.array_validation import Array
from mstmm.runtime.flexible.modal_body import ModalBody
from mstmm.runtime.flexible.modal_parts import ModalPort, Station

GRAVITY = (0.7, -9.81, 1.3)
#: Axes of both pins in the axes of the bodies.
AXIS = (0.0, 0.0, 1.0)
TIP_BODY: dict[str, Any] = {
    "name": "plate", "mass": 0.7, "inertia": [0.02, 0.03, 0.04],
    "center_of_mass": [0.1, 0.05, -0.02],
}  # fmt: skip
SCENE: dict[str, Any] = {
    "gravity": list(GRAVITY),
    "beam": [
        {
            "name": "rod", "length": 1.0, "mass_per_length": 1.0, "bending_stiffness": 1.0,
            "torsional_stiffness": 1.0, "polar_inertia_per_length": 0.01,
            "modes": {"y": 2, "z": 1, "twist": 1},
        }
    ],
    "body": [TIP_BODY],
    "hinge": [
        {"name": "pin", "type": "pin", "inboard": "ground", "outboard": "rod"},
        {"name": "joint", "type": "pin", "inboard": "rod.tip", "outboard": "plate"},
    ],
}  # fmt: skip


def random_body(rng: Generator, n: int = 4) -> ModalBody:
    """Modal body of an exact beam with drawn strains of all kinds, and drawn slices."""

    def station(previous: int, direction: float, **fields: Any) -> Station:
        rest = 0.1 * rng.normal(size=18)
        rest[0] += 0.3 * direction
        mass = rng.uniform(0.2, 0.6)
        root = rng.normal(size=(3, 3))
        slice_ = {
            "mass": mass, "center": 0.05 * rng.normal(size=3),
            "inertia": 0.01 * (root @ root.T + np.eye(3)),
        }  # fmt: skip
        return Station(0.0, previous, rest, 0.3 * rng.normal(size=(18, n)), **(fields or slice_))

    turned = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    stations = (
        station(-1, 1.0), station(0, 1.0), station(-1, -1.0), station(2, -1.0), station(1, 1.0),
        station(4, 1.0, end="tip", rotation=turned * np.linalg.det(turned)),
    )  # fmt: skip
    stiffness = rng.normal(size=(n, n))
    zeros = np.zeros
    port = ModalPort(zeros(3), np.eye(3), zeros((3, n)), zeros((3, n)), zeros((6, n, n)))
    return ModalBody(
        mass=1.0, first=zeros(3), second=np.eye(3), C=zeros((3, n)), E=zeros((3, 3, n)),
        F=np.einsum("ab,kl->abkl", np.eye(3), np.eye(n)), G=zeros((3, n, n)),
        X=zeros((3, 3, n, n)), name="rod", modes=tuple(f"m{k + 1}" for k in range(n)),
        K=stiffness @ stiffness.T + np.eye(n), D=zeros((n, n)),
        ports={"root": port, "tip": port}, stations=stations, eta=zeros(n), etad=zeros(n),
        frame="tangent",
    )  # fmt: skip


# --- equations of motion by Lagrange --------------------------------------------------------------


def _hat(x: Array) -> Array:
    v, w = x[:3], x[3:]
    return np.array(
        [[0, -w[2], w[1], v[0]], [w[2], 0, -w[0], v[1]], [-w[1], w[0], 0, v[2]], [0, 0, 0, 0]]
    )


def _commutator(a: Array, b: Array) -> Array:
    return a @ b - b @ a


def segment_pose(station: Station, eta: Array) -> Array:
    """Pose (4, 4) of the section at the end of a segment in that at its beginning."""
    strains = station.rest + station.shapes @ eta
    b1, b2, b3 = (_hat(strains[6 * k : 6 * k + 6]) for k in range(3))
    c1 = -_commutator(b1, b2)
    c2 = _commutator(b1, 2 * b3 + c1) / 60
    return np.asarray(expm(b1 + b3 / 12 - _commutator(-20 * b1 - b3 + c1, b2 + c2) / 240))


def _pin(angle: complex) -> Array:
    axis: Array = np.array([0, 0, 0, *AXIS])
    return np.asarray(expm(_hat(axis) * angle))


def _slices(body: ModalBody, y: Array) -> list[tuple[Array, float, Array, Array]]:
    """Pose, mass, mass centre and inertia of every rigid part; y = pin, joint, eta."""
    poses: list[Array] = []
    parts = []
    for station in body.stations:
        before = _pin(y[0]) if station.previous < 0 else poses[station.previous]
        poses.append(before @ segment_pose(station, y[2:]))
        parts.append((poses[-1], station.mass, station.center, station.inertia))
    end = np.eye(4)
    end[:3, :3] = body.stations[-1].rotation
    plate = poses[-1] @ end @ _pin(y[1])
    center, inertia = np.array(TIP_BODY["center_of_mass"]), np.diag(TIP_BODY["inertia"])
    return [*parts, (plate, TIP_BODY["mass"], center, inertia)]


def mass_matrix(body: ModalBody, y: Array) -> Array:
    """Mass matrix of the coordinates y, from complex steps of the poses."""
    step, count = 1e-30, len(y)
    moved = [_slices(body, y + 1j * step * unit) for unit in np.eye(count)]
    total = np.zeros((count, count))
    for k, (pose, mass, center, inertia) in enumerate(_slices(body, y)):
        rates = [parts[k][0].imag / step for parts in moved]
        turns = [pose[:3, :3].T @ rate[:3, :3] for rate in rates]
        spin = np.array([[t[2, 1], t[0, 2], t[1, 0]] for t in turns]).T
        velocity = np.array([rate[:3, :3] @ center + rate[:3, 3] for rate in rates]).T
        total += mass * velocity.T @ velocity + spin.T @ inertia @ spin
    return total


def _potential(body: ModalBody, y: Array) -> complex:
    height = sum(
        -mass * np.array(GRAVITY) @ (pose[:3, :3] @ center + pose[:3, 3])
        for pose, mass, center, _ in _slices(body, y)
    )
    return complex(height + y[2:] @ body.K @ y[2:] / 2)


def accelerations(body: ModalBody, y: Array, yd: Array) -> Array:
    """Accelerations of the coordinates y = pin, joint, eta."""
    units, step = np.eye(len(y)), 1e-4

    def difference(unit: Array) -> Array:
        """Derivative of the mass matrix along a direction, two central differences extrapolated."""
        wide, narrow = (
            (mass_matrix(body, y + h * unit) - mass_matrix(body, y - h * unit)) / (2 * h)
            for h in (step, step / 2)
        )
        return (4 * narrow - wide) / 3

    slopes = [difference(unit) for unit in units]
    rate = sum(speed * slope for speed, slope in zip(yd, slopes, strict=True))
    forces = np.array([_potential(body, y + 1e-30j * unit).imag / 1e-30 for unit in units])
    centrifugal = np.array([yd @ slope @ yd / 2 for slope in slopes])
    right = centrifugal - rate @ yd - forces
    return np.asarray(np.linalg.solve(mass_matrix(body, y), right))
