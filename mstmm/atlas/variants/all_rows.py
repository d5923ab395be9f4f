"""Closed loops with all their rows, those that repeat others too.

M a + G' l = M a0 and G a = 0 at rest, with the multipliers l of least size: of G M^-1 G' counts for
zero what is no larger than rounding beside its largest singular value (G. H. Golub, C. F. Van Loan,
Matrix Computations, 2013, 5.5).
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...runtime.engine.engine import Engine
from ...runtime.engine.loops.calls import LoopCalls
from ...runtime.model.model import Model
from ...runtime.pack.pack import pack


def accelerations_at_rest(closed: Model, tree: Model, q: Array) -> Array:
    """Of the speeds (nu,) of the tree, of which the closing hinges of the other come behind, at its
    coordinates q."""
    engine, still = Engine(pack(closed.scene)), np.zeros(tree.nu)
    calls = LoopCalls(engine, q)
    slips = [calls.correction(calls.slip, q, one)[1] for one in np.eye(tree.nu, engine.nu)]
    rows = np.ascontiguousarray(np.transpose(slips))
    at = np.ascontiguousarray(q[: tree.nq])
    alone, answers = tree.accelerations(at, still), tree.solve(at, rows.T).T
    multipliers = np.linalg.lstsq(rows @ answers.T, rows @ alone, rcond=None)[0]
    return np.asarray(alone - multipliers @ answers)
