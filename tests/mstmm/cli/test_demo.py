"""`mstmm demo`: what it leaves, what it says, and the scene it travels with."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import mstmm as package
from mstmm.cli.demo import scene_text
from tests.support.commands import Command
from tests.support.paths import ROOT

EXAMPLE = ROOT / "examples" / "three_bodies_on_balls" / "scene.toml"


def test_scene_is_that_of_the_example() -> None:
    assert scene_text() == EXAMPLE.read_text(encoding="utf-8")


def test_demo_leaves_result_table_picture_and_scene(mstmm: Command, folder: Path) -> None:
    done = mstmm("demo")
    assert done.code == 0 and done.err == ""
    assert max(map(len, done.out.splitlines())) <= 80
    result = package.load_result(folder / "demo.nc")
    assert result.t[-1] == 5.0 and np.ptp(result.energy()) < 1e-6
    assert (folder / "demo.png").read_bytes().startswith(b"\x89PNG")
    assert "Three bodies on ball hinges</title>" in (folder / "demo.html").read_text()
    table = (folder / "demo.txt").read_text()
    assert table in done.out and "body3.tip.z" in table
    assert mstmm("check", "demo.toml").code == 0


def test_with_the_core_alone(mstmm: Command, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mstmm.cli.options.missing_packages", lambda extra: ["something"])
    monkeypatch.setattr("mstmm.cli.demo.missing_packages", lambda extra: ["something"])
    done = mstmm("demo")
    assert done.code == 0
    assert {path.name for path in folder.glob("demo.*")} == {"demo.csv", "demo.txt", "demo.toml"}
    assert "mstmm[plot]" in done.out and "mstmm[io]" in done.out


def test_a_changed_scene_is_left_alone(mstmm: Command, folder: Path) -> None:
    (folder / "demo.toml").write_text("# mine\n")
    done = mstmm("demo", "--json")
    assert json.loads(done.out)["success"]
    assert (folder / "demo.toml").read_text() == "# mine\n"


def test_folder_in_the_way(mstmm: Command, folder: Path) -> None:
    (folder / "demo.nc").mkdir()
    done = mstmm("demo")
    assert done.code == 2 and "demo.nc" in done.err
