"""Vectors, rotations and quaternions (w, x, y, z), for numbers and for jets."""

from __future__ import annotations

from typing import Any

import numpy as np

from .jets import Array, Jet, as_jet, cos, dot, sin, sqrt, stack


def tilde(a: Any) -> Array:
    """Cross-product matrix over the last axis: tilde(a) b = a x b."""
    a = np.asarray(a, float)
    out = np.zeros((*a.shape, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -a[..., 2], a[..., 1], -a[..., 0]
    out[..., 1, 0], out[..., 2, 0], out[..., 2, 1] = a[..., 2], -a[..., 1], a[..., 0]
    return out


def axial(matrix: Array) -> Array:
    """Inverse of `tilde` on the skew part."""
    m = matrix
    pairs = (m[..., 2, 1] - m[..., 1, 2], m[..., 0, 2] - m[..., 2, 0], m[..., 1, 0] - m[..., 0, 1])
    return np.asarray(np.stack(pairs, -1) / 2)


def turn(axis: Any, angle: Jet) -> Jet:
    """Rotation by `angle` about the unit vector `axis` (Rodrigues), angle of any shape."""
    k = tilde(axis)
    return np.eye(3) + sin(angle)[..., None, None] * k + (1 - cos(angle))[..., None, None] * (k @ k)


def quaternion_matrix(q: Jet) -> Jet:
    """Rotation matrix of a quaternion over the last axis, used normalised."""
    q = as_jet(q)
    q = q / sqrt(dot(q, q))[..., None]
    w, x, y, z = (q[..., i] for i in range(4))
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return stack([stack([row[i] for row in rows]) for i in range(3)])


def attitude(q: Array) -> Array:
    """Rotation matrix of one quaternion, used normalised."""
    w, v = q[0], np.asarray(q[1:])
    square = float(q @ q)
    return np.asarray(np.eye(3) + (2 * w * tilde(v) + 2 * tilde(v) @ tilde(v)) / square)


def quaternion_product(a: Array, b: Array) -> Array:
    """Product of quaternions over the last axis."""
    w, v = a[..., :1], a[..., 1:]
    s, r = b[..., :1], b[..., 1:]
    scalar = w * s - np.sum(v * r, -1, keepdims=True)
    return np.concatenate([scalar, w * r + s * v + np.cross(v, r)], -1)


def pure(v: Array) -> Array:
    """Vector as a quaternion without scalar part."""
    return np.concatenate([np.zeros((*v.shape[:-1], 1)), v], -1)


def conjugate(q: Array) -> Array:
    """Conjugate quaternion."""
    return q * np.array([1.0, -1.0, -1.0, -1.0])


def to_quaternion(matrix: Array) -> Array:
    """Unit quaternion of a rotation matrix (Shepperd's largest-pivot form)."""
    trace = float(np.trace(matrix))
    diagonal = np.array([trace, *np.diag(matrix)])
    pivot = int(np.argmax(diagonal))
    skew = 2 * axial(matrix)
    if pivot == 0:
        q = np.array([1 + trace, *skew])
    else:
        i, j, k = pivot - 1, pivot % 3, (pivot + 1) % 3
        v = np.zeros(3)
        v[i] = 1 + 2 * matrix[i, i] - trace
        v[j], v[k] = matrix[i, j] + matrix[j, i], matrix[i, k] + matrix[k, i]
        q = np.array([skew[i], *v])
    return np.asarray(q / np.linalg.norm(q))


def orientation(value: Any) -> Array:
    """Rotation from [roll, pitch, yaw] (Rz Ry Rx) or from a quaternion; None is the identity."""
    if value is None:
        return np.eye(3)
    v = np.asarray(value, float)
    if v.shape == (4,):
        return quaternion_matrix(as_jet(v)).x
    roll, pitch, yaw = v
    x, y, z = np.eye(3)
    return turn(z, as_jet(yaw)).x @ turn(y, as_jet(pitch)).x @ turn(x, as_jet(roll)).x


def unit(v: Any) -> Array:
    """Vector of length one."""
    v = np.asarray(v, float)
    return np.asarray(v / np.linalg.norm(v))


def triad(axis: Any, hint: Any = None) -> Array:
    """Columns (in-plane 1, in-plane 2, axis), right-handed.

    The first is the part of `hint` normal to the axis; without a hint that of x, or of y where
    the axis is within 26 degrees of x.
    """
    a = unit(axis)
    h = np.eye(3)[0 if abs(a[0]) < 0.9 else 1] if hint is None else np.asarray(hint, float)
    first = unit(h - a * (a @ h))
    return np.stack([first, np.cross(a, first), a], axis=1)
