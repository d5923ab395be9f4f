"""Rates along a beam of what is of second order, by the generated kernels, and their integrals from
the root.

The rate of the displacement contains the rotation, which is an integral itself.
"""

from __future__ import annotations

import numpy as np

from mstmm.array_validation import Array

from . import beam_kernels
from .gauss_quadrature import Antiderivatives
from .multilinear import Row, Term, Terms, add_products, rows_of, terms
from .shape_fields import ShapeFields


class Rates:
    """The fields of a beam that rates of second order are made of, at points along it."""

    def __init__(self, shapes: ShapeFields) -> None:
        self._n, self._length = shapes.n, shapes.length
        self._integrals = Antiderivatives(shapes.pieces, shapes.density)
        values, slopes, bends = (shapes.rows(self.points, d) for d in range(3))
        theta = beam_kernels.evaluate("section", {"values": values, "slopes": slopes[1:3]})["theta"]
        kappa = beam_kernels.evaluate("section", {"values": slopes, "slopes": bends[1:3]})["theta"]
        self._turning = rows_of(np.concatenate([theta, kappa]))
        self._drawing = rows_of(np.concatenate([theta, slopes[:1]]))
        self._dh = terms("turning", ("theta_k", "kappa_k"), ("theta_l", "kappa_l"))["dh"]
        drawing = terms("drawing", ("theta_k", "stretch_k"), ("theta_l", "stretch_l"), ("h",))
        self._dg = drawing["dg"]
        self._lever = _factors_of_last(self._dg)

    @property
    def points(self) -> Array:
        """(N,) places along the beam, m."""
        return self._integrals.points

    def sums(self, x: Array, weights: Array) -> Array:
        """(p, 6, n, n): sums over sections x (m,) with weights (p, m) of g of all pairs of shapes,
        displacement and rotation from the root."""
        order = np.argsort(x)
        x = np.clip(x[order], 0.0, self._length)
        once, twice = self._integrals.weights(x, weights[:, order])
        found = np.zeros((len(weights), 6, self._n, self._n))
        for (row,), whole in self._dh.items():
            both = np.zeros((2 * len(weights), self._n, self._n))
            _add(both, self._turning, whole, np.concatenate([once, twice]))
            found[:, 3 + row], carried = np.split(both, 2)
            for place in np.flatnonzero(self._lever[:, row]):
                found[:, place] += self._lever[place, row] * carried
        for (row,), whole in self._dg.items():
            _add(found[:, row], self._drawing, whole, once)
        return found

    def of(self, x: Array, a: Array, b: Array) -> Array:
        """(t, m, 6) numbers a^T g b at sections x (m,) for modal coordinates a and b (t, n)."""
        order = np.argsort(x)
        x = np.clip(x[order], 0.0, self._length)
        turned, carried = self._integrals.of(_rates(self._dh, self._turning, a, b), x)
        drawn, _ = self._integrals.of(_rates(self._dg, self._drawing, a, b), x)
        drawn += np.tensordot(self._lever, carried, axes=1)
        found = np.empty((len(a), len(x), 6))
        found[:, order] = np.moveaxis(np.concatenate([drawn, turned]), 0, 2)
        return found


def _add(found: Array, rows: list[Row], whole: tuple[Term, ...], weights: Array) -> None:
    for factor, (k, other, *_) in whole:
        if k is not None and other is not None:
            add_products(found, rows[k], rows[other], factor * weights)


def _rates(rates: Terms, rows: list[Row], a: Array, b: Array) -> Array:
    """(3, t, N) by motions a and b (t, n)."""
    of_a, of_b = ([m[:, some] @ values for some, values in rows] for m in (a, b))
    found = np.zeros((3, *of_a[0].shape))
    for (row,), whole in rates.items():
        for factor, (k, other, *_) in whole:
            if k is not None and other is not None and len(rows[k][0]) and len(rows[other][0]):
                found[row] += factor * of_a[k] * of_b[other]
    return found


def _factors_of_last(rates: Terms) -> Array:
    """(3, 3) factors of the last group, which stands alone."""
    found = np.zeros((3, 3))
    for (row,), whole in rates.items():
        for factor, entries in whole:
            if entries[-1] is not None:
                found[row, entries[-1]] = factor
    return found
