"""Loads without equilibrium: constant load along a motion in all states of the scene."""

from __future__ import annotations

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure, SceneError

from .static_equilibrium import EquilibriumProblem

#: Maximum number of coordinates, number of random states in addition to that of coordinates, and
#: number of attempts per state.
_MAX_COORDINATES, _SPARE, _DRAWS = 200, 12, 2
#: Distances of the states, in characteristic scales: far enough to reach stops and the stiffness of
#: soft springs.
_NEAREST, FARTHEST = 0.1, 1e4
#: Variation that counts as rounding: of efforts, relative to the largest ones, and of the load.
_ROUNDING, _CONSTANT = 1e-9, 1e-6
#: Smallest scale of the efforts of a coordinate, relative to the largest scale.
_MIN_EFFORT_SCALE = 1e-5


def find_unbalanced_motion(
    problem: EquilibriumProblem, q: Array, farthest: float = FARTHEST
) -> tuple[Array, int] | None:
    """Motion (n,) with a constant non-zero load along it, and the number of states examined.

    Random states are drawn around q, at distances from 0.1 to `farthest` characteristic scales.
    None if every load varies, or if too few of the states are valid.
    """
    count = len(problem.sizes)
    if not 0 < count <= _MAX_COORDINATES:
        return None
    efforts = _random_efforts(problem, q, count + _SPARE, farthest)
    if len(efforts) < count + _SPARE:
        return None
    scale = np.abs(efforts).max(axis=0)
    if not scale.any():
        return None
    scale = np.maximum(scale, _MIN_EFFORT_SCALE * scale.max())
    rows = efforts / scale
    _, values, directions = np.linalg.svd(rows[1:] - rows[0])
    still = directions[values <= _ROUNDING * len(rows)]
    motion = still.T @ (still @ rows[0])
    loads = rows @ motion
    if np.linalg.norm(motion) <= _ROUNDING or np.ptp(loads) > _CONSTANT * abs(loads[0]):
        return None
    return motion / scale * problem.sizes, len(efforts)


def _random_efforts(problem: EquilibriumProblem, q: Array, count: int, farthest: float) -> Array:
    """Efforts (k, n), J, at q and at random states around it, with k at most `count`."""
    draw, effort_samples = np.random.default_rng(0), [problem.efforts(q)]
    for _ in range(_DRAWS * count):
        if len(effort_samples) == count:
            break
        distance = np.exp(draw.uniform(np.log(_NEAREST), np.log(farthest)))
        step = distance * draw.uniform(-1.0, 1.0, len(problem.sizes))
        try:
            effort_samples.append(problem.efforts(problem.advance_state(q, step)))
        except (NumericalFailure, SceneError):
            continue
    return np.array(effort_samples)
