"""A library that somebody else may have put into the cache or the store is never loaded."""

from __future__ import annotations

import hashlib
import json
import os
import stat
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from mstmm.errors import ElementError, EnvironmentFailure
from mstmm.runtime.kernels import kernel_store
from mstmm.runtime.libraries import cache
from tests.support.libraries.library_recipes import Kernel, library_value

DEEP = "[" * 100_000


def plant(entry: Path, mark: Path) -> None:
    """Replace the library by one that leaves a mark when it is loaded, with its right checksum."""
    source = entry / "planted.c"
    source.write_text(
        "#include <stdio.h>\n__attribute__((constructor)) static void load(void)\n"
        f'{{ FILE *f = fopen("{mark}", "w"); if (f) fclose(f); }}\n'
    )
    (library,) = entry.glob("*.so")
    library.unlink()
    subprocess.run(["gcc", "-shared", "-fPIC", "-o", library, source], check=True)
    about = json.loads((entry / "entry.json").read_text())
    content = library.read_bytes()
    about |= {"bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}
    (entry / "entry.json").write_text(json.dumps(about))


def open_to_others(name: str) -> Callable[[Path], None]:
    def change(entry: Path) -> None:
        path = entry / name
        path.chmod(stat.S_IMODE(path.stat().st_mode) | stat.S_IWOTH)

    return change


def turned_into_a_link(entry: Path) -> None:
    elsewhere = entry.parent.parent / "elsewhere"
    entry.rename(elsewhere)
    entry.symlink_to(elsewhere)


@pytest.mark.parametrize(
    "expose",
    [open_to_others("."), open_to_others("entry.json"), open_to_others("kernel.so"),
     turned_into_a_link],
    ids=["folder", "description", "library", "link"],
)  # fmt: skip
def test_a_library_that_others_may_have_written_is_built_again(
    expose: Callable[[Path], None], cache_folder: Path, tmp_path: Path
) -> None:
    entry = cache.library(Kernel().recipe).path.parent
    plant(entry, tmp_path / "mark")
    expose(entry)
    again = cache.library(Kernel().recipe)
    assert again.how == "compiled" and "rebuilt" in again.note
    assert library_value(again.path, again.key) == 21.0
    assert not (tmp_path / "mark").exists()


def test_entries_are_made_for_their_user_alone(cache_folder: Path) -> None:
    previous = os.umask(0)
    try:
        entry = cache.library(Kernel().recipe).path.parent
    finally:
        os.umask(previous)
    assert stat.S_IMODE(entry.stat().st_mode) == 0o700
    assert stat.S_IMODE((entry / "entry.json").stat().st_mode) == 0o600
    assert cache.library(Kernel().recipe).how == "cached"


def test_a_parent_that_all_may_change_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "open").mkdir()
    (tmp_path / "open").chmod(0o777)
    monkeypatch.setenv("MSTMM_CACHE", str(tmp_path / "open" / "cache"))
    with pytest.raises(EnvironmentFailure, match=r"others may replace.*open .*0777"):
        cache.library(Kernel().recipe)
    (tmp_path / "open").chmod(0o1777)  # as of /tmp
    assert cache.library(Kernel().recipe).how == "compiled"


def test_descriptions_that_nest_without_end_are_damaged(
    cache_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    entry = cache.library(Kernel().recipe).path.parent
    (entry / "entry.json").write_text(DEEP)
    assert cache.library(Kernel().recipe).how == "compiled"

    monkeypatch.setenv("MSTMM_KERNELS", str(tmp_path / "store"))
    place = tmp_path / "store" / "hinge_knee"
    place.mkdir(parents=True, mode=0o700)
    (tmp_path / "store").chmod(0o700)
    (place / "element.json").write_text(DEEP)
    with pytest.raises(ElementError, match="damaged"):
        kernel_store.find_spec(("hinge", "knee"))
    (place / "element.json").chmod(0o666)
    with pytest.raises(EnvironmentFailure, match=r"others may write to element\.json"):
        kernel_store.find_spec(("hinge", "knee"))
