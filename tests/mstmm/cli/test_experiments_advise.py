"""`mstmm advise`: what it prints and writes, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.support.commands import Command
from tests.support.scenes.advice import TIP, hub_and_beam, period

QUICK = ("--t-end", "1", "--times", "51", "--rounds", "0", "--budget", "600")


@pytest.fixture
def arm(folder: Path) -> str:
    (folder / "arm.toml").write_text(hub_and_beam("B", 2).to_toml())
    return "arm.toml"


def test_the_command(mstmm: Command, folder: Path, arm: str) -> None:
    end = str(period("B"))
    done = mstmm(
        "advise", arm, "--error", "1e-3", "--of", TIP, "--t-end", end, "--write", "small.toml"
    )
    assert done.code == 0, done.err
    assert "models are compared over the whole run" in done.err
    assert "for an error of 0.001 m of arm.tip.position: a reduced scene by " in done.out
    assert "stiffened, shapes 2 y" in done.out
    assert "the shapes left out (y2)" in done.out
    assert "wrote small.toml" in done.out
    again = mstmm("simulate", "small.toml", "--t-end", "0.1", "--output", "small.csv")
    assert again.code == 0, again.err


def test_as_json(mstmm: Command, arm: str) -> None:
    done = mstmm("advise", arm, "--error", "1e-2", "--of", TIP, *QUICK, "--json")
    assert done.code == 0, done.err
    data = json.loads(done.out)
    assert data["error"] <= data["error_asked"] == 1e-2
    assert data["bodies"][0]["name"] == "arm"
    assert {"method", "setting", "scene", "model_saving", "tried", "notes"} <= set(data)


def test_nothing_to_reduce(mstmm: Command, folder: Path) -> None:
    done = mstmm("advise", "pendulum.toml", *QUICK)
    assert done.code == 0, done.err
    assert "the scene as it is" in done.out
    assert "nothing to reduce" in done.out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("nope.toml",), "there is no such file"),
        (("pendulum.toml", "--error", "0"), "above 0 and below 1"),
        (("pendulum.toml", "--error", "-1e-3"), "above 0 and below 1"),
        (("pendulum.toml", "--error", "1"), "above 0 and below 1"),
        (("pendulum.toml", "--error", "small"), "is not a number"),
        (("pendulum.toml", "--of", "rod.tip.positon"), "did you mean"),
        (("pendulum.toml", "--budget", "0"), "expected a number above 0"),
        (("pendulum.toml", "--t-end", "inf"), "not a finite number"),
        (("pendulum.toml", "--write", "./pendulum.toml"), "this is the input scene"),
        (("pendulum.toml", "--write", "small.json"), "expected a name ending in .toml"),
        (("pendulum.toml", "--write", "none/small.toml"), "there is no folder none"),
        (("pendulum.toml", "--times", "1"), "--times"),
        (("pendulum.toml", "--engine", "fast"), "there are: auto, fused, looped"),
    ],
)
def test_bad_input(mstmm: Command, arguments: tuple[str, ...], words: str) -> None:
    done = mstmm("advise", *arguments)
    assert done.code == 2
    assert words in done.err
    assert "Traceback" not in done.err
