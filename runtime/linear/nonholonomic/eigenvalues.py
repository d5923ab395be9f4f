"""Eigenvalues of state matrices with zero eigenvalues of ignorable coordinates."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array

Complex = NDArray[np.complex128]

#: Entries of A that are rounding, relative to the largest of their row; lower bound of that largest
#: entry, relative to the largest of all; real and imaginary parts of eigenvalues that are rounding.
_NOTHING, _LEAST, _PART = 1e-9, 1e-6, 1e-8


def eigenpairs(a: Array) -> tuple[Complex, Complex]:
    """Eigenvalues (k,) of A (n, n) by rising magnitude, and eigenvectors (n, k).

    Of each conjugate pair only the eigenvalue above the real axis is kept.  Ignorable coordinates
    have eigenvalue 0 exactly.
    """
    core, ignorable = coupled_states(a)
    values, own = _deflated_eigenpairs(a[np.ix_(core, core)])
    vectors = np.zeros((len(a), len(values)), dtype=np.complex128)
    vectors[core] = own
    moving = values != 0
    for index in reversed(ignorable):
        vectors[index, moving] = (a[index] @ vectors)[moving] / values[moving]
    values = np.concatenate([np.zeros(len(ignorable)), values])
    vectors = np.hstack([np.eye(len(a))[:, ignorable], vectors])
    kept = np.flatnonzero(values.imag >= 0)
    kept = kept[np.argsort(np.abs(values[kept]), kind="stable")]
    return values[kept], vectors[:, kept]


def _deflated_eigenpairs(a: Array) -> tuple[Complex, Complex]:
    """Eigenvalues and eigenvectors of A (n, n), with the null space deflated stage by stage.

    Deflation is needed since a defective zero eigenvalue is otherwise accurate only to a root of
    the rounding error.
    """
    still, across, lengths = np.eye(0), np.eye(0), np.zeros(0)
    if len(a):
        _, lengths, across = np.linalg.svd(_scale_rows(a))
    count = int((lengths <= _NOTHING * lengths.max(initial=0.0)).sum())
    if not count:
        values, vectors = np.linalg.eig(a) if len(a) else (np.zeros(0), np.zeros((0, 0)))
        return _round_to_zero(values.astype(np.complex128)), vectors.astype(np.complex128)
    rest, still = across[:-count].T, across[-count:].T
    values, inner = _deflated_eigenpairs(rest.T @ a @ rest)
    vectors = rest @ inner
    moving = values != 0
    vectors[:, moving] += still @ (still.T @ a @ vectors[:, moving]) / values[moving]
    return np.concatenate([np.zeros(count), values]), np.hstack([still, vectors])


def _scale_rows(a: Array) -> Array:
    """A with each row scaled by its largest entry, as stiff and slow parts differ in size."""
    largest = np.abs(a).max(axis=1, initial=0.0)
    floor = _LEAST * float(largest.max(initial=0.0)) or 1.0
    return np.asarray(a / np.maximum(largest, floor)[:, None])


def _round_to_zero(values: Complex) -> Complex:
    """Eigenvalues with real or imaginary parts at rounding level set to zero."""
    rounding = _PART * np.abs(values).max(initial=0.0)
    values = np.where(np.abs(values.imag) <= rounding, values.real, values)
    return np.where(np.abs(values.real) <= rounding, 1j * values.imag, values)


def coupled_states(a: Array) -> tuple[list[int], list[int]]:
    """Indices of the coupled states, and of ignorable states in the order of their elimination.

    No remaining state depends on an ignorable one.
    """
    core, ignorable, scaled = list(range(len(a))), list[int](), np.abs(_scale_rows(a))
    while True:
        for index in core:
            if scaled[core, index].max(initial=0.0) <= _NOTHING:
                break
        else:
            return core, ignorable
        core.remove(index)
        ignorable.append(index)
