"""Libraries of scenes: text that every compiler takes, and files that are something else."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest

import mstmm
from mstmm.abi import fused_library as fused_abi
from mstmm.derive.codegen.scene_text import fused_sources
from mstmm.errors import EnvironmentFailure
from mstmm.runtime.kernels.scene_libraries import FusedLibrary, SingleStateCall, open_library
from mstmm.runtime.packing.fused_structure import structure_of
from tests.support.kernels.fused_helpers import COMPILERS
from tests.support.scenes.rods import chain, drawn_state

KEY = "5" * 64
MIXED = ["free", "pin", "ball", "prismatic"]


def compile_source(text: str, folder: Path, compiler: str = COMPILERS[0]) -> Path:
    source, target = folder / "fused.c", folder / "fused.so"
    source.write_text(text)
    strict = ("-Wall", "-Wextra", "-Wmissing-prototypes", "-Werror")
    command = [compiler, *fused_abi.COMPILER_FLAGS, *strict, "-fPIC", "-shared", str(source), "-lm"]
    done = subprocess.run(
        [*command, "-o", str(target)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return target


@pytest.fixture(scope="module")
def model() -> mstmm.Model:
    return mstmm.compile(mstmm.Scene(**chain(MIXED, skew=0.4)), engine="looped")


def text_of(model: mstmm.Model, part: str) -> str:
    structure, _ = structure_of(model.packed_scene.system, model.known or {})
    return fused_sources(model.fusion.structure_ir(structure), KEY, part)["fused.c"]


@pytest.mark.parametrize("compiler", COMPILERS)
def test_one_state_and_many(
    compiler: str, model: mstmm.Model, tmp_path: Path, rng: np.random.Generator
) -> None:
    _, p = structure_of(model.packed_scene.system, model.known or {})
    (tmp_path / "lanes").mkdir()
    scalar = open_library(compile_source(text_of(model, "scalar"), tmp_path, compiler), KEY)
    lanes = open_library(compile_source(text_of(model, "lanes"), tmp_path / "lanes", compiler), KEY)
    states = [drawn_state(chain(MIXED, skew=0.4), rng) for _ in range(11)]
    q, u = (np.array([state[k] for state in states]) for k in (0, 1))
    wanted = model.accelerations(q, u)
    size = np.abs(wanted).max(axis=1, keepdims=True)
    memory, none = np.zeros(max(1, scalar.n_memory)), np.zeros(model.nu)
    udot, qdot = np.empty_like(u), np.empty_like(q)
    assert not lanes.accelerations_batch(p, np.zeros(1), q, u, memory, None, udot, qdot).any()
    assert (np.abs(udot - wanted) / size).max() < 1e-13
    for k in range(len(q)):
        code, rates, one = scalar.evaluate(p, 0.0, q[k], u[k], memory, none)
        assert code == 0
        assert np.abs(one - wanted[k]).max() / size[k] < 1e-13
        assert np.abs(rates - qdot[k]).max() < 1e-13
    assert lanes.lanes in (2, 4, 8)
    assert scalar.lanes == 1


def test_every_state_may_have_its_own_row(model: mstmm.Model, tmp_path: Path) -> None:
    """Strides of p, t, memory and efforts: a row for each state equals one row for all."""
    _, p = structure_of(model.packed_scene.system, model.known or {})
    library = open_library(compile_source(text_of(model, "lanes"), tmp_path), KEY)
    q0, u0 = drawn_state(chain(MIXED, skew=0.4), np.random.default_rng(2))
    n = 5
    q, u, memory = np.tile(q0, (n, 1)), np.tile(u0, (n, 1)), np.zeros(max(1, library.n_memory))
    rows, shared = np.empty_like(u), np.empty_like(u)
    numbers = np.tile(p, (n, 1))
    numbers[3] *= 1.5
    efforts = np.zeros_like(u)
    efforts[1] = 2.0
    library.accelerations_batch(
        numbers, np.arange(5.0), q, u, np.tile(memory, (n, 1)), efforts, rows
    )  # nothing here depends on time
    library.accelerations_batch(p, np.zeros(1), q, u, memory, None, shared)
    same = [row.tobytes() == shared[0].tobytes() for row in rows]
    assert same == [True, False, True, False, True]


def test_prepared_calls(model: mstmm.Model, tmp_path: Path) -> None:
    _, p = structure_of(model.packed_scene.system, model.known or {})
    library = open_library(compile_source(text_of(model, "scalar"), tmp_path), KEY)
    q, u = drawn_state(chain(MIXED, skew=0.4), np.random.default_rng(3))
    call = SingleStateCall(library, p)
    call.q[:], call.u[:] = q, u
    assert call() == 0
    first = call.udot.copy()
    call.efforts[:] = 1.0
    assert call() == 0
    assert not np.array_equal(first, call.udot)


def check_refusal(path: Path, key: str, match: str) -> None:
    with pytest.raises(EnvironmentFailure, match=match):
        open_library(path, key)


def test_files_that_are_no_such_library(model: mstmm.Model, tmp_path: Path) -> None:
    check_refusal(tmp_path / "missing.so", KEY, "cannot be loaded")
    text = text_of(model, "scalar")
    whole = compile_source(text, tmp_path)
    assert isinstance(open_library(whole, KEY), FusedLibrary)
    check_refusal(whole, "6" * 64, "key 5555.*expected 6666")
    empty = tmp_path / "empty.so"
    empty.write_bytes(b"")
    check_refusal(empty, KEY, "cannot be loaded")
    for name, old, new, match in (
        ("older", f".abi = {fused_abi.ABI_VERSION}", ".abi = 1", "layout 1, this mstmm has"),
        ("other", fused_abi.SYMBOL, "something_else", "no fused library"),
    ):
        folder = tmp_path / name
        folder.mkdir()
        check_refusal(compile_source(text.replace(old, new), folder), KEY, match)
