"""What a terminal shows of work that takes long."""

from __future__ import annotations

import io
import sys
import time

import pytest

from mstmm.cli import progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize("stream", [Terminal(), io.StringIO()], ids=["terminal", "file"])
def test_work_without_a_measure_is_shown_on_a_terminal(
    monkeypatch: pytest.MonkeyPatch, stream: io.StringIO
) -> None:
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setattr(progress, "DISPLAY_DELAY", 0.0)
    with progress.elapsed_time_display("preparing the scene"):
        while stream.isatty() and "0:00:0" not in stream.getvalue():
            time.sleep(0.01)
    assert ("preparing the scene" in stream.getvalue()) == stream.isatty()


def test_short_work_is_not_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    stream = Terminal()
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setattr(progress, "DISPLAY_DELAY", 1e6)
    with progress.elapsed_time_display("preparing the scene"):
        pass
    assert stream.getvalue() == ""
