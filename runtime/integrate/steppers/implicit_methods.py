"""Implicit methods: Rosenbrock, diagonally implicit, exponential, Newmark's family.

All integrate q' = N(q) u, u' = a, 0 = R(t, q, u, a) with a tangent of R.  Stage 0 of each is the
slope at the start of the step, and k_s that at its end.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
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


@dataclass(frozen=True, eq=False)
class NewmarkFamily(Implicit):
    """Method of Newmark's family: coordinates and speeds are linear in the new acceleration.

        (1 - alpha_m) a_1 + alpha_m a_0 = (1 - alpha_f) u'_1 + alpha_f u'_0
        q_1 = q_0 + h u_0 + h^2 ((1/2 - beta) a_0 + beta a_1)
        u_1 = u_0 + h ((1 - gamma) a_0 + gamma a_1)

    Attributes:
        alpha_m, alpha_f, beta_n, gamma_n: its constants; `alpha_m = alpha_f = 0` makes a = u'.
        collocation: number of steps (Wilson: above 1, others: 1) after which the equations of
            motion are satisfied; the acceleration is linear up to there.
        backward: Houbolt's differences over three steps; the constants are used for the first two.
        one_iteration: one linear solution per step, at the predictor u'_1 = u'_0.
        on_positions: constraint rows are satisfied by positions at the end of a step, with their
            multipliers as unknowns (index 3); the error of speeds is of the order of the method.
            Shortened steps satisfy the rows by accelerations.
    """

    kind: ClassVar[int] = ALPHA
    alpha_m: float = 0.0
    alpha_f: float = 0.0
    beta_n: float = 0.25
    gamma_n: float = 0.5
    collocation: float = 1.0
    backward: bool = False
    one_iteration: bool = False
    on_positions: bool = False

    def _check_consistency(self) -> None:
        if not (self.beta_n > 0.0 and self.gamma_n > 0.0 and self.collocation >= 1.0):
            raise ValueError(f"tableau {self.name}: its constants must be positive")

    @property
    def error_constant(self) -> float:
        """Factor of h^2 times the change of acceleration in the local error of coordinates."""
        return self.beta_n + (self.alpha_m - self.alpha_f) / 2.0 - 1.0 / 6.0

    def amplification(self, z: ArrayLike) -> NDArray[np.complex128]:
        """Largest eigenvalue of one step on the oscillation with the eigenvalue z / h."""
        points = np.asarray(z, dtype=np.complex128)
        eigenvalues = [max(np.linalg.eigvals(self._step(x)), key=abs) for x in points.ravel()]
        return np.reshape(np.array(eigenvalues, dtype=np.complex128), points.shape)

    def _step(self, z: complex) -> Array:
        """Step matrix of u' = -c u - k q with h = 1, eigenvalues z and its conjugate."""
        k, c = abs(z) ** 2, -2.0 * z.real
        return _houbolt_step_matrix(k, c) if self.backward else self._newmark_step(k, c)

    def _newmark_step(self, k: float, c: float) -> Array:
        """Step matrix of the Newmark form on (q, u, u', a)."""
        h, q, u, rate, a = self.collocation, *np.eye(4)
        factor = (1.0 - self.alpha_f) / (1.0 - self.alpha_m)
        known_part = (self.alpha_f * rate - self.alpha_m * a) / (1.0 - self.alpha_m)

        def advance(h: float, new: Array) -> tuple[Array, Array]:
            acceleration = known_part + factor * new
            q_new = q + h * u + h * h * ((0.5 - self.beta_n) * a + self.beta_n * acceleration)
            return q_new, u + h * ((1.0 - self.gamma_n) * a + self.gamma_n * acceleration)

        free_motion = advance(h, np.zeros(4))
        divisor = 1.0 + factor * (c * h * self.gamma_n + k * h * h * self.beta_n)
        new = -(c * free_motion[1] + k * free_motion[0]) / divisor
        new = rate + (new - rate) / self.collocation
        return np.array([*advance(1.0, new), new, known_part + factor * new])


def _houbolt_step_matrix(k: float, c: float) -> Array:
    """Step matrix of Houbolt's method on the last three coordinates."""
    q0, q1, q2 = np.eye(3)  # the most recent first
    rest_a, rest_u = -5.0 * q0 + 4.0 * q1 - q2, (-18.0 * q0 + 9.0 * q1 - 2.0 * q2) / 6.0
    q_new = -(rest_a + c * rest_u) / (2.0 + c * 11.0 / 6.0 + k)
    return np.array([q_new, q0, q1])


def make_newmark_family(
    name: str, source: str, adaptive: bool = True, **constants: Any
) -> NewmarkFamily:
    """Method of Newmark's family, second order, from its constants."""
    zeros = np.zeros(3)
    return NewmarkFamily(
        name=name, order=2, source=source, A=to_read_only(np.zeros((3, 3))), C=to_read_only(zeros),
        B=to_read_only([0.0, 1.0, 0.0]), E=to_read_only([0.0, 0.0, 1.0, 0.0]) if adaptive else None,
        error_order=2 if adaptive else 0, dense=hermite([0.0, 1.0, 0.0]), dense_order=2,
        second=to_read_only(np.zeros((3, 3))), **constants,
    )  # fmt: skip


def with_position_constraints(tableau: Tableau, name: str) -> NewmarkFamily:
    """Variant of a method that satisfies constraints by positions (index 3), with a new name."""
    assert isinstance(tableau, NewmarkFamily)
    source = f"{tableau.source}, on index 3 after Arnold and Brüls (2007)"
    return replace(tableau, name=name, source=source, on_positions=True)


@dataclass(frozen=True, eq=False)
class Exponential(Implicit):
    """Exponential Rosenbrock method: exact linearised motion, two evaluations per step.

    Its weights are functions of a matrix, see `c/exponential.c`; the arrays here only define the
    positions of the step and its error for the loop.
    """

    kind: ClassVar[int] = EXPONENTIAL

    def _check_consistency(self) -> None:
        if not self.max_unknowns > 0:
            raise ValueError(f"tableau {self.name}: max_unknowns must be positive")

    def amplification(self, z: ArrayLike) -> NDArray[np.complex128]:
        """R(z) = exp(z) of one step on y' = lambda y with z = h lambda: exact."""
        return np.asarray(np.exp(np.asarray(z, dtype=np.complex128)))


def make_exponential(
    name: str, order: int, error_order: int, most: int, source: str
) -> Exponential:
    """Exponential method from its orders; `most` limits coordinates and speeds together."""
    zeros = np.zeros(3)
    return Exponential(
        name=name,
        order=order,
        source=source,
        A=to_read_only(np.zeros((3, 3))),
        C=to_read_only(zeros),
        B=to_read_only([0.0, 1.0, 0.0]),
        E=to_read_only([0.0, 0.0, 1.0, 0.0]),
        error_order=error_order,
        dense=hermite([0.0, 1.0, 0.0]),
        dense_order=order,
        second=to_read_only(np.zeros((3, 3))),
        max_unknowns=most,
    )
