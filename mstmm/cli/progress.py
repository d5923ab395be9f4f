"""Progress bar with the remaining time, on standard error and only on a terminal."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

#: Seconds before a bar appears, so that short runs show none.
DISPLAY_DELAY = 0.7


class ProgressBar:
    """Progress bar of a run, shown after `DISPLAY_DELAY`; call it with (t, t_end) of the run, s."""

    def __init__(self, shown: bool, label: str = "simulating", moves_alone: bool = True) -> None:
        self._is_shown, self._begin = shown, time.monotonic()
        self._auto_refresh = moves_alone
        self._bar: Any = None
        self._task: Any = None
        self._label = label

    def label(self, text: str) -> None:
        """Set the label of the following work, such as a second run, and restart the bar."""
        self._label = text
        if self._bar is not None:
            self._bar.reset(self._task, description=text)

    def __call__(self, t: float, t_end: float) -> None:
        self.show_fraction(t / t_end if t_end > 0 else 1.0, f"t = {t:.4g} of {t_end:.4g} s")

    def show_fraction(self, part: float, state: str) -> None:
        """Show the finished part, 0 to 1, with a text.

        If the terminal is closed, the bar ends but the work continues.
        """
        if not self._is_shown or (
            self._bar is None and time.monotonic() - self._begin < DISPLAY_DELAY
        ):
            return
        try:
            if self._bar is None:
                self._start()
            self._bar.update(
                self._task, completed=part, state=state, refresh=not self._auto_refresh
            )
        except OSError:
            self._is_shown = False

    def _start(self) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

        self._bar = Progress(
            TextColumn("{task.description}"), BarColumn(),
            TextColumn("{task.percentage:>3.0f} %  {task.fields[state]}  left"),
            TimeRemainingColumn(compact=True),
            console=Console(stderr=True), transient=True, auto_refresh=self._auto_refresh,
        )  # fmt: skip
        self._bar.start()
        self._task = self._bar.add_task(self._label, total=1.0, state="")

    def stop(self) -> None:
        """Remove the bar."""
        if self._bar is not None:
            with suppress(OSError):
                self._bar.stop()
            self._bar = None


@contextmanager
def progress_bar(label: str = "simulating", moves_alone: bool = True) -> Iterator[ProgressBar]:
    """Context with a progress bar, which is removed at the end of the block.

    Without `moves_alone` the bar is refreshed only by calls and costs no CPU time otherwise.
    """
    progress = ProgressBar(sys.stderr.isatty(), label, moves_alone)
    try:
        yield progress
    finally:
        progress.stop()


@contextmanager
def elapsed_time_display(text: str) -> Iterator[None]:
    """Context that shows a text and the elapsed time on a terminal, for work of unknown length."""
    end_event = threading.Event()

    def show() -> None:
        if end_event.wait(DISPLAY_DELAY):
            return
        from rich.console import Console
        from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

        columns = SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn()
        with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
            progress.add_task(text, total=None)
            end_event.wait()

    thread = threading.Thread(target=show, daemon=True)
    if sys.stderr.isatty():
        thread.start()
    try:
        yield
    finally:
        end_event.set()
        if thread.ident is not None:
            thread.join()
