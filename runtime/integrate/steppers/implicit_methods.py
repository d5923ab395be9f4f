"""Implicit methods by their tableaus: Rosenbrock and diagonally implicit ones.

All integrate q' = N(q) u, u' = a, 0 = R(t, q, u, a) with a tangent of R.  Stage 0 of each is the
slope at the start of the step, and k_s that at its end.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mstmm.array_validation import Array

from .tableau import Tableau, divided_difference, hermite, integrals_in_basis, to_read_only

ROSENBROCK, DIRK, ALPHA, EXPONENTIAL = 1, 2, 3, 4  # as in `c/integrate.h`

#: Inner nodes of the Lobatto rules on a step, by their order.
_LOBATTO_NODES = {4: (0.5,), 6: ((1 - math.sqrt(0.2)) / 2, (1 + math.sqrt(0.2)) / 2)}


def parse_numbers(text: str) -> Array:
    """Array of the numbers in a text, separated by blanks; fractions are allowed."""
    return np.array([float(Fraction(word)) for word in text.split()])


def lower_triangle(text: str, size: int) -> Array:
    """Strictly lower triangular matrix (size, size) from a text with its rows."""
    matrix = np.zeros((size, size))
    matrix[np.tril_indices(size, -1)] = parse_numbers(text)
    return matrix


@dataclass(frozen=True, eq=False)
class Implicit(Tableau):
    """Base class of implicit methods; see `Tableau` for the other attributes.

    Attributes:
        gamma: the diagonal of Rosenbrock and diagonally implicit methods.
        second: (s, s) a second set of weights for the stages, strictly lower triangular.
    """

    kind: ClassVar[int] = 0
    gamma: float = 0.0
    second: Array = field(default_factory=lambda: to_read_only(np.zeros((0, 0))))

    @property
    def implicit(self) -> bool:
        """True: steps need a tangent of the equations of motion."""
        return True

    @cached_property
    def real_stability_limit(self) -> float:
        """Infinite: decaying motion does not limit the step of these methods."""
        return math.inf

    @property
    def inner_nodes(self) -> Array:
        """Inner nodes of a step at which the rates of integrals are evaluated."""
        order = 4 if self.order <= 4 else 6
        return to_read_only(_LOBATTO_NODES[order])

    @property
    def quadrature(self) -> Array:
        """Weights (n + 2, d) of the rates at start, inner nodes and end in dense output.

        The dense output is that of the integrals of these rates.
        """
        nodes = [Fraction(0), *(Fraction(float(x)) for x in self.inner_nodes), Fraction(1)]
        weights = integrals_in_basis(nodes)
        return to_read_only(np.pad(weights, ((0, 0), (0, self.n_dense - weights.shape[1]))))

    @property
    def roughness(self) -> Array:
        """Weights (n + 2,) of those rates in their highest divided difference; sum |w| = 1."""
        nodes = np.array([0.0, *self.inner_nodes, 1.0])
        weights = divided_difference(nodes.tolist())
        return to_read_only(np.array(weights) / np.abs(weights).sum())

    def _rows(self) -> list[Array]:
        lower_rows = [np.tril(self.A, -1)[i] for i in range(1, self.n_stages)]
        empty = np.zeros(0)
        rows = [*lower_rows, self.B, empty if self.E is None else self.E, empty, *self.dense.T]
        return [*rows, *self.second[1:]]


@dataclass(frozen=True, eq=False)
class Rosenbrock(Implicit):
    """Rosenbrock method in the form without products by the tangent, U_i / h in its stages.

    With J the Jacobian of y' = f(t, y) and s = 1 / (gamma h) the stages solve
    (s - J) U_i = f(t + C_i h, y + A_ij U_j) + d_i h f_t + second_ij U_j / h; y + B U is the step.
    For mechanisms the mass matrix of the step's start multiplies the rows of speeds, so that
    Z = K W + C + s M is solved; f is evaluated, or its accelerations are unknowns of the stages
    and R replaces it.

    Attributes:
        d: (s,) weights of h times the partial derivative of f with respect to time.
    """

    kind: ClassVar[int] = ROSENBROCK
    d: Array = field(default_factory=lambda: to_read_only(np.zeros(0)))

    def _check_consistency(self) -> None:
        name = f"tableau {self.name}"
        if np.any(np.triu(self.A)) or np.any(np.triu(self.second)):
            raise ValueError(f"{name}: a stage depends on later ones")
        shapes = {"second": (self.second, self.A.shape), "d": (self.d, self.B.shape)}
        for label, (array, shape) in shapes.items():
            if array.shape != shape:
                raise ValueError(f"{name}: {label} is {array.shape}, expected {shape}")
        alpha, gamma = self.classical
        if abs(gamma.sum(axis=1) - self.d[1:]).max() > 1e-12:
            raise ValueError(f"{name}: d contradicts C")
        if abs(alpha.sum(axis=1) - self.C[1:]).max() > 1e-12:
            raise ValueError(f"{name}: the nodes contradict A")
        if not self.gamma > 0.0 or abs(self.weights_classical.sum() - 1.0) > 1e-12:
            raise ValueError(f"{name}: its weights do not add up to 1")

    @cached_property
    def _inverse(self) -> Array:
        """Gamma of the classical form; the second set of weights contains its inverse."""
        s = self.n_stages - 1
        inverse = np.linalg.inv(np.eye(s) / self.gamma - self.second[1:, 1:])
        return np.asarray(inverse, dtype=np.float64)

    @cached_property
    def classical(self) -> tuple[Array, Array]:
        """Coefficients (alpha, Gamma), (s - 1, s - 1) each, of the form with tangent products."""
        return np.asarray(self.A[1:, 1:] @ self._inverse), self._inverse

    @cached_property
    def weights_classical(self) -> Array:
        """Weights (s - 1,) of the step in the form with products by the tangent."""
        return np.asarray(self.B[1:] @ self._inverse)

    def amplification(self, z: ArrayLike) -> NDArray[np.complex128]:
        """R(z) of one step on y' = lambda y with z = h lambda."""
        alpha, gamma = self.classical
        return _stability_function(alpha + gamma, self.weights_classical, z)


def make_rosenbrock_pair(
    name: str,
    order: int,
    gamma: float,
    matrix: str,
    coupling: str,
    nodes: str,
    time_weights: str,
    dense: str,
    dense_order: int,
    source: str,
) -> Rosenbrock:
    """Stiffly accurate pair from published numbers: the last stage is the error of the step.

    `matrix` and `coupling` are the rows of A and C, `time_weights` d, `dense` H of
    `make_rosenbrock`.
    """
    stage_count = len(nodes.split())
    A = lower_triangle(matrix, stage_count)
    return make_rosenbrock(
        name, order, gamma, A, lower_triangle(coupling, stage_count), parse_numbers(nodes),
        parse_numbers(time_weights), B=[*A[-1][:-1], 1.0], E=np.eye(stage_count)[-1],
        H=parse_numbers(dense).reshape(-1, stage_count), error_order=order - 1,
        dense_order=dense_order, source=source,
    )  # fmt: skip


def make_rosenbrock(
    name: str,
    order: int,
    gamma: float,
    A: ArrayLike,
    C: ArrayLike,
    nodes: Array,
    d: Array,
    B: ArrayLike,
    E: ArrayLike,
    H: ArrayLike | None = None,
    dense_order: int = 3,
    **about: Any,
) -> Rosenbrock:
    """Rosenbrock method from published coefficients, in the form of Hairer and Wanner.

    Args:
        name, order: of the method.
        gamma, A, C, nodes, d: of its stages.
        B, E: weights of the step and of the error estimate.
        H: (2 or 3, stages) dense output y_0 (1 - x) + x (y_1 + (1 - x) (H_0 + x H_1 + x^2 H_2) U);
            by default the cubic through both ends and their slopes.
        dense_order: of that.
        about: `error_order` and `source`.
    """
    stage_count = len(nodes)
    padding = ((1, 0), (1, 0))
    b, e = np.pad(np.asarray(B, float), (1, 0)), np.pad(np.asarray(E, float), (1, 1))
    return Rosenbrock(
        name=name,
        order=order,
        gamma=gamma,
        A=to_read_only(np.pad(np.asarray(A, float), padding)),
        second=to_read_only(np.pad(np.asarray(C, float)[:, :stage_count], padding)),
        C=to_read_only([0.0, *nodes]),
        d=to_read_only([0.0, *d]),
        B=to_read_only(b),
        E=to_read_only(e),
        dense=hermite(b) if H is None else _published_dense_output(b, np.asarray(H, float)),
        dense_order=dense_order,
        **about,
    )


def _published_dense_output(b: Array, H: Array) -> Array:
    """Published dense output in the basis of `Tableau`: x^3 (1 - x) is phi_2 - phi_3 of it."""
    columns = [b[1:], H[0], H[1]] if len(H) == 2 else [b[1:], H[0], H[1] + H[2], -H[2]]
    return to_read_only(np.pad(np.stack(columns, axis=1), ((1, 1), (0, 0))))


def _stability_function(matrix: Array, weights: Array, z: ArrayLike) -> NDArray[np.complex128]:
    """Stability function 1 + z b (1 - z beta)^-1 1 at every z."""
    points = np.asarray(z, dtype=np.complex128)
    identity = np.eye(len(weights))
    values = [
        1.0 + x * (weights @ np.linalg.solve(identity - x * matrix, np.ones(len(weights))))
        for x in points.ravel()
    ]
    return np.reshape(np.array(values, dtype=np.complex128), points.shape)


def two_position_arrays(order: int) -> dict[str, Any]:
    """Attributes of a method whose C code needs no coefficients: positions of step and error."""
    none, step = to_read_only(np.zeros((3, 3))), [0.0, 1.0, 0.0]
    return {
        "order": order, "A": none, "second": none, "C": to_read_only(np.zeros(3)),
        "B": to_read_only(step), "E": to_read_only([0.0, 0.0, 1.0, 0.0]), "error_order": 2,
        "dense": hermite(step), "dense_order": order,
    }  # fmt: skip


@dataclass(frozen=True, eq=False)
class DiagonallyImplicit(Implicit):
    """Diagonally implicit Runge-Kutta method with an explicit first stage, stiffly accurate.

    The diagonal of `A` is gamma except for the first stage; `second` contains the weights of the
    previous slopes in the start value of the iteration for the next one.
    """

    kind: ClassVar[int] = DIRK

    @property
    def inner_nodes(self) -> Array:
        """No inner nodes: the stages also integrate the other rates."""
        return to_read_only(np.zeros(0))

    def _check_consistency(self) -> None:
        name, diagonal = f"tableau {self.name}", np.diag(self.A)
        if np.any(np.triu(self.A, 1)) or diagonal[0] != 0.0 or np.any(diagonal[1:] != self.gamma):
            raise ValueError(f"{name}: its diagonal is not (0, gamma, gamma, ...)")
        if abs(self.A.sum(1) - self.C).max() > 1e-12 or not np.array_equal(self.A[-1], self.B):
            raise ValueError(f"{name}: sum(A[i]) = C[i] or A[-1] = B does not hold")
        if self.second.shape != self.A.shape or np.any(np.triu(self.second)):
            raise ValueError(f"{name}: an iteration starts from later stages")

    def amplification(self, z: ArrayLike) -> NDArray[np.complex128]:
        """R(z) of one step on y' = lambda y with z = h lambda."""
        return _stability_function(self.A, self.B, z)


def make_diagonal(
    name: str,
    order: int,
    A: Sequence[Sequence[float]],
    C: Sequence[float],
    E: ArrayLike,
    **about: Any,
) -> DiagonallyImplicit:
    """Diagonally implicit method from the rows of its matrix, each up to the diagonal.

    `about` as in `make_rosenbrock`.
    """
    s = len(A)
    matrix = np.array([[*row, *[0.0] * (s - len(row))] for row in A])
    return DiagonallyImplicit(
        name=name,
        order=order,
        gamma=float(matrix[1, 1]),
        A=to_read_only(matrix),
        B=to_read_only(matrix[-1]),
        C=to_read_only(C),
        E=to_read_only(np.append(np.asarray(E, float), 0.0)),
        second=to_read_only(_start_weights(C)),
        dense=hermite(matrix[-1]),
        dense_order=3,
        **about,
    )


def _start_weights(C: Sequence[float]) -> Array:
    """Weights (s, s) of the previous slopes in the start value of each stage's iteration.

    They extrapolate by the polynomial through the (at most three) nearest previous nodes.
    """
    weights = np.zeros((len(C), len(C)))
    for i in range(1, len(C)):
        nearest = sorted(range(i), key=lambda j: abs(C[j] - C[i]))[:3]
        for j in nearest:
            others = [k for k in nearest if k != j]
            weights[i, j] = math.prod((C[i] - C[k]) / (C[j] - C[k]) for k in others)
    return weights
