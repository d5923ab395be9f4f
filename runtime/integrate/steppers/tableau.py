"""Coefficients of a Runge-Kutta method for the C loop, as plain arrays.

A method has `s` stages k_0 .. k_(s-1), then k_s = f(t + h, y_new), which is also the first stage
of the next step, then `e` extra stages for dense output only.  Dense output is

    y(t + theta h) = y(t) + h sum_i k_i p_i(theta),   p_i(theta) = sum_j dense[i, j] phi_j(theta)

with phi = theta, theta (1 - theta), theta^2 (1 - theta), theta^2 (1 - theta)^2, ...: a basis in
which the first column is the step itself and the others vanish at both ends, so that evaluation
is free of cancellation.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mstmm.array_validation import Array

#: Maximum number of stages of a block that C evaluates together.
MAX_LANES = 8


def to_read_only(values: ArrayLike | Sequence[Any]) -> Array:
    """Contiguous, read-only copy in double precision."""
    array = np.array(values, dtype=np.float64, order="C")
    array.flags.writeable = False
    return array


def parse_sparse_rows(text: str, columns: int) -> list[Array]:
    """Read rows of published decimals, `column:value`; every row starts with column 0."""
    rows: list[Array] = []
    for word in text.split():
        column, value = word.split(":")
        if column == "0":
            rows.append(np.zeros(columns))
        rows[-1][int(column)] = float(value)
    return rows


@dataclass(frozen=True, eq=False)
class Tableau:
    """Explicit Runge-Kutta method.

    Attributes:
        name: the `method=` of `simulate`.
        order: order of the result.
        A: (s, s), strictly lower triangular; `A[0]` is zero.
        B: (s,) weights of the step.
        C: (s,) nodes, `C[0] = 0`.
        dense: (s + 1 + e, d) dense-output weights in the basis of the module's docstring.
        dense_order: order q of the dense output: it errs by O(h^(q + 1)) within a step, so that a
            run is accurate to min(order, q + 1) everywhere.
        E: (s + 1,) weights of the error estimate; None for fixed steps only.
        error_order: order of that estimate; a step is scaled by norm**(-1 / (error_order + 1)).
        E_low: (s + 1,) second estimate of lower order, combined with E as
            E^2 / sqrt(E^2 + 0.01 E_low^2) (the 8(5,3) pair); None without.
        A_extra, C_extra: (e, s + 1 + e) and (e,) rows of the extra stages.
        beta: exponent of the previous error in the step controller, 0 for the plain one.
        iterated: (nodes, iterations) of a method whose stages after the first form so many blocks;
            each depends only on the previous block (the first on k_0) with the same weights: the
            stages of a block are evaluated together.  None for other methods.
        max_unknowns: maximum number of coordinates and speeds together, 0 for no limit.
        source: publication of the coefficients.

    Raises:
        ValueError: for shapes that do not fit, or weights that contradict each other.
    """

    name: str
    order: int
    A: Array
    B: Array
    C: Array
    dense: Array
    dense_order: int
    E: Array | None = None
    error_order: int = 0
    E_low: Array | None = None
    A_extra: Array = field(default_factory=lambda: to_read_only(np.zeros((0, 0))))
    C_extra: Array = field(default_factory=lambda: to_read_only(np.zeros(0)))
    beta: float = 0.0
    iterated: tuple[int, int] | None = None
    max_unknowns: int = 0
    source: str = ""

    def __post_init__(self) -> None:
        rows, extra = self.n_stages + 1 + self.n_extra, self.n_extra
        for label, array, shape in (
            ("A", self.A, (self.n_stages, self.n_stages)),
            ("C", self.C, (self.n_stages,)),
            ("A_extra", self.A_extra, (extra, rows if extra else self.A_extra.shape[-1])),
            ("dense", self.dense, (rows, self.n_dense)),
            ("E", self.E, (self.n_stages + 1,)),
            ("E_low", self.E_low, (self.n_stages + 1,)),
        ):
            if array is None:
                continue
            if array.shape != shape:
                raise ValueError(f"tableau {self.name}: {label} is {array.shape}, expected {shape}")
            if array.flags.writeable or not array.flags.c_contiguous:
                raise ValueError(
                    f"tableau {self.name}: {label} must be read-only; use to_read_only"
                )
        self._check_consistency()

    def _check_consistency(self) -> None:
        step = np.append(self.B, np.zeros(1 + self.n_extra))
        if np.any(np.triu(self.A)) or self.C[0] != 0.0:
            raise ValueError(f"tableau {self.name}: the method is not explicit")
        if abs(self.B.sum() - 1.0) > 1e-13 or np.abs(self.A.sum(1) - self.C).max() > 1e-12:
            raise ValueError(f"tableau {self.name}: sum(B) = 1 or sum(A[i]) = C[i] does not hold")
        if np.abs(self.dense[:, 0] - step).max() > 1e-13:
            raise ValueError(f"tableau {self.name}: dense output differs from the step at its end")
        if self.iterated is not None and not self._is_iterated(*self.iterated):
            raise ValueError(f"tableau {self.name}: its stages are not {self.iterated} blocks")

    def _is_iterated(self, nodes: int, iterations: int) -> bool:
        if not 1 <= nodes <= MAX_LANES or iterations < 2 or self.n_stages != 1 + nodes * iterations:
            return False
        expected = np.zeros_like(self.A)
        expected[1 : 1 + nodes, 0] = self.C[1 : 1 + nodes]
        for block in range(1, iterations):
            block_start, previous_start = 1 + block * nodes, 1 + (block - 1) * nodes
            expected[block_start : block_start + nodes, previous_start:block_start] = self._block(
                nodes
            )
        nodes_repeat = np.array_equal(self.C[1:], np.tile(self.C[1 : 1 + nodes], iterations))
        return nodes_repeat and np.array_equal(self.A, expected)

    def _block(self, nodes: int) -> Array:
        return self.A[1 + nodes : 1 + 2 * nodes, 1 : 1 + nodes]

    @property
    def block_weights(self) -> Array:
        """Weights (nodes, 8) of an iterated method's blocks, transposed for eight lanes."""
        nodes = self.iterated[0] if self.iterated else 0
        mix = np.zeros((nodes, MAX_LANES))
        mix[:, :nodes] = self._block(nodes).T
        return mix

    @property
    def shared_blocks(self) -> list[int]:
        """1 for every block of an iterated method that more than the next block reads, else 0."""
        nodes, iterations = self.iterated or (1, 0)
        reading_rows = [self.B, np.abs(self.dense).sum(axis=1), np.abs(self.A_extra).sum(axis=0)]
        reading_rows += [row for row in (self.E, self.E_low) if row is not None]
        blocks = [slice(1 + i * nodes, 1 + (i + 1) * nodes) for i in range(iterations)]
        return [int(any(np.any(row[block]) for row in reading_rows)) for block in blocks]

    def _rows(self) -> list[Array]:
        empty = np.zeros(0)
        rows = [*self.A[1:], self.B]
        rows += [empty if row is None else row for row in (self.E, self.E_low)]
        return [*rows, *self.A_extra, *self.dense.T]

    @cached_property
    def rows(self) -> tuple[list[int], list[int], Array]:
        """Starts, columns and weights of the sparse rows of `mstmm_tableau` in C."""
        rows = self._rows()
        starts, columns, weights = [0], list[int](), list[float]()
        for row in rows:
            nonzero_columns = np.flatnonzero(row)
            columns += nonzero_columns.tolist()
            weights += row[nonzero_columns].tolist()
            starts.append(len(columns))
        return starts, columns, to_read_only(weights)

    @property
    def implicit(self) -> bool:
        """True if steps need a tangent of the equations of motion."""
        return False

    @property
    def n_stages(self) -> int:
        """Number of stages s of the step."""
        return len(self.B)

    @property
    def n_extra(self) -> int:
        """Number of extra stages e of the dense output."""
        return len(self.C_extra)

    @property
    def n_dense(self) -> int:
        """Degree d of the dense output in theta."""
        return int(self.dense.shape[1])

    @property
    def adaptive(self) -> bool:
        """True if the method estimates its error."""
        return self.E is not None

    def weights(self, theta: float) -> Array:
        """Weights p(theta) (s + 1 + e,): y(t + theta h) = y(t) + h p(theta) @ k."""
        total = np.zeros(self.dense.shape[0])
        for j in reversed(range(self.n_dense)):
            total = (total + self.dense[:, j]) * (1.0 - theta if j % 2 else theta)
        return total

    @cached_property
    def stability_polynomial(self) -> Array:
        """Coefficients of R(z), constant first: 1, b 1, b A 1, b A^2 1, ... (A is nilpotent)."""
        row, coefficients = self.B, [1.0]
        for _ in range(self.n_stages):
            coefficients.append(float(row.sum()))
            row = row @ self.A
        return to_read_only(np.trim_zeros(coefficients, "b"))

    def amplification(self, z: ArrayLike) -> NDArray[np.complex128]:
        """R(z) of one step on y' = lambda y with z = h lambda: y(t + h) = R(z) y(t)."""
        points = np.asarray(z, dtype=np.complex128)
        value = np.zeros_like(points)
        for coefficient in self.stability_polynomial[::-1]:
            value = value * points + coefficient
        return value

    @cached_property
    def real_stability_limit(self) -> float:
        """Largest x with |R(-x')| <= 1 for all 0 <= x' <= x."""
        return self._limit(-1.0 + 0.0j)

    @cached_property
    def imaginary_stability_limit(self) -> float:
        """Largest x with |R(i x')| <= 1, up to rounding, for all 0 <= x' <= x."""
        return self._limit(0.0 + 1.0j)

    def _limit(self, direction: complex) -> float:
        low, width = 0.0, 100.0
        for _ in range(4):  # find the first unstable of 1000 points, then refine 1000 times
            x = low + width * np.arange(1, 1001) / 1000
            unstable = np.abs(self.amplification(x * direction)) > 1.0 + 1e-9
            if not unstable.any():
                return float(x[-1])
            first = int(unstable.argmax())
            low, width = float(x[first]) - width / 1000, width / 1000
        return low


def hermite(B: Sequence[float] | Array, n_extra: int = 0, D: ArrayLike | None = None) -> Array:
    """Dense weights of the cubic Hermite interpolant through both ends and their slopes.

    Args:
        B: (s,) weights of the step.
        n_extra: number e of extra stages.
        D: (d - 3, s + 1 + e) corrections of higher degree, which vanish at both ends with their
            slopes, as in the 8(5,3) method of Hairer, Norsett and Wanner.

    Returns:
        (s + 1 + e, 3 or d) weights in the basis of this module.
    """
    s = len(B)
    step = np.append(np.asarray(B, dtype=np.float64), np.zeros(1 + n_extra))
    first, last = np.zeros_like(step), np.zeros_like(step)
    first[0], last[s] = 1.0, 1.0
    columns = [step, first - step, 2.0 * step - first - last]
    if D is not None:
        columns += list(np.asarray(D, dtype=np.float64))
    return to_read_only(np.stack(columns, axis=1))


def from_monomials(P: Iterable[Iterable[Any]]) -> Array:
    """Dense weights from p_i(theta) = sum_j P[i, j] theta^(j + 1), converted in exact arithmetic.

    Args:
        P: (s + 1 + e, d) coefficients of theta, theta^2, ..., exact where they are fractions.
    """
    rows = [[x if isinstance(x, Fraction) else Fraction(float(x)) for x in row] for row in P]
    degree = len(rows[0])
    basis = _basis_in_monomials(degree)
    dense = []
    for row in rows:
        remainder, weights = list(row), [Fraction(0)] * degree
        for j in reversed(range(degree)):  # phi_j has degree j + 1: strip the highest power first
            weights[j] = remainder[j] / basis[j][j]
            remainder = [r - weights[j] * b for r, b in zip(remainder, basis[j], strict=True)]
        dense.append([float(w) for w in weights])
    return to_read_only(dense)


def integrals(nodes: Sequence[Fraction]) -> list[list[Fraction]]:
    """Coefficients of theta, theta^2, ... of the integral from 0 of each Lagrange polynomial."""
    integrals_found = []
    for i, node in enumerate(nodes):
        product = [Fraction(1)]
        for j, other_node in enumerate(nodes):
            if j != i:
                shifted, scaled = [Fraction(0), *product], [other_node * x for x in product] + [0]
                product = [
                    (a - b) / (node - other_node) for a, b in zip(shifted, scaled, strict=True)
                ]
        integrals_found.append([x / (power + 1) for power, x in enumerate(product)])
    return integrals_found


def divided_difference(points: Sequence[Any]) -> list[float]:
    """Weights of the values at n points in their highest divided difference."""
    return [
        float(1 / math.prod(point - other for other in points if other != point))
        for point in points
    ]


def integrals_in_basis(nodes: Sequence[Fraction]) -> Array:
    """Dense weights (n, n) of an integral whose slope is known at n nodes."""
    return from_monomials(integrals(nodes))


def _basis_in_monomials(degree: int) -> list[list[Fraction]]:
    """Basis functions phi_j as coefficients of theta .. theta^degree."""
    power = [Fraction(0), Fraction(1), *[Fraction(0)] * (degree - 1)]  # of theta^0 .. theta^degree
    basis = [power[1:]]
    for j in range(1, degree):
        shifted = [Fraction(0), *power[:-1]]
        power = shifted if j % 2 == 0 else [p - q for p, q in zip(power, shifted, strict=True)]
        basis.append(power[1:])
    return basis
