"""The classical matrices and the engine's sweep start from one residual: the same numbers.

The engine's kernel (element sweep_modal) takes moments of the fields, the classical kernels take
theirs; both come from the same particles, with shapes in three dimensions.
"""

from __future__ import annotations

import dataclasses
from functools import cache
from typing import Any

import mpmath
import numpy as np
import pytest

from mstmm.derive.catalogue.kernels import built_in_kernels
from mstmm.derive.classical.discrete import body as flexible_body
from mstmm.derive.classical.discrete.body_options import PLANE, SPACE, BodyStatement
from mstmm.derive.definition.derivation import Quantity
from mstmm.derive.definition.notation import matrix_symbols
from mstmm.derive.lower.kernel_lowering import lower
from mstmm.derive.verification.kernel_evaluation import evaluate
from mstmm.ir import KernelIR
from tests.support.classical.discrete_bodies import (
    DIGITS,
    Array,
    ParticleBody,
    cross,
    kernel_inputs,
)
from tests.support.classical.random_bodies import random_body

PAIRS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
MODES = 2
#: What both sides state: rows at the predictor, mass matrix, and the motion in frame axes.
WANTED = ("F_b", "M", "w", "wd", "a", "etad", "etadd")


@cache
def residual_of_the_engine() -> KernelIR:
    return next(k for k in built_in_kernels("sweep", "modal") if k.name == "residual").ir()


def classical_residual(statement: BodyStatement) -> KernelIR:
    """The classical kernel up to its residual."""
    derivation = flexible_body.derivation(statement)
    defined = {str(e.left.name): e.left for e in derivation.definitions}
    shown = tuple(Quantity(defined[name]) for name in WANTED)
    last = next(i for i, e in enumerate(derivation.definitions) if str(e.left.name) == "M")
    kept = derivation.definitions[: last + 1]
    used = {str(s.name) for e in kept for s in matrix_symbols(e.right)}
    inputs = tuple(q for q in derivation.inputs if q.name in used)
    return lower(
        dataclasses.replace(derivation, inputs=inputs, outputs=shown, definitions=kept), "residual"
    )


def moments(body: ParticleBody) -> dict[str, list[Any]]:
    """Moments of the fields as the engine's kernel has them."""
    n, first, second = body.modes, mpmath.zeros(3, 1), mpmath.zeros(3)
    sums = {f"F_{a}{b}": mpmath.zeros(n) for a in range(3) for b in range(3)}
    shift, spin = mpmath.zeros(3, n), mpmath.zeros(3, n)
    products = {f"{a}{b}": mpmath.zeros(1, n) for a in range(3) for b in range(3)}
    for m, r, phi in zip(body.masses, body.places, body.shapes, strict=True):
        first += m * r
        second += m * (r * r.T)
        shift += m * phi
        for k in range(n):
            spin[:, k] = spin[:, k] + m * cross(r, phi[:, k])
        for a in range(3):
            for b in range(3):
                products[f"{a}{b}"] += m * r[a] * phi[b, :]
                sums[f"F_{a}{b}"] += m * (phi[a, :].T * phi[b, :])
    values = {
        "p": [mpmath.fsum(body.masses), *first, *(second[pair] for pair in PAIRS)],
        "C": shift, "P": spin, "M": sums["F_00"] + sums["F_11"] + sums["F_22"],
        "B": mpmath.matrix([list(products[f"{a}{b}"] + products[f"{b}{a}"]) for a, b in PAIRS]),
        "K": body.values["K_f"], "D": body.values["D_f"],
    }  # fmt: skip
    for a, b in PAIRS:
        both = sums[f"F_{a}{b}"]
        values["Z_" + "xyz"[a] + "xyz"[b]] = both + both.T
    for i, axis in enumerate("xyz"):
        a, b = (i + 1) % 3, (i + 2) % 3
        values[f"Y_{axis}"] = sums[f"F_{a}{b}"] - sums[f"F_{b}{a}"]
        values[f"G_{axis}"] = mpmath.zeros(n)
    return {name: list(value) for name, value in values.items()}


def by_engine(body: ParticleBody, own: dict[str, list[Any]]) -> tuple[Array, Array]:
    """(rows, mass matrix) at the motion that the classical kernel found, [a; w] as space has it."""

    def three(name: str) -> list[Any]:
        row = own[name]
        before = 0 if name == "a" else 3 - len(row)
        return [*[0] * before, *row, *[0] * (3 - before - len(row))]

    inputs = moments(body) | {
        "eta": list(body.values["eta_p"]), "etad": own["etad"],
        "motion": [*three("w"), *three("wd"), *three("a")],
    }  # fmt: skip
    out = evaluate(residual_of_the_engine(), inputs, digits=DIGITS, n=body.modes)
    size = 6 + body.modes
    mass, entries = mpmath.zeros(size), iter(out["S"])
    for i in range(6):
        for j in range(i, 6):
            mass[i, j] = mass[j, i] = next(entries)
    for i in range(6):
        for k in range(body.modes):
            mass[i, 6 + k] = mass[6 + k, i] = out["S_rf"][body.modes * i + k]
    for k, value in enumerate(out["S_ff"]):
        mass[6 + k // body.modes, 6 + k % body.modes] = value
    rows = mpmath.matrix([*out["e"], *out["e_f"]])
    return rows + mass[:, 6:] * mpmath.matrix(own["etadd"]), mass


@pytest.mark.parametrize("space", [PLANE, SPACE], ids=["planar", "spatial"])
def test_residual_and_mass_matrix_are_the_engines(space: Any, rng: np.random.Generator) -> None:
    body = random_body(rng, space.planar, "elastic", MODES)
    ir = classical_residual(BodyStatement("", "", space, "elastic", MODES, "", ""))
    with mpmath.workdps(DIGITS):
        own = evaluate(ir, kernel_inputs(body, ir), digits=DIGITS)
        rows, mass = by_engine(body, own)
        kept = [0, 1, 5, 6, 7] if space.planar else list(range(8))
        size = len(kept)
        for i, row in enumerate(kept):
            assert abs(own["F_b"][i] - rows[row]) < mpmath.mpf(10) ** -60
            for j, column in enumerate(kept):
                gap = own["M"][size * i + j] - mass[row, column]
                assert abs(gap) < mpmath.mpf(10) ** -60
