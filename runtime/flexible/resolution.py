"""Up to which frequency shapes hold: their natural motions beside those of a richer model."""

from __future__ import annotations

import numpy as np

from mstmm.array_validation import Array

#: Part by which a frequency may be too high for its motion still to be one of the shapes.
_GOOD = 0.05
#: Below this part of the first frequency a body follows its loads as at rest, to 12 %.
_SLOW = 1 / 3


def resolved_frequency(found: Array, expected: Array) -> float:
    """The highest frequency (rad/s) up to which all motions are there and right to 5 %.

    `found` (n,) of the shapes, `expected` of the richer model, both ascending and without motions
    of the whole body.  Where the first is wrong already, a third of it.
    """
    count = min(len(found), len(expected))
    if not count:
        return 0.0
    right = found[:count] <= (1 + _GOOD) * expected[:count]
    good = count if right.all() else int(np.argmin(right))
    return float(expected[good - 1]) if good else float(_SLOW * expected[0])


def ritz_frequencies(stiffness: Array, mass: Array) -> Array:
    """(m,) rad/s, ascending, of motions that are spanned by n columns whose stiffness and mass
    (n, n) these are; columns may repeat each other.  The stiffness is that of held columns."""
    size = 1 / np.sqrt(np.maximum(np.diag(stiffness), 1e-300))
    scale = np.outer(size, size)
    values, vectors = np.linalg.eigh(stiffness * scale)
    kept = values > 1e-12 * values.max(initial=0.0)
    basis = vectors[:, kept] / np.sqrt(values[kept])
    inverse = np.linalg.eigvalsh(basis.T @ (mass * scale) @ basis)
    moving = inverse > 1e-14 * inverse.max(initial=0.0)
    return np.asarray(np.sort(1 / np.sqrt(inverse[moving])))
