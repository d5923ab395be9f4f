"""The command line run inside the test's own process, in a folder of its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from mstmm.cli.error_boundary import run

PENDULUM = """\
gravity = [0, -9.81, 0]
[[body]]
name = "rod"
mass = 1.0
center_of_mass = [0.5, 0, 0]
inertia = [0.001, 0.084, 0.084]
ends = { tip = [1, 0, 0] }
[[hinge]]
name = "pivot"
type = "pin"
inboard = "ground"
outboard = "rod"
initial = { q = [0.3] }
"""


@dataclass(frozen=True)
class Outcome:
    """Exit code and what was printed."""

    code: int
    out: str
    err: str


Command = Callable[..., Outcome]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working folder with a scene, and a kernel store of its own."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MSTMM_KERNELS", str(tmp_path / "store"))
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.delenv("MSTMM_DEBUG", raising=False)
    (tmp_path / "pendulum.toml").write_text(PENDULUM)
    return tmp_path


@pytest.fixture
def mstmm(folder: Path, capsys: pytest.CaptureFixture[str]) -> Command:
    """Runs one command: `mstmm("simulate", "pendulum.toml")`."""

    def command(*arguments: str) -> Outcome:
        capsys.readouterr()
        code = run(arguments)
        said = capsys.readouterr()
        return Outcome(code, said.out, said.err)

    return command
