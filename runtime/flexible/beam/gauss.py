"""Gauss rules along a beam."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.polynomial import legendre

from ..modal_body import Array

if TYPE_CHECKING:
    from .shapes import Shape

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


def antiderivatives(
    places: Iterable[float], density: Density, x: Array
) -> tuple[Array, Array, Array]:
    """(points (N,), once (m, N), twice (m, N)): from values f of products of two shapes at the
    points, once @ f is the integral of f from the first place to every x, and twice @ f that of
    (x - t) f(t) dt, the integral of the integral."""
    points, once, twice = [], [], []
    for a, b in pairwise(places):
        waves = density(a, b)
        cuts = _cuts(a, b, waves)
        h = (b - a) / cuts
        for start in a + h * np.arange(cuts):
            nodes, weights, first, second = _partial(16 + int(np.ceil(5.0 * h * waves)))
            ours, weights = start + h * nodes, h * weights
            beyond = (x >= start + h)[:, None]
            part, whole = beyond * weights, beyond * weights * (x[:, None] - ours)
            inside = (x > start) & (x < start + h)
            at = 2 * (x[inside] - start) / h - 1
            part[inside] = h * legendre.legval(at, first).T
            whole[inside] = h**2 * legendre.legval(at, second).T
            points.append(ours)
            once.append(part)
            twice.append(whole)
    return np.concatenate(points), np.concatenate(once, axis=1), np.concatenate(twice, axis=1)


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
