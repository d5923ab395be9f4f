"""Whether heavy bodies behind light ones cost the accelerations of closed loops digits.

Then every answer is refined once: what inverse dynamics of it leaves over is answered too, and
added.  What that changes at the start is what is lost.
"""

from __future__ import annotations

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import NumericalFailure

from ..engine import Engine

#: Change of the accelerations, in parts of the largest, from which on four digits are lost.
_LOST = 1e-12


def loses_digits(engine: Engine, q: Array, u: Array) -> bool:
    """Whether a refinement changes accelerations at (q, u), or those of drawn efforts, by more than
    rounding."""
    model = engine.packed.model
    if engine.packed.flexible:
        return False  # what modes leave over is not answered
    efforts = np.random.default_rng(0).uniform(-1.0, 1.0, (2, engine.nu))
    efforts[0] = 0.0
    memory = engine.start_memory()
    states = np.tile(q, (2, 1)), np.tile(u, (2, 1)), np.tile(memory, (2, 1))
    try:
        plain = engine.accelerations(0.0, *states, efforts)[1]
        model.refines = 1
        refined = engine.accelerations(0.0, *states, efforts)[1]
    except NumericalFailure:
        return False
    finally:
        model.refines = 0
    size = np.abs(refined).max(axis=1)
    return bool((np.abs(plain - refined).max(axis=1) > _LOST * size).any())
