"""`mstmm chart`: what it writes and prints, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.support.commands import Command

QUICK = ("--t-end", "1", "--times", "11", "--rounds", "0", "-m", "dop853", "-m", "rodas4")


def test_the_command(mstmm: Command, folder: Path) -> None:
    done = mstmm(
        "chart", "pendulum.toml", "--out", "charts/first", *QUICK, "-q", "rod.tip.position"
    )
    assert done.code == 0, done.err
    assert {path.name for path in (folder / "charts" / "first").iterdir()} == {
        "chart.png", "chart.html", "chart.json",
    }  # fmt: skip
    assert "budget 60 s" in done.err
    assert "its own error is" in done.err
    assert "for an error of 0.001 m: " in done.out
    assert "target error" in done.out


def test_as_json(mstmm: Command, folder: Path) -> None:
    done = mstmm("chart", "pendulum.toml", "--out", "out", *QUICK, "--error", "1e-5", "--json")
    assert done.code == 0, done.err
    data = json.loads(done.out)
    assert {"reference", "points", "front", "recommended"} <= set(data)
    keys = {
        "method",
        "model",
        "setting",
        "error",
        "cpu_s",
        "evaluations",
        "factorizations",
        "steps",
    }
    assert all(keys <= set(point) for point in data["points"])
    assert {point["method"] for point in data["points"]} == {"dop853", "rodas4"}
    assert all(p["factorizations"] == 0 for p in data["points"] if p["method"] == "dop853")
    assert all(p["factorizations"] > 0 for p in data["points"] if p["method"] == "rodas4")
    assert data["recommended"]["sure_error"] <= 1e-5
    assert data["recommended"] in data["front"]
    kept = json.loads((folder / "out" / "chart.json").read_text())
    assert kept["points"] == data["points"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("nope.toml", "--out", "out"), "there is no such file"),
        (("pendulum.toml",), "--out"),
        (("pendulum.toml", "--out", "pendulum.toml"), "this is not a folder"),
        (("pendulum.toml", "--out", ""), "expected the name of a folder"),
        (("pendulum.toml", "--out", "out", "--budget", "0"), "expected a number above 0"),
        (("pendulum.toml", "--out", "out", "--budget", "nan"), "not a finite number"),
        (("pendulum.toml", "--out", "out", "--error", "-1"), "expected a number above 0"),
        (("pendulum.toml", "--out", "out", "-m", "rodas"), "unknown method"),
        (("pendulum.toml", "--out", "out", "-q", "rod.tip.positon"), "did you mean"),
        (("pendulum.toml", "--out", "out", "--times", "1"), "'--times': '1': expected a whole"),
        (("pendulum.toml", "--out", "out", "--times", "x"), "'--times': 'x' is not a whole number"),
        (("pendulum.toml", "--out", "out", "--rounds", "-1"), "'--rounds': '-1': expected a whole"),
        (("pendulum.toml", "--out", "out", "--engine", "fast"), "there are: auto, fused, looped"),
    ],
)
def test_bad_input(mstmm: Command, arguments: tuple[str, ...], words: str) -> None:
    done = mstmm("chart", *arguments)
    assert done.code == 2
    assert words in done.err
    assert "Traceback" not in done.err


def test_without_matplotlib(mstmm: Command, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import mstmm.cli.options as command
    from mstmm.runtime.experiments.chart import chart as charts

    monkeypatch.setattr(command, "missing_packages", lambda _: ["matplotlib"])
    monkeypatch.setattr(charts, "has_matplotlib", lambda: False)
    done = mstmm("chart", "pendulum.toml", "--out", "out", *QUICK)
    assert done.code == 0, done.err
    assert "no plot: it needs matplotlib: pip install 'mstmm[plot]'" in done.out
    assert {path.name for path in (folder / "out").iterdir()} == {"chart.html", "chart.json"}
