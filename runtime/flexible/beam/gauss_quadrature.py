"""Gauss quadrature and antiderivatives along a beam."""

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

#: Function: half-waves per metre between two positions (m).
Density: TypeAlias = Callable[[float, float], float]

#: Largest number of half-waves per Gauss rule.
_MAX_HALF_WAVES = 8.0


@lru_cache(maxsize=64)
def gauss_rule(points: int) -> tuple[Array, Array]:
    """Nodes and weights of a Gauss rule on 0 to 1."""
    nodes, weights = np.polynomial.legendre.leggauss(points)
    return (nodes + 1.0) / 2.0, weights / 2.0


def shape_density(shapes: Sequence[Shape]) -> Density:
    """Largest density of half-waves of the shapes that are not zero in an interval."""
    spans = [(min(s.breaks), max(s.breaks), s.density) for s in shapes]

    def max_density(a: float, b: float) -> float:
        return max((d for first, last, d in spans if first < b and a < last), default=0.0)

    return max_density


def gauss_points(places: Iterable[float], density: Density) -> tuple[Array, Array]:
    """Gauss points and weights (m) for products of two shapes, between given positions (m).

    `places` are ascending; `density` gives the half-waves per metre between two of them.  Long
    pieces are divided, because rules of high order lose digits.
    """
    points, point_weights = [], []
    for a, b in pairwise(places):
        waves = density(a, b)
        count = _cell_count(a, b, waves)
        h = (b - a) / count
        nodes, weights = gauss_rule(8 + int(np.ceil(3.0 * h * waves)))
        points.append((a + h * (np.arange(count)[:, None] + nodes)).ravel())
        point_weights.append(np.tile(h * weights, count))
    return np.concatenate(points), np.concatenate(point_weights)


def _cell_count(a: float, b: float, waves: float) -> int:
    return max(1, int(np.ceil((b - a) * waves / _MAX_HALF_WAVES)))


class Antiderivatives:
    """First and second integrals along a beam, from its first position to any x.

    The integrands are products of two shapes, known at `points` (N,) (m).
    """

    def __init__(self, places: Iterable[float], density: Density) -> None:
        self._cells: list[_Cell] = []
        count = 0
        for a, b in pairwise(places):
            waves = density(a, b)
            cells = _cell_count(a, b, waves)
            h = (b - a) / cells
            order = 16 + int(np.ceil(5.0 * h * waves))
            for start in a + h * np.arange(cells):
                self._cells.append(_Cell(float(start), h, slice(count, count + order)))
                count += order
        self.points = np.concatenate([cell.points for cell in self._cells])

    def integrate(self, values: Array, x: Array) -> tuple[Array, Array]:
        """First and second integrals (..., m) at ascending x (m,), of values (..., N) at points."""
        once, twice = (np.empty((*values.shape[:-1], len(x))) for _ in range(2))
        total, moment = (np.zeros((*values.shape[:-1], 1)) for _ in range(2))
        for cell, inside in self._cells_with_points(x):
            cell_values = values[..., cell.selection]
            first, second = cell.partial(x[inside])
            once[..., inside] = total + cell_values @ first.T
            twice[..., inside] = total * x[inside] - moment + cell_values @ second.T
            total = total + (cell_values @ cell.weights)[..., None]
            moment = moment + (cell_values @ (cell.weights * cell.points))[..., None]
        return once, twice

    def weights(self, x: Array, of_places: Array) -> tuple[Array, Array]:
        """Weights (p, N) of the points in weighted sums of the first and of the second integral.

        The sums run over ascending x (m,), with the weights `of_places` (p, m).
        """
        once, twice = (np.empty((len(of_places), len(self.points))) for _ in range(2))
        total, moment = (np.zeros((len(of_places), 1)) for _ in range(2))
        for cell, inside in reversed(list(self._cells_with_points(x))):
            cell_places = of_places[:, inside]
            first, second = cell.partial(x[inside])
            once[:, cell.selection] = cell_places @ first + total * cell.weights
            twice[:, cell.selection] = (
                cell_places @ second + (moment - total * cell.points) * cell.weights
            )
            total = total + cell_places.sum(axis=1)[:, None]
            moment = moment + (cell_places @ x[inside])[:, None]
        return once, twice

    def _cells_with_points(self, x: Array) -> Iterator[tuple[_Cell, slice]]:
        """Cells with the slice of x inside each; the last cell includes its end."""
        firsts = np.searchsorted(x, [cell.start for cell in self._cells[1:]])
        for cell, first, end in zip(self._cells, (0, *firsts), (*firsts, len(x)), strict=True):
            yield cell, slice(first, end)


class _Cell:
    """Part of a beam with one Gauss rule."""

    def __init__(self, start: float, length: float, selection: slice) -> None:
        self.start, self.length, self.selection = start, length, selection
        nodes, weights, *self._integrals = _partial_integrals(selection.stop - selection.start)
        self.points, self.weights = start + length * nodes, length * weights

    def partial(self, x: Array) -> tuple[Array, Array]:
        """Weights (m, .) of the first and second integral from the start of the cell to x (m,)."""
        first, second = self._integrals
        if not len(x):
            return np.zeros((0, first.shape[1])), np.zeros((0, first.shape[1]))
        positions = np.maximum(2 * (x - self.start) / self.length - 1, -1.0)
        values = legendre.legvander(positions, len(second) - 1)
        values[positions == -1.0] = 0.0
        return self.length * values[:, : len(first)] @ first, self.length**2 * values @ second


@lru_cache(maxsize=64)
def _partial_integrals(count: int) -> tuple[Array, Array, Array, Array]:
    """Gauss rule on 0 to 1, and integrals of its Lagrange polynomials.

    Nodes, weights, and Legendre coefficients (:, count) of the first and second integral from 0 of
    the polynomial that is 1 at one node and 0 at the others.
    """
    nodes, weights = gauss_rule(count)
    degrees = 2 * np.arange(count) + 1
    values = legendre.legvander(2 * nodes - 1, count - 1)
    coefficients = (degrees * values * weights[:, None]).T
    first = legendre.legint(coefficients, lbnd=-1, scl=1, axis=0) / 2
    second = legendre.legint(first, lbnd=-1, scl=1, axis=0) / 2
    return nodes, weights, first, second
