"""Fused, baked, side by side, interpreted and looped are one meaning: T10 on random states."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.random import Generator

import mstmm
from mstmm.ir.interpreter import evaluate_floats
from mstmm.runtime.packing.fused_structure import structure_of
from tests.reference import random_scenes
from tests.reference.compare import fresh, worst
from tests.reference.jets import Array
from tests.reference.tree import SIZES
from tests.support.draws import draws

AGREEMENT = 1e-13
TIME = 0.3


def bound(model: mstmm.Model, q: Array) -> float:
    """1e-13, more where the mass matrix passes rounding on more than a thousandfold."""
    matrix = model.mass_matrix(q)
    size = np.sqrt(np.diag(matrix))
    condition = np.linalg.cond(matrix / np.outer(size, size)) if len(size) else 1.0
    return float(AGREEMENT * max(1.0, condition / 1e3))


def looped_accelerations(
    scene: dict[str, Any], q: Array, u: Array, efforts: Array | None = None
) -> Array:
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    assert model.engine == "looped"
    return model.accelerations(q, u, TIME, efforts)


def fused_model(scene: dict[str, Any], **options: Any) -> mstmm.Model:
    model = mstmm.compile(mstmm.Scene(**scene), engine="fused", **options)
    assert model.engine == "fused"
    return model


def interpreted_outputs(model: mstmm.Model, q: Array, u: Array) -> dict[str, Any]:
    """Outputs of the fused IR for a state, evaluated in floats."""
    structure, p = structure_of(model.packed_scene.system, model.known or {})
    found = model.fusion.structure_ir(structure).kernels
    kernel = found.get("accelerations_power", found["accelerations"])
    inputs = {
        "p": list(p), "t": [TIME], "q": list(q), "u": list(u), "efforts": [0.0] * model.nu,
        "memory": [0.0] * structure.n_memory,
    }  # fmt: skip
    return evaluate_floats(kernel, inputs)


@pytest.mark.parametrize("draw", draws(8, 25))
def test_interpreted_equals_looped(draw: int, rng: Generator) -> None:
    scene, q, u = fresh(rng)
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    found, expected = interpreted_outputs(model, q, u)["udot"], model.accelerations(q, u, TIME)
    assert worst(found, expected) < bound(model, q)


@pytest.mark.parametrize("kind", [*SIZES, "all"])
def test_compiled_equals_looped(kind: str, rng: Generator) -> None:
    options: dict[str, Any] = {"most": 4}
    if kind != "all":
        options = {"types": (kind,), "chain": True, "most": 3}
    scene, q, u = fresh(rng, **options)
    efforts = rng.normal(size=u.shape)
    model, expected = fused_model(scene), looped_accelerations(scene, q, u, efforts)
    allowed = bound(model, q)
    assert worst(model.accelerations(q, u, TIME, efforts), expected) < allowed
    states = 11
    many = model.accelerations(
        np.tile(q, (states, 1)), np.tile(u, (states, 1)), TIME, np.tile(efforts, (states, 1))
    )
    assert worst(many, np.tile(expected, (states, 1))) < allowed


def test_baked_equals_looped(rng: Generator) -> None:
    scene, q, u = fresh(rng, most=3)
    model = fused_model(scene, bake=True)
    assert not len(model.fusion.numbers)
    assert worst(model.accelerations(q, u, TIME), looped_accelerations(scene, q, u)) < bound(
        model, q
    )


@pytest.mark.parametrize("seed", range(3))
def test_runs_agree(seed: int) -> None:
    scene = random_scenes.aligned_chain(seed, ("pin", "prismatic", "universal"), springs=True)
    results = [
        mstmm.compile(mstmm.Scene(**scene), engine=engine).simulate(0.5, rtol=1e-10, atol=1e-12)
        for engine in ("looped", "fused")
    ]
    assert all(result.success for result in results)
    assert worst(results[1].q[-1], results[0].q[-1], floor=1.0) < 1e-9
    assert worst(results[1].energy()[-1:], results[0].energy()[-1:], floor=1.0) < 1e-9
