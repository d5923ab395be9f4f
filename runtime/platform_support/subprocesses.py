"""Run another program, or a call of Python, in a process that cannot outlive this one."""

from __future__ import annotations

import contextlib
import math
import os
import pickle
import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

from mstmm.errors import EnvironmentFailure

#: Bytes of a program's output that are kept; the rest is read and dropped.
_MAX_OUTPUT_BYTES = 20_000

#: Waits until its input is closed, which happens whenever this process ends, and then kills its
#: process group.
_WATCHDOG = "read -r end; kill -s KILL 0"

#: Pause between two checks, s, where the system does not signal the end of a process.
_POLL_INTERVAL = 0.01


class ProcessTimeout(Exception):
    """The program did not end within its time limit; it and its child processes were killed."""


@dataclass(frozen=True)
class ProcessResult:
    """Exit code of a program, -n if signal n ended it, and the beginning of its output."""

    code: int
    output: str

    def signal(self) -> str:
        """Name of the signal that ended the program."""
        is_known = -self.code in set(signal.Signals)
        return signal.Signals(-self.code).name if is_known else f"signal {-self.code}"


def run(command: Sequence[str], folder: Path, timeout: float, **environment: str) -> ProcessResult:
    """Run `command` in `folder` for at most `timeout` s, with changes to the environment.

    The program gets a process group with a watchdog.  Unless it ends normally, the whole group is
    killed (time limit, Ctrl-C, failure, this process killed), so that no compiler pass continues to
    write.  Raises Hanging, and OSError if the program cannot be started.
    """
    # Use a pipe because the disk may be full.  Stop reading when the program itself has ended
    # because a grandchild could keep the pipe open forever.
    reader, writer = os.pipe()
    try:
        os.set_blocking(reader, False)
        with _watchdog_group() as group:
            try:
                process = subprocess.Popen(
                    command, stdin=subprocess.DEVNULL, stdout=writer, stderr=subprocess.STDOUT,
                    cwd=folder, env={**os.environ, "LC_ALL": "C", **environment},
                    process_group=group,
                )  # fmt: skip
            finally:
                os.close(writer)
            try:
                output = _read_until_end(process, reader, timeout)
            finally:
                if process.returncode != 0:
                    with contextlib.suppress(ProcessLookupError, PermissionError):
                        os.killpg(group or process.pid, signal.SIGKILL)
                    process.wait()
    finally:
        os.close(reader)
    return ProcessResult(process.returncode, output.decode("utf-8", "replace"))


@contextlib.contextmanager
def _watchdog_group() -> Iterator[int]:
    """Yield the number of a process group that is killed if this process ends inside the block.

    The watchdog joins the group before the program.  0, a new group, if no watchdog can start.
    """
    reader, writer = os.pipe()
    with contextlib.ExitStack() as cleanup:
        cleanup.callback(os.close, writer)
        try:
            watchdog = subprocess.Popen(
                ["sh", "-c", _WATCHDOG], stdin=reader, stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL, process_group=0,
            )  # fmt: skip
        except OSError:  # no shell
            yield 0
            return
        finally:
            os.close(reader)
        cleanup.callback(watchdog.wait)
        cleanup.callback(watchdog.kill)  # before it can read the end of its input
        yield watchdog.pid


def _read_until_end(process: subprocess.Popen[bytes], reader: int, timeout: float) -> bytes:
    """Output of the program until it ends; raises Hanging if it does not end in time."""
    output = bytearray()
    deadline = time.monotonic() + timeout
    poll = select.poll()
    poll.register(reader, select.POLLIN)
    with _watch_process_end(process, poll) as max_pause:
        while True:
            remaining = deadline - time.monotonic()
            ready = {handle for handle, _ in poll.poll(max(0.0, min(remaining, max_pause)) * 1000)}
            if reader in ready and not _read_available(reader, output):
                poll.unregister(reader)  # all writers have closed it: the output is complete
            if process.poll() is not None:
                _read_available(reader, output)
                return bytes(output)
            if remaining <= 0:
                raise ProcessTimeout


@contextlib.contextmanager
def _watch_process_end(process: subprocess.Popen[bytes], poll: select.poll) -> Iterator[float]:
    """Wake `poll` when the process ends; yields the longest pause between two checks, s."""
    try:
        handle = os.pidfd_open(process.pid)
    except (AttributeError, OSError):  # not on this system
        yield _POLL_INTERVAL
        return
    try:
        poll.register(handle, select.POLLIN)
        yield 3600.0
    finally:
        os.close(handle)


def _read_available(reader: int, said: bytearray) -> bool:
    """Read the available output; False when all writers have closed the pipe."""
    with contextlib.suppress(BlockingIOError):
        for _ in range(64):  # then check the time again: some programs never stop writing
            chunk = os.read(reader, 65536)
            if not chunk:
                return False
            said += chunk[: max(0, _MAX_OUTPUT_BYTES - len(said))]
    return True


# --- calls of Python in a separate process --------------------------------------------------------
#
# A library that holds Python's global lock until it returns, such as a sparse factorisation, blocks
# signals: an interrupt and every progress display would wait for its end.

Outcome = TypeVar("Outcome")

_SCRIPT = """\
import pickle, sys
with open(sys.argv[1], "rb") as file:
    work, arguments = pickle.load(file)
try:
    found = True, work(*arguments)
except Exception as failure:
    found = False, failure
with open(sys.argv[2], "wb") as file:
    pickle.dump(found, file, pickle.HIGHEST_PROTOCOL)
"""


def run_in_subprocess(what: str, work: Callable[..., Outcome], *arguments: Any) -> Outcome:
    """Compute work(*arguments) in another Python process that an interrupt of this one kills.

    `work` is a function of a module; it, its arguments and its result or exception are pickled.
    An embedded Python, which cannot start another process, calls it directly.
    Raises EnvironmentFailure with `what`, the name of the computed quantity, if the process crashes
    or is killed.
    """
    if not sys.executable:
        return work(*arguments)
    with TemporaryDirectory(prefix="mstmm-apart-") as folder_name:
        folder = Path(folder_name)
        request_path, result_path = folder / "asked", folder / "found"
        request_path.write_bytes(pickle.dumps((work, arguments), pickle.HIGHEST_PROTOCOL))
        command = [sys.executable, "-P", "-c", _SCRIPT, str(request_path), str(result_path)]
        search_path = os.pathsep.join(os.path.abspath(path) for path in sys.path)
        process_result = run(command, folder, math.inf, PYTHONPATH=search_path)
        if process_result.code != 0:
            raise _lost_process_error(
                what,
                process_result.signal()
                if process_result.code < 0
                else _last_line(process_result.output),
            )
        is_success, result = pickle.loads(result_path.read_bytes())
    if not is_success:
        raise result
    return result


def _last_line(said: str) -> str:
    lines = said.strip().splitlines()
    return lines[-1] if lines else "no message"


def _lost_process_error(what: str, how: str) -> EnvironmentFailure:
    return EnvironmentFailure(
        f"{what}: the process that computed it ended unexpectedly ({how}); if memory ran out, use "
        "a coarser mesh"
    )
