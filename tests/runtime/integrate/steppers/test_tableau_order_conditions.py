"""The published coefficients: against SciPy's arrays, and against the equations they must solve."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import DOP853, RK45

from mstmm.runtime.integrate.steppers import Tableau, get
from mstmm.runtime.integrate.steppers.implicit_methods import Rosenbrock

IMPLICIT = ("rodas4", "rodas4p2", "rodas5p", "ros34pw2", "rodas4pw", "esdirk436", "kvaerno5")

#: A rooted tree is the sorted tuple of its branches.
Tree = tuple["Tree", ...]


@cache
def trees(order: int) -> tuple[Tree, ...]:
    """Rooted trees with so many vertices."""
    return tuple(sorted(set(forests(order - 1, order - 1))))


def forests(vertices: int, largest: int) -> Iterator[Tree]:
    """Multisets of trees with so many vertices in all, none larger than `largest`."""
    if vertices == 0:
        yield ()
    for size in range(1, min(vertices, largest) + 1):
        for tree in trees(size):
            for rest in forests(vertices - size, size):
                yield tuple(sorted((tree, *rest)))


@cache
def density(tree: Tree) -> int:
    """gamma(t): the product of the sizes of all subtrees."""
    product = size(tree)
    for branch in tree:
        product *= density(branch)
    return product


@cache
def size(tree: Tree) -> int:
    return 1 + sum(size(branch) for branch in tree)


class Stages:
    """Elementary weights of a method's stages, each tree once."""

    def __init__(self, a: NDArray[np.float64]) -> None:
        self.a, self.known = a, dict[Tree, NDArray[np.float64]]()

    def elementary_weights(self, tree: Tree) -> NDArray[np.float64]:
        """Phi_i(t) without the root's weight: the product over the branches of A Phi."""
        if tree not in self.known:
            product = np.ones(len(self.a))
            for branch in tree:
                product = product * (self.a @ self.elementary_weights(branch))
            self.known[tree] = product
        return self.known[tree]


def worst(tableau: Tableau, weights: NDArray[np.float64], order: int) -> float:
    """Largest residual of the conditions of one order (Hairer, Norsett, Wanner I, theorem 2.13)."""
    stages = Stages(tableau.A)
    return max(
        abs(float(weights @ stages.elementary_weights(tree)) - 1 / density(tree))
        for tree in trees(order)
    )


def test_there_are_as_many_trees_as_published() -> None:
    assert [len(trees(n)) for n in range(1, 9)] == [1, 1, 2, 4, 9, 20, 48, 115]


@pytest.mark.parametrize(("name", "checked"), [("rk4", 4), ("dopri5", 5), ("dop853", 8)])
def test_conditions_hold_up_to_the_order_and_no_further(name: str, checked: int) -> None:
    tableau = get(name)
    for order in range(1, checked + 1):
        assert worst(tableau, tableau.B, order) < 1e-14, order
    assert worst(tableau, tableau.B, checked + 1) > 1e-7


def test_conditions_of_the_iterated_method() -> None:
    tableau = get("pirk13")
    for order in range(1, 9):
        assert worst(tableau, tableau.B, order) < 1e-15, order
    # bushy and tall trees up to order 13: quadrature, and the exponential series
    tall = [1.0, *np.cumprod(1.0 / np.arange(1, 14))]
    assert tableau.stability_polynomial == pytest.approx(tall, rel=1e-13)
    for power in range(13):
        assert tableau.B @ tableau.C**power == pytest.approx(1 / (power + 1), rel=1e-14)


def test_estimates_vanish_to_their_order_and_no_further() -> None:
    for name, estimate, last in (("dopri5", "E", 4), ("dop853", "E", 5), ("dop853", "E_low", 3)):
        tableau = get(name)
        stages = Stages(np.vstack([np.pad(tableau.A, ((0, 0), (0, 1))), [*tableau.B, 0.0]]))
        for order in range(1, last + 2):
            residual = max(
                abs(getattr(tableau, estimate) @ stages.elementary_weights(t)) for t in trees(order)
            )
            assert residual < 1e-14 if order <= last else residual > 1e-6, (name, order)
    iterated = get("pirk13")
    assert iterated.E is not None
    with_end = np.vstack([np.pad(iterated.A, ((0, 0), (0, 1))), [*iterated.B, 0.0]])
    tall, bushy, row = [], [], iterated.E
    for power in range(12):
        tall.append(abs(row.sum()))
        bushy.append(abs(iterated.E @ np.append(iterated.C, 1.0) ** power))
        row = row @ with_end
    last = iterated.error_order
    assert max(*tall[:last], *bushy[:last]) < 1e-14
    assert bushy[last] > 1e-9  # what depends on time alone counts too
    assert tall[last + 1] > 1e-11


def test_coefficients_are_scipys() -> None:
    ours = get("dop853")
    for mine, theirs in (
        (ours.A, DOP853.A), (ours.B, DOP853.B), (ours.C, DOP853.C), (ours.E, DOP853.E5),
        (ours.E_low, DOP853.E3), (ours.A_extra, DOP853.A_EXTRA), (ours.C_extra, DOP853.C_EXTRA),
        (ours.dense[:, 3:], DOP853.D.T),
    ):  # fmt: skip
        assert mine is not None
        assert np.array_equal(mine, theirs)
    ours = get("dopri5")
    for mine, theirs in ((ours.A[:, :5], RK45.A), (ours.B, RK45.B), (ours.C, RK45.C)):
        assert np.array_equal(mine, theirs)
    assert ours.E is not None
    assert np.array_equal(ours.E, RK45.E)


class Weights:
    """Elementary weights of a method's stages: a vertex with one branch takes the matrix with the
    tangent in it, others the matrix without (Hairer and Wanner II, theorem IV.7.4)."""

    def __init__(self, one: NDArray[np.float64], several: NDArray[np.float64]) -> None:
        self.one, self.several = one, several

    def elementary_weights(self, tree: Tree) -> NDArray[np.float64]:
        """Elementary weights of the stages, without the root's weight."""
        matrix = self.one if len(tree) == 1 else self.several
        product = np.ones(len(matrix))
        for branch in tree:
            product = product * (matrix @ self.elementary_weights(branch))
        return product

    def worst(self, weights: NDArray[np.float64], order: int, step: bool = True) -> float:
        """Largest residual of the conditions of one order, of a step or of an error estimate."""
        return max(
            abs(
                float(weights @ self.elementary_weights(tree))
                - (1 / density(tree) if step else 0.0)
            )
            for tree in trees(order)
        )


def conditions(tableau: Tableau) -> tuple[Weights, NDArray[np.float64], NDArray[np.float64]]:
    """Weights of the stages, of the step and of the error estimate."""
    assert tableau.E is not None
    if isinstance(tableau, Rosenbrock):
        alpha, gamma = tableau.classical  # U = Gamma k
        return Weights(alpha + gamma, alpha), tableau.weights_classical, tableau.E[1:-1] @ gamma
    return Weights(tableau.A, tableau.A), tableau.B, tableau.E[:-1]


@pytest.mark.parametrize("name", IMPLICIT)
def test_conditions_of_implicit_methods_hold_up_to_the_order_and_no_further(name: str) -> None:
    tableau = get(name)
    stages, step, _ = conditions(tableau)
    for order in range(1, tableau.order + 1):
        assert stages.worst(step, order) < 3e-12, order
    assert stages.worst(step, tableau.order + 1) > 1e-6


@pytest.mark.parametrize("name", IMPLICIT)
def test_estimates_of_implicit_methods_vanish_to_their_order_and_no_further(name: str) -> None:
    tableau = get(name)
    stages, _, error = conditions(tableau)
    for order in range(1, tableau.error_order + 1):
        assert stages.worst(error, order, step=False) < 3e-12, order
    assert stages.worst(error, tableau.error_order + 1, step=False) > 1e-6
