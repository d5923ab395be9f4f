"""Planar chain of rods on pins by Lagrange's equations in absolute angles, in extended precision.

Rod k has length 1, its mass centre in the middle; with c_kj = 1 (j < k), 1/2 (j = k), 0 (j > k):
M_ij = sum_k m_k c_ki c_kj cos(a_i - a_j) + J_i (i = j), and the right-hand side has
sum_j m c c sin(a_i - a_j) a_j'^2 and the weights.  Exact to about 1e-17 of the largest entry.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy.linalg

from .jets import Array


def accelerations(
    masses: Array, inertias: Array, q: Array, u: Array, gravity: float = 9.81
) -> Array:
    """Rates of the relative speeds for relative angles q and speeds u; gravity along -y."""
    wide = np.longdouble
    n = len(masses)
    angle, rate = np.cumsum(q.astype(wide)), np.cumsum(u.astype(wide))
    arms = np.tril(np.ones((n, n), wide), -1) + np.eye(n, dtype=wide) / 2
    weighted = masses.astype(wide)[:, None] * arms
    coupling = arms.T @ weighted
    between = angle[:, None] - angle[None, :]
    matrix = coupling * np.cos(between) + np.diag(inertias.astype(wide))
    right = -(coupling * np.sin(between)) @ rate**2
    right -= wide(gravity) * weighted.sum(axis=0) * np.cos(angle)
    factors = scipy.linalg.lu_factor(matrix.astype(float))
    x = np.zeros(n, wide)
    for _ in range(12):
        x = x + scipy.linalg.lu_solve(factors, (right - matrix @ x).astype(float))
    return np.asarray(np.diff(x, prepend=wide(0)), float)


def scene(masses: Array, inertias: Array, orientation: Any = (0, 0, 0)) -> dict[str, Any]:
    """The same chain as a scene, its plane turned by `orientation` (gravity with it)."""
    from .algebra import orientation as rotation

    bodies = [
        {
            "name": f"rod{i}",
            "mass": float(m),
            "center_of_mass": [0.5, 0, 0],
            "inertia": [float(j) / 10, float(j), float(j)],
            "ends": {"tip": [1, 0, 0]},
        }
        for i, (m, j) in enumerate(zip(masses, inertias, strict=True))
    ]
    hinges: list[dict[str, Any]] = [
        {
            "name": f"pin{i}",
            "type": "pin",
            "inboard": f"rod{i - 1}.tip" if i else "ground",
            "outboard": f"rod{i}",
        }
        for i in range(len(masses))
    ]
    hinges[0]["orientation"] = list(orientation)
    gravity = (rotation(orientation) @ [0, -9.81, 0]).tolist()
    return {"schema_version": 1, "gravity": gravity, "body": bodies, "hinge": hinges}
