"""`mstmm view`, `report` and `plot`: what they write and print, and what they refuse."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from PIL import Image

import mstmm as package
from tests.support.commands import Command


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


def test_the_nearest_pose_of_a_loop_that_stays_open(mstmm: Command, folder: Path) -> None:
    """Two rods of 1 m whose feet are 2.5 m apart: in line, half a metre open; drawn and refused."""
    rod = {"mass": 1.0, "center_of_mass": [0.5, 0, 0], "inertia": [0.01, 0.1, 0.1],
           "ends": {"tip": [1, 0, 0]}}  # fmt: skip
    pins = [("ground", "left", 0.4), ("left.tip", "right.tip", 0.0), ("ground", "right", 2.8)]
    hinges = [
        {"name": f"pin{k}", "type": "pin", "inboard": inboard, "outboard": outboard, "cut": k == 1,
         "initial": {"q": q}, "position": [2.5 * (k == 2), 0, 0]}
        for k, (inboard, outboard, q) in enumerate(pins)
    ]  # fmt: skip
    del hinges[1]["position"]
    bodies = [rod | {"name": name} for name in ("left", "right")]
    scene = package.Scene(gravity=[0, -9.81, 0], body=bodies, hinge=hinges)
    (folder / "short.toml").write_text(scene.to_toml())
    done = mstmm("view", "short.toml", "-o", "short.html")
    assert done.code == 2 and "the nearest pose has a gap of 0.5 m" in done.err
    assert "short.html: the nearest pose" in done.out
    page = (folder / "short.html").read_text()
    assert "<title>short: nearest pose, open by 0.5</title>" in page[:4000]
    done = mstmm("check", "short.toml")
    assert done.code == 2 and "nearest pose: pin0: q = " in done.err
    told = json.loads(mstmm("check", "short.toml", "--json").out)["checked"][0]
    assert abs(told["gap"] - 0.5) < 1e-8
    assert abs(told["nearest_pose"]["pin0"][0]) < 1e-4


def test_a_result(mstmm: Command, folder: Path) -> None:
    assert mstmm("simulate", "pendulum.toml", "--t-end", "0.5", "-o", "run.nc").code == 0
    done = mstmm("view", "run.nc")
    assert done.code == 0, done.err
    assert "run.html: a page for any browser" in done.out
    assert "<title>run</title>" in (folder / "run.html").read_text()[:4000]
    told = json.loads(mstmm("view", "run.nc", "-o", "a.html", "--json").out)
    assert told["files"] == ["a.html"] and told["t_end"] == 0.5 and told["samples"] > 5
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
        (("run.nc", "--t-end", "2"), "expected a scene, found a result"),
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
    told = json.loads(mstmm("report", "run.nc", "-o", "read.html", "--json").out)
    assert told["files"] == ["read.html"]
    assert (told["t_start"], told["t_end"]) == (0.0, 0.5)
    assert mstmm("report", "pendulum.toml").code == 2


@pytest.fixture
def runs(mstmm: Command, folder: Path) -> Path:
    for name, rtol in (("run.nc", "1e-8"), ("loose.csv", "1e-2")):
        options = ("--t-end", "1", "--times", "60", "--rtol", rtol, "-o", name, "--no-certify")
        assert mstmm("simulate", "pendulum.toml", *options).code == 0
    return folder


def test_curves_of_results(mstmm: Command, runs: Path) -> None:
    done = mstmm("plot", "run.nc", "loose.csv", "-o", "a.png", "-o", "a.svg", "--title", "both")
    assert done.code == 0, done.err
    assert done.out.splitlines() == [
        "angle of hinge pivot (rad): pivot.angle", "wrote a.png and a.svg",
    ]  # fmt: skip
    with Image.open(runs / "a.png") as picture:
        assert picture.size[0] == 1125
    names = ("-q", "pivot.motion", "-q", "rod.tip.velocity", "-q", "energy")
    assert mstmm("plot", "run.nc", *names).code == 2
    done = mstmm("plot", "run.nc", "loose.csv", *names[2:], "--json")
    assert done.code == 0, done.err
    told = json.loads(done.out)
    assert told["files"] == ["run.png"] and told["runs"] == ["run", "loose"]
    assert [panel["title"] for panel in told["panels"]] == [
        "velocity of rod.tip (m/s)", "total energy (J)",
    ]  # fmt: skip
    assert told["panels"][1]["curves"] == ["run", "loose"]
    for kind, title in (("--phase", "rate of angle of"), ("--spectrum", "amplitude of angle of")):
        done = mstmm("plot", "run.nc", "loose.csv", "-q", "pivot.angle", kind, "-o", "a.pdf")
        assert done.code == 0, done.err
        assert done.out.startswith(title)
    done = mstmm("plot", "run.nc", "-q", "rod.tip.y", "--against", "rod.tip.x", "-o", "a.pdf")
    assert done.code == 0, done.err


def test_curves_that_are_refused(
    mstmm: Command, runs: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cases = {
        ("run.nc", "-q", "pivot.angel"): 'did you mean "pivot.angle"',
        ("loose.csv", "-q", "pivot.angel"): 'did you mean "pivot.angle"',
        ("run.nc", "-q", "pivot.angle", "--against", "nothing"): "there is no such quantity",
        ("pendulum.toml",): "expected a saved result, .nc, .csv, .mat",
        ("missing.csv",): "there is no such file",
        ("run.nc", "-o", "a.html"): ".png or .svg or .pdf",
        ("run.nc", "--phase", "--spectrum"): "use only one of them",
        ("run.nc", "-q", "energy", "--phase"): "a phase plot needs its rate",
    }
    for arguments, message in cases.items():
        done = mstmm("plot", *arguments)
        assert done.code == 2, arguments
        assert message in " ".join(done.err.split())
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    done = mstmm("plot", "loose.csv")
    assert done.code == 3 and "pip install 'mstmm[plot]'" in done.err
