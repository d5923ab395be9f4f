"""A process that tries mutants one after another; it may die, its owner notes how."""

from __future__ import annotations

import faulthandler
import multiprocessing as mp
import os
import resource
import signal
import warnings
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from .trial import CRASH, HANG, Outcome, of_exception, trial


@dataclass(frozen=True)
class Limits:
    """Bounds of one trial.

    Attributes:
        cpu: processor time (s) of one phase (compiling, one run), whatever else the machine does.
        wall: time (s) of a whole trial; only for what waits without computing.
        memory: address space of the process in bytes; 0 for no limit (sanitizers need that).
    """

    cpu: float = 20.0
    wall: float = 300.0
    memory: int = 6 * 2**30


class Worker:
    """One forked process, made anew when it died."""

    def __init__(self, limits: Limits, engine: str, folder: Path, number: int) -> None:
        self.limits, self.engine, self.number = limits, engine, number
        self.stack = folder / f"stack-{number}.txt"
        self.phase = folder / f"phase-{number}.txt"
        self._process: Any = None

    def ask(self, data: Any, turn: int | None = None) -> None:
        """Begin a trial; `turn` as for `trial`."""
        if self._process is None or not self._process.is_alive():
            self._start()
        self.connection.send((data, turn))

    def answer(self) -> Outcome:
        """The outcome of the trial begun last."""
        try:
            if self.connection.poll(self.limits.wall):
                return Outcome(*self.connection.recv())
            self._process.kill()
            self._process.join()
            return Outcome(HANG, f"waits without computing ({self._phase()})")
        except (EOFError, OSError):
            self._process.join()
            return self._exit_outcome()

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.join()
            self._process = None

    def _start(self) -> None:
        context = mp.get_context("fork")
        self.connection, theirs = context.Pipe()
        arguments = (theirs, self.connection, self.limits, self.engine, self.stack, self.phase)
        self._process = context.Process(target=_work, args=arguments, daemon=True)
        self._process.start()
        theirs.close()

    def _phase(self) -> str:
        return self.phase.read_text() if self.phase.exists() else "?"

    def _exit_outcome(self) -> Outcome:
        """How the process ended, told from its exit code and the stack that it left."""
        stack = self.stack.read_text() if self.stack.exists() else ""
        code = self._process.exitcode
        if code == -signal.SIGPROF:
            return Outcome(HANG, f"{_innermost(stack)} ({self._phase()})", stack[-4000:])
        name = signal.Signals(-code).name if code is not None and code < 0 else f"exit {code}"
        return Outcome(CRASH, f"{name} at {_innermost(stack)} ({self._phase()})", stack[-4000:])


def _innermost(stack: str) -> str:
    """The innermost line of ours in what faulthandler wrote (most recent call first)."""
    current = stack.split("Current thread")[-1]
    for line in current.splitlines():
        if 'File "' not in line:
            continue
        path = Path(line.split('"')[1])
        if "mstmm" in path.parts and path.parent != Path(__file__).parent:
            return f"{path.name}:{line.split('line ')[1]}".replace(" in ", " ")
    return "?"


def _work(
    connection: Connection, other: Connection, limits: Limits, engine: str, stack: Path, phase: Path
) -> None:
    other.close()
    warnings.simplefilter("ignore")
    signal.signal(signal.SIGINT, signal.default_int_handler)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if limits.memory:
        resource.setrlimit(resource.RLIMIT_AS, (limits.memory, limits.memory))
    quiet = os.open(os.devnull, os.O_WRONLY)
    if not limits.memory:  # a sanitizer speaks through the standard error
        quiet = os.open(stack.with_suffix(".sanitizer"), os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    os.dup2(quiet, 1)
    os.dup2(quiet, 2)

    def begin(name: str) -> None:
        phase.write_text(name)
        signal.setitimer(signal.ITIMER_PROF, limits.cpu)

    with stack.open("w") as file:
        faulthandler.enable(file)
        faulthandler.register(signal.SIGPROF, file, all_threads=True, chain=True)
        while True:
            try:
                data, turn = connection.recv()
            except EOFError:
                return
            file.seek(0)
            file.truncate()
            try:
                outcome = trial(data, begin, turn, engine)
            except BaseException as error:  # raised between the phases, such as a late Ctrl-C
                outcome = of_exception(error, "between")
            signal.setitimer(signal.ITIMER_PROF, 0.0)
            connection.send((outcome.kind, outcome.detail, outcome.text))
