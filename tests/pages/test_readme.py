"""The README as a newcomer follows it: its files are written, its commands and its Python run."""

from __future__ import annotations

import re
import runpy
import shlex
from pathlib import Path

import pytest

from mstmm.cli.guard import run

README = (Path(__file__).parents[2] / "README.md").read_text("utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", README, re.M | re.S)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The files the README names, in an empty folder with a kernel store of its own."""
    (tmp_path / "pendulum.toml").write_text(blocks("toml")[0], encoding="utf-8")
    run, beam, knee = blocks("python")
    (tmp_path / "run.py").write_text(run, encoding="utf-8")
    (tmp_path / "beam.py").write_text(beam, encoding="utf-8")
    (tmp_path / "knee.py").write_text(knee, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MSTMM_KERNELS", str(tmp_path / "kernels"))
    return tmp_path


def test_the_python_block_runs(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    runpy.run_path(str(folder / "run.py"))
    assert "finished at t = 5 s" in capsys.readouterr().out


def test_the_beam_bends(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = runpy.run_path(str(folder / "beam.py"))
    assert "frame chord" in capsys.readouterr().out
    assert names["result"].warnings == ()
    assert (folder / "rod.png").stat().st_size > 10000


def test_every_command_succeeds(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    commands = [line for block in blocks("console") for line in block.splitlines() if line]
    assert len(commands) > 8
    for command in commands:
        program, *arguments = shlex.split(command)
        assert program == "mstmm"
        assert run(arguments) == 0, command + capsys.readouterr().err
    for name in ("pendulum.nc", "pendulum.png", "rigid.html"):
        assert (folder / name).stat().st_size > 1000
