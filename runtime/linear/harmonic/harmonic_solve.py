"""Harmonic amplitudes from M, C, K: closed loops and operating points with rotating balls."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array

from ..mck_matrices import Matrices

Complex = NDArray[np.complex128]


class Amplitudes:
    """Solver of Z(s) x = r with the dynamic stiffness Z, for dense matrices.

    Replaces `HarmonicResponse`, which covers trees at rest; x and r are at the indices `places`
    among the speeds.
    """

    def __init__(self, places: Sequence[int], whole: Matrices, lossy: Matrices | None) -> None:
        self._indices, self._matrices = list(places), whole
        self._loss_stiffness = 0.0 if lossy is None else 1j * (lossy.K - whole.K)

    def amplitudes(self, s: Complex, columns: Array) -> tuple[Complex, Array, NDArray[np.int32]]:
        """Amplitudes x (k, n, nu) at s (k,) for n right-hand sides (n, nu).

        Also returns the condition number (k,) of Z and the body index -1 (k,): no body.
        """
        x = np.zeros((len(s), *columns.shape), dtype=np.complex128)
        growth, whole = np.zeros(len(s)), self._matrices
        for k, at in enumerate(s):
            parts = at**2 * whole.M, at * whole.C, whole.K + self._loss_stiffness
            z = np.asarray(sum(parts))
            growth[k] = _condition(z, np.asarray(sum(map(np.abs, parts))))
            if np.isfinite(growth[k]):
                x[k][:, self._indices] = np.linalg.solve(z, columns[:, self._indices].T).T
        return x, growth, np.full(len(s), -1, dtype=np.int32)


def _condition(z: Complex, cancelling: Array) -> float:
    """Condition number of z relative to the sizes of its cancelling terms; inf if singular."""
    scale = np.sqrt(cancelling.max(axis=1, initial=0.0))
    if not len(z) or not scale.all():
        return float(np.inf) if len(z) else 1.0
    size = float(np.linalg.norm(cancelling / np.outer(scale, scale), 2))
    least = float(np.linalg.svd(z / np.outer(scale, scale), compute_uv=False).min())
    return size / least if least else float(np.inf)
