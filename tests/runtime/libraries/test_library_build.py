"""Sixteen processes at once, some of them killed: no half entry, no wrong number, no crash."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from mstmm.runtime.libraries import cache
from mstmm.runtime.libraries.cache import clean_cache, count_unfinished_builds
from mstmm.runtime.libraries.cache_files import read_entry
from mstmm.runtime.libraries.library_build import remove_leftovers
from mstmm.runtime.platform_support import file_lock
from tests.support.libraries.library_recipes import (
    Kernel,
    alive,
    assert_tidy,
    entry_folders,
    false_compiler,
    library_value,
)
from tests.support.paths import TESTS

BUILDER = TESTS / "support" / "libraries" / "build_processes.py"


class Crowd:
    """The processes of `build_processes.py`, their ids and what they said."""

    def __init__(self, factors: list[int]) -> None:
        self.process = subprocess.Popen(
            [sys.executable, str(BUILDER), *map(str, factors)], stdout=subprocess.PIPE, text=True
        )
        assert self.process.stdout is not None
        self.output = self.process.stdout
        lines = [self.output.readline().split() for _ in factors]
        assert all(line[0] == "child" for line in lines)
        self.pids = [int(line[1]) for line in lines]

    def output_lines(self) -> list[str]:
        """Lines that the processes have printed, once all have ended."""
        rest = self.output.read()
        assert self.process.wait() == 0
        self.output.close()
        return rest.splitlines()


def counting_compiler(folder: Path, pause: str = "") -> Path:
    """A compiler that leaves a mark per run and takes its time."""
    marks = folder / "marks"
    marks.mkdir()
    return false_compiler(folder, f'touch {marks}/$$\n{pause}\nexec $REAL "$@"')


def runs(folder: Path) -> int:
    return len(list((folder / "marks").iterdir()))


def test_sixteen_want_the_same(
    cache_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CC", str(counting_compiler(tmp_path, "sleep 0.1")))
    said = Crowd([3] * 16).output_lines()
    assert Counter(line.split()[2] for line in said) == {"compiled": 1, "cached": 15}
    assert all(line.split()[:2] == ["3", "21"] for line in said)
    assert runs(tmp_path) == 2  # one compilation, one question for the version
    assert_tidy(cache_folder, 1)


def test_sixteen_want_five_and_some_are_killed(
    cache_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator
) -> None:
    """Killed at moments drawn afresh, while compiling, waiting, renaming, or before."""
    monkeypatch.setenv("CC", str(false_compiler(tmp_path, 'sleep 0.05\nexec $REAL "$@"')))
    factors = [i % 5 + 1 for i in range(16)]
    crowd = Crowd(factors)
    doomed = rng.choice(crowd.pids, 7, replace=False)
    for pid in doomed:
        time.sleep(float(rng.uniform(0.0, 0.12)))
        with contextlib.suppress(ProcessLookupError):  # it has done its work already
            os.kill(int(pid), signal.SIGKILL)
    said = crowd.output_lines()
    assert 9 <= len(said) <= 16
    for line in said:
        factor, value, how, *note = line.split()
        assert float(value) == 7.0 * int(factor) and how in ("compiled", "cached"), line
        assert not note, line
    for folder in entry_folders(cache_folder):  # whatever was left is whole
        assert read_entry(folder) is not None
    for number in range(1, 6):
        built = cache.library(Kernel(number).recipe)
        assert library_value(built.path, built.key) == 7.0 * number
    _wait_for_orphans(cache_folder)
    remove_leftovers(cache_folder, age=0.0)
    assert_tidy(cache_folder, 5)


def _wait_for_orphans(folder: Path) -> None:
    """Compilers of killed processes go on for a moment, in folders of their own."""

    def have_orphans_ended() -> bool:
        commands = (path / "cmdline" for path in Path("/proc").glob("[0-9]*"))
        return not any(str(folder).encode() in _content(path) for path in commands)

    _until(have_orphans_ended)


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError:
        return b""


#: A compiler whose pass, a process of its own, goes on for minutes; both leave their ids.
ENDLESS = """\
case "$*" in *--version*) exec $REAL "$@";; esac
sleep 600 &
echo $! >pass
wait
"""


@pytest.mark.usefixtures("heard")
@pytest.mark.parametrize("which", ["SIGTERM", "SIGKILL", "SIGINT"])
def test_lock_and_compiler_end_with_their_killed_owner(
    cache_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, which: str
) -> None:
    marks = counting_compiler(tmp_path, ENDLESS.replace("pass", str(tmp_path / "pass")))
    monkeypatch.setenv("CC", str(marks))
    crowd = Crowd([3])
    _until(lambda: (tmp_path / "pass").exists() and (tmp_path / "pass").read_text().endswith("\n"))
    started = [int((tmp_path / "pass").read_text()), *map(int, os.listdir(tmp_path / "marks"))]
    assert all(alive(pid) for pid in started)
    os.kill(crowd.pids[0], signal.Signals[which])
    assert crowd.output_lines() == []
    _until(lambda: not any(alive(pid) for pid in started))
    remains = int(which != "SIGINT")  # Python leaves its blocks there, and cleans up
    assert count_unfinished_builds(cache_folder) == remains and entry_folders(cache_folder) == []
    monkeypatch.delenv("CC")
    path = cache._place_and_order(Kernel().recipe)[0]
    with file_lock.file_lock(path.parent / f".{path.name}.lock", timeout=0.0) as remark:
        assert remark == ""  # nobody waits for the dead
    built = cache.library(Kernel().recipe)
    assert library_value(built.path, built.key) == 21.0
    assert count_unfinished_builds(cache_folder) == remains  # young: it could be somebody's
    for left in cache_folder.glob(".building-*"):
        os.utime(left, (1e9, 1e9))
    cache.library(Kernel(factor=8).recipe)
    assert_tidy(cache_folder, 2)


def _until(condition: Callable[[], bool]) -> None:
    """The test's own time limit ends the wait for what does not come."""
    while not condition():
        time.sleep(0.01)


def test_owner_that_takes_too_long_is_named_and_not_waited_for(
    cache_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Patience for the owner alone: the compiler has as long as it takes."""
    locked = file_lock.file_lock
    monkeypatch.setattr(file_lock, "file_lock", lambda place, timeout: locked(place, 1.0))
    kernel = Kernel()
    place = cache._place_and_order(kernel.recipe)[0]
    with locked(place.parent / f".{place.name}.lock", timeout=0.0) as remark:
        assert remark == ""
        built = cache.library(kernel.recipe)
    assert built.how == "compiled" and library_value(built.path, built.key) == 21.0
    assert f"process {os.getpid()} on" in built.note and "1 s" in built.note
    assert_tidy(cache_folder, 1)


def test_file_system_without_locks(cache_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def without(handle: int, operation: int) -> None:
        raise OSError(95, "Operation not supported")

    monkeypatch.setattr("fcntl.flock", without)
    built = cache.library(Kernel().recipe)
    assert library_value(built.path, built.key) == 21.0 and "no locks" in built.note
    assert_tidy(cache_folder, 1)


def test_slower_of_two_builders_takes_what_is_there(
    cache_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without a lock both compile; the second finds the place taken."""
    kernel = Kernel()
    plain = kernel.recipe
    inner: list[cache.BuiltLibrary] = []

    def sources(key: str) -> dict[str, str]:
        if not inner:
            inner.append(cache.library(kernel.recipe, timeout=60.0))
        return dict(plain.sources(key))

    monkeypatch.setattr(file_lock, "_try_lock", lambda handle: None)
    recipe = cache.Recipe(plain.name, plain.identity, sources, plain.flags)
    built = cache.library(recipe)
    assert built.path == inner[0].path and library_value(built.path, built.key) == 21.0
    assert_tidy(cache_folder, 1)


def test_threads_of_one_process(cache_folder: Path) -> None:
    kernel = Kernel()
    found: list[str] = []

    def work() -> None:
        built = cache.library(kernel.recipe)
        assert library_value(built.path, built.key) == 21.0
        found.append(built.how)

    threads = [threading.Thread(target=work) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert Counter(found) == {"compiled": 1, "cached": 7}
    assert_tidy(cache_folder, 1)


def test_removed_while_others_use_it(cache_folder: Path) -> None:
    built = cache.library(Kernel().recipe)

    def opener(path: Path, key: str) -> float:
        if not removed:
            removed.append(clean_cache(cache_folder)[0])
        return library_value(path, key)

    removed: list[int] = []
    value, again = cache.open_cached_library(Kernel().recipe, opener)
    assert value == 21.0 and removed == [1] and again.path == built.path
    assert_tidy(cache_folder, 1)


#: An owner that is killed as soon as its program runs, before it has learned of that.
KILLED_AT_ONCE = """\
import os, signal, subprocess, sys
from pathlib import Path
from mstmm.runtime.platform_support import subprocesses

start, note = subprocess.Popen, Path(sys.argv[1])

def started(command, **kept):
    made = start(command, **kept)
    if command[0] == sys.argv[2]:
        while not (note.exists() and note.read_text().endswith("\\n")): pass
        os.kill(os.getpid(), signal.SIGKILL)
    return made

subprocess.Popen = started
subprocesses.run([sys.argv[2], "version"], note.parent, 600.0)
"""


def test_a_program_ends_with_an_owner_that_is_killed_as_it_starts(tmp_path: Path) -> None:
    note = tmp_path / "pass"
    program = false_compiler(tmp_path, ENDLESS.replace("pass", str(note)))
    given = [sys.executable, "-c", KILLED_AT_ONCE, str(note), str(program)]
    assert subprocess.run(given, check=False).returncode == -signal.SIGKILL
    _until(lambda: not alive(int(note.read_text())))
