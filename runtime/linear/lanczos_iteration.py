"""Lanczos' method with the inverse of K - sigma M, in the inner product of M.

Every step is one solution and one product.  All vectors are kept orthogonal, against each other and
against motions that are known, so that another run finds what the first one missed: of motions with
equal frequencies it sees one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh_tridiagonal

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure

from .matrix_operators import Pencil

#: Residuals of motions that are found, in parts of 1/(omega^2 - sigma).
_CLOSE = 1e-9
#: What is left of a vector is rounding below this part of it.
_NOTHING = 1e-13
#: Steps between looks at what is found, most vectors for each motion wanted, and most runs.
_LOOK, _VECTORS, _ROOM, _RUNS = 4, 4, 60, 30


@dataclass(frozen=True)
class ConvergedPairs:
    """omega^2 (k,) rising, shapes (n, k) with unit modal mass, and M times them as rows (k, n)."""

    squares: Array
    shapes: Array
    pushed: Array

    @classmethod
    def none(cls, n: int) -> ConvergedPairs:
        """Nothing yet."""
        return cls(np.zeros(0), np.zeros((n, 0)), np.zeros((0, n)))

    def joined(self, squares: Array, shapes: Array, pushed: Array) -> ConvergedPairs:
        """With others, that rise."""
        if not len(self.squares):
            return ConvergedPairs(squares, shapes, pushed)
        every = np.concatenate([self.squares, squares])
        order = np.argsort(every, kind="stable")
        return ConvergedPairs(
            every[order],
            np.hstack([self.shapes, shapes])[:, order],
            np.vstack([self.pushed, pushed])[order],
        )


def slowest(
    pencil: Pencil, wanted: int, sigma: float, edge: float, trial: int, known: ConvergedPairs
) -> ConvergedPairs:
    """Those that are known and, beside them, the `wanted` motions with omega^2 next to sigma, or
    fewer if one of them lies beyond `edge` already.

    Raises NumericalFailure where the iteration does not find them.
    """
    pencil.factor(-sigma)
    start = pencil.solve(np.random.default_rng(trial).standard_normal(len(pencil)))
    found, more = known, 0
    for _ in range(_RUNS):
        run = _Run(pencil, found, start)
        run.go(wanted - more, 1 / (edge - sigma))
        squares = sigma + 1 / run.values
        found = found.joined(squares, run.shapes, run.pushed)
        more += len(squares)
        if more >= wanted or run.ended or (squares > edge).any():
            return found
        start = run.rest
    raise NumericalFailure(
        f"modes: {more} of {wanted} motions found before the iterations were exhausted; ask for "
        "fewer"
    )


class _Run:
    """A sequence of vectors q_j (rows of `q`, M q_j in `p`), orthogonal in M, in which the inverse
    is tridiagonal: `alpha`, and `beta` beside it.

    Attributes:
        values, shapes, pushed: 1/(omega^2 - sigma) of what is found, shapes and M times them.
        rest: where another run begins; `ended` says that there is no other.
    """

    def __init__(self, pencil: Pencil, known: ConvergedPairs, start: Array) -> None:
        n = len(pencil)
        self.pencil, self.known, self.rest = pencil, known, start
        self.alpha: list[float] = []
        self.beta: list[float] = []
        self.values, self.shapes, self.pushed = np.zeros(0), np.zeros((n, 0)), np.zeros((0, n))
        self.ended = False

    def go(self, wanted: int, least: float) -> None:
        """Steps until that many are found, in order, or one with 1/(omega^2 - sigma) below `least`,
        or there is no room for more vectors."""
        n = len(self.pencil)
        room = min(n - len(self.known.squares), _VECTORS * wanted + _ROOM)
        self.q, self.p = np.empty((room, n)), np.empty((room, n))
        self._next(self.rest, float(np.linalg.norm(self.rest)))
        while not self.ended:
            self._step()
            steps = len(self.alpha)
            due = steps % _LOOK == 0 and (steps > wanted or least > 0)
            if (due or self.ended or steps == room) and self._look(wanted, least):
                return

    def _step(self) -> None:
        """The inverse times the last vector, and what is new in it."""
        j = len(self.alpha)
        w = self.pencil.solve(self.p[j])
        size = float(np.linalg.norm(w))
        self.alpha.append(float(self.p[j] @ w))
        w -= self.alpha[j] * self.q[j]
        if j:
            w -= self.beta[j - 1] * self.q[j - 1]
        self.beta.append(self._next(w, size))

    def _next(self, w: Array, size: float) -> float:
        """The next vector, orthogonal to all others, and what is left of w; its size was `size`."""
        j = len(self.alpha)
        for known, pushed in ((self.known.shapes.T, self.known.pushed), (self.q[:j], self.p[:j])):
            w = w - (pushed @ w) @ known
        pushed = self.pencil.mass(w)
        square = float(w @ pushed)
        self.ended = square <= 0 or float(np.linalg.norm(w)) <= _NOTHING * size
        left = 0.0 if self.ended else float(np.sqrt(square))
        if left and j < len(self.q):
            self.q[j], self.p[j] = w / left, pushed / left
        return left

    def _look(self, wanted: int, least: float) -> bool:
        """Whether the run is at its end, and what it found."""
        steps = len(self.alpha)
        values, weights = eigh_tridiagonal(self.alpha, self.beta[:-1])
        order = np.argsort(-np.abs(values), kind="stable")
        values, weights = values[order], weights[:, order]
        close = np.abs(self.beta[-1] * weights[-1]) <= _CLOSE * np.abs(values)
        kept = min(int(np.argmin(np.append(close, False))), wanted)
        enough = kept == wanted or (np.abs(values[:kept]) < least).any()
        if not enough and not self.ended and steps < len(self.q):
            return False
        self.values, found = values[:kept], weights[:, :kept]
        self.shapes, self.pushed = self.q[:steps].T @ found, found.T @ self.p[:steps]
        self.rest = self.q[:steps].T @ weights[:, kept:wanted].sum(axis=1)
        return True
