"""The coefficients of implicit methods: the equations they must solve, and what they promise."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from mstmm.errors import SceneError
from mstmm.runtime.integrate import steppers
from mstmm.runtime.integrate.steppers import Tableau, get, to_read_only
from mstmm.runtime.integrate.steppers.alpha_family import NewmarkFamily
from mstmm.runtime.integrate.steppers.exprb32 import Exponential
from mstmm.runtime.integrate.steppers.implicit_methods import (
    DiagonallyImplicit,
    Rosenbrock,
    make_rosenbrock,
)

ROSENBROCK = ("rodas4", "rodas4p2", "rodas5p", "ros34pw2", "rodas4pw")
DIAGONAL = ("esdirk436", "kvaerno5")
NEWMARK = ("genalpha", "dttmm", "hht", "newmark", "wilson", "houbolt")


def of_rosenbrock(name: str) -> Rosenbrock:
    method = get(name)
    assert isinstance(method, Rosenbrock)
    return method


@pytest.mark.parametrize("name", ROSENBROCK + DIAGONAL)
def test_infinitely_fast_motion_is_gone_after_a_step(name: str) -> None:
    tableau = get(name)
    assert abs(tableau.amplification(-1e9)) < 1e-7
    assert abs(tableau.amplification(1e9j)) < 1e-7
    frequencies = np.logspace(-2, 4, 200)
    assert np.all(np.abs(tableau.amplification(1j * frequencies)) < 1 + 1e-9)


@pytest.mark.parametrize("name", ROSENBROCK + DIAGONAL + NEWMARK)
def test_amplification_agrees_with_the_exponential_to_the_order(name: str) -> None:
    tableau = get(name)
    points = [size * (1 + 1j) for size in (0.2, 0.1)]
    errors = [abs(tableau.amplification(z) - np.exp(z)) for z in points]
    assert np.log2(errors[0] / errors[1]) > tableau.order + 0.75


@pytest.mark.parametrize("name", ROSENBROCK + DIAGONAL)
def test_dense_output_ends_with_the_step(name: str) -> None:
    tableau = get(name)
    assert np.all(tableau.weights(0.0) == 0.0)
    assert tableau.weights(1.0) == pytest.approx(np.append(tableau.B, 0.0), abs=1e-14)


def test_dense_output_is_the_published_polynomial() -> None:
    # y_0 (1 - x) + x (y_1 + (1 - x) (H_0 + x H_1 + x^2 H_2) U), of stage 5 of Rodas5P
    tableau = get("rodas5p")
    x, step = 0.3, 0.030198172008377946
    H = (0.524948541321073, 20.176138334709044, -52.072871366152654)
    wanted = x * (step + (1 - x) * (H[0] + x * H[1] + x**2 * H[2]))
    assert tableau.weights(x)[5] == pytest.approx(wanted, rel=1e-14)


@pytest.mark.parametrize("radius", [0.0, 0.3, 0.8, 1.0])
@pytest.mark.parametrize("name", steppers.METHODS_WITH_RADIUS)
def test_the_radius_is_what_is_left_of_infinitely_fast_motion(name: str, radius: float) -> None:
    if radius == 1.0 and name.endswith(steppers.INDEX3_SUFFIX):
        with pytest.raises(SceneError, match="would have no damping"):
            get(name, radius)
        return
    tableau = get(name, radius)
    assert abs(tableau.amplification(1e5j)) == pytest.approx(radius, abs=3e-3)
    sizes = np.abs(tableau.amplification(1j * np.logspace(-2, 4, 100)))
    assert sizes.max() < 1 + 1e-9


def test_constants_of_the_family_are_the_published_ones() -> None:
    alpha, newmark, hht = get("genalpha", 1.0), get("newmark"), get("hht")
    assert isinstance(alpha, NewmarkFamily)
    assert isinstance(newmark, NewmarkFamily)
    assert isinstance(hht, NewmarkFamily)
    assert (alpha.alpha_m, alpha.alpha_f, alpha.beta_n, alpha.gamma_n) == (0.5, 0.5, 0.25, 0.5)
    assert (newmark.beta_n, newmark.gamma_n, newmark.error_constant) == (0.25, 0.5, 0.25 - 1 / 6)
    assert hht.beta_n == pytest.approx(0.275625)
    # undamped: nothing is lost at any frequency
    assert np.abs(newmark.amplification(1j * np.logspace(-2, 3, 50))) == pytest.approx(1.0)
    # at h omega = 1 as of 10 periods: an amplitude of .967 is left of radius .8
    steps = 20 * math.pi
    left = abs(get("genalpha").amplification(1j)) ** steps
    assert left == pytest.approx(0.967, abs=0.002)


def test_quadratures_are_exact_to_their_degree() -> None:
    for name, degree in (("genalpha", 1), ("rodas4", 3), ("rodas5p", 5)):
        tableau = get(name)
        assert isinstance(tableau, (NewmarkFamily, Rosenbrock))
        nodes = np.array([0.0, *tableau.inner_nodes, 1.0])
        for power in range(degree + 1):
            found = tableau.quadrature[:, 0] @ nodes**power
            assert found == pytest.approx(1 / (power + 1), rel=1e-14)


def test_a_radius_that_makes_no_sense_is_refused() -> None:
    with pytest.raises(
        SceneError,
        match='method "rodas4" has no such parameter; methods with a radius are genalpha',
    ):
        get("rodas4", 0.5)


def test_an_exponential_step_moves_as_the_linear_motion_does() -> None:
    exprb = get("exprb32")
    assert isinstance(exprb, Exponential)
    assert (exprb.order, exprb.error_order, exprb.adaptive) == (3, 2, True)
    assert exprb.amplification([-1e9, 0.0, 1j * np.pi]) == pytest.approx([0.0, 1.0, -1.0])


def test_contradictory_coefficients_are_refused() -> None:
    rodas, esdirk, newmark = of_rosenbrock("rodas4"), get("esdirk436"), get("newmark")
    assert isinstance(esdirk, DiagonallyImplicit)
    wrong = np.array(rodas.second)
    wrong[2, 1] = 1.0
    cases: list[tuple[Tableau, dict[str, Any], str]] = [
        (rodas, {"d": to_read_only([0.0, *[0.1] * 6])}, "d contradicts C"),
        (rodas, {"d": to_read_only([0.0])}, r"d is \(1,\), expected \(7,\)"),
        (rodas, {"C": to_read_only([0.0, 0.1, *rodas.C[2:]])}, "the nodes contradict"),
        (
            rodas,
            {"B": to_read_only(2 * rodas.B), "dense": to_read_only(2 * rodas.dense)},
            "add up to 1",
        ),
        (rodas, {"A": to_read_only(rodas.A.T)}, "depends on later ones"),
        (esdirk, {"gamma": 0.3}, "diagonal"),
        (esdirk, {"C": to_read_only([0.0] * 6)}, "does not hold"),
        (esdirk, {"second": to_read_only(np.eye(6))}, "starts from later stages"),
        (newmark, {"beta_n": 0.0}, "positive"),
        (get("exprb32"), {"max_unknowns": 0}, "positive"),
    ]
    for tableau, change, message in cases:
        with pytest.raises(ValueError, match=message):
            dataclasses.replace(tableau, **change)


def test_a_method_from_outside_is_one_call() -> None:
    # the linearly implicit Euler method
    euler = make_rosenbrock(
        "euler", 1, 1.0, [[0.0]], [[0.0]], np.zeros(1), np.ones(1), B=[1.0], E=[0.0], source="test"
    )
    assert euler.amplification(-3.0) == pytest.approx(0.25)
