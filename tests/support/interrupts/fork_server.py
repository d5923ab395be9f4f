"""A process that forks commands of mstmm which are signalled at a chosen point: program, not test.

Every line on its standard input is a command as JSON; every line it answers says how that ended.
A point is counted, not timed: the n-th step that touches a file ("files"), or the n-th line
executed in the rooms that keep a run ("lines").  Where "after" is not None the signal comes after
so many seconds instead.
"""

from __future__ import annotations

import json
import mmap
import os
import signal
import struct
import sys
import time
from pathlib import Path
from types import FrameType
from typing import Any

from mstmm import signal_handling
from mstmm.cli import error_boundary
from mstmm.runtime.run import integration_run, run_execution

#: Events of Python's audit that are steps of files, each told before it happens.
STEPS = {"open", "os.rename", "os.remove", "os.truncate", "os.chmod", "fcntl.flock"}

SIGNALS = (signal.SIGINT, signal.SIGTERM)

#: Files whose lines are counted.
TRACED_FILES = (
    "cli/simulate.py", "checkpoint.py", "run_execution.py", "safe_files.py", "file_lock.py",
    "xarray_dataset.py",
)  # fmt: skip


class Countdown:
    """Sends a signal to this process when `count_point` has been called `at` times, and then, where
    `every` is not 0, again after so many times."""

    def __init__(self, number: int, at: int, every: int, count: mmap.mmap) -> None:
        self.number, self.at, self.every = number, at, every
        self.shared, self.count = count, 0

    def count_point(self) -> None:
        self.count += 1
        self.shared[:8] = struct.pack("q", self.count)
        behind = self.count - self.at
        if self.at > 0 and (behind == 0 or (behind > 0 and self.every and not behind % self.every)):
            os.kill(os.getpid(), self.number)

    def on_files(self) -> None:
        folder = os.getcwd()

        def hook(event: str, details: tuple[Any, ...]) -> None:
            if event in STEPS and (event == "fcntl.flock" or _inside(details[0], folder)):
                self.count_point()

        sys.addaudithook(hook)

    def on_lines(self) -> None:
        def line(frame: FrameType, event: str, _: object) -> Any:
            if event == "line":
                self.count_point()
            return line

        def call(frame: FrameType, event: str, _: object) -> Any:
            return line if frame.f_code.co_filename.endswith(TRACED_FILES) else None

        sys.settrace(call)


def _inside(path: object, folder: str) -> bool:
    if not isinstance(path, (str, bytes, os.PathLike)):
        return False
    return os.path.dirname(os.path.abspath(os.fsdecode(path))) == folder


def child(kill: dict[str, Any], count: mmap.mmap) -> None:
    """Run one command as the program does; never returns."""
    os.chdir(kill["folder"])
    for number, name in ((1, "out"), (2, "err")):
        handle = os.open(Path(kill["streams"]) / name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        os.dup2(handle, number)
    for each in SIGNALS:
        signal.signal(each, signal.SIG_IGN if each in kill["ignored"] else signal.SIG_DFL)
    run_execution.CHECKPOINT_INTERVAL = integration_run.SLICE = kill["pace"]
    signal_handling.exit_on_signal()
    signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)  # what comes too early waits until here
    countdown = Countdown(kill["signal"], kill["at"], kill["every"], count)
    getattr(countdown, f"on_{kill['points']}")()
    error_boundary.run_and_exit(kill["arguments"])


def main() -> None:
    """Serve until the input ends."""
    count = mmap.mmap(-1, 8)
    for line in sys.stdin:
        kill = json.loads(line)
        count[:8] = struct.pack("q", 0)
        signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
        process = os.fork()
        if process == 0:
            try:
                child(kill, count)
            except SystemExit as end:
                sys.stdout.flush()
                os._exit(end.code if isinstance(end.code, int) else 1)
            except BaseException:
                sys.excepthook(*sys.exc_info())
            os._exit(1)
        if kill["after"] is not None:
            time.sleep(kill["after"])
            os.kill(process, kill["signal"])  # a corpse, where it came too late
        _, status = os.waitpid(process, 0)
        ended = {"code": os.waitstatus_to_exitcode(status), "points": struct.unpack("q", count)[0]}
        print(json.dumps(ended), flush=True)


if __name__ == "__main__":
    sys.stdout.reconfigure(line_buffering=True)  # type: ignore[union-attr]
    error_boundary.run(["simulate", *sys.argv[1:]])  # loads all that a command needs
    print(json.dumps({"ready": True}), flush=True)
    main()
