"""`mstmm simulate --on-risk`: what is told, what is kept, and the exit code."""

from __future__ import annotations

import json
from pathlib import Path

from tests.support.commands import Command

COARSE = ("simulate", "pendulum.toml", "--t-end", "5", "--method", "rk4", "-o", "run.csv")


def test_a_doubtful_result_is_saved_and_then_refused(mstmm: Command, folder: Path) -> None:
    done = mstmm(*COARSE, "--step", "0.2", "--on-risk", "refuse")
    assert done.code == 4
    assert "energy-drift: energy is not conserved" in done.err and "run.csv" in done.err
    assert (folder / "run.csv").exists() and "wrote run.csv" in done.out
    assert not (folder / "run.csv.checkpoint").exists()
    data = json.loads(mstmm(*COARSE, "--step", "0.2", "--on-risk", "refuse", "--json").out)
    assert [row["name"] for row in data["risks"]] == ["energy-drift"]
    assert data["risks"][0]["figure"] > data["risks"][0]["limit"]
    assert data["certificate"]["risks"] == data["risks"]
    assert data["error"]["exit_code"] == 4 and "energy-drift" in data["error"]["message"]


def test_a_run_that_cannot_do_well_is_not_made(mstmm: Command, folder: Path) -> None:
    done = mstmm(*COARSE, "--step", "2", "--on-risk", "refuse")
    assert done.code == 4 and done.out == ""
    assert "before the run" in done.err and "step-stability" in done.err
    assert not (folder / "run.csv").exists()
    told = mstmm(*COARSE, "--step", "2", "--on-risk", "refuse", "--json")
    assert json.loads(told.out)["error"]["exit_code"] == 4


def test_warnings_are_the_rule_and_silence_can_be_asked_for(mstmm: Command) -> None:
    assert "energy is not conserved" in mstmm(*COARSE, "--step", "0.2").out
    quiet = mstmm(*COARSE, "--step", "0.2", "--on-risk", "ignore")
    assert quiet.code == 0 and "warning" not in quiet.out
    assert quiet.out.startswith("NOT trusted") and "see below" not in quiet.out
    assert mstmm(*COARSE, "--step", "0.2", "--on-risk", "stop").code == 2
