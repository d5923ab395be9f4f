"""What goes wrong while a result is saved costs no run; what killed writers left is swept."""

from __future__ import annotations

import errno
import json
import os
import signal
import subprocess
import sys
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import mstmm as library
from mstmm import errors
from mstmm.runtime.experiments import run_results
from mstmm.runtime.integrate.c_loop import Status
from mstmm.runtime.platform_support import interrupts
from mstmm.runtime.platform_support.safe_files import replace_atomically
from mstmm.runtime.result.export import column_files
from mstmm.runtime.run import integration_run, run_execution
from tests.support.commands import Command
from tests.support.scenes.chart import pendulum

RUN = ("simulate", "pendulum.toml", "--t-end", "1", "-o", "a.csv", "--no-certify")
KEPT = "the run is saved in a.csv.checkpoint; continue with the same command and --resume"


@pytest.mark.parametrize(
    ("error", "code", "said"),
    [
        (OSError(errno.ENOSPC, "No space left on device"), 3, "No space left on device"),
        (MemoryError(), 3, "not enough memory"),
        (KeyboardInterrupt(), 130, "interrupted"),
    ],
    ids=["disk", "memory", "interrupt"],
)
@pytest.mark.parametrize("options", [(), ("--certify",)], ids=["plain", "certified"])
def test_a_result_that_cannot_be_saved(
    mstmm: Command, folder: Path, monkeypatch: pytest.MonkeyPatch,
    error: BaseException, code: int, said: str, options: tuple[str, ...],
) -> None:  # fmt: skip
    assert mstmm(*RUN, *options).code == 0
    whole = (folder / "a.csv").read_bytes()
    (folder / "a.csv").unlink()

    def fail(*_: object) -> None:
        raise error

    with monkeypatch.context() as patch:
        patch.setitem(column_files.TABLES, ".csv", fail)
        done = mstmm(*RUN, *options)
    assert done.code == code and said in done.err and KEPT in done.err
    assert {path.name for path in folder.iterdir()} == {"pendulum.toml", "a.csv.checkpoint"}
    with np.load(folder / "a.csv.checkpoint") as file:
        data = {key: file[key] for key in file.files}
    with (folder / "a.csv.checkpoint").open("wb") as kept:
        np.savez(kept, **(data | {"seconds": np.array(5000.0)}))
    with monkeypatch.context() as patch:
        patch.setattr(run_execution, "_advance_and_save", fail)  # nothing is computed again
        again = mstmm(*RUN, "--resume", "--json")
    assert again.code == 0 and json.loads(again.out)["seconds"] > 5000
    assert (folder / "a.csv").read_bytes() == whole
    assert {path.name for path in folder.iterdir()} == {"pendulum.toml", "a.csv"}


def test_an_interrupt_while_the_error_is_estimated(
    mstmm: Command, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The result is there, and the checkpoint goes with the last step alone."""

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(run_results, "second_run", interrupt)
        done = mstmm(*RUN[:-1], "--certify", "--json")
    assert done.code == 130 and KEPT in json.loads(done.out)["error"]["message"]
    first = (folder / "a.csv").read_bytes()
    assert mstmm(*RUN[:-1], "--certify", "--resume").code == 0
    assert (folder / "a.csv").read_bytes() == first
    assert {path.name for path in folder.iterdir()} == {"pendulum.toml", "a.csv"}


#: Writes half a file, says so, and waits to be killed.
WRITER = """
import sys, time
from pathlib import Path
from mstmm.runtime.platform_support.safe_files import replace_atomically
from mstmm.runtime.integrate.c_loop import Status
with replace_atomically(Path(sys.argv[1])) as file:
    file.write_text("half")
    print("half", flush=True)
    time.sleep(600)
"""


def test_leftovers_go_with_their_writer_and_not_before(tmp_path: Path) -> None:
    target = tmp_path / "a[1].csv"
    writer = subprocess.Popen(
        [sys.executable, "-c", WRITER, str(target)], stdout=subprocess.PIPE, text=True
    )
    assert writer.stdout is not None and writer.stdout.readline() == "half\n"
    with replace_atomically(tmp_path / "b.csv") as file:
        file.write_text("whole")
    assert len(list(tmp_path.iterdir())) == 3  # the other one is still at work
    writer.kill()
    writer.communicate()
    with replace_atomically(target) as file:
        file.write_text("whole")
    assert {path.name for path in tmp_path.iterdir()} == {"a[1].csv", "b.csv"}
    assert target.read_text() == "whole"


def test_a_file_is_on_the_disk_before_it_takes_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    steps = list[str]()
    fsync, replace = os.fsync, Path.replace

    def noted_fsync(handle: int) -> None:
        steps.append("sync")
        fsync(handle)

    def noted_replace(path: Path, target: Path) -> Path:
        steps.append("name")
        return replace(path, target)

    monkeypatch.setattr(os, "fsync", noted_fsync)
    monkeypatch.setattr(Path, "replace", noted_replace)
    with replace_atomically(tmp_path / "a.csv") as file:
        file.write_text("whole")
    assert steps == ["sync", "name", "sync"]


def test_a_folder_that_cannot_be_written(tmp_path: Path) -> None:
    with (
        pytest.raises(errors.EnvironmentFailure, match="cannot be written"),
        replace_atomically(tmp_path / "none" / "a.csv") as file,
    ):
        file.write_text("")


@pytest.mark.parametrize("which", [signal.SIGINT, signal.SIGTERM], ids=["SIGINT", "SIGTERM"])
def test_a_run_that_does_not_look_is_left_by_the_second_interrupt(
    heard: None, monkeypatch: pytest.MonkeyPatch, which: signal.Signals
) -> None:
    with interrupts.record_interrupts() as flag:
        for _ in range(3):
            signal.raise_signal(which)
        assert flag
        monkeypatch.setattr(interrupts, "MAX_INTERRUPT_DELAY", -1.0)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(which)
    assert signal.getsignal(which) is signal.default_int_handler


@pytest.mark.parametrize("inner", [False, True])
@pytest.mark.parametrize("outer", [False, True])
def test_an_interrupt_that_nobody_hears_comes_again(heard: None, inner: bool, outer: bool) -> None:
    reached = False
    comes = nullcontext() if inner or outer else pytest.raises(KeyboardInterrupt)
    with comes, interrupts.record_interrupts() as first:
        with interrupts.record_interrupts() as second:
            signal.raise_signal(signal.SIGINT)
            assert not inner or second
        reached = not outer or bool(first)
    assert reached
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_an_interrupt_comes_again_behind_an_error(heard: None) -> None:
    with pytest.raises(KeyboardInterrupt) as caught, interrupts.record_interrupts():
        signal.raise_signal(signal.SIGINT)
        raise ValueError
    assert isinstance(caught.value.__context__, ValueError)


def test_a_run_that_ends_by_itself_hands_an_interrupt_on(
    heard: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A program of many short runs ends by Ctrl-C, which none of them has the time to hear."""
    model, advance = library.compile(pendulum(), engine="looped"), integration_run.advance

    def signal_and_advance(*arguments: Any) -> Status | None:
        signal.raise_signal(signal.SIGINT)
        return advance(*arguments)

    monkeypatch.setattr(run_execution, "advance", signal_and_advance)
    with pytest.raises(KeyboardInterrupt):
        model.simulate(1e-3)
