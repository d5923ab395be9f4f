"""Rates of the second-order field along a beam, and their integrals from the root.

The rates are generated kernels.  That of the displacement contains the rotation, which is an
integral itself.
"""

from __future__ import annotations

import numpy as np

from mstmm.array_validation import Array

from . import beam_kernels
from .gauss_quadrature import Antiderivatives
from .multilinear import Row, Term, Terms, add_products, kernel_terms, shape_rows
from .shape_fields import ShapeFields


class Rates:
    """Fields of a beam in its second-order rates, at points along it."""

    def __init__(self, shapes: ShapeFields) -> None:
        self._count, self._length = shapes.n, shapes.length
        self._integrals = Antiderivatives(shapes.pieces, shapes.density)
        values, slopes, curvatures = (shapes.rows(self.points, d) for d in range(3))
        theta = beam_kernels.evaluate("section", {"values": values, "slopes": slopes[1:3]})["theta"]
        rates = {"values": slopes, "slopes": curvatures[1:3]}
        kappa = beam_kernels.evaluate("section", rates)["theta"]
        self._rotation_fields = shape_rows(np.concatenate([theta, kappa]))
        self._displacement_fields = shape_rows(np.concatenate([theta, slopes[:1]]))
        groups = ("theta_k", "kappa_k"), ("theta_l", "kappa_l")
        self._rotation_terms = kernel_terms("turning", *groups)["dh"]
        groups = ("theta_k", "stretch_k"), ("theta_l", "stretch_l")
        self._displacement_terms = kernel_terms("drawing", *groups, ("h",))["dg"]
        self._rotation_factors = _last_group_factors(self._displacement_terms)

    @property
    def points(self) -> Array:
        """Integration points (N,) along the beam, m."""
        return self._integrals.points

    def sums(self, x: Array, weights: Array) -> Array:
        """Weighted sums (p, 6, n, n) of g of all pairs of shapes over sections x (m,).

        `weights` are (p, m); displacement and rotation are relative to the root.
        """
        order = np.argsort(x)
        x = np.clip(x[order], 0.0, self._length)
        once, twice = self._integrals.weights(x, weights[:, order])
        sums = np.zeros((len(weights), 6, self._count, self._count))
        for (row,), terms in self._rotation_terms.items():
            integrals = np.zeros((2 * len(weights), self._count, self._count))
            _add_terms(integrals, self._rotation_fields, terms, np.concatenate([once, twice]))
            sums[:, 3 + row], twice_integrated = np.split(integrals, 2)
            for axis in np.flatnonzero(self._rotation_factors[:, row]):
                sums[:, axis] += self._rotation_factors[axis, row] * twice_integrated
        for (row,), terms in self._displacement_terms.items():
            _add_terms(sums[:, row], self._displacement_fields, terms, once)
        return sums

    def evaluate(self, x: Array, a: Array, b: Array) -> Array:
        """Values a^T g b (t, m, 6) at sections x (m,) for modal coordinates a and b (t, n)."""
        order = np.argsort(x)
        x = np.clip(x[order], 0.0, self._length)
        rates = _evaluate_rates(self._rotation_terms, self._rotation_fields, a, b)
        rotation, integral = self._integrals.integrate(rates, x)
        rates = _evaluate_rates(self._displacement_terms, self._displacement_fields, a, b)
        displacement, _ = self._integrals.integrate(rates, x)
        displacement += np.tensordot(self._rotation_factors, integral, axes=1)
        values = np.empty((len(a), len(x), 6))
        values[:, order] = np.moveaxis(np.concatenate([displacement, rotation]), 0, 2)
        return values


def _add_terms(total: Array, rows: list[Row], terms: tuple[Term, ...], weights: Array) -> None:
    for factor, (first, second, *_) in terms:
        if first is not None and second is not None:
            add_products(total, rows[first], rows[second], factor * weights)


def _evaluate_rates(rate_terms: Terms, rows: list[Row], a: Array, b: Array) -> Array:
    """Rates (3, t, N) at the points for modal coordinates a and b (t, n)."""
    of_a, of_b = ([eta[:, indices] @ values for indices, values in rows] for eta in (a, b))
    rates = np.zeros((3, *of_a[0].shape))
    for (row,), terms in rate_terms.items():
        for factor, (k, m, *_) in terms:
            if k is not None and m is not None and len(rows[k][0]) and len(rows[m][0]):
                rates[row] += factor * of_a[k] * of_b[m]
    return rates


def _last_group_factors(rates: Terms) -> Array:
    """Factors (3, 3) of the last group of inputs, which occurs without other factors."""
    factors = np.zeros((3, 3))
    for (row,), terms in rates.items():
        for factor, entries in terms:
            if entries[-1] is not None:
                factors[row, entries[-1]] = factor
    return factors
