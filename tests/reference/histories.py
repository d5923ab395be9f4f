"""Whole motions by the dense equations in hinge coordinates, integrated by SciPy."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from . import newton_euler as dense
from .jets import Array
from .tree import Tree, read


def integrate(
    scene: Mapping[str, Any] | Tree,
    times: Any,
    q: Array | None = None,
    u: Array | None = None,
    tolerance: float = 1e-10,
) -> tuple[Array, Array]:
    """q (time, nq) and u (time, nu) at `times`, from the scene's start values or q, u."""
    tree = read(scene)
    start_q, start_u = tree.initial()
    start = np.concatenate([start_q if q is None else q, start_u if u is None else u])
    times = np.asarray(times, float)

    def rate(t: float, y: Array) -> Array:
        now_q, now_u = y[: tree.nq], y[tree.nq :]
        udot = dense.solve(tree, now_q, now_u, t).udot
        return np.concatenate([dense.coordinate_rates(tree, now_q, now_u), udot])

    span = (float(times[0]), float(times[-1]))
    found = solve_ivp(rate, span, start, "DOP853", times, rtol=tolerance, atol=tolerance)
    if not found.success:
        raise RuntimeError(found.message)
    return found.y[: tree.nq].T, found.y[tree.nq :].T
