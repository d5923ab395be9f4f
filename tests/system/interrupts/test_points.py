"""A run signalled at every point: nothing is lost, and what goes on has the bytes of the whole."""

from __future__ import annotations

import signal

import numpy as np
import pytest

from tests.support.interrupts.fork_server import TRACED_FILES
from tests.support.interrupts.interrupted_commands import CHECKPOINT, RESULT, Laboratory
from tests.support.paths import ROOT

#: Lines are many: a prime number between two that are tried.
STRIDE = {signal.SIGINT: 29, signal.SIGTERM: 31}


def time_of(laboratory: Laboratory) -> float:
    """How far the checkpoint reaches; it is whole."""
    with np.load(laboratory.folder / CHECKPOINT) as file:
        return float(file["t"][-1])


def test_traced_files_exist() -> None:
    paths = [str(path) for folder in ("mstmm", "runtime") for path in (ROOT / folder).rglob("*.py")]
    assert not [name for name in TRACED_FILES if not any(path.endswith(name) for path in paths)]


@pytest.mark.parametrize("begun", [False, True], ids=["from the start", "from a checkpoint"])
def test_killed_at_every_step_of_its_files(laboratory: Laboratory, begun: bool) -> None:
    whole, old, more = (
        laboratory.uninterrupted_result(),
        laboratory.half_way(),
        ["--resume"] if begun else [],
    )
    at, existed, reached = 0, begun, 0.0
    while True:
        at += 1
        laboratory.clear()
        if begun:
            (laboratory.folder / CHECKPOINT).write_bytes(old)
        end = laboratory.command(*more, which=signal.SIGKILL, at=at)
        if end.code == 0:
            break
        assert end.code == -signal.SIGKILL
        names = laboratory.names()
        if existed:
            assert CHECKPOINT in names or (laboratory.folder / RESULT).read_bytes() == whole, at
        if CHECKPOINT in names:
            existed = True
            assert time_of(laboratory) >= reached
            reached = time_of(laboratory)
        assert laboratory.finish_run() == whole, at
    assert at > 12 and existed and reached == pytest.approx(0.3)


@pytest.mark.parametrize("which", [signal.SIGINT, signal.SIGTERM], ids=["SIGINT", "SIGTERM"])
def test_interrupted_at_any_line(laboratory: Laboratory, which: signal.Signals) -> None:
    whole = laboratory.uninterrupted_result()
    at, said, existed = 1, set(), False
    while True:
        laboratory.clear()
        end = laboratory.command(which=which, at=at, points="lines")
        if end.points < at:
            break
        said.add(end.err)
        assert end.code in (0, 130) and end.err.startswith("mstmm: interrupted") == (end.code > 0)
        names = laboratory.names()
        assert CHECKPOINT in names or RESULT in names or not existed, at
        existed = existed or CHECKPOINT in names
        if RESULT in names:  # whole, or what there was
            part = (laboratory.folder / RESULT).read_bytes()
            assert whole.startswith(part) and (CHECKPOINT in names or part == whole), at
        assert laboratory.finish_run() == whole, at
        at += STRIDE[which]
    assert any("; the run is saved in a.csv.checkpoint" in text for text in said)
    assert any("interrupted at t = " in text and "--resume" in text for text in said)


def test_interrupted_again_and_again(laboratory: Laboratory) -> None:
    """The first interrupt ends the run, the next one the saving, none the checkpoint."""
    whole = laboratory.uninterrupted_result()
    lines = laboratory.command(points="lines").points
    for at in range(lines // 5, lines // 3, 11):
        laboratory.clear()
        end = laboratory.command(which=signal.SIGINT, at=at, every=3, points="lines")
        assert end.code == 130 and "interrupted" in end.err
        assert CHECKPOINT in laboratory.names(), at
        assert laboratory.finish_run() == whole


def test_a_checkpoint_of_another_run_is_refused(laboratory: Laboratory) -> None:
    old = laboratory.half_way()
    (laboratory.folder / CHECKPOINT).write_bytes(old)
    end = laboratory.command("--resume", "--t-end", "0.4")
    assert end.code == 2 and "checkpoint" in end.err and "kept" not in end.err
    assert (laboratory.folder / CHECKPOINT).read_bytes() == old


def test_an_ignored_signal_stays_ignored(laboratory: Laboratory) -> None:
    whole = laboratory.uninterrupted_result()
    for which in (signal.SIGINT, signal.SIGTERM):
        end = laboratory.command(which=which, at=1, every=7, points="lines", ignored=(which,))
        assert end.code == 0 and (laboratory.folder / RESULT).read_bytes() == whole
    end = laboratory.command(
        which=signal.SIGTERM, at=100, points="lines", ignored=(signal.SIGINT,)
    )  # as under nohup
    assert end.code == 130 and "interrupted at t = " in end.err
