"""Second-order displacement and rotation -1/2 eta^T g eta along a beam, in its frame.

The rates along the beam are generated kernels (`derive.flexible.beam_foreshortening`).  They are
integrated here, less the rigid motion that the conditions of the floating frame remove: in second
order, as in first, the frame is that of a section, of the chord or of the mean.

Arrays g of all pairs of shapes are computed for few sections or for sums over sections.  For given
modal coordinates a^T g b is integrated from the fields of a and b, without the pairs.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array

from ..modal_parts import chunk_slices
from . import beam_kernels
from .beam_kernels import Row, Term, Terms, add_products, kernel_terms, shape_rows
from .gauss_quadrature import Antiderivatives
from .shape_fields import ShapeFields

if TYPE_CHECKING:
    from .beam_data import Frame
    from .shape_fields import ShapeFields


# --- rates ----------------------------------------------------------------------------------------
#
# The rates are generated kernels.  That of the displacement contains the rotation, which is an
# integral itself.


class Rates:
    """Fields of a beam in its second-order rates, at points along it."""

    def __init__(self, shapes: ShapeFields) -> None:
        self._count, self._length = shapes.n, shapes.length
        self._integrals = Antiderivatives(shapes.pieces, shapes.density)
        values, slopes = (shapes.rows(self.points, d) for d in range(2))
        rotations, curvatures = (shapes.bending_rotations(self.points, d) for d in range(2))
        section = {"values": values, "slopes": rotations}
        theta = beam_kernels.evaluate("section", section)["theta"]
        rates = {"values": slopes, "slopes": curvatures}
        kappa = beam_kernels.evaluate("section", rates)["theta"]
        strain = np.concatenate([slopes[:1], slopes[1:3] - rotations])
        self._rotation_fields = shape_rows(np.concatenate([theta, kappa]))
        self._displacement_fields = shape_rows(np.concatenate([theta, strain]))
        groups = ("theta_k", "kappa_k"), ("theta_l", "kappa_l")
        self._rotation_terms = kernel_terms("turning", *groups)["dh"]
        groups = ("theta_k", "eps_k"), ("theta_l", "eps_l")
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


# --- second-order field ---------------------------------------------------------------------------


class SecondOrder:
    """Second-order field g (6, n, n) of a beam: displacement in 1/m, rotation vector.

    With `carried` the rotation is that of the inertia of the sections: all of it with rotary
    inertia, else the twist and the rotation removed by the frame conditions.
    """

    def __init__(self, shapes: ShapeFields, frames: Mapping[str, Frame]) -> None:
        self.shapes, self._frames = shapes, frames

    @cached_property
    def _rates(self) -> Rates:
        return Rates(self.shapes)

    @cached_property
    def _rigid_motion_field(self) -> Array:
        return _RigidMotion(self).removed_field(self._frames)

    def field_at(self, x: Array, carried: bool = False) -> Array:
        """g (m, 6, n, n) at sections x (m,)."""
        g = np.empty((len(x), 6, self.shapes.n, self.shapes.n))
        for chunk in chunk_slices(len(x), 12 * self.shapes.n**2):
            g[chunk] = self.sums(x[chunk], np.eye(len(x[chunk])), carried)
        return g

    def sums(self, x: Array, weights: Array, carried: bool = False) -> Array:
        """Sums (p, 6, n, n) of g over sections x (m,) with weights (p, m)."""
        rigid_sums = _rigid_motion_sums(weights.sum(axis=1), weights @ x)
        rigid = np.tensordot(rigid_sums, self._rigid_motion_field, axes=(2, 0))
        return self.from_root(x, weights, carried) - rigid

    def from_root(self, x: Array, weights: Array, carried: bool = False) -> Array:
        """`sums` of the field without displacement and rotation at x = 0."""
        sums = self._rates.sums(x, weights)
        if carried and not self.shapes.rotary:
            sums[:, 4:] = 0.0
        return sums

    def evaluate(self, x: Array, a: Array, b: Array, carried: bool = False) -> Array:
        """Values a^T g b (t, m, 6) at sections x (m,) for modal coordinates a and b (t, n)."""
        rows = len(self._rates.points) * 32
        values = np.empty((len(a), len(x), 6))
        with np.errstate(over="ignore", invalid="ignore"):  # a failed run may have diverged
            for chunk in chunk_slices(len(a), max(rows, 6 * len(x), self.shapes.n**2)):
                values[chunk] = self._bilinear_chunk(x, a[chunk], b[chunk], carried)
        return values

    def _bilinear_chunk(self, x: Array, a: Array, b: Array, carried: bool) -> Array:
        if self.shapes.n <= _FEW_SHAPES:
            pairs = (a[:, :, None] * b[:, None, :]).reshape(len(a), -1)
            g = _pair_matrix(self, x.tobytes(), carried)
            return np.asarray(pairs @ g).reshape(len(a), len(x), 6)
        values = self._rates.evaluate(x, a, b)
        if carried and not self.shapes.rotary:
            values[..., 4:] = 0.0
        rigid = np.stack([((a @ g) * b).sum(axis=1) for g in self._rigid_motion_field], axis=1)
        return values - np.tensordot(rigid, _rigid_motion_sums(np.ones(len(x)), x), axes=(1, 2))


#: Number of shapes up to which all pairs are fewer than the integration points.
_FEW_SHAPES = 25


@lru_cache(maxsize=16)
def _pair_matrix(field: SecondOrder, places: bytes, carried: bool) -> Array:
    """g at sections as a matrix (n n, m 6)."""
    g = field.field_at(np.frombuffer(places), carried)
    return np.ascontiguousarray(np.moveaxis(g, (2, 3), (0, 1)).reshape(field.shapes.n**2, -1))


def _rigid_motion_sums(weight_sums: Array, x_sums: Array) -> Array:
    """Weighted sums (p, 6, 6) over sections of a rigid motion of the origin.

    `weight_sums` (p,) are the sums of the weights, `x_sums` (p,) of the weights times x.
    """
    sums = np.multiply.outer(weight_sums, np.eye(6))
    sums[:, 1, 5], sums[:, 2, 4] = x_sums, -x_sums
    return sums


class _RigidMotion:
    """Rigid motion (6, n, n) of the origin that the frame conditions remove from the field.

    Each bending plane, the twist and the axial displacement use the frame of their own direction,
    or that of the first direction with shapes.
    """

    def __init__(self, field: SecondOrder) -> None:
        self.field, self.shapes = field, field.shapes
        self._sections: dict[float, Array] = {0.0: np.zeros((6, self.shapes.n, self.shapes.n))}

    def removed_field(self, frames: Mapping[str, Frame]) -> Array:
        rigid = np.zeros((6, self.shapes.n, self.shapes.n))
        if not frames:
            return rigid
        first = next(iter(frames.values()))
        rigid[0] = self._removed_value(0, first)
        rigid[3] = self._removed_value(3, frames.get("twist", first))
        rigid[1], rigid[5] = self._removed_line((1, 5), frames.get("y", first))
        # A rotation about y moves the axis against z.
        rigid[2], rigid[4] = self._removed_line((2, 4), frames.get("z", first))
        return rigid

    def _section(self, x: float) -> Array:
        """Field (6, n, n) from the root at one section."""
        if x not in self._sections:
            self._sections[x] = self.field.from_root(np.array([x]), np.ones((1, 1)))[0]
        return self._sections[x]

    @cached_property
    def _weights(self) -> tuple[Array, Array]:
        """Sections x and weights (5, m) of the mean frame.

        The weights are mass, mass times x, rotary inertia about y and z, and the weight of twist:
        polar inertia, or mass without any.
        """
        x, w = self.shapes.rule()
        sections = self.shapes.sections(x)
        mass, (polar, about_y, about_z) = sections.mass_per_length, sections.rho_I
        twist = polar if polar.all() else mass
        return x, w * np.stack([mass, mass * x, about_y, about_z, twist])

    @cached_property
    def _sums(self) -> Array:
        """Sums (5, 6, n, n) of the field from the root with the weights of the mean frame."""
        return self.field.from_root(*self._weights, carried=True)

    def _removed_value(self, row: int, frame: Frame) -> Array:
        """Part (n, n) of a row that the frame removes: its value at a section, or its mean."""
        if frame.origin is not None:
            return self._section(frame.origin)[row]
        index = 0 if row == 0 else 4
        return np.asarray(self._sums[index, row] / self._weights[1][index].sum())

    def _removed_line(self, rows: tuple[int, int], frame: Frame) -> tuple[Array, Array]:
        """Deflection at the origin and rotation that the frame removes in a bending plane."""
        v, theta = rows
        sign = 1.0 if v == 1 else -1.0  # v' = theta_z, w' = -theta_y
        if frame.kind == "tangent":
            section = self._section(frame.x)
            slope = section[theta]
            return section[v] - sign * frame.x * slope, slope
        if frame.kind == "chord":
            length = self.shapes.length
            tip_deflection = self._section(length)[v]
            return np.zeros_like(tip_deflection), sign * tip_deflection / length
        (x, weights), rotary = self._weights, 3 if v == 1 else 2
        mass, first, inertia = weights[0].sum(), weights[1].sum(), weights[rotary].sum()
        matrix = np.array([[mass, first], [first, weights[1] @ x + inertia]])
        right = np.stack([self._sums[0, v], self._sums[1, v] + sign * self._sums[rotary, theta]])
        origin, slope = np.tensordot(np.linalg.inv(matrix), right, axes=1)
        return origin, sign * slope


__all__ = ["SecondOrder"]
