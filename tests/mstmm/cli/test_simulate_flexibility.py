"""`mstmm simulate --flexibility`: levels of model, and elastic bodies from files."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import mstmm as package
from mstmm.runtime.flexible.elastic.modal_elastic import save_matrices
from tests.support.commands import Command
from tests.support.scenes import elastic_bar as bar

SCENE = """
gravity = [0, 0, -9.81]
[[elastic]]
name = "bar"
matrices = "parts/bar.npz"
modes = 1
[elastic.ends]
root = { plane = [1, 0, 0, 0.0] }
tip = { plane = [1, 0, 0, 1.0] }
[[hinge]]
name = "held"
type = "pin"
axis = [0, 1, 0]
inboard = "ground"
outboard = "bar.root"
drive = "0.2*sin(5*t)"
"""


def test_levels(mstmm: Command, folder: Path) -> None:
    """The file is found beside the scene; every level runs and gives its own tip."""
    (folder / "parts").mkdir()
    model = bar.model(elements=2)
    save_matrices(folder / "parts" / "bar.npz", model.mass, model.stiffness, model.nodes)
    (folder / "bar.toml").write_text(SCENE)
    coordinates, tips = {}, {}
    for level in ("coupled", "one-way", "rigid"):
        options = ("--t-end", "0.1", "--times", "3", "--no-certify", "--json")
        done = mstmm("simulate", "bar.toml", "--flexibility", level, *options)
        assert done.code == 0, done.err
        data = json.loads(done.out)
        coordinates[level] = set(data["q"])
        tips[level] = package.load_result(folder / "bar.nc").position("bar.tip")[-1, 2]
    assert coordinates["coupled"] == {"held.angle", "bar.m1"}
    assert coordinates["one-way"] == coordinates["rigid"] == {"held.angle"}
    assert abs(tips["rigid"] - tips["coupled"]) > 1e-4
    assert abs(tips["one-way"] - tips["coupled"]) < 0.2 * abs(tips["rigid"] - tips["coupled"])
    refused = mstmm("simulate", "bar.toml", "--flexibility", "soft")
    assert refused.code == 2
    assert "expected one of coupled, one-way, rigid, found" in refused.err


@pytest.mark.parametrize("command", ["simulate", "check"])
def test_missing_file_is_named(mstmm: Command, folder: Path, command: str) -> None:
    (folder / "bar.toml").write_text(SCENE)
    done = mstmm(command, "bar.toml")
    assert done.code == 2
    assert 'bar.toml: elastic "bar" (bar.npz): there is no file' in done.err
