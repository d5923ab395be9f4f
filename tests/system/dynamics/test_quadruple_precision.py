"""Both engines and the integrators against the same equations in quadruple precision."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.packing.fused_structure import structure_of
from mstmm.runtime.packing.system_builder import system_of
from tests.reference.compare import seeded_scene
from tests.reference.jets import Array
from tests.support.kernels.scalar_kernels import ScalarKernel, farthest
from tests.support.scenes.rods import chain, drawn_state


def reference(
    scene: mstmm.Scene, q: Array, u: Array, t: float, folder: Path
) -> tuple[ScalarKernel, dict[str, Any]]:
    """The accelerations of a scene in quadruple precision, and the inputs of a state."""
    model = mstmm.compile(scene, engine="looped")
    structure, p = structure_of(system_of(scene, model.known)[0], model.known or {})
    kernel = model.fusion.structure_ir(structure).kernels["accelerations"]
    still = {"memory": [0.0] * structure.n_memory, "efforts": [0.0] * model.nu}
    inputs = {"p": p, "t": [t], "q": q, "u": u, **still}
    return ScalarKernel(kernel, "quadruple", folder), inputs


@pytest.mark.parametrize(
    ("kind", "count", "skew"), [("pin", 100, 0.0), ("pin", 24, 0.7), ("ball", 24, 0.7)]
)
def test_looped_engine_on_long_chains(
    kind: str, count: int, skew: float, tmp_path: Path, rng: np.random.Generator
) -> None:
    """Relative error below 1e-13, here with a margin of five."""
    data = chain([kind] * count, skew=skew)
    scene = mstmm.Scene(**data)
    q, u = drawn_state(data, rng)
    exact, inputs = reference(scene, q, u, 0.0, tmp_path)
    model = mstmm.compile(scene, engine="looped")
    assert farthest(model.accelerations(q, u), exact(inputs)["udot"]) < 2e-14


@pytest.mark.parametrize("kind", ["pin", "ball"])
def test_fused_engine_on_a_chain(kind: str, tmp_path: Path, rng: np.random.Generator) -> None:
    data = chain([kind] * 4, skew=0.7)
    scene = mstmm.Scene(**data)
    q, u = drawn_state(data, rng)
    exact, inputs = reference(scene, q, u, 0.0, tmp_path)
    model = mstmm.compile(scene, engine="fused")
    assert farthest(model.accelerations(q, u), exact(inputs)["udot"]) < 5e-15


@pytest.mark.parametrize("seed", range(4))
def test_looped_engine_on_trees(seed: int, tmp_path: Path) -> None:
    """Masses over three decades, all hinges, laws, loads and springs."""
    data, q, u = seeded_scene(700 + seed)
    scene = mstmm.Scene(**data)
    exact, inputs = reference(scene, q, u, 0.3, tmp_path)
    model = mstmm.compile(scene, engine="looped")
    assert farthest(model.accelerations(q, u, 0.3), exact(inputs)["udot"]) < 1e-12


@pytest.mark.parametrize("kind", ["pin", "ball"])
def test_motions(kind: str, tmp_path: Path) -> None:
    """Three rods for 0.4 s: the reference converges beyond doubles, and dop853 meets it."""
    data = chain([kind] * 3, skew=0.7)
    scene = mstmm.Scene(**data)
    q, u = drawn_state(data, np.random.default_rng(5))
    exact, inputs = reference(scene, q, u, 0.0, tmp_path)
    coarse, fine = exact.motion(inputs, 0.4, 50), exact.motion(inputs, 0.4, 70)
    for a, b in zip(coarse, fine, strict=True):
        assert max(abs(x - y) for x, y in zip(a, b, strict=True)) < 1e-20
    result = mstmm.compile(scene, engine="looped").simulate(
        0.4, rtol=1e-13, atol=1e-14, initial=(q, u), output_times=[0.4]
    )
    assert result.success, result.message
    assert farthest(result.q[-1], fine[0]) < 1e-12
    assert farthest(result.u[-1], fine[1]) < 1e-12
