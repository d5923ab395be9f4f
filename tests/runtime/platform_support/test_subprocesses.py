"""Work in a process of its own: what it gives, what it refuses, and how it is interrupted."""

from __future__ import annotations

import importlib
import os
import signal
import sys
import threading
import time
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from mstmm.errors import EnvironmentFailure, SceneError
from mstmm.runtime.flexible.elastic import modal_elastic
from mstmm.runtime.flexible.modal_body import ModalBody
from mstmm.runtime.platform_support.subprocesses import run_in_subprocess
from tests.support.scenes import elastic_bar as bar

#: `hold` keeps Python's lock, as a sparse factorisation does.
MODULE = """\
import ctypes, os
from mstmm.errors import SceneError

def double(x): return 2 * x
def refuse(what): raise SceneError(what)
def crash(): os.abort()
def hold(note):
    with open(note, "w") as file:
        file.write(str(os.getpid()))
    ctypes.PyDLL(None).sleep(600)
"""


@pytest.fixture
def work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    (tmp_path / "work_of_the_test.py").write_text(MODULE)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "work_of_the_test", raising=False)
    return importlib.import_module("work_of_the_test")


def test_outcome_and_refusal(work: ModuleType) -> None:
    assert run_in_subprocess("a body", work.double, 21) == 42
    with pytest.raises(SceneError, match=r"^what was said$"):
        run_in_subprocess("a body", work.refuse, "what was said")
    with pytest.raises(EnvironmentFailure, match=r"^a body: the process .* \(SIGABRT\)"):
        run_in_subprocess("a body", work.crash)


def test_an_embedded_python_does_it_itself(
    work: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.executable", "")
    assert run_in_subprocess("a body", lambda x: work.double(x), 21) == 42


@pytest.mark.usefixtures("heard")
def test_an_interrupt_ends_work_that_holds_the_lock(work: ModuleType, tmp_path: Path) -> None:
    note = tmp_path / "pid"

    def interrupt() -> None:
        while not (note.exists() and note.read_text()):
            time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=interrupt, daemon=True)
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        run_in_subprocess("a body", work.hold, str(note))
    thread.join()
    with pytest.raises(ProcessLookupError):
        os.kill(int(note.read_text()), 0)


def test_long_bodies_are_made_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    """The numbers are those of this process, and a body that is refused is refused in its words."""

    def build_body(**changes: Any) -> ModalBody:
        modal_elastic._cached_body.cache_clear()
        return modal_elastic.elastic_bodies(bar.scene(bar.table(**changes)))["bar"]

    here, used = build_body(), []

    def record_call(what: str, *call: Any) -> Any:
        used.append(what)
        return run_in_subprocess(what, *call)

    monkeypatch.setattr(modal_elastic, "SUBPROCESS_UNKNOWNS", 0.0)
    monkeypatch.setattr(modal_elastic, "run_in_subprocess", record_call)
    there = build_body()
    assert used == ['elastic "bar"'] and there.notes == here.notes
    assert there.C.tobytes() == here.C.tobytes() and there.K.tobytes() == here.K.tobytes()
    with pytest.raises(SceneError, match=r'elastic "bar".*highest_frequency: expected at least'):
        build_body(highest_frequency=1e-3)
