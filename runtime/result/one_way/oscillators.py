"""Exact motion of damped oscillators under piecewise polynomial loads.

M etadd + D etad + K eta = p(t). In the eigenvectors of its first-order form every component obeys
yd = lambda y + sum c_j s^j, whose solution over a cell is evaluated without steps: the only errors
are those of the polynomials, whatever the frequencies.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array

#: Sampling points of a load in each cell: a polynomial of degree 5.
POINTS_PER_CELL = 6
#: Larger condition numbers of the eigenvectors indicate critically damped oscillators.
_MAX_CONDITION = 1e7


@dataclass(frozen=True)
class Cells:
    """Intervals of time on each of which loads are one polynomial.

    `edges` (m + 1,) s, increasing; `breaks` are indices of edges at which loads may jump.
    """

    edges: Array
    breaks: frozenset[int]

    @classmethod
    def from_times(cls, times: Array, cells: int) -> Cells:
        """Cells from the first to the last of `times`, about `cells`, with edges at all times."""
        share = np.diff(times) / (times[-1] - times[0])
        counts = np.maximum(np.ceil(cells * share), 1).astype(int)
        parts = [
            np.linspace(a, b, n, endpoint=False)
            for a, b, n in zip(times[:-1], times[1:], counts, strict=True)
        ]
        break_positions = np.cumsum(counts)[:-1]
        return cls(np.concatenate([*parts, times[-1:]]), frozenset(break_positions.tolist()))

    @property
    def lengths(self) -> Array:
        """Cell lengths (m,) in s."""
        return np.diff(self.edges)

    @property
    def samples(self) -> Array:
        """Times (m * POINTS_PER_CELL,) of the load samples, inside the cells (Gauss points)."""
        nodes = (np.polynomial.legendre.leggauss(POINTS_PER_CELL)[0] + 1) / 2
        return np.asarray((self.edges[:-1, None] + self.lengths[:, None] * nodes).reshape(-1))

    def polynomials(self, values: Array) -> Array:
        """Coefficients (m, POINTS_PER_CELL, n) of (s / length)^j from values at `samples`.

        `values` is (m * POINTS_PER_CELL, n).
        """
        nodes = (np.polynomial.legendre.leggauss(POINTS_PER_CELL)[0] + 1) / 2
        inverse = np.linalg.inv(np.vander(nodes, increasing=True))
        by_cell = values.reshape(len(self.lengths), POINTS_PER_CELL, -1)
        return np.asarray(np.einsum("jp,cpn->cjn", inverse, by_cell))

    def jumps(self, coefficients: Array) -> Array:
        """Largest jump (n,) of the polynomials at edges where loads are smooth: their error."""
        before, after = coefficients.sum(axis=1)[:-1], coefficients[1:, 0]
        smooth_edges = [k - 1 for k in range(1, len(self.edges) - 1) if k not in self.breaks]
        return np.asarray(np.max(np.abs(after - before)[smooth_edges], axis=0, initial=0.0))

    def find(self, times: Array) -> NDArray[np.int64]:
        """Cell index of each time; an edge belongs to the next cell, the last edge to the last."""
        indices = np.searchsorted(self.edges, times, side="right") - 1
        return np.clip(indices, 0, len(self.lengths) - 1)


@dataclass(frozen=True)
class Oscillators:
    """Coefficients (n, n): stiffness and mass symmetric and definite, damping symmetric."""

    stiffness: Array
    damping: Array
    mass: Array

    @cached_property
    def modes(self) -> tuple[Array, Array]:
        """Frequencies (n,) in rad/s and mode shapes (n, n) with unit modal mass, undamped."""
        from scipy import linalg

        squares, shapes = linalg.eigh(self.stiffness, self.mass)
        return np.sqrt(squares), shapes

    @cached_property
    def _first_order(self) -> tuple[Any, Any, Any]:
        """Eigenvalues lambda (2n,), eigenvectors, and their inverse, over [eta; etad].

        In undamped modes.
        """
        omega, shapes = self.modes
        n, damping = len(omega), shapes.T @ self.damping @ shapes
        while True:
            matrix = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(omega**2), -damping]])
            scale = np.concatenate([np.ones(n), omega])
            roots, vectors = np.linalg.eig(matrix * scale / scale[:, None])
            if np.linalg.cond(vectors) < _MAX_CONDITION:
                vectors = vectors * scale[:, None]
                return roots, vectors, np.linalg.inv(vectors)
            damping = damping * (1 + 1e-9) + 1e-12 * np.diag(omega)

    def motion(self, cells: Cells, loads: Array, start: tuple[Array, Array], times: Array) -> Array:
        """Motion (3, times, n): eta, etad, etadd at `times`.

        `start` = (eta, etad) at the first edge, and `loads` (m, POINTS_PER_CELL, n) are the
        coefficients of the polynomials.
        """
        roots, vectors, inverse = self._first_order
        shapes = self.modes[1]
        n = len(shapes)
        forcing = np.einsum("kj,cpi,ij->cpk", inverse[:, n:], loads, shapes)
        projection = shapes.T @ self.mass
        state = inverse @ np.concatenate([projection @ start[0], projection @ start[1]])
        starts = [state]
        growth, weights = _propagation(roots, cells.lengths, cells.lengths)
        for cell in range(len(cells.lengths)):
            state = growth[cell] * state + np.sum(weights[cell] * forcing[cell], axis=0)
            starts.append(state)
        cell_indices = cells.find(times)
        offsets = times - cells.edges[cell_indices]
        growth, weights = _propagation(roots, offsets, cells.lengths[cell_indices])
        states = growth * np.array(starts)[cell_indices] + np.sum(
            weights * forcing[cell_indices], axis=1
        )
        shares = (offsets / cells.lengths[cell_indices])[:, None] ** np.arange(POINTS_PER_CELL)
        load_values = np.einsum("tp,tpk->tk", shares, forcing[cell_indices])
        rates = states * roots + load_values
        components = np.stack(
            [states @ vectors[:n].T, states @ vectors[n:].T, rates @ vectors[n:].T]
        )
        return np.asarray(components.real @ shapes.T)


def _propagation(roots: Any, lengths: Array, whole: Array) -> tuple[Any, Any]:
    """Propagators e^(lambda s) (m, 2n), and integrals of the powers (m, POINTS_PER_CELL, 2n).

    The integrals are int_0^s e^(lambda (s - r)) (r / whole)^j dr.
    """
    z = lengths[:, None] * roots
    growth = np.exp(z)
    share = (lengths / whole)[:, None]
    is_large = np.abs(z) > 2.0
    safe_z = np.where(is_large, z, 1.0)
    recursive, series, integrals = (growth - 1) / safe_z, 0.0, []
    for j in range(POINTS_PER_CELL):
        if j:
            recursive = (j * recursive - 1) / safe_z
        series, term = np.zeros_like(z), np.full_like(z, 1 / (j + 1))
        for k in range(30):
            series = series + term
            term = term * np.where(is_large, 0.0, z) / (j + 2 + k)
        integral = np.where(is_large, recursive, series)
        integrals.append(integral * lengths[:, None] * share**j)
    return growth, np.stack(integrals, axis=1)
