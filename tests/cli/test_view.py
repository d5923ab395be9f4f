"""`mstmm view` and `mstmm report`: what they write and print, and what they refuse."""

from __future__ import annotations

from pathlib import Path

import pytest
from PIL import Image

from cli.commands import Command


def test_a_scene_at_its_start_and_moving(mstmm: Command, folder: Path) -> None:
    done = mstmm("view", "pendulum.toml", "-o", "still.png", "--moments", "2")
    assert done.code == 0, done.err
    assert "still.png: pictures, at the start" in done.out
    done = mstmm("view", "pendulum.toml", "--t-end", "1", "-o", "moves.png", "--trail", "rod.tip")
    assert done.code == 0, done.err
    assert "moves.png: pictures, t = 0 to 1 s" in done.out
    for name in ("still.png", "moves.png"):
        with Image.open(folder / name) as picture:
            assert picture.size[0] == 1440


def test_a_result(mstmm: Command, folder: Path) -> None:
    assert mstmm("simulate", "pendulum.toml", "--t-end", "0.5", "-o", "run.nc").code == 0
    done = mstmm("view", "run.nc")
    assert done.code == 0, done.err
    assert "run.html: a page for any browser" in done.out
    assert "<title>run</title>" in (folder / "run.html").read_text()[:4000]
    done = mstmm("view", "run.nc", "--frames", "frames", "--speed", "1")
    assert done.code == 0, done.err
    assert len(list((folder / "frames").iterdir())) == 16


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("pendulum.toml", "-o", "run.avi"), "expected a name ending in .html"),
        (("pendulum.toml", "--trail", "rod.top", "-o", "a.png"), "rod.tip"),
        (("missing.toml",), "there is no such file"),
        (("missing.nc",), "there is no such file"),
        (("run.nc", "--t-end", "2"), "a result has run already"),
        (("pendulum.toml", "--speed", "0"), "above 0"),
    ],
)
def test_refusals(mstmm: Command, arguments: tuple[str, ...], message: str) -> None:
    done = mstmm("view", *arguments)
    assert done.code == 2
    assert message in " ".join(done.err.split())


def test_a_report(mstmm: Command, folder: Path) -> None:
    assert mstmm("simulate", "pendulum.toml", "--t-end", "0.5", "-o", "run.nc").code == 0
    done = mstmm("report", "run.nc", "-o", "read.html", "-q", "rod.tip.position")
    assert done.code == 0, done.err
    assert "read.html: a page" in done.out
    assert (folder / "read.html").stat().st_size > 100_000
    assert mstmm("report", "pendulum.toml").code == 2
