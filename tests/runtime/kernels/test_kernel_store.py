"""Users' elements are built, checked and replaced as the libraries of the cache are."""

from __future__ import annotations

import os
import shutil
import stat
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import EnvironmentFailure
from mstmm.runtime.kernels import kernel_store
from mstmm.runtime.libraries.cache_files import folder_problem
from tests.support.libraries.library_recipes import false_compiler
from tests.support.paths import TESTS

DEFINITIONS = TESTS / "support" / "user_elements" / "definitions"
KNEE = {"type": "knee", "parameters": {"width": 0.06, "depth": 0.03, "slip": 0.4}}


@pytest.fixture(scope="module")
def knee_store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store with the knee, generated once."""
    folder = tmp_path_factory.mktemp("store")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("MSTMM_KERNELS", str(folder))
        patch.delenv("CC", raising=False)
        (made,) = mstmm.generate_file(DEFINITIONS / "knee.py")
    assert made.execution == "compiled"
    return folder


@pytest.fixture
def library(knee_store: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The library of a copy of that store, as a new process would meet it."""
    shutil.copytree(knee_store, tmp_path / "store")
    monkeypatch.setenv("MSTMM_KERNELS", str(tmp_path / "store"))
    monkeypatch.delenv("CC", raising=False)
    kernel_store.open_element.cache_clear()
    (found,) = (tmp_path / "store").glob("hinge_knee/*/hinge_knee.so")
    return found


def accelerations() -> tuple[str, Any]:
    """How the hinge ran (by library or tape), and two states' accelerations."""
    body = {"name": "shank", "mass": 3.0, "center_of_mass": [0.02, -0.2, 0.05],
            "inertia": [0.05, 0.02, 0.06]}  # fmt: skip
    joint = {"name": "joint", "inboard": "ground", "outboard": "shank", **KNEE}
    data = {"gravity": [0.3, -9.81, 0.2], "body": [body], "hinge": [joint]}
    model = mstmm.compile(mstmm.Scene.model_validate(data), engine="looped")
    assert model.known is not None
    how = "library" if model.known["hinge", "knee"].tape is None else "tape"
    return how, model.accelerations(np.array([[0.3], [-0.8]]), np.array([[1.0], [-2.0]]))


def replace_file(library: Path, content: bytes) -> None:
    """Replace the file under its name; processes that have it open keep the old one."""
    library.unlink()
    library.write_bytes(content)


def test_damaged_library_is_built_again_from_its_text(library: Path) -> None:
    how, expected = accelerations()
    assert how == "library"
    content = library.read_bytes()
    flipped = bytearray(content)
    flipped[len(content) // 2] ^= 1
    for damaged in (content[:1000], b"", bytes(flipped)):
        replace_file(library, damaged)
        kernel_store.open_element.cache_clear()
        how, found = accelerations()
        assert how == "library" and np.array_equal(found, expected)
        assert library.read_bytes() != damaged


def test_damaged_library_without_a_compiler_is_interpreted(
    library: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, expected = accelerations()
    replace_file(library, library.read_bytes()[:1000])
    monkeypatch.setenv("CC", "/nonexistent")
    kernel_store.open_element.cache_clear()
    how, found = accelerations()
    assert how == "tape" and np.abs(found - expected).max() < 1e-11 * np.abs(expected).max()


def test_library_is_opened_without_a_compiler(
    library: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CC", "/nonexistent")
    assert accelerations()[0] == "library"


def test_failing_compiler_leaves_nothing(
    library: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MSTMM_KERNELS", str(tmp_path / "new"))
    monkeypatch.setenv("CC", str(false_compiler(tmp_path, "echo 'error: no luck' >&2; exit 1")))
    (made,) = mstmm.generate_file(DEFINITIONS / "knee.py")
    assert (
        made.execution.startswith("interpreted")
        and "no luck" in made.execution
        and "\n" not in made.execution
    )
    left = {path.name for path in made.folder.iterdir() if not path.name.endswith(".lock")}
    assert left == {"definition.py", "element.json", "hinge_knee.c", "mstmm.h"}


def test_library_of_an_earlier_definition_goes(library: Path, tmp_path: Path) -> None:
    text = (DEFINITIONS / "knee.py").read_text(encoding="utf-8")
    assert "title = " in text
    changed = tmp_path / "my_knee.py"
    changed.write_text(text.replace('title = "', 'title = "another '), encoding="utf-8")
    (made,) = mstmm.generate_file(changed)
    assert "replacing" in made.execution
    assert not library.exists() and len(list(made.folder.glob("*/hinge_knee.so"))) == 1
    assert os.listdir(made.folder / "..") == ["hinge_knee"]


@pytest.mark.parametrize("mode", [0o777, 0o775, 0o1777])
@pytest.mark.parametrize("below", [False, True], ids=["the store", "an element"])
def test_nothing_is_taken_from_a_folder_that_others_may_write_to(
    library: Path, mode: int, below: bool
) -> None:
    place = library.parents[1] if below else library.parents[2]
    place.chmod(mode)
    generate = partial(mstmm.generate_file, DEFINITIONS / "knee.py")
    for attempt in (accelerations, kernel_store.all_specs, generate):
        with pytest.raises(EnvironmentFailure, match=r"others may write.*chmod 700.*MSTMM_KERNELS"):
            attempt()
    place.chmod(0o755)
    assert accelerations()[0] == "library"


def test_nothing_is_taken_from_a_folder_of_somebody_else(
    library: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    owner = os.geteuid()
    monkeypatch.setattr("os.geteuid", lambda: owner + 1)
    if owner != 0:  # root's are as good as ours
        with pytest.raises(EnvironmentFailure, match=r"belongs to user .*MSTMM_KERNELS"):
            accelerations()
    place, status = library.parents[2], os.stat(library.parents[2])
    assert "belongs to user" in folder_problem(place, status, owners=())


def test_a_new_store_is_private(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MSTMM_KERNELS", str(tmp_path / "new" / "store"))
    before = os.umask(0)
    try:
        (made,) = mstmm.generate_file(DEFINITIONS / "knee.py")
    finally:
        os.umask(before)
    for place in (made.folder, made.folder.parent):
        assert stat.S_IMODE(place.stat().st_mode) == 0o700
