"""Discrete-time classical matrices satisfy the premises that they are derived from.

At random values of the time map's A, B, C, D, of predictor, states and loads: the premises are
linearised by differences at 80 digits, which knows nothing of the derivation.
"""

from __future__ import annotations

import dataclasses
from functools import cache

import mpmath
import numpy as np
import pytest

from mstmm.derive.catalogue.kernels import Kernel
from mstmm.derive.classical.catalogue import BODIES, CLASSICAL, HINGES, PLANAR_MODES, SPATIAL_MODES
from mstmm.derive.classical.discrete import body as flexible_body
from mstmm.derive.classical.discrete.body_options import PLANE, SPACE, BodyStatement
from mstmm.derive.classical.discrete.hinge import PAIRINGS, Pairing, named_pairing
from mstmm.derive.definition.derivation import Derivation
from mstmm.derive.lower.kernel_lowering import lower
from tests.support.classical.discrete_bodies import DIGITS, kernel_inputs
from tests.support.classical.hinge_premises import body_residual, hinge_residual, matrices
from tests.support.classical.premises import Premises
from tests.support.classical.random_bodies import random_body
from tests.support.kernels.mutations import mutants

#: The differences' own error is 1e-50.
LIMIT = 1e-40

MORE_MODES = (
    BodyStatement("beam_4", "", PLANE, "beam", 4, "", ""),
    BodyStatement("beam_yyz", "", SPACE, "beam", 3, "", "", "yyz"),
    BodyStatement("elastic_2", "", SPACE, "elastic", 2, "", ""),
)


@cache
def classical_derivation(name: str) -> Derivation:
    return CLASSICAL[name]()


@pytest.mark.parametrize("body", (*BODIES, *MORE_MODES), ids=lambda b: b.element)
def test_body_satisfies_its_premises(body: BodyStatement, rng: np.random.Generator) -> None:
    generated = body.element in CLASSICAL
    derivation = classical_derivation(body.element) if generated else flexible_body.derivation(body)
    sample = random_body(rng, body.space.planar, body.kind, body.modes, body.planes)
    error = body_residual(
        Premises(derivation), lower(derivation, "transfer"), sample, rng, body.space
    )
    assert error < LIMIT


@pytest.mark.parametrize("body", BODIES, ids=lambda b: b.element)
def test_determinant_is_one_at_any_motion(body: BodyStatement, rng: np.random.Generator) -> None:
    ir = lower(classical_derivation(body.element), "transfer")
    sample = random_body(rng, body.space.planar, body.kind, body.modes, body.planes)
    with mpmath.workdps(DIGITS):
        whole = matrices(ir, kernel_inputs(sample, ir))["U"]
        assert abs(mpmath.det(whole) - 1) < LIMIT


def pair_of(name: str, which: str) -> Pairing:
    planar = HINGES[name][1]
    return named_pairing(
        PLANE if planar else SPACE, which, PLANAR_MODES if planar else SPATIAL_MODES
    )


@pytest.mark.parametrize("which", PAIRINGS)
@pytest.mark.parametrize("name", HINGES)
def test_hinge_satisfies_its_premises(name: str, which: str, rng: np.random.Generator) -> None:
    derivation = classical_derivation(f"{name}_{which}")
    ir = lower(derivation, "transfer")
    assert hinge_residual(Premises(derivation), ir, derivation, pair_of(name, which), rng) < LIMIT


#: Quantities of which a summand's sign is turned (one that is not zero by structure), by body.
BODY_PLACES = {
    "beam_planar_discrete_2": ("F_b", "J_e", "N_b", "Z", "b", "rho_z", "M_O", "W"),
    "beam_spatial_discrete": ("rho_z", "W"),
}
HINGE_PLACES = (
    ("hinge_fixed_spatial", "E"), ("hinge_smooth_planar", "E"), ("hinge_pin_spatial", "G"),
    ("hinge_spring_planar", "m_z"), ("hinge_spring_planar", "Z_r"),
    ("hinge_elastic_spatial", "d_z"), ("hinge_elastic_spatial", "o_z"),
)  # fmt: skip
#: Summands tried per quantity.
TRIED = 2


@pytest.mark.parametrize("name", BODY_PLACES)
def test_a_turned_sign_in_a_body_is_noticed(name: str, rng: np.random.Generator) -> None:
    body = next(b for b in BODIES if b.element == name)
    good = classical_derivation(name)
    premises = Premises(good)
    sample = random_body(rng, body.space.planar, body.kind, body.modes, body.planes)
    for quantity in BODY_PLACES[name]:
        found = mutants(Kernel("transfer", good), quantity)
        for mutant in found[:: max(1, len(found) // TRIED)]:
            error = body_residual(premises, mutant.ir(), sample, rng, body.space)
            assert error > 1e-6, (quantity, mutant.derivation.definition(quantity))


@pytest.mark.parametrize(("name", "quantity"), HINGE_PLACES)
def test_a_turned_sign_in_a_hinge_is_noticed(
    name: str, quantity: str, rng: np.random.Generator
) -> None:
    good, pair = classical_derivation(f"{name}_beam_beam"), pair_of(name, "beam_beam")
    premises = Premises(good)
    found = mutants(Kernel("transfer", good), quantity)
    for mutant in found[:: max(1, len(found) // TRIED)]:
        altered = dataclasses.replace(good, definitions=mutant.derivation.definitions)
        error = hinge_residual(premises, lower(altered, "transfer"), good, pair, rng)
        assert error > 1e-6, mutant.derivation.definition(quantity)


def test_every_generated_matrix_is_listed_here() -> None:
    named = {body.element for body in BODIES} | {f"{h}_{p}" for h in HINGES for p in PAIRINGS}
    assert named == {name for name in CLASSICAL if "discrete" in name or name.startswith("hinge_")}
