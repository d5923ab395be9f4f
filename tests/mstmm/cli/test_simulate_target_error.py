"""`mstmm simulate --error`: what it says, writes and refuses."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import mstmm as package
from tests.support.commands import Command

RUN = ("simulate", "pendulum.toml", "--t-end", "2", "-o", "run.nc")


def test_it_says_what_was_reached(mstmm: Command, folder: Path) -> None:
    done = mstmm(*RUN, "--error", "1e-7")
    assert done.code == 0 and done.err == ""
    assert done.out.startswith("trusted: error of all coordinates as requested")
    assert "(1.0e-07 requested): by" in done.out
    assert max(map(len, done.out.splitlines())) <= 80
    again = package.load_result(folder / "run.nc").achieved_error
    assert again is not None and again.is_met and again.target == 1e-7


def test_json_has_the_estimate_and_its_runs(mstmm: Command) -> None:
    data = json.loads(mstmm(*RUN, "--error", "1e-6", "--of", "energy.kinetic", "--json").out)
    known = data["error_estimate"]
    assert data["trusted"] and known["met"] and known["estimate"] <= known["asked"] == 1e-6
    assert known["of"] == "energy.kinetic" and known["unit"] == "J"
    assert known["rtol"] == known["runs"][-1]["rtol"]
    assert len(known["runs"]) > 1 and known["cpu_s"] > 0
    assert json.loads(mstmm(*RUN, "--json").out)["error_estimate"] is None


def test_it_is_what_the_library_gives(mstmm: Command, folder: Path) -> None:
    mstmm(*RUN, "--error", "1e-5", "--times", "0.5")
    model = package.compile(package.load_scene(folder / "pendulum.toml"))
    expected = model.simulate(2.0, output_times=[0, 0.5, 1, 1.5, 2], error=1e-5)
    np.testing.assert_array_equal(package.load_result(folder / "run.nc").q, expected.q)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--error", "1e-6", "--rtol", "1e-9"), "rtol = 1e-09 together with error"),
        (("--error", "1e-6", "--step", "0.01"), "step = 0.01 together with error"),
        (("--error", "1e-6", "--method", "rk4"), "has fixed steps"),
        (("--error", "1e-6", "--resume"), "no checkpoint"),
        (("--error", "1e-6", "--accuracy", "1e-3"), "leave out --accuracy"),
        (("--error", "1e-6", "--of", "nothing"), "no such quantity"),
        (("--error", "2"), "less than 1"),
        (("--error", "0"), "--error"),
        (("--of", "energy"), "give --error too"),
    ],
)
def test_what_makes_no_sense_is_refused(
    mstmm: Command, options: tuple[str, ...], words: str
) -> None:
    done = mstmm(*RUN, *options)
    assert done.code == 2
    assert words in done.err and "Traceback" not in done.err
