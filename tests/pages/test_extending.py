"""The pages on elements of one's own: their files are written, their commands and Python run."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mstmm.cli.guard import run
from mstmm.runtime.integrate import steppers

PAGES = Path(__file__).parents[2] / "docs" / "use" / "extending"
#: A block, with the file's name where the line before it is one.
BLOCK = re.compile(r"^(?:`([\w.]+)`:\n\n)?```(python|toml|console)\n(.*?)^```", re.M | re.S)


def play(page: str, folder: Path, capsys: pytest.CaptureFixture[str]) -> tuple[dict[str, Any], str]:
    """Everything a page says, in order: names its Python leaves behind, and what it printed."""
    names: dict[str, Any] = {"__name__": "page"}
    printed = ""
    for file, language, text in BLOCK.findall((PAGES / f"{page}.md").read_text("utf-8")):
        if file:
            (folder / file).write_text(text, encoding="utf-8")
        elif language == "python":
            capsys.readouterr()  # what the commands said
            exec(compile(text, f"{page}.md", "exec"), names)
            printed += capsys.readouterr().out
        else:
            for command in text.splitlines():
                program, *arguments = shlex.split(command)
                assert program == "mstmm"
                assert run(arguments) == 0, command + capsys.readouterr().err
    return names, printed


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MSTMM_KERNELS", str(tmp_path / "kernels"))
    monkeypatch.setattr(steppers, "_registered", {})
    return tmp_path


@pytest.mark.slow
def test_hinge(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names, printed = play("hinge", folder, capsys)
    assert printed.startswith("compiled\n")
    result = names["result"]
    assert result.success
    assert np.all(np.diff(result.energy()) < 1e-9)  # the law's damper takes energy
    assert names["Pilot"].name == "pilot"
    assert (folder / "kernels" / "hinge_pilot" / "element.json").is_file()


def test_body(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names, printed = play("body", folder, capsys)
    gaps = [float(x) for x in re.findall(r"-?\d\.?\d*(?:e[-+]\d+)?", printed)]
    assert len(gaps) == 9
    assert max(map(abs, gaps)) < 1e-8
    assert np.ptp(names["result"].energy()) < 1e-8


def test_force(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names, _ = play("force", folder, capsys)
    y = names["result"].position("mount")[-1, 1]
    assert 4e3 * y + 3e7 * y**3 == pytest.approx(-2 * 9.81, rel=1e-4)
    assert names["stiffer"].parameters["rubber.parameters.stiffness"] == 8e3


def test_stepper(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    _, printed = play("stepper", folder, capsys)
    ratios = [float(x) for x in re.findall(r"\d+\.\d+", printed)]
    assert ratios == pytest.approx([8.0, 8.0], rel=0.1)
