"""Devices and named pipes where a file is expected: refused, not waited on for ever."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

import mstmm
from mstmm.runtime.flexible.elastic.matrices import load_matrices
from mstmm.runtime.flexible.elastic.mesh import read_mesh
from tests.support.scenes.results import pins


@pytest.fixture
def pipe(tmp_path: Path) -> Iterator[Path]:
    """A named pipe whose other end closes as soon as somebody reads, so that nothing can hang."""
    path = tmp_path / "pipe"
    os.mkfifo(path)
    writer = threading.Thread(target=lambda: os.close(os.open(path, os.O_WRONLY)))
    writer.start()
    yield path
    reader = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    writer.join()
    os.close(reader)


def resume_run(path: Path) -> Any:
    return mstmm.compile(pins(1, [0.3])).simulate(
        0.1, execution=mstmm.Execution(checkpoint=path, resume=True)
    )


READERS: dict[str, Callable[[Path], Any]] = {
    "matrices": lambda path: load_matrices(path, "here"),
    "mesh": lambda path: read_mesh(path, "here"),
    "checkpoint": resume_run,
    "result": mstmm.load_result,
}


@pytest.mark.parametrize("kind", READERS)
def test_a_named_pipe_is_refused(kind: str, pipe: Path) -> None:
    with pytest.raises(mstmm.SceneError, match="pipe is not a regular file; give the path of one"):
        READERS[kind](pipe)


@pytest.mark.parametrize("kind", READERS)
def test_a_device_is_refused(kind: str) -> None:
    with pytest.raises(mstmm.SceneError, match="/dev/null is not a regular file"):
        READERS[kind](Path("/dev/null"))
