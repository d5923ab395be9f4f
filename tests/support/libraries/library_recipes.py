"""A cache of the test's own, a recipe whose library computes something, and false compilers."""

from __future__ import annotations

import contextlib
import os
import shutil
import stat
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cffi

from mstmm.runtime.libraries.cache import Recipe
from mstmm.runtime.libraries.cache_files import read_entry
from mstmm.runtime.libraries.library_build import LOCK_SUFFIX, UNFINISHED_PREFIX

#: A user who owns nothing here.
NOBODY = 65534

_TEXT = """\
#include <string.h>
const char mstmm_fused_library[] = "{key}";
double scaled(double x) {{ return {factor} * x; }}
{more}
"""


@dataclass
class Kernel:
    """A library with one function, x -> factor * x; counts how often its text is printed."""

    factor: int = 3
    more: str = ""
    printed: list[str] = field(default_factory=list)

    @property
    def recipe(self) -> Recipe:
        identity = {"factor": str(self.factor), "more": self.more}
        return Recipe("kernel", identity, self._sources, ("-O1", "-march=native"))

    def _sources(self, key: str) -> dict[str, str]:
        self.printed.append(key)
        return {"kernel.c": _TEXT.format(key=key, factor=self.factor, more=self.more)}


def library_value(path: Path, key: str, x: float = 7.0) -> float:
    """Value of the library at `path` for x.  OSError if it does not open or has another key."""
    ffi = cffi.FFI()
    ffi.cdef("extern const char mstmm_fused_library[]; double scaled(double x);")
    lib: Any = ffi.dlopen(str(path))
    try:
        found = ffi.string(lib.mstmm_fused_library)
        if found != key.encode():
            raise OSError(f"key {found!r}")
        return float(lib.scaled(x))
    finally:
        ffi.dlclose(lib)


def entry_folders(cache: Path) -> list[Path]:
    """The entries of a cache, right or wrong."""
    return sorted(path for path in cache.iterdir() if not path.name.startswith("."))


def assert_tidy(cache: Path, count: int) -> None:
    """`count` whole entries, and nothing half: no folder of a build, no other file but locks."""
    folders = entry_folders(cache)
    assert len(folders) == count
    for folder in folders:
        assert read_entry(folder) is not None
        names = {path.name for path in folder.iterdir()}
        assert names == {"entry.json", "kernel.c.gz", "kernel.so"}
    hidden = [path.name for path in cache.iterdir() if path.name.startswith(".")]
    assert not [name for name in hidden if name.startswith(UNFINISHED_PREFIX)]
    assert all(name.endswith(LOCK_SUFFIX) for name in hidden)


def false_compiler(folder: Path, script: str, name: str = "cc") -> Path:
    """A compiler that is a shell script; `$REAL "$@"` in it is the true one."""
    real = shutil.which("gcc") or shutil.which("cc") or shutil.which("clang")
    assert real is not None
    path = folder / name
    path.write_text(f"#!/bin/sh\nREAL={real}\n{script}\n")
    path.chmod(path.stat().st_mode | stat.S_IXUSR | stat.S_IXGRP | stat.S_IXOTH)
    return path


@contextlib.contextmanager
def without_privileges() -> Iterator[None]:
    """Root may write everywhere; for a moment it is nobody.  Others stay who they are."""
    if os.geteuid() != 0:
        yield
        return
    os.seteuid(NOBODY)
    try:
        yield
    finally:
        os.seteuid(0)


def alive(pid: int) -> bool:
    """Is there such a process, and is it more than a corpse nobody has fetched?"""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state not in "ZX"
