"""Highest frequency that shapes resolve, by comparison with the modes of a richer model."""

from __future__ import annotations

import numpy as np

from mstmm.array_validation import Array

#: Largest relative error (too high) of a natural frequency whose mode counts as resolved.
_TOLERANCE = 0.05
#: Share of the first frequency below which the static response to a load is right to 12 %.
_QUASI_STATIC = 1 / 3


def resolved_frequency(found: Array, expected: Array) -> float:
    """Highest frequency (rad/s) up to which all modes are present and accurate to 5 %.

    `found` (n,) are natural frequencies of the shapes, `expected` those of the richer model, both
    ascending and without rigid motions.  A third of the first one if that is already wrong.
    """
    count = min(len(found), len(expected))
    if not count:
        return 0.0
    accurate = found[:count] <= (1 + _TOLERANCE) * expected[:count]
    resolved_count = count if accurate.all() else int(np.argmin(accurate))
    return (
        float(expected[resolved_count - 1])
        if resolved_count
        else float(_QUASI_STATIC * expected[0])
    )


def ritz_frequencies(stiffness: Array, mass: Array) -> Array:
    """Natural frequencies (m,) in the span of n assumed shapes, rad/s, ascending.

    `stiffness` and `mass` (n, n) are those of the shapes, which may be linearly dependent and
    contain no rigid motion.
    """
    size = 1 / np.sqrt(np.maximum(np.diag(stiffness), 1e-300))
    scale = np.outer(size, size)
    values, vectors = np.linalg.eigh(stiffness * scale)
    independent = values > 1e-12 * values.max(initial=0.0)
    basis = vectors[:, independent] / np.sqrt(values[independent])
    inverse = np.linalg.eigvalsh(basis.T @ (mass * scale) @ basis)
    moving = inverse > 1e-14 * inverse.max(initial=0.0)
    return np.asarray(np.sort(1 / np.sqrt(inverse[moving])))
