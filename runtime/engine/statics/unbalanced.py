"""Loads that no state balances: work along a motion that is the same wherever the scene is."""

from __future__ import annotations

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure, SceneError

from .rest import Rest

#: Coordinates up to which states are drawn, states beyond their number, and draws for each state.
_MOST, _SPARE, _DRAWS = 200, 12, 2
#: Distances of the states, in sizes: far enough to meet stops and the stiffness of soft springs.
_NEAREST, FARTHEST = 0.1, 1e4
#: Variation of efforts that is rounding, in parts of the largest ones and of the load found.
_ROUNDING, _CONSTANT = 1e-9, 1e-6
#: Efforts are compared with the largest of their coordinate, or with this part of the largest.
_LEAST = 1e-5


def find_unbalanced_motion(
    problem: Rest, q: Array, farthest: float = FARTHEST
) -> tuple[Array, int] | None:
    """Motion (n,) along which the load is a constant other than 0, and the number of states seen.

    The states are drawn around q, from 0.1 to `farthest` sizes away.  None where every load varies,
    or where too few of the states exist.
    """
    count = len(problem.sizes)
    if not 0 < count <= _MOST:
        return None
    efforts = _drawn_efforts(problem, q, count + _SPARE, farthest)
    if len(efforts) < count + _SPARE:
        return None
    scale = np.abs(efforts).max(axis=0)
    if not scale.any():
        return None
    scale = np.maximum(scale, _LEAST * scale.max())
    rows = efforts / scale
    _, values, directions = np.linalg.svd(rows[1:] - rows[0])
    still = directions[values <= _ROUNDING * len(rows)]
    motion = still.T @ (still @ rows[0])
    loads = rows @ motion
    if np.linalg.norm(motion) <= _ROUNDING or np.ptp(loads) > _CONSTANT * abs(loads[0]):
        return None
    return motion / scale * problem.sizes, len(efforts)


def _drawn_efforts(problem: Rest, q: Array, count: int, farthest: float) -> Array:
    """Efforts in J at q and at states drawn, `count` (k, n) of them or fewer."""
    draw, found = np.random.default_rng(0), [problem.efforts(q)]
    for _ in range(_DRAWS * count):
        if len(found) == count:
            break
        distance = np.exp(draw.uniform(np.log(_NEAREST), np.log(farthest)))
        step = distance * draw.uniform(-1.0, 1.0, len(problem.sizes))
        try:
            found.append(problem.efforts(problem.after(q, step)))
        except (NumericalFailure, SceneError):
            continue
    return np.array(found)
