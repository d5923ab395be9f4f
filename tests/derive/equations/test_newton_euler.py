"""Euler's equations: integrated, by angular momentum, and against moving mass points."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import mpmath
import numpy as np
import pytest
import sympy as sp

from mstmm.derive.definition.derivation import tilde
from mstmm.derive.definition.element import Symbols
from mstmm.derive.definition.notation import Matrix
from mstmm.derive.elements.body_rigid import RigidBody
from mstmm.derive.equations import newton_euler as ne
from mstmm.derive.equations.newton_euler import POINT, from_inertia_tensor, general, point_masses
from mstmm.derive.equations.rigid_body import rigid_body
from mstmm.derive.lower.kernel_lowering import lower
from mstmm.ir.interpreter import evaluate_floats
from tests.support.book_formulas.formulas import (
    PRINTED_FORMULAS,
    PrintedFormula,
    as_markdown,
    as_page,
)
from tests.support.classical.dense_chain import output_state, random_body
from tests.support.paths import ROOT

ZERO = sp.zeros(3, 1)
Points = Sequence[tuple[float, tuple[float, float, float]]]


def test_both_forms_agree_identically() -> None:
    euler_less_momentum, euler_less_relative = ne.forms_difference()
    assert euler_less_momentum == ZERO
    assert euler_less_relative == ZERO
    assert ne.euler_form() != ZERO


def test_general_form_is_the_tensor_form() -> None:
    assert (ne.euler_form() - ne.tensor_form(general())).expand() == ZERO


@pytest.mark.parametrize("term", ["acceleration of the origin", "angular acceleration", "gyration"])
def test_a_sign_flip_breaks_the_agreement(term: str) -> None:
    body = general()
    flipped = {
        "acceleration of the origin": body.mass * tilde(body.center) * ne.A0,
        "angular acceleration": body.inertia * ne.OMEGADOT,
        "gyration": tilde(ne.OMEGA) * body.inertia * ne.OMEGA,
    }[term]
    assert (ne.angular_momentum_form() - ne.tensor_form(body) + 2 * flipped).expand() != ZERO


def test_transport_term_is_needed() -> None:
    """Without omega x v in the rate of a vector the two roads part."""
    momentum = ne.relative_momentum(general())
    body = general()
    without = body.mass * tilde(body.center) * ne.A0 + ne.component_rate(momentum)
    assert (without - ne.euler_form()).expand() != ZERO


def test_integral_of_point_masses_is_their_sum() -> None:
    positions = [Matrix(p) for p in ([1, 2, 3], [-2, 1, 4], [0, -3, 1])]
    masses = [sp.Integer(2), sp.Integer(5), sp.Integer(3)]
    integrand = tilde(POINT) * ne.acceleration_field()
    direct = sp.zeros(3, 1)
    for m, p in zip(masses, positions, strict=True):
        direct += m * integrand.subs(dict(zip(POINT, p, strict=True)))
    assert (ne.euler_form(point_masses(masses, positions)) - direct).expand() == ZERO


def test_degree_three_is_refused() -> None:
    with pytest.raises(ValueError, match="degree 3"):
        general().integral(Matrix([POINT[0] ** 3]))


def test_euler_form_against_mass_points_in_motion() -> None:
    """Moment of m d2X/dt2 of points on a prescribed motion, differentiated numerically."""
    with mpmath.workdps(40):
        points = [(1.5, (0.3, -0.2, 0.5)), (0.7, (-0.4, 0.6, 0.1)), (2.1, (0.2, 0.3, -0.7))]
        t0 = mpmath.mpf("0.4")
        moment = _measured_moment(points, t0)
        values = _motion_values(t0)
        body = point_masses(
            [sp.Float(m, 40) for m, _ in points],
            [Matrix([sp.Float(c, 40) for c in p]) for _, p in points],
        )
        derived = ne.euler_form(body).subs(values)
        assert (
            max(abs(mpmath.mpf(str(d)) - m) for d, m in zip(derived, moment, strict=True)) < 1e-15
        )


def _turn(axis: int, angle: mpmath.mpf) -> mpmath.matrix:
    c, s, turn = mpmath.cos(angle), mpmath.sin(angle), mpmath.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    turn[i, i], turn[i, j], turn[j, i], turn[j, j] = c, -s, s, c
    return turn


def _rotation(t: mpmath.mpf) -> mpmath.matrix:
    return _turn(0, mpmath.sin(t)) * _turn(1, t**2 / 3) * _turn(2, mpmath.cos(2 * t) / 2)


def _origin(t: mpmath.mpf) -> mpmath.matrix:
    return mpmath.matrix([mpmath.sin(t), t**3, mpmath.exp(-t)])


def _rate(f: Callable[[mpmath.mpf], mpmath.matrix], t: mpmath.mpf, order: int) -> mpmath.matrix:
    """Derivative of a matrix function, entry by entry."""
    result = f(t).copy()
    for i in range(result.rows):
        for j in range(result.cols):
            result[i, j] = mpmath.diff(partial(_entry, f, i, j), t, order)
    return result


def _entry(f: Callable[[mpmath.mpf], mpmath.matrix], i: int, j: int, t: mpmath.mpf) -> mpmath.mpf:
    return f(t)[i, j]


def _omega(t: mpmath.mpf) -> mpmath.matrix:
    skew = _rotation(t).T * _rate(_rotation, t, 1)
    return mpmath.matrix([skew[2, 1], skew[0, 2], skew[1, 0]])


def _measured_moment(points: Points, t: mpmath.mpf) -> list[mpmath.mpf]:
    turn, total = _rotation(t), mpmath.matrix(3, 1)
    for m, p in points:
        r = mpmath.matrix(p)
        a = turn.T * (_rate(_origin, t, 2) + _rate(_rotation, t, 2) * r)
        cross = [r[1] * a[2] - r[2] * a[1], r[2] * a[0] - r[0] * a[2], r[0] * a[1] - r[1] * a[0]]
        total += m * mpmath.matrix(cross)
    return list(total)


def _motion_values(t: mpmath.mpf) -> dict[sp.Symbol, sp.Float]:
    """a0, omega, omegadot in body axes at t."""
    a0 = _rotation(t).T * _rate(_origin, t, 2)
    numbers = [*a0, *_omega(t), *_rate(_omega, t, 1)]
    symbols = [*ne.A0, *ne.OMEGA, *ne.OMEGADOT]
    return {s: sp.Float(str(v), 30) for s, v in zip(symbols, numbers, strict=True)}


@pytest.mark.parametrize("formula", PRINTED_FORMULAS, ids=lambda f: f.number)
def test_printed_formula_is_judged_by_computation(formula: PrintedFormula) -> None:
    assert formula.check()


def test_printed_formulas_cover_the_chapter_and_render() -> None:
    statuses = {formula.status for formula in PRINTED_FORMULAS}
    assert statuses == {"holds", "misprint", "convention"}
    table = as_markdown()
    assert table.count("\n") == len(PRINTED_FORMULAS) + 2
    assert all(line.count(" | ") == 5 for line in table.splitlines())


def test_the_page_of_printed_formulas_is_current() -> None:
    page = ROOT / "docs" / "explanation" / "errata.md"
    assert page.read_text(encoding="utf-8") == as_page()


def test_body_element_is_the_integrated_equation() -> None:
    """The residual of the rigid body element equals the integrals, term by term."""
    p = Symbols("p", tuple(x.name for x in RigidBody.parameters))
    inertia = Matrix([[p.Jxx, p.Jxy, p.Jxz], [p.Jxy, p.Jyy, p.Jyz], [p.Jxz, p.Jyz, p.Jzz]])
    center = Matrix([p.mcx, p.mcy, p.mcz]) / p.mass
    body = from_inertia_tensor(p.mass, center, inertia)
    derived = ne.inertial_force(body).col_join(ne.euler_form(body))
    a, alpha, w = (sp.Matrix(v) for v in (ne.A0, ne.OMEGADOT, ne.OMEGA))
    stated = RigidBody().residual(a, alpha, w, p)
    assert (sp.Matrix(stated) - derived).applyfunc(sp.expand) == sp.zeros(6, 1)


@pytest.mark.parametrize("seed", range(3))
def test_rigid_body_with_outputs_and_loads(seed: int) -> None:
    """f_I of a body with two ends and a load off the mass centre, against Newton-Euler about C."""
    rng = np.random.default_rng(seed)
    body = random_body(rng)
    end, point, f_l, m_l, a, q, m = rng.normal(size=(7, 3))
    alpha = rng.normal(size=3)
    inputs = {
        "M": [body.mass], "r_IC": body.r_ic, "J_I": body.j_i[np.triu_indices(3)],
        "omega": body.omega, "r_O1": body.r_io, "r_O2": end,
        "r_L1": point, "f_L1": f_l, "m_L1": m_l,
    }  # fmt: skip
    kernel = lower(rigid_body(outputs=2, loads=1), "body")
    result = evaluate_floats(kernel, {k: list(map(float, v)) for k, v in inputs.items()})
    mass_matrix = np.zeros((6, 6))
    mass_matrix[np.triu_indices(6)] = result["mass_matrix"]
    mass_matrix += np.triu(mass_matrix, 1).T
    acceleration = np.concatenate([a, alpha])
    f_o2 = np.concatenate([q, m])
    shift = np.array(result["X_2"]).reshape(6, 6)
    wrench = mass_matrix @ acceleration + np.array(result["bias"]) + shift.T @ f_o2
    loads = np.concatenate(
        [f_l - q, m_l + np.cross(point - body.r_ic, f_l) - m - np.cross(end - body.r_ic, q)]
    )
    free = type(body)(body.mass, body.r_io, body.r_ic, body.j_c, body.omega, loads[:3], loads[3:])
    state = np.concatenate([a, alpha, wrench[3:], wrench[:3], [1.0]])
    behind = output_state(free, state)
    assert np.abs(behind[6:12]).max() < 1e-13 * np.abs(wrench).max()
    b_2 = np.array(result["b_2"])
    expected = a + np.cross(alpha, end) + np.cross(body.omega, np.cross(body.omega, end))
    assert np.allclose((shift @ acceleration + b_2)[:3], expected, rtol=0, atol=1e-13)
