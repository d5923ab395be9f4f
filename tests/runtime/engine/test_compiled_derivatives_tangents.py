"""Compiled derivatives against those of the tape; when there are which."""

from __future__ import annotations

import ctypes
from pathlib import Path

import numpy as np
import pytest

import mstmm
from mstmm.abi.derivative_library import SYMBOL
from mstmm.errors import EnvironmentFailure
from mstmm.runtime.engine import compiled_derivatives
from mstmm.runtime.kernels.scene_libraries import open_derivative_library
from tests.reference.compare import seeded_scene, worst

ARRAYS = ("q", "u", "efforts", "t", "rate_q", "rate_u")
TIME = 0.3


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A cache of its own, empty."""
    monkeypatch.setenv("MSTMM_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def in_use(model: mstmm.Model, names: tuple[str, ...] = ()) -> bool:
    return model._differentiations[names].tangents.uses_compiled_code


def test_compiled_and_interpreted_agree(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Quaternions, laws, loads; a batch; parameters; and the next model finds the library."""
    data, q, u = seeded_scene(33, types=("ball", "pin"), most=2)
    scene = mstmm.Scene(**data)
    names = (f"{data['body'][0]['name']}.mass", "gravity[1]")
    batch = np.stack([q, q, q]), np.stack([u, 2 * u, -u])
    tape = mstmm.compile(scene)
    wanted = tape.derivatives(*batch, TIME, parameters=names)
    assert not in_use(tape, names)
    monkeypatch.setattr(compiled_derivatives, "WORTH_COMPILING", 0)
    model = mstmm.compile(scene)
    found = model.derivatives(*batch, TIME, parameters=names)
    assert in_use(model, names)
    for name in ARRAYS:
        assert worst(getattr(found, name), getattr(wanted, name), floor=1.0) < 1e-11, name
    for name in names:
        assert worst(found.parameters[name], wanted.parameters[name], floor=1.0) < 1e-11
    one = model.derivatives(q, 2 * u, TIME, parameters=names)
    assert all(np.array_equal(getattr(one, name), getattr(found, name)[1]) for name in ARRAYS)
    monkeypatch.undo()
    monkeypatch.setenv("MSTMM_CACHE", str(cache))
    again = mstmm.compile(scene)
    cached = again.derivatives(*batch, TIME, parameters=names)
    assert in_use(again, names)
    assert all(np.array_equal(getattr(cached, name), getattr(found, name)) for name in ARRAYS)


def test_the_compiler_is_started_when_directions_add_up(
    cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data, q, u = seeded_scene(11, types=("pin",), most=1)
    model = mstmm.compile(mstmm.Scene(**data))
    per_state = 4 * model.nu + 1
    monkeypatch.setattr(compiled_derivatives, "WORTH_COMPILING", 3 * per_state)
    for count in range(1, 5):
        model.derivatives(q, u)
        assert in_use(model) == (count > 3)


def test_without_a_compiler_the_tape_goes_on(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiled_derivatives, "WORTH_COMPILING", 0)
    monkeypatch.setenv("CC", "/bin/false")
    data, q, u = seeded_scene(11, most=2)
    model = mstmm.compile(mstmm.Scene(**data))
    for _ in range(2):
        found = model.derivatives(q, u)
        assert not in_use(model)
        assert worst(found.efforts @ model.mass_matrix(q), np.eye(model.nu)) < 1e-11


def test_the_looped_engine_never_compiles(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiled_derivatives, "WORTH_COMPILING", 0)
    data, q, u = seeded_scene(11, most=2)
    model = mstmm.compile(mstmm.Scene(**data), engine="looped")
    model.derivatives(q, u)
    assert not in_use(model)


def test_another_library_is_refused(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiled_derivatives, "WORTH_COMPILING", 0)
    data, q, u = seeded_scene(11, types=("pin",), most=1)
    model = mstmm.compile(mstmm.Scene(**data))
    model.derivatives(q, u)
    (path,) = [p for p in cache.rglob("*.so") if hasattr(ctypes.CDLL(str(p)), SYMBOL)]
    with pytest.raises(EnvironmentFailure, match="is not the expected library of derivatives"):
        open_derivative_library(path, "another key")
    with pytest.raises(EnvironmentFailure, match="cannot be loaded"):
        open_derivative_library(cache / "nothing.so", "key")
