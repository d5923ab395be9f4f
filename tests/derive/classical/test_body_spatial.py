"""Classical body matrices against Newton-Euler about the mass centre, and their closed forms."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import sympy as sp

from mstmm.derive.classical import body_planar, body_spatial
from mstmm.derive.classical.state_vector import PLANAR, SPATIAL
from mstmm.derive.definition.derivation import Derivation, Equation, tilde
from mstmm.derive.definition.notation import Matrix, explicit
from mstmm.derive.equations import newton_euler as ne
from mstmm.derive.equations.newton_euler import from_inertia_tensor
from tests.support.classical.classical_kernels import (
    PLANAR_ROWS,
    kernel,
    planar_inputs,
    run,
    spatial_inputs,
)
from tests.support.classical.dense_chain import Body, output_state, planar_body, random_body
from tests.support.classical.sign_flips import Flip, flip_sign, flips

SPATIAL_KERNEL = kernel(body_spatial.derivation())
PLANAR_KERNEL = kernel(body_planar.derivation())


@pytest.mark.parametrize("seed", range(5))
def test_spatial_body_against_newton_euler(seed: int) -> None:
    rng = np.random.default_rng(seed)
    body, state = random_body(rng), np.append(rng.normal(size=12), 1.0)
    transfer = run(SPATIAL_KERNEL, **spatial_inputs(body))["U"]
    assert np.allclose(transfer @ state, output_state(body, state), rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("seed", range(5))
def test_planar_body_against_newton_euler(seed: int) -> None:
    rng = np.random.default_rng(seed)
    body, state = planar_body(rng), np.zeros(13)
    state[PLANAR_ROWS] = np.append(rng.normal(size=6), 1.0)
    transfer = run(PLANAR_KERNEL, **planar_inputs(body))["U"]
    expected = output_state(body, state)[PLANAR_ROWS]
    assert np.allclose(transfer @ state[PLANAR_ROWS], expected, rtol=1e-13, atol=1e-13)


def test_planar_matrix_is_the_submatrix_of_the_spatial_one() -> None:
    """Symbolically: planar data in (5.27), rows and columns 1, 2, 6, 9, 10, 11, 13, is (5.18)."""
    planar = body_planar.derivation().definition("U")
    spatial = body_spatial.derivation()
    biases = {
        e: value
        for equation in body_spatial.bias_definitions()
        for e, value in zip(explicit(equation.left), explicit(equation.right), strict=True)
    }
    full = spatial.definition("U").xreplace(biases).xreplace(_planar_data())
    entries = PLANAR_ROWS
    part = sp.Matrix(7, 7, lambda i, j: full[entries[i], entries[j]])
    assert (part - sp.Matrix(planar)).applyfunc(sp.expand) == sp.zeros(7, 7)
    rest = [i for i in range(13) if i not in entries]
    coupling = [sp.expand(full[i, j]) for i in entries for j in rest]
    assert coupling == [0] * len(coupling)


def _planar_data() -> dict[sp.Basic, sp.Expr]:
    """Spatial symbols replaced by what they are in the plane."""
    s, p = body_spatial, body_planar
    inertia = s.INERTIA.as_explicit()
    flat: dict[sp.Basic, sp.Expr] = {}
    for spatial, planar in ((s.OUTPUT, p.OUTPUT), (s.CENTER, p.CENTER), (s.FORCE, p.FORCE)):
        flat |= {spatial[0, 0]: planar[0, 0], spatial[1, 0]: planar[1, 0], spatial[2, 0]: 0}
    for spatial, planar in ((s.OMEGA, p.OMEGA), (s.MOMENT, p.MOMENT)):
        flat |= {spatial[0, 0]: 0, spatial[1, 0]: 0, spatial[2, 0]: planar[0, 0]}
    flat |= {inertia[i, j]: 0 for i in range(3) for j in range(3) if i != j}
    return flat | {inertia[2, 2]: p.INERTIA[0, 0], s.MASS[0, 0]: p.MASS[0, 0]}


def test_spatial_closed_form() -> None:
    """The solved matrix equals the block form assembled from cross-product matrices."""
    s = body_spatial
    mass, inertia = s.MASS[0, 0], s.INERTIA.as_explicit()
    io, ic, unit, none = tilde(s.OUTPUT), tilde(s.CENTER), sp.eye(3), sp.zeros(3)
    b_o, b_c, gyration = (explicit(x) for x in (s.B_OUTPUT, s.B_CENTER, s.GYRATION))
    force, moment = explicit(s.FORCE), explicit(s.MOMENT)
    load = (ic - io) * force + moment - gyration + mass * io * b_c
    zero = sp.zeros(3, 1)
    expected = sp.Matrix.vstack(
        sp.Matrix.hstack(unit, -io, none, none, b_o),
        sp.Matrix.hstack(none, unit, none, none, zero),
        sp.Matrix.hstack(mass * (io - ic), -(inertia + mass * io * ic), unit, -io, load),
        sp.Matrix.hstack(-mass * unit, mass * ic, none, unit, force - mass * b_c),
        sp.Matrix([[0] * 12 + [1]]),
    )
    found = sp.Matrix(s.derivation().definition("U"))
    assert (found - expected).applyfunc(sp.expand) == sp.zeros(13, 13)


def test_premises_are_the_integrated_laws() -> None:
    """Newton's and Euler's premise have the integrals of newton_euler on their left."""
    _, _, newton, euler = body_spatial.premises()
    rdd, wd, _, _ = SPATIAL.end_blocks("I")
    inertia = body_spatial.INERTIA.as_explicit()
    symmetric = Matrix(3, 3, lambda i, j: inertia[min(i, j), max(i, j)])
    body = from_inertia_tensor(body_spatial.MASS[0, 0], explicit(body_spatial.CENTER), symmetric)
    names = dict(zip((*ne.A0, *ne.OMEGADOT), (*explicit(rdd), *explicit(wd)), strict=True))
    names |= dict(zip(ne.OMEGA, explicit(body_spatial.OMEGA), strict=True))
    biases = {
        e: value
        for equation in body_spatial.bias_definitions()
        for e, value in zip(explicit(equation.left), explicit(equation.right), strict=True)
    }
    same_inertia = dict(zip(inertia, symmetric, strict=True))
    for premise, integral in ((newton, ne.inertial_force(body)), (euler, ne.euler_form(body))):
        stated = explicit(premise.left).xreplace(biases).xreplace(same_inertia)
        difference = stated - Matrix(integral).xreplace(names)
        assert difference.applyfunc(sp.expand) == sp.zeros(3, 1)


@pytest.mark.parametrize("flip", flips(body_spatial.premises()), ids=str)
def test_a_flipped_sign_in_the_spatial_premises_is_found(flip: Flip) -> None:
    premises = flip_sign(body_spatial.premises(), flip)
    assert _error(body_spatial.derivation(premises), random_body, spatial_inputs) > 1e-3


@pytest.mark.parametrize("flip", flips(body_planar.premises()), ids=str)
def test_a_flipped_sign_in_the_planar_premises_is_found(flip: Flip) -> None:
    premises = flip_sign(body_planar.premises(), flip)
    assert _error(body_planar.derivation(premises), planar_body, planar_inputs) > 1e-3


def _error(
    derivation: Derivation,
    draw: Callable[[np.random.Generator], Body],
    inputs: Callable[[Body], dict[str, object]],
) -> float:
    rng = np.random.default_rng(7)
    body, state = draw(rng), np.zeros(13)
    planar = derivation.definition("U").shape == (7, 7)
    rows = PLANAR_ROWS if planar else list(range(13))
    state[rows] = np.append(rng.normal(size=len(rows) - 1), 1.0)
    found = run(kernel(derivation), **inputs(body))["U"] @ state[rows]
    return float(np.abs(found - output_state(body, state)[rows]).max())


def test_premises_that_leave_an_output_open_are_refused() -> None:
    with pytest.raises(ValueError, match="do not determine"):
        body_spatial.derivation(body_spatial.premises()[:3])


def test_premises_must_be_linear_in_the_state() -> None:
    rdd = PLANAR.end_blocks("I")[0]
    square = rdd * (rdd.T * rdd)
    wrong = Equation("acceleration of the output end", PLANAR.end_blocks("O")[0], square)
    with pytest.raises(ValueError, match="not linear"):
        body_planar.derivation((wrong, *body_planar.premises()[1:]))
