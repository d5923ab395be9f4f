"""`mstmm simulate`: files, tables, JSON, settings that are refused."""

from __future__ import annotations

import csv
import json
import signal
from pathlib import Path

import numpy as np
import pytest
import scipy.integrate

import mstmm as package
from mstmm.runtime.integrate import steppers
from mstmm.runtime.run import external_integrators
from tests.support.commands import PENDULUM, Command


def columns(path: Path) -> dict[str, list[float]]:
    with path.open(newline="") as file:
        head, *rows = csv.reader(file)
    return {name: [float(row[k]) for row in rows] for k, name in enumerate(head)}


def test_the_listing_of_methods_names_every_method(mstmm: Command) -> None:
    assert "mstmm list methods" in " ".join(mstmm("simulate", "--help").out.split())
    listed = " ".join(mstmm("list", "methods").out.split())
    for name in (
        *steppers.names(),
        *external_integrators.METHODS,
        "dttmm-classical-product",
        "auto",
    ):
        scipy, _, own = name.partition("scipy-")
        assert (own or scipy) in listed, name


def test_result_is_that_of_the_library(mstmm: Command, folder: Path) -> None:
    done = mstmm("simulate", "pendulum.toml", "--t-end", "2", "--times", "0.5", "-o", "run.csv")
    assert done.code == 0 and done.err == ""
    model = package.compile(package.load_scene(folder / "pendulum.toml"))
    expected = model.simulate(2.0, output_times=[0, 0.5, 1, 1.5, 2])
    found = columns(folder / "run.csv")
    assert found["time [s]"] == [0, 0.5, 1, 1.5, 2]
    np.testing.assert_array_equal(found["pivot.angle [rad]"], expected.q[:, 0])


def test_text_names_scene_steps_and_files(mstmm: Command) -> None:
    done = mstmm("simulate", "pendulum.toml", "--t-end", "1", "-o", "run.csv")
    assert "1 body on 1 hinge, 1 degree of freedom" in done.out
    assert "pivot.angle" in done.out and "energy" in done.out
    assert "run.csv" in done.out
    assert max(map(len, done.out.splitlines())) <= 80


def test_degrees_of_freedom_are_those_that_nobody_imposes(mstmm: Command, folder: Path) -> None:
    (folder / "arm.toml").write_text(
        """
        gravity = [0, -9.81, 0]
        body = [
            { name = "cart", mass = 1 },
            { name = "rod", mass = 1, inertia = [1, 1, 1] },
            { name = "hook", mass = 1, inertia = [1, 1, 1] },
        ]
        [[hinge]]
        name = "rail"
        type = "prismatic"
        axis = [1, 0, 0]
        inboard = "ground"
        outboard = "cart"
        drive = ["sin(t)"]
        [[hinge]]
        name = "pin"
        type = "pin"
        inboard = "cart"
        outboard = "rod"
        [[hinge]]
        name = "latch"
        type = "fixed"
        inboard = "rod"
        outboard = "hook"
        release = "t > 5"
        """
    )
    done = mstmm("simulate", "arm.toml", "--t-end", "0.01", "--no-certify")
    expected = "3 bodies on 3 hinges, 1 degree of freedom, 1 driven, 6 locked until released"
    assert done.code == 0 and expected in done.out


def test_the_verdict_comes_first(mstmm: Command) -> None:
    command = ("simulate", "pendulum.toml", "--t-end", "1", "-o", "run.csv", "--certify")
    assert mstmm(*command).out.startswith("trusted: errors within 0.01 rad")
    assert mstmm(*command, "--accuracy", "1e-15").out.startswith("NOT trusted: the estimated error")
    unjudged = mstmm(*command[:-1], "--no-certify")
    assert unjudged.out.startswith("not verified: the error was not estimated (use --certify)")
    assert unjudged.code == 0
    data = json.loads(mstmm(*command, "--accuracy", "1e-15", "--json").out)
    assert data["success"] and not data["trusted"]
    assert data["verdict"].startswith("NOT trusted")


def test_an_interrupted_run_of_scipy_promises_no_checkpoint(
    mstmm: Command, folder: Path, heard: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Late(scipy.integrate.RK45):
        def step(self) -> str | None:
            if self.t > 0.5:
                signal.raise_signal(signal.SIGINT)
            return super().step()

    monkeypatch.setattr(scipy.integrate, "RK45", Late)
    command = ("simulate", "pendulum.toml", "--method", "scipy-RK45", "-o", "run.csv")
    done = mstmm(*command)
    assert done.code == 130 and "the result so far is in run.csv" in done.err
    assert "--resume" not in done.err and not (folder / "run.csv.checkpoint").exists()
    assert columns(folder / "run.csv")["time [s]"][-1] > 0.5
    assert "checkpoint" not in json.loads(mstmm(*command, "--json").out)


def test_no_step_is_longer_than_the_longest(mstmm: Command, folder: Path) -> None:
    command = ("simulate", "pendulum.toml", "--t-end", "1", "-o", "run.csv")
    assert mstmm(*command, "--max-step", "0.01").code == 0
    assert np.diff(columns(folder / "run.csv")["time [s]"]).max() <= 0.01 * (1 + 1e-12)


def test_a_motion_that_sticks_ends_by_name(mstmm: Command, folder: Path) -> None:
    law = PENDULUM + '\nlaw = { effort = "-10*sign(u)" }\n'
    (folder / "sticky.toml").write_text(law)
    done = mstmm("simulate", "sticky.toml", "--times", "5", "-o", "run.csv")
    assert done.code == 4
    assert "no end in sight" in done.err
    assert "'sign(u)' (effort of hinge \"pivot\") chatters" in done.err


def test_default_result_is_netcdf_beside_us(mstmm: Command, folder: Path) -> None:
    assert mstmm("simulate", "pendulum.toml", "--t-end", "0.1").code == 0
    assert package.load_result(folder / "pendulum.nc").t[-1] == 0.1


def test_without_the_extra_the_result_is_csv(
    mstmm: Command, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mstmm.cli.options.missing_packages", lambda extra: ["h5netcdf"])
    assert mstmm("simulate", "pendulum.toml", "--t-end", "0.1").code == 0
    assert (folder / "pendulum.csv").is_file()
    refused = mstmm("simulate", "pendulum.toml", "-o", "x.nc")
    assert refused.code == 3 and "pip install 'mstmm[io]'" in refused.err
    refused = mstmm("simulate", "pendulum.toml", "--plot", "x.png")
    assert refused.code == 3 and "pip install 'mstmm[plot]'" in refused.err


def test_json_is_one_document(mstmm: Command) -> None:
    done = mstmm("simulate", "pendulum.toml", "--t-end", "0.5", "--times", "3", "--json")
    data = json.loads(done.out)
    assert data["success"] and data["t"] == 0.5 and data["samples"] == 3
    assert set(data["q"]) == {"pivot.angle"} and data["files"] == ["pendulum.nc"]


def test_engine_is_chosen_and_named(mstmm: Command, folder: Path) -> None:
    results = {}
    for engine in ("looped", "fused"):
        done = mstmm("simulate", "pendulum.toml", "--t-end", "0.5", "--engine", engine, "--json")
        assert done.code == 0, done.err
        results[engine] = json.loads(done.out)
        assert results[engine]["engine"] == engine
    angles = [results[engine]["q"]["pivot.angle"] for engine in ("looped", "fused")]
    assert angles[0] == pytest.approx(angles[1], abs=1e-9)
    refused = mstmm("simulate", "pendulum.toml", "--engine", "quick")
    assert refused.code == 2
    assert "auto, fused, looped" in refused.err


def test_the_sweep_is_chosen(mstmm: Command, folder: Path) -> None:
    options = ("simulate", "pendulum.toml", "--t-end", "0.5", "--json")
    angles = []
    for sweep in ("riccati", "qr", "product"):
        done = mstmm(*options, "--sweep", sweep)
        assert done.code == 0, done.err
        angles.append(json.loads(done.out)["q"]["pivot.angle"])
    assert angles[1:] == [pytest.approx(angles[0], abs=1e-9)] * 2
    for more in (("--sweep", "quick"), ("--sweep", "qr", "--method", "genalpha", "--step", "0.01")):
        refused = mstmm(*options, *more)
        assert refused.code == 2
        assert "riccati" in refused.err and "qr" in refused.err


@pytest.mark.parametrize(("tip", "sweep"), [(1.0, "riccati"), (1e11, "refined")])
def test_the_sweep_that_the_start_needs_is_chosen_and_told(
    mstmm: Command, folder: Path, tip: float, sweep: str
) -> None:
    rods = "".join(
        f"""
        [[body]]
        name = "rod{i}"
        mass = {tip if i == 3 else 1.0}
        inertia = [0.1, 0.1, 0.1]
        ends.tip = [1, 0, 0]
        [[hinge]]
        name = "pin{i}"
        type = "pin"
        inboard = "{f"rod{i - 1}.tip" if i else "ground"}"
        outboard = "rod{i}"
        """
        for i in range(4)
    )
    (folder / "heavy.toml").write_text(f"gravity = [0, -9.81, 0]\n{rods}")
    done = mstmm("simulate", "heavy.toml", "--t-end", "1e-6")
    assert ("looped engine, sweep refined" in done.out) == (sweep == "refined")
    found = json.loads(mstmm("simulate", "heavy.toml", "--t-end", "1e-6", "--json").out)
    assert found["sweep"] == sweep
    assert "pivot-loss" not in [risk["name"] for risk in found["risks"]]


def test_plot_of_quantities(mstmm: Command, folder: Path) -> None:
    options = ("--t-end", "0.5", "--plot", "a.png", "-q", "rod.tip.position", "-q", "energy")
    done = mstmm("simulate", "pendulum.toml", *options)
    assert done.code == 0 and "rod.tip.position.x" in done.out
    assert (folder / "a.png").read_bytes().startswith(b"\x89PNG")


def test_plot_of_a_scene_whose_coordinates_are_quaternions(mstmm: Command, folder: Path) -> None:
    (folder / "ball.toml").write_text(
        PENDULUM.replace('"pin"', '"ball"').replace("q = [0.3]", "u = [1, 2, 3]")
    )
    done = mstmm("simulate", "ball.toml", "--t-end", "0.2", "--plot", "a.svg")
    assert done.code == 0 and "pivot.yaw" in done.out
    assert "<svg" in (folder / "a.svg").read_text()


def test_unknown_quantity_is_refused_before_the_run(mstmm: Command, folder: Path) -> None:
    done = mstmm("simulate", "pendulum.toml", "-q", "rod.tp.position")
    assert done.code == 2 and '--quantity "rod.tp.position"' in done.err
    assert "did you mean" in done.err
    assert not (folder / "pendulum.nc").exists()


def test_event_that_stops_is_a_success(mstmm: Command, folder: Path) -> None:
    stop = '[[event]]\nname = "low"\nwhen = "pivot.q < 0"\ndo = "stop"\n'
    (folder / "stop.toml").write_text(PENDULUM + stop)
    done = mstmm("simulate", "stop.toml")
    assert done.code == 0 and "low" in done.out


def test_numerical_failure_keeps_what_was_computed(mstmm: Command, folder: Path) -> None:
    push = PENDULUM + 'law = { effort = "1/(1 - t)" }\n'
    (folder / "push.toml").write_text(push)
    done = mstmm("simulate", "push.toml", "--t-end", "3", "-o", "push.csv", "--json")
    data = json.loads(done.out)
    assert done.code == 4 and not data["success"]
    assert "push.csv" in done.err and "push.toml" in done.err
    last = columns(folder / "push.csv")["time [s]"][-1]
    assert 0.9 < last <= 1.0


def test_mass_that_leaves_a_motion_undetermined_is_bad_input(mstmm: Command, folder: Path) -> None:
    light = PENDULUM.replace("mass = 1.0", "mass = 0.0").replace(
        "[0.001, 0.084, 0.084]", "[0, 0, 0]"
    )
    (folder / "light.toml").write_text(light)
    for command in ("simulate", "check"):
        done = mstmm(command, "light.toml")
        assert done.code == 2
        assert "pivot" in done.err and "light.toml" in done.err


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--t-end", "nan"), "--t-end"),
        (("--t-end", "inf"), "finite"),
        (("--t-end", "1e999"), "finite"),
        (("--t-end", "-1"), "above 0"),
        (("--t-end", "soon"), "not a number"),
        (("--t-end", ""), "not a number"),
        (("--t-end",), "--t-end"),
        (("--rtol", "0"), "above 0"),
        (("--atol", "-1e-9"), "0 or more"),
        (("--step", "-0.1"), "above 0"),
        (("--max-step", "-1"), "0 or more"),
        (("--times", "1"), "2 samples"),
        (("--times", "0.0"), "--times"),
        (("--times", "99999999999999999999"), "at most"),
        (("--times", "1e-300"), "at most"),
        (("--times", "-5"), "--times"),
        (("--method", "magic"), "dop853"),
        (("--method", "rk4"), "step"),
        (("--method", "rk4", "--step", "1e-320", "--times", "2"), "step"),
        (("--output", ""), "file name"),
        (("--output", "x.xls"), ".nc or .csv"),
        (("--output", "away/x.nc"), "no folder away"),
        (("--output", "x" * 300 + ".nc"), "long"),
        (("--output", "folder.nc"), "folder"),
        (("--plot", "x.bmp"), ".png"),
        (("--plot", "x.png", "-q", "nothing"), "nothing"),
        (("--resume",), "checkpoint"),
        (("--hinge", "none.py"), "none.py"),
        (("--nonsense",), "--nonsense"),
        (("--method", "rodas4p3"), 'method "rodas4p3" is not known'),
        (("--method", "genalpha", "--radius", "1.5"), "a spectral radius from 0 to 1"),
        (("--method", "rodas4p2", "--radius", "0.5"), 'method "rodas4p2" has no such option'),
        (("--method", "rodas4", "--tangent", "laws"), "rodas4 has a low order"),
        (("--tangent", "exact"), 'method "auto" has no such option'),
        (("--method", "dop853", "--tangent", "exact"), 'method "dop853" has no such option'),
        (("--method", "genalpha", "--tangent", "law"), "expected one of auto, exact, laws"),
        (("--method", "wilson"), '"wilson" takes fixed steps'),
        (("another.toml",), "another.toml"),
    ],
)
def test_refused(mstmm: Command, folder: Path, options: tuple[str, ...], said: str) -> None:
    (folder / "folder.nc").mkdir()
    done = mstmm("simulate", "pendulum.toml", *options)
    assert done.code == 2
    assert said in done.err and "Traceback" not in done.err
    assert len(done.err) < 400


def test_folder_that_cannot_be_written(mstmm: Command) -> None:
    done = mstmm("simulate", "pendulum.toml", "-o", "/proc/run.nc")
    assert done.code == 3 and "/proc/run.nc" in done.err


def test_device_is_no_result_file(mstmm: Command, folder: Path) -> None:
    (folder / "null.nc").symlink_to("/dev/null")
    assert mstmm("simulate", "pendulum.toml", "-o", "null.nc").code == 2


def test_disk_too_full_for_netcdf(
    mstmm: Command, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Usage:
        free = 1000

    monkeypatch.setattr(
        "mstmm.runtime.result.export.xarray_dataset.shutil.disk_usage", lambda path: Usage
    )
    done = mstmm("simulate", "pendulum.toml", "--t-end", "0.1")
    assert done.code == 3 and "MB left" in done.err
    assert not list(folder.glob("*.nc")) and not list(folder.glob(".*.nc"))


def test_the_classical_method_has_options_of_its_own(mstmm: Command, folder: Path) -> None:
    method = ("simulate", "pendulum.toml", "--t-end", "1", "--method", "dttmm-classical")
    done = mstmm(
        *method, "--step", "0.01", "--scheme", "hht:0.1", "--iterations", "9", "-o", "a.csv"
    )
    assert done.code == 0
    assert "dttmm-classical, step 0.01 s: 100 steps" in done.out
    assert not (folder / "a.csv.checkpoint").exists()
    refused = mstmm(*method, "--step", "0.01", "--scheme", "euler", "-o", "b.csv")
    assert refused.code == 2 and "generalised-alpha, hht, newmark, wilson" in refused.err
    assert mstmm(*method, "-o", "b.csv").code == 2


def test_the_choice_of_methods_is_told(mstmm: Command, folder: Path) -> None:
    scene = (folder / "pendulum.toml").read_text()
    (folder / "stiff.toml").write_text(scene + "law = { damping = [1e6] }\n")
    command = ("--t-end", "1", "--method", "auto", "--rtol", "1e-4", "-o", "run.csv")
    told = mstmm("simulate", "stiff.toml", *command)
    assert told.code == 0 and "auto, rtol 0.0001" in told.out
    assert "  dop853 from t = 0 s" in told.out and "  rodas4p2 from t = " in told.out
    assert max(map(len, told.out.splitlines())) <= 80
    data = json.loads(mstmm("simulate", "stiff.toml", *command, "--json").out)
    assert [row["method"] for row in data["methods"]] == ["dop853", "rodas4p2"]
    plain = mstmm("simulate", "pendulum.toml", "--t-end", "1", "-o", "run.csv")
    assert "from t = 0 s" not in plain.out
    refused = mstmm("simulate", "stiff.toml", *command, "--step", "0.1")
    assert refused.code == 2 and "chooses its steps" in refused.err


def test_bounces_that_come_to_rest_are_no_success(mstmm: Command, folder: Path) -> None:
    """Flights of sqrt(2 h / g) (1 + e) / (1 - e) in all: 1.35 s of the 5 s asked for."""
    (folder / "ball.toml").write_text(
        """
gravity = [0, -9.81, 0]
[[body]]
name = "ball"
mass = 0.2
[[hinge]]
name = "fall"
type = "prismatic"
inboard = "ground"
outboard = "ball"
axis = [0, 1, 0]
initial = { q = [1.0] }
[[event]]
name = "floor"
when = "ball.y <= 0"
do = "bounce"
restitution = 0.5
"""
    )
    done = mstmm("simulate", "ball.toml", "--t-end", "5", "--json", "-o", "run.csv")
    data = json.loads(done.out)
    assert done.code == 4 and not data["success"] and not data["trusted"]
    assert "come to rest" in done.err
