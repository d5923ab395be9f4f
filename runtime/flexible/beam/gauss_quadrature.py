"""Gauss rules along a beam."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.polynomial import legendre

from mstmm.array_validation import Array

if TYPE_CHECKING:
    from .shape_functions import Shape

#: Half-waves per metre between two places (m).
Density: TypeAlias = Callable[[float, float], float]

#: Half-waves that one Gauss rule covers at most.
_WAVES = 8.0


@lru_cache(maxsize=64)
def gauss(points: int) -> tuple[Array, Array]:
    """Nodes and weights of the Gauss rule on 0 to 1."""
    nodes, weights = np.polynomial.legendre.leggauss(points)
    return (nodes + 1.0) / 2.0, weights / 2.0


def density_of(shapes: Sequence[Shape]) -> Density:
    """The half-waves per metre of the shapes that are not zero there."""
    spans = [(min(s.breaks), max(s.breaks), s.density) for s in shapes]

    def between(a: float, b: float) -> float:
        return max((d for first, last, d in spans if first < b and a < last), default=0.0)

    return between


def gauss_between(places: Iterable[float], density: Density) -> tuple[Array, Array]:
    """Gauss points and weights (m) between neighbouring places, for products of two shapes with
    `density` half-waves per metre; long pieces are cut, for rules of high order lose digits."""
    xs, ws = [], []
    for a, b in pairwise(places):
        waves = density(a, b)
        cuts = _cuts(a, b, waves)
        h = (b - a) / cuts
        nodes, weights = gauss(8 + int(np.ceil(3.0 * h * waves)))
        xs.append((a + h * (np.arange(cuts)[:, None] + nodes)).ravel())
        ws.append(np.tile(h * weights, cuts))
    return np.concatenate(xs), np.concatenate(ws)


def _cuts(a: float, b: float, waves: float) -> int:
    return max(1, int(np.ceil((b - a) * waves / _WAVES)))


class Antiderivatives:
    """Integrals along a beam from its first place to any x, and the integrals of these, of products
    of two shapes that are known at `points` (N,)."""

    def __init__(self, places: Iterable[float], density: Density) -> None:
        self._cells: list[_Cell] = []
        count = 0
        for a, b in pairwise(places):
            waves = density(a, b)
            cuts = _cuts(a, b, waves)
            h = (b - a) / cuts
            order = 16 + int(np.ceil(5.0 * h * waves))
            for start in a + h * np.arange(cuts):
                self._cells.append(_Cell(float(start), h, slice(count, count + order)))
                count += order
        self.points = np.concatenate([cell.points for cell in self._cells])

    def of(self, values: Array, x: Array) -> tuple[Array, Array]:
        """Once and twice integrated (..., m) at x (m,), ascending, from values (..., N) at the
        points."""
        once, twice = (np.empty((*values.shape[:-1], len(x))) for _ in range(2))
        whole, lever = (np.zeros((*values.shape[:-1], 1)) for _ in range(2))
        for cell, inside in self._places(x):
            own = values[..., cell.known]
            first, second = cell.partial(x[inside])
            once[..., inside] = whole + own @ first.T
            twice[..., inside] = whole * x[inside] - lever + own @ second.T
            whole = whole + (own @ cell.weights)[..., None]
            lever = lever + (own @ (cell.weights * cell.points))[..., None]
        return once, twice

    def weights(self, x: Array, of_places: Array) -> tuple[Array, Array]:
        """Weights (p, N) of the points in sums over x (m,), ascending, weighted by `of_places`
        (p, m), of what is once integrated and of what is twice."""
        once, twice = (np.empty((len(of_places), len(self.points))) for _ in range(2))
        whole, lever = (np.zeros((len(of_places), 1)) for _ in range(2))
        for cell, inside in reversed(list(self._places(x))):
            own = of_places[:, inside]
            first, second = cell.partial(x[inside])
            once[:, cell.known] = own @ first + whole * cell.weights
            twice[:, cell.known] = own @ second + (lever - whole * cell.points) * cell.weights
            whole = whole + own.sum(axis=1)[:, None]
            lever = lever + (own @ x[inside])[:, None]
        return once, twice

    def _places(self, x: Array) -> Iterator[tuple[_Cell, slice]]:
        """Every cell with the x that lie in it; the last one's end is in it."""
        firsts = np.searchsorted(x, [cell.start for cell in self._cells[1:]])
        for cell, first, end in zip(self._cells, (0, *firsts), (*firsts, len(x)), strict=True):
            yield cell, slice(first, end)


class _Cell:
    """A stretch of a beam with a Gauss rule of its own."""

    def __init__(self, start: float, length: float, known: slice) -> None:
        self.start, self.length, self.known = start, length, known
        nodes, weights, *self._integrals = _partial(known.stop - known.start)
        self.points, self.weights = start + length * nodes, length * weights

    def partial(self, x: Array) -> tuple[Array, Array]:
        """Weights (m, .) of the first and the second integral from the start to x (m,)."""
        first, second = self._integrals
        if not len(x):
            return np.zeros((0, first.shape[1])), np.zeros((0, first.shape[1]))
        at = np.maximum(2 * (x - self.start) / self.length - 1, -1.0)
        values = legendre.legvander(at, len(second) - 1)
        values[at == -1.0] = 0.0
        return self.length * values[:, : len(first)] @ first, self.length**2 * values @ second


@lru_cache(maxsize=64)
def _partial(count: int) -> tuple[Array, Array, Array, Array]:
    """Nodes and weights on 0 to 1; Legendre coefficients (:, count) of the first and the second
    integral from 0 of the polynomial that is 1 at one node and 0 at the others."""
    nodes, weights = gauss(count)
    degrees = 2 * np.arange(count) + 1
    values = legendre.legvander(2 * nodes - 1, count - 1)
    of_node = (degrees * values * weights[:, None]).T
    first = legendre.legint(of_node, lbnd=-1, scl=1, axis=0) / 2
    second = legendre.legint(first, lbnd=-1, scl=1, axis=0) / 2
    return nodes, weights, first, second
