"""`mstmm linearize` and `mstmm modes`."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from tests.support.commands import Command

#: Of the rod that hangs: half its weight over its inertia.
OMEGA = math.sqrt(9.81 * 0.5 / 0.334)


def test_modes_are_told_and_written(mstmm: Command, folder: Path) -> None:
    done = mstmm("modes", "pendulum.toml", "--set", "pivot.law.damping[0]=0", "-o", "modes.csv")
    assert done.code == 0, done.err
    assert f"{OMEGA:.6g}" in done.out and "pivot.angle" in done.out
    assert "all modes below the last one are found" in done.out and "wrote modes.csv" in done.out
    head, row = (folder / "modes.csv").read_text().splitlines()
    assert head.split(",")[:2] == ["mode", "omega [rad/s]"] and "pivot.angle" in head
    assert float(row.split(",")[1]) == pytest.approx(OMEGA)
    assert "kinetic energy" in done.out and "rod 100%" in done.out


def test_matrices_are_told_and_written(mstmm: Command, folder: Path) -> None:
    done = mstmm("linearize", "pendulum.toml", "-i", "pivot.effort", "-o", "linear.csv")
    assert done.code == 0, done.err
    assert "coordinates 1, inputs 1, disturbances 3" in done.out
    rows = [line.split(",") for line in (folder / "linear.csv").read_text().splitlines()]
    numbers = {(m, row, column): float(value) for m, row, column, value in rows[1:]}
    assert numbers["M", "pivot.angle", "pivot.angle"] == pytest.approx(0.334)
    assert numbers["V", "pivot.angle", "pivot.effort"] == 1.0
    assert ("elastic", "pivot.angle", "pivot.angle") not in numbers


def test_answers_are_told_drawn_and_written(mstmm: Command, folder: Path) -> None:
    done = mstmm("frf", "pendulum.toml", "-i", "pivot.effort", "-q", "rod.tip.vy", "--from", "0.01",
                 "--to", "0.02", "--points", "3", "-o", "frf.csv", "--plot", "bode.png",
                 "--set", "pivot.law.damping[0]=0.2")  # fmt: skip
    assert done.code == 0, done.err
    assert "rod.tip.velocity.y" in done.out and "m/s / N*m" in done.out
    assert "wrote bode.png" in done.out and (folder / "bode.png").stat().st_size > 10_000
    assert len((folder / "frf.csv").read_text().splitlines()) == 4
    data = json.loads(mstmm("frf", "pendulum.toml", "--json", "--points", "2", "--to", "7").out)
    assert data["frequency"] == pytest.approx([0.1, 7.0]) and len(data["inputs"]) == 3


def test_inputs_and_outputs_of_the_scene_are_meant(mstmm: Command, folder: Path) -> None:
    text = (folder / "pendulum.toml").read_text()
    more = """[[load]]
on = "rod.tip"
force = ["wind", 0, 0]
[[input]]
name = "wind"
unit = "N"
[[output]]
name = "swing"
of = "pivot.angle/deg"
unit = "deg"
"""
    (folder / "blown.toml").write_text(f"{text}\n{more}")
    done = mstmm("frf", "blown.toml", "--points", "2")
    assert done.code == 0, done.err
    assert "swing" in done.out and "wind" in done.out and "deg / N" in done.out
    assert "inputs 1" in mstmm("linearize", "blown.toml").out


@pytest.mark.parametrize("command", ["modes", "linearize"])
def test_pictures_of_both(mstmm: Command, folder: Path, command: str) -> None:
    done = mstmm(command, "pendulum.toml", "--plot", "of.png")
    assert done.code == 0, done.err
    assert "wrote of.png" in done.out and (folder / "of.png").stat().st_size > 10_000
    assert json.loads(mstmm(command, "pendulum.toml", "--plot", "of.svg", "--json").out)["plot"]


def test_damping_is_asked_for(mstmm: Command) -> None:
    def imaginary(*damping: str) -> float:
        done = mstmm("frf", "pendulum.toml", "--json", "--points", "2", "-i", "pivot.effort",
                     "--set", "pivot.law.stiffness[0]=3", *damping)  # fmt: skip
        return float(json.loads(done.out)["imag"][0][0][0])

    assert imaginary() == 0
    one, two = imaginary("--structural", "0.01"), imaginary("--structural", "pivot=0.02")
    assert two < one < 0 and two == pytest.approx(2 * one, rel=1e-3)
    assert imaginary("--modal", "0.02") < 0


def test_peaks_are_those_between_the_points(mstmm: Command) -> None:
    """1/sqrt((k - J w^2)^2 + (c w)^2) at w^2 = k/J - c^2/(2 J^2), from three points; without
    damping there is no bound."""
    k, c, j = 9.81 * 0.5, 0.002, 0.334
    square = k / j - (c / j) ** 2 / 2
    peak = 1 / math.hypot(k - j * square, c * math.sqrt(square))
    given = ("frf", "pendulum.toml", "-i", "pivot.effort", "--points", "3", "--to", "1")
    done = mstmm(*given, "--set", f"pivot.law.damping[0]={c}")
    assert done.code == 0, done.err
    assert f"{peak:.4g} rad / N*m" in done.out
    assert f"{math.sqrt(square) / (2 * math.pi):.5g}" in done.out
    alone = mstmm(*given, "--set", "pivot.law.damping[0]=0")
    assert "unbounded rad" in alone.out and f"{OMEGA / (2 * math.pi):.5g}" in alone.out
    lossy = mstmm(*given, "--set", "pivot.law.damping[0]=0", "--modal", "1e-4")
    assert f"{1 / (2e-4 * k):.4g} rad / N*m" in lossy.out


def test_damped_and_undamped_frequencies_are_told_apart(mstmm: Command) -> None:
    """sqrt(k/J - (c/2J)^2)/(2 pi) in Hz beside sqrt(k/J) in rad/s."""
    damped = mstmm("modes", "pendulum.toml", "--set", "pivot.law.damping[0]=1").out
    hertz = math.sqrt(OMEGA**2 - (1 / 0.668) ** 2) / (2 * math.pi)
    assert f"{hertz:.6g}" in damped and f"{OMEGA:.6g}" in damped
    assert "damped Hz" in damped and "undamped rad/s" in damped
    assert "damped Hz" not in mstmm("modes", "pendulum.toml", "--undamped").out


def test_json_of_both(mstmm: Command) -> None:
    modes = json.loads(mstmm("modes", "pendulum.toml", "--json", "--count", "5").out)
    assert modes["omega"] == [pytest.approx(OMEGA)] and modes["complete"] is True
    linear = json.loads(mstmm("linearize", "pendulum.toml", "--json", "--at-start").out)
    assert linear["K"][0][0] == pytest.approx(-9.81 * 0.5 * math.sin(0.3))
    assert "is not steady" in linear["warnings"][0]


def test_netcdf_of_both(mstmm: Command) -> None:
    import xarray

    assert mstmm("modes", "pendulum.toml", "-o", "modes.nc").code == 0
    assert mstmm("linearize", "pendulum.toml", "-o", "linear.nc").code == 0
    with xarray.open_dataset("modes.nc", engine="h5netcdf") as data:
        assert float(data.omega[0]) == pytest.approx(OMEGA)
    with xarray.open_dataset("linear.nc", engine="h5netcdf") as data:
        found = data.W.sel(coordinate="pivot.angle", disturbance="ground.acceleration.x")
        assert float(found) == pytest.approx(-0.5)


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["linearize", "pendulum.toml", "-i", "pivot.efort"], 'did you mean "pivot.effort"'),
        (["modes", "pendulum.toml", "--set", "pivot.law"], "expected NAME=VALUE"),
        (["modes", "pendulum.toml", "--set", "rod.mas=2"], "rod.mass"),
        (
            ["modes", "pendulum.toml", "--set", "rod.mass=2", "--set", "rod.mass = 3"],
            "rod.mass is set to 2 already",
        ),
        (["modes", "pendulum.toml", "--plot", "x.gif"], ".png or .svg or .pdf"),
        (["modes", "pendulum.toml", "--count", "0"], "--count"),
        (["modes", "pendulum.toml", "-o", "modes.txt"], ".nc or .csv"),
        (["modes", "none.toml"], "none.toml"),
        (["frf", "pendulum.toml", "--from", "5", "--to", "1"], "expected --to above --from"),
        (["frf", "pendulum.toml", "-q", "pivot.angel"], 'did you mean "pivot.angle"'),
        (["frf", "pendulum.toml", "--structural", "pivot"], "expected NAME=VALUE"),
        (
            ["frf", "pendulum.toml", "--structural", "pivot=0.1", "--structural", "pivot=0.2"],
            "--structural pivot=0.2: pivot is set to 0.1 already",
        ),
        (["frf", "pendulum.toml", "--exact", "rod"], '"rod": expected a flexible beam'),
        (["frf", "pendulum.toml", "--exact", "all"], "no flexible beam"),
        (["frf", "pendulum.toml", "--modal", "-1"], "expected damping ratios of 0 or more"),
        (["frf", "pendulum.toml", "--plot", "x.gif"], ".png or .svg or .pdf"),
    ],
)
def test_bad_input_is_told_in_a_line(mstmm: Command, arguments: list[str], expected: str) -> None:
    done = mstmm(*arguments)
    assert done.code == 2 and expected in done.err and "Traceback" not in done.err


def test_no_rest_is_a_numerical_failure(mstmm: Command, folder: Path) -> None:
    text = (folder / "pendulum.toml").read_text() + "law = { effort = 100.0 }\n"
    (folder / "driven.toml").write_text(text)
    done = mstmm("modes", "driven.toml")
    assert done.code == 4 and "no equilibrium" in done.err


def test_a_coin_that_rolls(mstmm: Command, folder: Path) -> None:
    """Beside its motion there are A and its motions, the last of w^2 = 12/5 spin^2 - 4/5 g/r."""
    across = 0.0625
    (folder / "coin.toml").write_text(f"""gravity = [0, 0, -9.81]
body = [{{ name = "coin", mass = 1.0, inertia = [{across}, {2 * across}, {across}] }}]
[[hinge]]
name = "fly"
type = "free"
inboard = "ground"
outboard = "coin"
initial = {{ q = [0, 0, 0.5, 1, 0, 0, 0], u = [2, 0, 0, 0, 4, 0] }}
[[constraint]]
name = "road"
type = "rolling"
from = "ground"
to = "coin"
normal = [0, 0, 1]
radius = 0.5
axis = [0, 1, 0]
""")
    shown = mstmm("linearize", "coin.toml", "--at-start").out
    assert "trusted: no check objects to it" in shown
    assert "-7.848 fly.wx_increment, -2.4 fly.wz" in shown
    modes = json.loads(mstmm("modes", "coin.toml", "--at-start", "--json").out)
    assert modes["omega"][-1] == pytest.approx(math.sqrt(12 / 5 * 16 - 4 / 5 * 9.81 / 0.5))
    assert mstmm("modes", "coin.toml", "--at-start", "--undamped").code != 0
    assert mstmm("linearize", "coin.toml", "--at-start", "--plot", "a.png").code == 0
    assert mstmm("linearize", "coin.toml", "--at-start", "-o", "a.csv").code == 0
