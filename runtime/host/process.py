"""Another program, run so that it cannot outlive or outwait us."""

from __future__ import annotations

import contextlib
import os
import select
import signal
import subprocess
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

#: Bytes of a program's output that are kept; the rest is read and dropped.
_KEPT = 20_000

#: Waits until nobody can write to its input any more (we are gone, whatever took us), and takes its
#: process group along.
_WATCHDOG = "read -r end; kill -s KILL 0"

#: Where the system does not announce the end of a process: pause between two looks, s.
_PAUSE = 0.01


class Hanging(Exception):
    """The program did not end within its time; it and all it started were killed."""


@dataclass(frozen=True)
class Ended:
    """Exit code of a program, -n where signal n ended it, and the beginning of what it said."""

    code: int
    said: str

    def signal(self) -> str:
        """Name of the signal that ended it."""
        known = -self.code in set(signal.Signals)
        return signal.Signals(-self.code).name if known else f"signal {-self.code}"


def run(command: Sequence[str], folder: Path, timeout: float, **environment: str) -> Ended:
    """Run `command` in `folder` for at most `timeout` s, with changes to the environment.

    The program gets a process group with a watchdog; whenever it does not end by itself and well
    (time, Ctrl-C, a failure), the whole group is killed, so that no compiler pass goes on writing;
    so it is when this process is killed.  Raises Hanging, and OSError if the program cannot be
    started.
    """
    # A pipe, for the disk may be full; we stop reading when the program itself has ended, for a
    # grandchild could keep the pipe open for ever.
    reader, writer = os.pipe()
    try:
        os.set_blocking(reader, False)
        with _watched_group() as group:
            try:
                process = subprocess.Popen(
                    command, stdin=subprocess.DEVNULL, stdout=writer, stderr=subprocess.STDOUT,
                    cwd=folder, env={**os.environ, "LC_ALL": "C", **environment},
                    process_group=group,
                )  # fmt: skip
            finally:
                os.close(writer)
            try:
                said = _said_until_the_end(process, reader, timeout)
            finally:
                if process.returncode != 0:
                    with contextlib.suppress(ProcessLookupError, PermissionError):
                        os.killpg(group or process.pid, signal.SIGKILL)
                    process.wait()
    finally:
        os.close(reader)
    return Ended(process.returncode, said.decode("utf-8", "replace"))


@contextlib.contextmanager
def _watched_group() -> Iterator[int]:
    """Number of a process group that is killed if this process ends inside the block, whenever that
    is: the watchdog is in it before anybody else.  0, a group of one's own, without a watchdog."""
    reader, writer = os.pipe()
    with contextlib.ExitStack() as ends:
        ends.callback(os.close, writer)
        try:
            dog = subprocess.Popen(
                ["sh", "-c", _WATCHDOG], stdin=reader, stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL, process_group=0,
            )  # fmt: skip
        except OSError:  # no shell
            yield 0
            return
        finally:
            os.close(reader)
        ends.callback(dog.wait)
        ends.callback(dog.kill)  # before it can see the end of its input
        yield dog.pid


def _said_until_the_end(process: subprocess.Popen[bytes], reader: int, timeout: float) -> bytes:
    """What the program writes; Hanging if it does not end in time."""
    said = bytearray()
    deadline = time.monotonic() + timeout
    poll = select.poll()
    poll.register(reader, select.POLLIN)
    with _announced_end(process, poll) as announced:
        while True:
            left = deadline - time.monotonic()
            ready = {handle for handle, _ in poll.poll(max(0.0, min(left, announced)) * 1000)}
            if reader in ready and not _take(reader, said):
                poll.unregister(reader)  # all have closed it: nothing more to come
            if process.poll() is not None:
                _take(reader, said)
                return bytes(said)
            if left <= 0:
                raise Hanging


@contextlib.contextmanager
def _announced_end(process: subprocess.Popen[bytes], poll: select.poll) -> Iterator[float]:
    """Let `poll` wake up when the process ends; yields the longest pause to make in between, s."""
    try:
        handle = os.pidfd_open(process.pid)
    except (AttributeError, OSError):  # not on this system
        yield _PAUSE
        return
    try:
        poll.register(handle, select.POLLIN)
        yield 3600.0
    finally:
        os.close(handle)


def _take(reader: int, said: bytearray) -> bool:
    """Read what is there; False when the other side is closed."""
    with contextlib.suppress(BlockingIOError):
        for _ in range(64):  # then look at the clock again: some programs never stop talking
            chunk = os.read(reader, 65536)
            if not chunk:
                return False
            said += chunk[: max(0, _KEPT - len(said))]
    return True
