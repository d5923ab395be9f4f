"""`mstmm simulate --input`: inputs of a scene set for one run, and the files of its signals."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import mstmm as package
from tests.support.commands import PENDULUM, Command

SCENE = """
[constants]
weak = 0.25
[[input]]
name = "motor"
unit = "N m"
value = "2*weak"
[[signal]]
name = "gust"
file = "gust.csv"
column = "force"
[[load]]
on = "rod.tip"
moment = [0, 0, "motor"]
"""


@pytest.fixture
def scene(folder: Path) -> str:
    (folder / "scenes").mkdir()
    (folder / "scenes" / "gust.csv").write_text("time,calm,force\n0,0,0\n1,0,4\n")
    (folder / "scenes" / "motor.toml").write_text(PENDULUM + SCENE)
    return "scenes/motor.toml"


def angle(mstmm: Command, scene: str, *given: str) -> float:
    """The angle behind a run with these inputs."""
    done = mstmm("simulate", scene, "--t-end", "1", "--no-certify", "-o", "run.nc", "--json",
                 *(part for one in given for part in ("--input", one)))  # fmt: skip
    assert done.code == 0, done.err
    return float(json.loads(done.out)["q"]["pivot.angle"])


def test_an_input_is_set_for_a_run(mstmm: Command, scene: str) -> None:
    plain = angle(mstmm, scene)
    assert angle(mstmm, scene, "motor=0.5") == plain == angle(mstmm, scene, " motor = 2*weak ")
    strong = angle(mstmm, scene, "motor=3")
    assert strong > plain and angle(mstmm, scene, "motor=gust") not in (plain, strong)


def test_the_saved_result_has_the_inputs_of_its_run(mstmm: Command, scene: str) -> None:
    end = angle(mstmm, scene, "motor=gust")
    (saved := Path(scene)).with_name("gust.csv").unlink()  # it is in the result
    result = package.load_result("run.nc")
    assert result.model.scene.input[0].value == "gust" and saved.exists()
    assert result.q[-1, 0] == end
    gust = result.quantity("motor")
    np.testing.assert_allclose(gust.values, 4 * result.t, rtol=0, atol=1e-12)
    assert (gust.unit, gust.long_name) == ("N m", "input motor")
    data = result.to_xarray()
    np.testing.assert_array_equal(data["signal_gust"], gust.values)
    assert data["input_motor"].attrs["units"] == "N m"
    again = package.compile(result.model.scene).simulate(1.0)
    assert again.q[-1, 0] == end


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ("moter=3", 'no such input in the scene; did you mean "motor"'),
        ("gust=3", "this is a signal of the scene"),
        ("motor", "expected NAME=VALUE"),
        ("motor=", "expected NAME=VALUE"),
        ("motor=gist", 'there is no signal "gist", and no constant; did you mean "gust"'),
        ("motor=nan", "expected a finite number"),
        ("motor=sin(t)", "expected a number or the name of a signal"),
    ],
)
def test_what_no_input_can_be(mstmm: Command, scene: str, given: str, says: str) -> None:
    done = mstmm("simulate", scene, "--input", given)
    assert done.code == 2 and says in done.err and done.err.startswith("mstmm: --input")
    twice = mstmm("simulate", scene, "--input", "motor=1", "--input", "motor=2")
    assert twice.code == 2 and "motor is given twice" in twice.err


def test_a_file_that_is_not_there_is_named(mstmm: Command, scene: str) -> None:
    Path(scene).with_name("gust.csv").unlink()
    done = mstmm("simulate", scene)
    assert done.code == 2
    assert f"{scene}: signal \"gust\": file: 'gust.csv': there is no such file" in done.err


def test_outputs_are_shown_and_told(mstmm: Command, scene: str) -> None:
    outputs = '[[output]]\nname = "hand"\nof = "rod.tip.position"\n'
    outputs += '[[output]]\nname = "power"\nof = "motor*pivot.angle_rate"\nunit = "W"\n'
    with Path(scene).open("a") as file:
        file.write(outputs.replace("power", "motor_power"))
    done = mstmm("simulate", scene, "--t-end", "1", "-o", "run.nc", "--json", "--error", "1e-4",
                 "--of", "motor_power")  # fmt: skip
    assert done.code == 0, done.err
    told = json.loads(done.out)
    assert told["outputs"]["motor_power"] == 0.5 * told["u"]["pivot.angle_rate"]
    assert len(told["outputs"]["hand"]) == 3 and told["error_estimate"] is not None
    shown = mstmm("simulate", scene, "--t-end", "1", "-o", "run.nc").out
    assert "hand.x" in shown and "motor_power" in shown
    with Path(scene).open("a") as file:
        file.write('[[output]]\nname = "foot"\nof = "rod.tap.x"\n')
    done = mstmm("simulate", scene)
    assert done.code == 2 and done.out == ""
    assert f'{scene}: output "foot": of: "rod.tap.x": there is no such quantity' in done.err
