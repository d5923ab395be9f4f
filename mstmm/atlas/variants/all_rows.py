"""Closed loops with all their rows, those that repeat others too.

M a + G' l = M a0 and G a = 0 at rest, of which the multipliers l solve S l = G a0, S = G M^-1 G'.
Where rows repeat others S is singular, and somebody has to say which multipliers are meant: those
of least size, where of S counts for zero what is below a share of its largest singular value
(G. H. Golub, C. F. Van Loan, Matrix Computations, 2013, 5.5), or those of S made regular by a
little of the unit matrix.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...arrays import Array
from ...runtime.engine.engine import Engine
from ...runtime.engine.loops.calls import LoopCalls
from ...runtime.model.model import Model
from ...runtime.pack.pack import pack


def of_least_size(mobility: Array, asked: Array, share: float | None = None) -> Array:
    """Multipliers of least size; `share` is of the largest singular value, if not rounding."""
    return np.asarray(np.linalg.lstsq(mobility, asked, rcond=share)[0], dtype=np.float64)


def regularised(mobility: Array, asked: Array, share: float) -> Array:
    """Multipliers with a share of the mean diagonal entry added to all."""
    rows = len(mobility)
    return np.linalg.solve(mobility + share * np.trace(mobility) / rows * np.eye(rows), asked)


def accelerations_at_rest(
    closed: Model, tree: Model, q: Array, solved: Callable[[Array, Array], Array] = of_least_size
) -> Array:
    """Of the speeds (nu,) of the tree, of which the closing hinges of the other come behind, at its
    coordinates q; `solved` says what multipliers are meant."""
    engine, still = Engine(pack(closed.scene)), np.zeros(tree.nu)
    calls = LoopCalls(engine, q)
    slips = [calls.correction(calls.slip, q, one)[1] for one in np.eye(tree.nu, engine.nu)]
    rows = np.ascontiguousarray(np.transpose(slips))
    at = np.ascontiguousarray(q[: tree.nq])
    alone, answers = tree.accelerations(at, still), tree.solve(at, rows.T).T
    return np.asarray(alone - solved(rows @ answers.T, rows @ alone) @ answers)
