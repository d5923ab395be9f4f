"""Another program, run so that it cannot outlive or outwait us."""

from __future__ import annotations

import contextlib
import os
import select
import signal
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path


class Hanging(Exception):
    """The program did not end within its time; it and all it started were killed."""


def run(command: Sequence[str], said: Path, timeout: float, **environment: str) -> int:
    """Run `command` in the folder of the file `said`, which receives all that it prints.

    Returns its exit code, -n where signal n ended it.  The program gets a process group of its own;
    whenever it does not end by itself and well (timeout in s, Ctrl-C, a failure), the whole group
    is killed, so that no compiler pass goes on writing.  Raises Hanging, and OSError if the program
    cannot be started.
    """
    # A file takes the output: reading a pipe could wait for ever on a grandchild that kept it open.
    with said.open("wb") as output:
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT,
            cwd=said.parent, env=_environment(environment), start_new_session=True,
        )  # fmt: skip
    try:
        _wait(process, timeout)
    finally:
        if process.returncode != 0:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
    return process.returncode


def _environment(changes: Mapping[str, str]) -> dict[str, str]:
    return {**os.environ, "LC_ALL": "C", **changes}


def _wait(process: subprocess.Popen[bytes], timeout: float) -> None:
    """Wait without the pauses of up to 50 ms that Popen.wait(timeout) sleeps."""
    try:
        handle = os.pidfd_open(process.pid)
    except (AttributeError, OSError):  # not on this system
        try:
            process.wait(timeout)
        except subprocess.TimeoutExpired:
            raise Hanging from None
        return
    try:
        poll = select.poll()
        poll.register(handle, select.POLLIN)
        if not poll.poll(timeout * 1000):
            raise Hanging
        process.wait()
    finally:
        os.close(handle)


def head(said: Path, size: int = 20_000) -> str:
    """The beginning of what a program printed."""
    try:
        with said.open("rb") as file:
            return file.read(size).decode("utf-8", "replace")
    except OSError:
        return ""
