"""Rotation vectors with a truncated rate, in the extreme the angular velocity.

Within a step an attitude is q exp(theta), and theta' = w + theta x w / 2 + theta x (theta x w) / 12
up to the third power of theta (H. Munthe-Kaas, BIT 38 (1998) 92-111).  Here products are omitted.
"""

from __future__ import annotations

import numpy as np

from ...array_validation import Array
from ...runtime.model.model import Model


def rotate(attitude: Array, theta: Array) -> Array:
    """Quaternion (4,) of an attitude rotated by a rotation vector (3,) in body axes."""
    angle = float(np.linalg.norm(theta))
    w, v = np.cos(angle / 2), 0.5 * np.sinc(angle / (2 * np.pi)) * theta
    w0, v0 = attitude[0], attitude[1:]
    return np.array([w0 * w - v0 @ v, *(w0 * v + w * v0 + np.cross(v0, v))])


def rotation_vector_rate(theta: Array, u: Array, products: int = 2) -> Array:
    """Rate (3,) of a rotation vector at an angular velocity, with 0 to 2 of these products."""
    cross_product = np.cross(theta, u)
    rate = np.asarray(u, float)
    if products > 0:
        rate = rate + cross_product / 2
    return rate + np.cross(theta, cross_product) / 12 if products > 1 else rate


def final_attitude(model: Model, step: float, steps: int, products: int = 0) -> Array:
    """q (4,) of a body on a ball hinge after `steps` steps of rk4 on rotation vectors."""
    attitude, speeds = model.initial_state()
    for _ in range(steps):
        stages: list[tuple[Array, Array]] = []
        for fraction in (0.0, 0.5, 0.5, 1.0):
            rate, acceleration = stages[-1] if stages else (np.zeros(3), np.zeros(3))
            theta, u = fraction * step * rate, speeds + fraction * step * acceleration
            stages.append(
                (
                    rotation_vector_rate(theta, u, products),
                    model.accelerations(rotate(attitude, theta), u),
                )
            )
        rate, acceleration = step / 6 * np.tensordot([1, 2, 2, 1], np.array(stages), 1)
        attitude, speeds = rotate(attitude, rate), speeds + acceleration
    return attitude
