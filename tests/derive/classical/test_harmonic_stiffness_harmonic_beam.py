"""Transfer matrices of vibrating beams: field equation, closed forms, and signs that mislead."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from mstmm.derive.classical.harmonic_stiffness import (
    BETA,
    LENGTH,
    field_matrix,
    mass_matrix,
    spring_matrix,
)


def test_the_field_equation_and_the_start() -> None:
    u = field_matrix()
    rate = sp.Matrix([[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], [BETA**4, 0, 0, 0]])
    assert (u.diff(LENGTH) - rate * u).applyfunc(sp.simplify) == sp.zeros(4)
    assert u.subs(LENGTH, 0) == sp.eye(4)
    assert sp.simplify(u.det()) == 1


def test_parts_make_the_whole() -> None:
    u = field_matrix()
    twice = (u.subs(LENGTH, LENGTH / 2) ** 2).subs({BETA: 3, LENGTH: 1}).evalf(30)
    assert sp.Matrix(twice - u.subs({BETA: 3, LENGTH: 1}).evalf(30)).norm() < 1e-25


def test_the_cantilever() -> None:
    """Free at the end: cos(beta l) cosh(beta l) = -1."""
    u = field_matrix()[2:, 2:].det()
    assert sp.simplify(u - (1 + sp.cos(BETA * LENGTH) * sp.cosh(BETA * LENGTH)) / 2) == 0


def test_a_mass_and_a_spring_at_the_tip() -> None:
    """1 + c C = beta r (s C - c S) for a mass r; + k/beta^3 in its place for a spring."""
    m, k = sp.symbols("m k", positive=True)
    bracket = sp.sin(BETA) * sp.cosh(BETA) - sp.cos(BETA) * sp.sinh(BETA)
    plain = 1 + sp.cos(BETA) * sp.cosh(BETA)
    for behind, more in ((mass_matrix(m), -m * BETA), (spring_matrix(k), k / BETA**3)):
        u = (behind * field_matrix().subs(LENGTH, 1))[2:, 2:].det()
        assert sp.simplify(2 * u - plain - more * bracket) == 0


@pytest.mark.parametrize(("spans", "right"), [(2, True), (4, True), (8, False)])
def test_signs_of_many_spans_mislead(spans: int, right: bool) -> None:
    """2 n - 1 modes below 6.5 (counted in
    tests/runtime/linear/harmonic/test_dynamic_stiffness_modes.py); of eight spans the signs
    of the determinant tell of hundreds."""
    span = spring_matrix(sp.Integer(2000)) * mass_matrix(sp.Rational(1, 2)) * field_matrix()
    one = sp.lambdify(BETA, span.subs(LENGTH, 1), "numpy")
    values = []
    for beta in np.linspace(0.5, 6.5, 20_001):
        chain = np.linalg.matrix_power(np.asarray(one(beta), dtype=float), spans)
        values.append(chain[2, 2] * chain[3, 3] - chain[2, 3] * chain[3, 2])
    signs = np.sign(values)
    changes = int(np.count_nonzero(signs[1:] * signs[:-1] < 0))
    assert changes == 2 * spans - 1 if right else changes > 100
