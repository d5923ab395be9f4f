"""Lanczos iteration with the inverse of K - sigma M, in the inner product of M.

Each step needs one solution and one product.  All vectors are orthogonalised against each other and
against known modes.  A run finds only one of several modes with equal frequencies; further runs
find the others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh_tridiagonal

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure

from .mck_matrices import Pencil

#: Largest residual of a converged mode, relative to 1/(omega^2 - sigma).
_CLOSE = 1e-9
#: Remainder of a vector that is rounding, relative to the vector.
_NEGLIGIBLE = 1e-13
#: Steps between convergence checks, vectors per requested mode, additional vectors, largest number
#: of runs.
_CHECK_INTERVAL, _VECTORS_PER_MODE, _EXTRA_VECTORS, _MAX_RUNS = 4, 4, 60, 30


@dataclass(frozen=True)
class ConvergedPairs:
    """Ascending omega^2 (k,), shapes (n, k) of unit modal mass, and M times them as rows (k, n)."""

    squares: Array
    shapes: Array
    mass_shapes: Array

    @classmethod
    def empty(cls, n: int) -> ConvergedPairs:
        """Empty set of pairs for n coordinates."""
        return cls(np.zeros(0), np.zeros((n, 0)), np.zeros((0, n)))

    def merge(self, squares: Array, shapes: Array, pushed: Array) -> ConvergedPairs:
        """Merge with other ascending pairs."""
        if not len(self.squares):
            return ConvergedPairs(squares, shapes, pushed)
        every = np.concatenate([self.squares, squares])
        order = np.argsort(every, kind="stable")
        return ConvergedPairs(
            every[order],
            np.hstack([self.shapes, shapes])[:, order],
            np.vstack([self.mass_shapes, pushed])[order],
        )


def slowest(
    pencil: Pencil, count: int, sigma: float, edge: float, trial: int, known: ConvergedPairs
) -> ConvergedPairs:
    """Known modes and `count` further modes with omega^2 nearest to sigma.

    There are fewer if one of them already has omega^2 above `edge`.

    Raises NumericalFailure if the iteration does not converge.
    """
    pencil.factor(-sigma)
    start = pencil.solve(np.random.default_rng(trial).standard_normal(len(pencil)))
    pairs, more = known, 0
    for _ in range(_MAX_RUNS):
        run = _Run(pencil, pairs, start)
        run.iterate(count - more, 1 / (edge - sigma))
        squares = sigma + 1 / run.values
        pairs = pairs.merge(squares, run.shapes, run.mass_shapes)
        more += len(squares)
        if more >= count or run.is_exhausted or (squares > edge).any():
            return pairs
        start = run.next_start
    raise NumericalFailure(
        f"modes: not converged: {more} of {count} modes found within the iteration limit; request "
        "fewer"
    )


class _Run:
    """Lanczos run: M-orthonormal vectors in which the inverse is tridiagonal.

    Attributes:
        q, p: vectors q_j and M q_j as rows.
        alpha, beta: diagonal and off-diagonal of the tridiagonal matrix.
        values, shapes, mass_shapes: 1/(omega^2 - sigma) of the modes found, their shapes and M
            times these.
        next_start: start vector of the next run.
        is_exhausted: whether no further vector, and no next run, exists.
    """

    def __init__(self, pencil: Pencil, known: ConvergedPairs, start: Array) -> None:
        n = len(pencil)
        self.pencil, self.known_pairs, self.next_start = pencil, known, start
        self.alpha: list[float] = []
        self.beta: list[float] = []
        self.values, self.shapes, self.mass_shapes = np.zeros(0), np.zeros((n, 0)), np.zeros((0, n))
        self.is_exhausted = False

    def iterate(self, count: int, least: float) -> None:
        """Iterate until `count` modes are found in order.

        Stop early at a mode with 1/(omega^2 - sigma) below `least`, or without space for further
        vectors.
        """
        n = len(self.pencil)
        room = min(n - len(self.known_pairs.squares), _VECTORS_PER_MODE * count + _EXTRA_VECTORS)
        self.q, self.p = np.empty((room, n)), np.empty((room, n))
        self._append_vector(self.next_start, float(np.linalg.norm(self.next_start)))
        while not self.is_exhausted:
            self._step()
            steps = len(self.alpha)
            due = steps % _CHECK_INTERVAL == 0 and (steps > count or least > 0)
            if (due or self.is_exhausted or steps == room) and self._check_convergence(
                count, least
            ):
                return

    def _step(self) -> None:
        """Multiply the last vector by the inverse and append the new direction."""
        j = len(self.alpha)
        w = self.pencil.solve(self.p[j])
        size = float(np.linalg.norm(w))
        self.alpha.append(float(self.p[j] @ w))
        w -= self.alpha[j] * self.q[j]
        if j:
            w -= self.beta[j - 1] * self.q[j - 1]
        self.beta.append(self._append_vector(w, size))

    def _append_vector(self, w: Array, size: float) -> float:
        """Append w, made orthogonal to all vectors; return the M-norm of the remainder.

        `size` is the norm of w before orthogonalisation.
        """
        j = len(self.alpha)
        for known, pushed in (
            (self.known_pairs.shapes.T, self.known_pairs.mass_shapes),
            (self.q[:j], self.p[:j]),
        ):
            w = w - (pushed @ w) @ known
        pushed = self.pencil.mass(w)
        square = float(w @ pushed)
        self.is_exhausted = square <= 0 or float(np.linalg.norm(w)) <= _NEGLIGIBLE * size
        left = 0.0 if self.is_exhausted else float(np.sqrt(square))
        if left and j < len(self.q):
            self.q[j], self.p[j] = w / left, pushed / left
        return left

    def _check_convergence(self, count: int, least: float) -> bool:
        """Check convergence; at the end of the run store the modes found and return True."""
        steps = len(self.alpha)
        values, weights = eigh_tridiagonal(self.alpha, self.beta[:-1])
        order = np.argsort(-np.abs(values), kind="stable")
        values, weights = values[order], weights[:, order]
        close = np.abs(self.beta[-1] * weights[-1]) <= _CLOSE * np.abs(values)
        kept = min(int(np.argmin(np.append(close, False))), count)
        enough = kept == count or (np.abs(values[:kept]) < least).any()
        if not enough and not self.is_exhausted and steps < len(self.q):
            return False
        self.values, vectors = values[:kept], weights[:, :kept]
        self.shapes, self.mass_shapes = self.q[:steps].T @ vectors, vectors.T @ self.p[:steps]
        self.next_start = self.q[:steps].T @ weights[:, kept:count].sum(axis=1)
        return True
