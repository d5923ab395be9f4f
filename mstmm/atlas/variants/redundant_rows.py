"""Closed loops with all their constraint rows, including redundant ones.

M a + G' l = M a0 and G a = 0 at rest, of which the multipliers l solve S l = G a0, S = G M^-1 G'.
With redundant rows S is singular, and the multipliers are not unique.  They are either those of
least norm, with singular values of S below a fraction of the largest one taken as zero (G. H.
Golub, C. F. Van Loan, Matrix Computations, 2013, 5.5), or those of S regularised by a multiple of
the unit matrix.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...array_validation import Array
from ...runtime.engine.looped_engine import LoopedEngine
from ...runtime.engine.loops.loop_calls import LoopCalls
from ...runtime.model.model import Model
from ...runtime.packing.scene_packing import pack


def least_norm_multipliers(mobility: Array, right: Array, share: float | None = None) -> Array:
    """Multipliers of least norm; rank limit: `share` times the largest singular value."""
    return np.asarray(np.linalg.lstsq(mobility, right, rcond=share)[0], dtype=np.float64)


def regularised_multipliers(mobility: Array, right: Array, share: float) -> Array:
    """Multipliers after adding `share` times the mean diagonal entry to all diagonal entries."""
    rows = len(mobility)
    return np.linalg.solve(mobility + share * np.trace(mobility) / rows * np.eye(rows), right)


def accelerations_at_rest(
    closed: Model,
    tree: Model,
    q: Array,
    solve_multipliers: Callable[[Array, Array], Array] = least_norm_multipliers,
) -> Array:
    """Accelerations (nu,) of the tree at its coordinates q, with all rows of the loops.

    In `closed` the cut hinges follow the hinges of `tree`; `solve_multipliers(S, G a0)` returns
    the multipliers.
    """
    engine, zeros = LoopedEngine(pack(closed.scene)), np.zeros(tree.nu)
    calls = LoopCalls(engine, q)
    slip_columns = [
        calls.correction(calls.velocity_level, q, unit_speed)[1]
        for unit_speed in np.eye(tree.nu, engine.nu)
    ]
    rows = np.ascontiguousarray(np.transpose(slip_columns))
    tree_q = np.ascontiguousarray(q[: tree.nq])
    tree_udot, responses = tree.accelerations(tree_q, zeros), tree.solve(tree_q, rows.T).T
    multipliers = solve_multipliers(rows @ responses.T, rows @ tree_udot)
    return np.asarray(tree_udot - multipliers @ responses)
