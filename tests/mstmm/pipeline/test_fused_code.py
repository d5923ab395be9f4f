"""What a user meets: with any fault of compiler or cache, a scene gives right accelerations.

The closed form of the pendulum says what is right; `engine_reason` says what happened.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import mstmm
from mstmm.pipeline.fused_code import Fusion
from mstmm.runtime.kernels.scene_libraries import open_library
from mstmm.runtime.libraries import cache
from mstmm.runtime.libraries.cache import list_entries
from tests.support.libraries.library_recipes import NOBODY, entry_folders, false_compiler

MASS, ARM, INERTIA, G = 1.7, 0.4, 0.3, 9.81
#: Evaluations that repay any compiler.
MANY = 1e12


@pytest.fixture
def scene() -> mstmm.Scene:
    rod = {"name": "rod", "mass": MASS, "center_of_mass": [ARM, 0, 0], "inertia": [INERTIA] * 3}
    pivot = {"name": "pivot", "type": "pin", "inboard": "ground", "outboard": "rod",
             "axis": [0, 0, 1]}  # fmt: skip
    return mstmm.Scene.model_validate({"gravity": [G, 0, 0], "body": [rod], "hinge": [pivot]})


def assert_right(model: mstmm.Model) -> None:
    angles = np.linspace(-3, 3, 9)[:, None]
    square = MASS * G * ARM / (INERTIA + MASS * ARM**2)
    for q in angles:
        assert abs(model.accelerations(q, np.zeros(1))[0] + square * np.sin(q[0])) < 1e-13 * square
    batch = model.accelerations(angles, np.zeros_like(angles))
    assert np.abs(batch + square * np.sin(angles)).max() < 1e-13 * square


def test_fused_code_comes_from_the_compiler_then_from_the_cache(
    cache_folder: Path, scene: mstmm.Scene
) -> None:
    first = mstmm.compile(scene, engine="fused")
    assert first.engine == "fused" and "compiled in" in first.engine_reason
    again = mstmm.compile(scene)
    assert again.engine == "fused" and "cache" in again.engine_reason
    assert_right(first)
    assert_right(again)
    whole = [entry for entry in list_entries(cache_folder) if not entry.problem]
    assert len(whole) == len(entry_folders(cache_folder)) >= 1


Fault = Callable[[Path, Path, pytest.MonkeyPatch], None]


def _compiler(script: str, seconds: float = 300.0) -> Fault:
    def fault(folder: Path, own: Path, patch: pytest.MonkeyPatch) -> None:
        patch.setenv("CC", str(false_compiler(own, script)))
        patch.setenv("MSTMM_COMPILE_TIMEOUT", str(seconds))

    return fault


def _missing(folder: Path, own: Path, patch: pytest.MonkeyPatch) -> None:
    patch.setenv("CC", "/nonexistent/gcc")


def _foreign(folder: Path, own: Path, patch: pytest.MonkeyPatch) -> None:
    folder.mkdir(mode=0o700)
    if os.geteuid() == 0:
        os.chown(folder, NOBODY, NOBODY)
    else:
        other = os.geteuid() + 1
        patch.setattr(os, "geteuid", lambda: other)


def _open_to_all(folder: Path, own: Path, patch: pytest.MonkeyPatch) -> None:
    folder.mkdir()
    folder.chmod(0o777)


def _unwritable(folder: Path, own: Path, patch: pytest.MonkeyPatch) -> None:
    patch.setenv("MSTMM_CACHE", "/proc/cache")


#: Fault -> what the message must say, and the fault itself.
FAULTS: dict[str, tuple[str, Fault]] = {
    "no compiler": ("no C compiler", _missing),
    "compiler fails": ("could not compile", _compiler("exit 1")),
    "compiler is killed": ("killed by SIGKILL", _compiler("kill -9 $$")),
    "compiler hangs": ("did not finish", _compiler("exec sleep 600", seconds=0.5)),
    "compiler makes nonsense": (
        "cannot be used",
        _compiler('for last; do :; done\necho text >"$last"'),
    ),
    "disk is full": (
        "no space",
        _compiler('echo "cannot write: No space left on device" >&2; exit 1'),
    ),
    "folder of another": ("belongs to user", _foreign),
    "folder open to all": ("others may write", _open_to_all),
    "folder unwritable": ("/proc/cache", _unwritable),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_everything_runs_on_the_looped_engine_and_says_so(
    fault: str,
    cache_folder: Path,
    scene: mstmm.Scene,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    said, make = FAULTS[fault]
    make(cache_folder, tmp_path, monkeypatch)
    model = mstmm.compile(scene)
    assert model.fusion.ready(MANY) is None
    assert model.engine == "looped"
    assert model.engine_reason.startswith("looped: ") and said in model.engine_reason
    assert "\n" not in model.engine_reason
    assert_right(model)
    assert model.simulate(0.5, rtol=1e-9).success
    with pytest.raises(mstmm.EnvironmentFailure, match=said):
        mstmm.compile(scene, engine="fused")


@pytest.mark.parametrize("cut", [True, False])
def test_damaged_library_is_not_opened_but_built_again(
    cut: bool, cache_folder: Path, scene: mstmm.Scene
) -> None:
    mstmm.compile(scene, engine="fused")
    (folder,) = entry_folders(cache_folder)
    content = bytearray((folder / "fused.so").read_bytes())
    for place in range(64, len(content), 97):  # every function is hit
        content[place] ^= 0x15
    (folder / "fused.so").unlink()  # what is open stays as it was
    (folder / "fused.so").write_bytes(content[: len(content) // 2] if cut else content)
    assert mstmm.compile(scene).engine == "looped"  # nobody waits for a compiler here
    model = mstmm.compile(scene, engine="fused")
    assert "rebuilt" in model.engine_reason
    assert_right(model)
    assert {entry.problem for entry in list_entries(cache_folder)} == {""}


def test_library_of_another_layout_is_built_again(
    cache_folder: Path, scene: mstmm.Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As if two versions of mstmm had agreed on a key and not on the descriptor."""
    mstmm.compile(scene, engine="fused")
    attempts: list[Path] = []

    def reluctant(path: Path, key: str) -> object:
        attempts.append(path)
        if len(attempts) == 1:
            raise mstmm.EnvironmentFailure("built for layout 0")
        return open_library(path, key)

    monkeypatch.setattr("mstmm.pipeline.fused_code.open_library", reluctant)
    model = mstmm.compile(scene, engine="fused")
    assert len(attempts) == 2 and model.engine == "fused"
    assert_right(model)


def test_parameter_study_compiles_once(
    cache_folder: Path, scene: mstmm.Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = mstmm.compile(scene, engine="fused")

    def never(*arguments: object) -> float:
        raise AssertionError("the compiler was asked again")

    monkeypatch.setattr("mstmm.runtime.libraries.toolchain.build", never)
    heavier = model.with_parameters({"rod.mass": 2 * MASS})
    assert heavier.engine == "fused" and len(entry_folders(cache_folder)) == 1
    square = 2 * MASS * G * ARM / (INERTIA + 2 * MASS * ARM**2)
    found = heavier.accelerations(np.array([0.7]), np.zeros(1))[0]
    assert abs(found + square * np.sin(0.7)) < 1e-13 * square


def test_the_key_is_that_of_the_library(cache_folder: Path, scene: mstmm.Scene) -> None:
    model = mstmm.compile(scene, engine="fused")
    (entry,) = list_entries(cache_folder)
    assert isinstance(model.fusion, Fusion)
    found = cache.find(model.fusion._recipe("scalar"))
    assert found is not None and found.key == entry.about["key"]
    assert entry.folder.name.endswith(found.key[:32])
