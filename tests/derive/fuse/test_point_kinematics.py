"""Kinematics of points as code of one scene: the looped engine's numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.random import Generator

import mstmm
from mstmm.errors import SceneError
from mstmm.ir.interpreter import evaluate_floats
from mstmm.pipeline import fused_code
from mstmm.pipeline.fused_code import Fusion
from mstmm.runtime.packing.fused_structure import structure_of
from tests.reference.jets import Array
from tests.reference.random_scenes import random_scene, random_state
from tests.support.draws import draws
from tests.support.paths import ROOT
from tests.support.scenes.results import rod

from .test_scene_kernels_inverse_dynamics import beams

KINDS = {"positions": "q", "poses": "q", "velocities": "qu", "jacobian": "q", "jacobian_rate": "qu"}


def relative_difference(found: Array, expected: Array) -> float:
    """Largest difference over the largest entry, or over 1: code of a scene has exact zeros."""
    return float(np.abs(found - expected).max()) / max(1.0, float(np.abs(expected).max()))


def replay_kernels(model: mstmm.Model, of: str, q: Array, u: Array) -> dict[str, Array]:
    """Outputs of the kernels of an end, evaluated in floats."""
    assert isinstance(model.fusion, Fusion)
    structure, p = structure_of(model.packed_scene.system, model.known or {})
    body, axes, offset = model.packed_scene.end(of)
    state: dict[str, Any] = {
        "p": p, "t": [0.0], "q": q, "u": u, "memory": np.zeros(structure.n_memory),
        "end": [*offset, *axes],
    }  # fmt: skip
    found: dict[str, Array] = {}
    for name, kernel in model.fusion.fused_points(structure, body).kernels.items():
        inputs = {port.name: list(state[port.name]) for port in kernel.inputs}
        given = evaluate_floats(kernel, inputs)
        found |= {name if port == "J" else port: np.array(values) for port, values in given.items()}
    return found


@pytest.mark.parametrize("seed", draws(3, 8))
def test_trees(seed: int) -> None:
    """Driven coordinates and speeds are taken as they are given, too."""
    scene = random_scene(seed)
    model = mstmm.compile(mstmm.Scene(**scene), engine="looped")
    q, u = random_state(scene, seed)
    for body in scene["body"]:
        of = body["name"]
        found, pose = replay_kernels(model, of, q, u), model.poses(q, of)
        assert relative_difference(found["place"], pose[:3, 3]) < 1e-12
        assert relative_difference(found["axes"].reshape(3, 3), pose[:3, :3]) < 1e-12
        assert relative_difference(found["velocity"], model.velocities(q, u, of)) < 1e-12
        jacobian = model.jacobian(q, of)
        assert relative_difference(found["jacobian"].reshape(jacobian.shape), jacobian) < 1e-12
        rate = model.jacobian_rate(q, u, of)
        assert relative_difference(found["jacobian_rate"].reshape(rate.shape), rate) < 1e-11


@pytest.fixture
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fused_code, "_MIN_POINT_CALLS", 1)


def machine() -> mstmm.Scene:
    """A driven pin, a joint whose axes turn with its own coordinates, and an end with axes."""
    hand = rod("c") | {"ends": {"tool": {"position": [0.2, 0.1, 0.0],
                                         "orientation": [0.3, -0.2, 0.5]}}}  # fmt: skip
    return mstmm.Scene(
        gravity=[0, -9.81, 0], body=[rod("a"), rod("b"), hand],
        input=[{"name": "push", "unit": "N", "value": 2.0}],
        hinge=[
            {"name": "h", "type": "pin", "inboard": "ground", "outboard": "a", "drive": "sin(t)"},
            {"name": "k", "type": "universal", "axis2": [0, 1, 0], "inboard": "a.tip",
             "outboard": "b"},
            {"name": "l", "type": "ball", "inboard": "b.tip", "outboard": "c"},
        ],
        load=[{"name": "f", "on": "c", "force": [0, "push", 0]}],
    )  # fmt: skip


def compiled_parts(model: mstmm.Model) -> set[str]:
    """Parts of the scene's code that are compiled."""
    assert isinstance(model.fusion, Fusion)
    return set(model.fusion.libraries)


def test_compiled_code_serves_single_calls(rng: Generator, at_once: None) -> None:
    fused, looped = (mstmm.compile(machine(), engine=one) for one in ("fused", "looped"))
    q, u = fused.integrate(rng.normal(size=looped.nq), np.zeros(looped.nu), 0.0), rng.normal(size=6)
    for of in ("c.tool", ["a", "c.tool", "b.tip"]):
        for kind, given in KINDS.items():
            states = (q, u)[: len(given)]
            ours, theirs = (getattr(model, kind)(*states, of) for model in (fused, looped))
            assert relative_difference(ours, theirs) < 1e-12, kind
    assert {"points 0", "points 1", "points 2"} <= compiled_parts(fused)
    assert not compiled_parts(looped)


@pytest.mark.parametrize("name", ["four_bar", "bricard", "stewart_platform"])
def test_closed_loops_have_no_say(name: str, rng: Generator, at_once: None) -> None:
    """Cut hinges and constraints among them; states need not close the loops."""
    scene = mstmm.load_scene(ROOT / "examples" / name / "scene.toml")
    fused, looped = (mstmm.compile(scene, engine=one) for one in ("fused", "looped"))
    q, u = fused.initial_state()
    q, u = fused.integrate(q, rng.normal(size=fused.nu), 0.3), rng.normal(size=fused.nu)
    of = [body.name for body in scene.body][-2:]
    for kind, given in KINDS.items():
        states = (q, u)[: len(given)]
        ours, theirs = (getattr(model, kind)(*states, of) for model in (fused, looped))
        assert relative_difference(ours, theirs) < 1e-12, kind
    assert any(part.startswith("points") for part in compiled_parts(fused))


def test_numbers_of_a_variant_are_its_own(rng: Generator, at_once: None) -> None:
    """The code is the same scene's."""
    fused, longer = (mstmm.compile(machine(), engine=one) for one in ("fused", "looped"))
    q = rng.normal(size=fused.nq)
    before, change = fused.jacobian(q, "c.tool"), {"a.ends.tip.position[0]": 1.7}
    fused, longer = fused.with_parameters(change), longer.with_parameters(change)
    assert "points 2" in compiled_parts(fused)
    assert relative_difference(fused.jacobian(q, "c.tool"), longer.jacobian(q, "c.tool")) < 1e-12
    assert relative_difference(fused.jacobian(q, "c.tool"), before) > 0.01


def test_code_that_pays_serves_all_that_is_asked_of_its_body(
    rng: Generator, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("MSTMM_CACHE", str(tmp_path))
    model = mstmm.compile(machine(), engine="fused")
    q, u = rng.normal(size=model.nq), rng.normal(size=model.nu)
    before = model.jacobian_rate(q, u, "c")
    for _ in range(126):
        model.positions(q, "c")
    assert "points 2" not in compiled_parts(model)
    model.positions(q, "c")
    assert "points 2" in compiled_parts(model)
    kinematics = model._kinematics
    assert not kinematics._request_counts and [kind for kind, _ in kinematics._calls] == ["places"]
    assert relative_difference(model.jacobian_rate(q, u, "c"), before) < 1e-12


def test_the_ground_and_what_bends_are_left_to_the_loops(rng: Generator, at_once: None) -> None:
    fused = mstmm.compile(machine(), engine="fused")
    q = rng.normal(size=fused.nq)
    assert not fused.jacobian(q, ["ground", "c"])[0].any()
    assert not any(part.startswith("points") for part in compiled_parts(fused))
    bent = mstmm.compile(mstmm.Scene(**beams()), engine="fused")
    bent.velocities(np.zeros(bent.nq), np.zeros(bent.nu), "b.tip")
    assert not any(part.startswith("points") for part in compiled_parts(bent))


@pytest.mark.parametrize("of", ["nobody", ["a", "nobody"]])
def test_names_that_there_are_not(of: Any) -> None:
    fused = mstmm.compile(machine(), engine="fused")
    with pytest.raises(SceneError, match="nobody"):
        fused.positions(np.zeros(fused.nq), of)


@pytest.mark.parametrize("of", [3, [["a"]], ["a", 2], np.zeros(2)])
def test_what_is_no_name(of: Any) -> None:
    fused = mstmm.compile(machine(), engine="fused")
    with pytest.raises(SceneError, match=r"^of"):
        fused.positions(np.zeros(fused.nq), of)
