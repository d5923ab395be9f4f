"""Inverse dynamics and mass matrix as code of one scene: the looped engine's numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.random import Generator

import mstmm
from mstmm.ir.interpreter import evaluate_floats
from mstmm.pipeline.fused_code import Fusion
from mstmm.runtime.packing.fused_structure import structure_of
from tests.reference.jets import Array
from tests.reference.random_scenes import random_scene, random_state
from tests.runtime.engine.test_tangent_matrix import worst
from tests.support.scenes.results import rod

TIME = 0.3


def beams() -> dict[str, Any]:
    """Two beams on pins, the second one on the tip of the first."""
    beam = {"length": 1.0, "mass_per_length": 1.2, "bending_stiffness": [50.0, 80.0],
            "modes": 2}  # fmt: skip
    pin = {"type": "pin", "axis": [0.1, 0.2, 0.9]}
    return {
        "gravity": [0.5, -9.81, 0.3],
        "beam": [beam | {"name": "a"}, beam | {"name": "b"}],
        "hinge": [
            pin | {"name": "h", "inboard": "ground", "outboard": "a"},
            pin | {"name": "k", "inboard": "a.tip", "outboard": "b", "law": {"inertia": 0.3}},
        ],
    }


def replay_kernels(model: mstmm.Model, q: Array, u: Array, a: Array) -> dict[str, Array]:
    """Outputs of the kernels of inverse dynamics, evaluated in floats."""
    assert isinstance(model.fusion, Fusion)
    structure, p = structure_of(model.packed_scene.system, model.known or {})
    state: dict[str, Any] = {
        "p": p, "t": [TIME], "q": q, "u": u, "a": a, "memory": np.zeros(structure.n_memory),
    }  # fmt: skip
    found: dict[str, Array] = {}
    for kernel in model.fusion.fused_inverse(structure).kernels.values():
        inputs = {port.name: list(state[port.name]) for port in kernel.inputs}
        given = evaluate_floats(kernel, inputs)
        found |= {port: np.array(values) for port, values in given.items()}
    return found


@pytest.mark.parametrize("seed", range(8))
def test_trees(seed: int, rng: Generator) -> None:
    scene = random_scene(seed)
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    q, u = random_state(scene, seed)
    a = rng.normal(size=model.nu)
    found = replay_kernels(model, q, u, a)
    assert worst(found["required"], model.inverse_dynamics(q, u, a, TIME)) < 1e-11
    mass = model.mass_matrix(q)
    assert worst(found["M"].reshape(mass.shape), mass) < 1e-11


def test_flexible_bodies(rng: Generator) -> None:
    """Efforts of their speeds too; their mass matrix is the looped engine's affair."""
    model = mstmm.compile(mstmm.Scene(**beams()), engine="looped")
    q, u, a = (rng.uniform(-0.1, 0.1, n) for n in (model.nq, model.nu, model.nu))
    found = replay_kernels(model, q, u, a)
    assert list(found) == ["required"]
    assert worst(found["required"], model.inverse_dynamics(q, u, a, TIME)) < 1e-11


def test_compiled_code_serves_single_calls(rng: Generator) -> None:
    """Laws, rotors, an input and a load that changes with time, at states one by one."""
    scene = {
        "gravity": [0, -9.81, 0],
        "input": [{"name": "push", "unit": "N*m", "value": 2.0}],
        "body": [rod("a"), rod("b")],
        "hinge": [
            {"name": "h", "type": "pin", "inboard": "ground", "outboard": "a",
             "law": {"damping": 0.4, "inertia": 0.2}},
            {"name": "k", "type": "ball", "inboard": "a.tip", "outboard": "b"},
        ],
        "load": [{"name": "l", "on": "b", "moment": [0, "push*cos(3*t)", 0]}],
    }  # fmt: skip
    fused, looped = (mstmm.compile(mstmm.Scene(**scene), engine=one) for one in ("fused", "looped"))
    for t in (0.0, 0.7):
        q, u = np.array([0.3, 0.5, -0.5, 0.5, 0.5]), rng.normal(size=looped.nu)
        a = rng.normal(size=looped.nu)
        expected = looped.inverse_dynamics(q, u, a, t)
        assert worst(fused.inverse_dynamics(q, u, a, t), expected) < 1e-12
        assert worst(fused.mass_matrix(q), looped.mass_matrix(q)) < 1e-12
        assert worst(fused.accelerations(q, u, t), looped.accelerations(q, u, t)) < 1e-11
    assert fused.fusion.inverse is not None and looped.fusion.inverse is None


def test_driven_scenes_have_no_such_code() -> None:
    scene = mstmm.Scene(
        gravity=[0, -9.81, 0], body=[rod("a")],
        hinge=[{"name": "h", "type": "pin", "inboard": "ground", "outboard": "a",
                "drive": "sin(t)"}],
    )  # fmt: skip
    model = mstmm.compile(scene)
    assert isinstance(model.fusion, Fusion) and not model.fusion.obstacle
    assert model.fusion.ready_inverse(np.inf) is None
