"""What is found again, what is built again, and what a key depends on."""

from __future__ import annotations

import gzip
import json
import os
import stat
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from mstmm.errors import EnvironmentFailure
from mstmm.runtime.libraries import cache, toolchain
from mstmm.runtime.libraries.cache import clean_cache, list_entries
from tests.support.libraries.library_recipes import (
    Kernel,
    assert_tidy,
    entry_folders,
    false_compiler,
    library_value,
)


def test_second_time_nothing_is_printed_or_compiled(
    cache_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kernel = Kernel()
    assert cache.find(kernel.recipe) is None
    first = cache.library(kernel.recipe)
    assert (first.how, first.note) == ("compiled", "") and first.seconds > 0
    assert library_value(first.path, first.key) == 21.0

    def no_process(*arguments: object, **more: object) -> None:
        raise AssertionError("a process was started")

    monkeypatch.setattr(subprocess, "Popen", no_process)
    second = cache.library(kernel.recipe)
    assert second == replace(first, how="cached")
    assert cache.find(kernel.recipe) == second
    assert kernel.printed == [first.key]
    assert_tidy(cache_folder, 1)


def test_warm_hit_loads_neither_numpy_nor_what_starts_processes(cache_folder: Path) -> None:
    built = cache.library(Kernel().recipe)
    script = (
        "import sys; before = set(sys.modules)\n"
        "from mstmm.runtime.libraries import cache\n"
        "from pathlib import Path\n"
        "from mstmm.runtime.libraries.library_build import find_library\n"
        f"assert find_library(Path({str(built.path.parent)!r}), {built.key!r}) is not None\n"
        "print(*(set(sys.modules) - before))\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, check=True)
    assert not {"numpy", "subprocess", "cffi", "gzip"} & set(done.stdout.decode().split())


def test_entry_says_what_it_was_made_of(cache_folder: Path) -> None:
    kernel = Kernel()
    built = cache.library(kernel.recipe)
    about = json.loads((built.path.parent / "entry.json").read_text())
    assert about["identity"] == {"factor": "3", "more": ""} and about["key"] == built.key
    assert about["flags"] == ["-O1", "-march=native"]
    assert about["compiler"]["path"] == toolchain.find_compiler().path
    assert about["compiler_version"] != "unknown"
    text = gzip.decompress((built.path.parent / "kernel.c.gz").read_bytes()).decode()
    assert "return 3 * x;" in text and built.key in text


def test_folder_is_made_for_its_user_alone(cache_folder: Path) -> None:
    previous = os.umask(0)
    try:
        cache.library(Kernel().recipe)
    finally:
        os.umask(previous)
    assert stat.S_IMODE(cache_folder.stat().st_mode) == 0o700


# --- what a key depends on ------------------------------------------------------------------------

Change = Callable[[cache.Recipe, pytest.MonkeyPatch, Path], cache.Recipe]


def _other_compiler(recipe: cache.Recipe, patch: pytest.MonkeyPatch, folder: Path) -> cache.Recipe:
    patch.setenv("CC", str(false_compiler(folder, 'exec $REAL "$@"')))
    return recipe


def _updated_compiler(
    recipe: cache.Recipe, patch: pytest.MonkeyPatch, folder: Path
) -> cache.Recipe:
    found = toolchain.find_compiler()
    patch.setattr(toolchain, "find_compiler", lambda: replace(found, modified=found.modified + 1))
    return recipe


def _other_processor(recipe: cache.Recipe, patch: pytest.MonkeyPatch, folder: Path) -> cache.Recipe:
    patch.setattr(toolchain, "processor_features", lambda: {"model name": "other", "flags": "sse2"})
    return recipe


def _other_version(recipe: cache.Recipe, patch: pytest.MonkeyPatch, folder: Path) -> cache.Recipe:
    patch.setattr("mstmm.version.__version__", "99.9")
    return recipe


def _other_headers(recipe: cache.Recipe, patch: pytest.MonkeyPatch, folder: Path) -> cache.Recipe:
    patch.setenv("CPATH", str(folder))
    return recipe


CHANGES: dict[str, Change] = {
    "identity": lambda recipe, patch, folder: replace(recipe, identity={"factor": "4"}),
    "flags": lambda recipe, patch, folder: replace(recipe, flags=("-O2", "-march=native")),
    "name": lambda recipe, patch, folder: replace(recipe, name="other"),
    "compiler": _other_compiler,
    "updated compiler": _updated_compiler,
    "processor": _other_processor,
    "version": _other_version,
    "headers": _other_headers,
}


@pytest.mark.parametrize("change", CHANGES)
def test_what_decides_the_code_decides_the_key(
    change: str, cache_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recipe = Kernel().recipe
    _, before = cache._place_and_order(recipe)
    _, same = cache._place_and_order(Kernel().recipe)
    _, after = cache._place_and_order(CHANGES[change](recipe, monkeypatch, tmp_path))
    assert same.key == before.key != after.key


def test_processor_is_read_from_its_first_block(tmp_path: Path) -> None:
    x86 = tmp_path / "x86"
    x86.write_text(
        "processor\t: 0\nmodel name\t: Some CPU\ncpu MHz\t: 1.0\nflags\t: fpu avx2\n\n"
        "processor\t: 1\nflags\t: fpu\n"
    )
    found = toolchain.processor_features(x86)
    assert found["flags"] == "fpu avx2" and found["model name"] == "Some CPU"
    assert "cpu MHz" not in found and "host" not in found
    arm = tmp_path / "arm"
    arm.write_text("processor\t: 0\nFeatures\t: fp asimd\nCPU part\t: 0xd0c\n")
    assert toolchain.processor_features(arm)["Features"] == "fp asimd"


def test_unknown_processor_shares_with_no_other_machine(tmp_path: Path) -> None:
    assert toolchain.processor_features(tmp_path / "missing")["host"] == os.uname().nodename


# --- what was changed behind our back -------------------------------------------------------------


def _truncate_file(library: Path) -> None:
    library.write_bytes(library.read_bytes()[:-100])


def _empty_file(library: Path) -> None:
    library.write_bytes(b"")


def _flip_bit(library: Path) -> None:
    content = bytearray(library.read_bytes())
    content[len(content) // 2] ^= 4
    library.write_bytes(content)


def _of_another(library: Path) -> None:
    other = cache.library(Kernel(factor=5).recipe)
    for path in other.path.parent.iterdir():
        (library.parent / path.name).write_bytes(path.read_bytes())


def _delete_description(library: Path) -> None:
    (library.parent / "entry.json").unlink()


def _garble_description(library: Path) -> None:
    (library.parent / "entry.json").write_bytes(b'{"format": 1, "key": \xff')


def _older_layout(library: Path) -> None:
    path = library.parent / "entry.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "format": 0}))


def _pointing_away(library: Path) -> None:
    path = library.parent / "entry.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "library": "../other.so"}))


def _a_file(library: Path) -> None:
    for path in library.parent.iterdir():
        path.unlink()
    library.parent.rmdir()
    library.parent.write_text("in the way")


DAMAGES = {
    "bytes of": _truncate_file,
    "0 bytes": _empty_file,
    "checksum": _flip_bit,
    "another scene": _of_another,
    "missing": _delete_description,
    "cannot be read": _garble_description,
    "another layout": _older_layout,
    "another folder": _pointing_away,
    "description": _a_file,
}


@pytest.mark.parametrize("said", DAMAGES)
def test_damaged_entry_is_built_again(said: str, cache_folder: Path) -> None:
    kernel = Kernel()
    first = cache.library(kernel.recipe)
    DAMAGES[said](first.path)
    assert cache.find(kernel.recipe) is None
    again = cache.library(kernel.recipe)
    assert again.how == "compiled" and again.path == first.path
    assert said in again.note and "\n" not in again.note
    assert library_value(again.path, again.key) == 21.0
    assert cache.library(kernel.recipe).how == "cached"
    assert_tidy(cache_folder, 2 if said == "another scene" else 1)


def test_library_of_another_layout_is_built_again_once(cache_folder: Path) -> None:
    kernel = Kernel()
    cache.library(kernel.recipe)
    refused: list[Path] = []

    def opener(path: Path, key: str) -> float:
        if not refused:
            refused.append(path)
            raise EnvironmentFailure("built for ABI 0")
        return library_value(path, key)

    value, built = cache.open_cached_library(kernel.recipe, opener)
    assert value == 21.0 and built.how == "compiled" and len(kernel.printed) == 2
    assert_tidy(cache_folder, 1)


def test_library_that_is_refused_for_ever_is_told(cache_folder: Path) -> None:
    def opener(path: Path, key: str) -> float:
        raise OSError("wrong ELF class")

    kernel = Kernel()
    cache.library(kernel.recipe)
    with pytest.raises(EnvironmentFailure, match="wrong ELF class"):
        cache.open_cached_library(kernel.recipe, opener)
    assert len(kernel.printed) == 2


# --- how much is kept -----------------------------------------------------------------------------


def test_least_recently_used_goes_first(
    cache_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    built = [cache.library(Kernel(factor=i).recipe) for i in range(4)]
    for age, one in enumerate(built):
        then = one.path.stat().st_mtime - 1000 * (age + 1)
        os.utime(one.path.parent / "entry.json", (then, then))
    assert cache.library(Kernel(factor=3).recipe).how == "cached"  # used now: no longer the oldest
    size = sum(entry.bytes for entry in list_entries(cache_folder))
    monkeypatch.setenv("MSTMM_CACHE_SIZE", str(1.1 * size / 1e6))  # room for four
    cache.library(Kernel(factor=9).recipe)
    kept = {entry.about["key"] for entry in list_entries(cache_folder)}
    assert built[2].key not in kept and {built[0].key, built[1].key, built[3].key} < kept


def test_what_is_in_use_stays_beyond_the_limit(
    cache_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MSTMM_CACHE_SIZE", "0")
    for i in range(3):
        cache.library(Kernel(factor=i).recipe)
    assert len(entry_folders(cache_folder)) == 3


def test_clean_spares_what_was_used_lately(cache_folder: Path) -> None:
    old, new = (cache.library(Kernel(factor=i).recipe) for i in (1, 2))
    os.utime(old.path.parent / "entry.json", (1e9, 1e9))
    assert clean_cache(cache_folder, unused=3600.0)[0] == 1
    assert not old.path.exists() and library_value(new.path, new.key) == 14.0
    count, size = clean_cache(cache_folder)
    assert count == 1 and size > 1000
    assert list(cache_folder.iterdir()) == []
