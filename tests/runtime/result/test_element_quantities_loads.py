"""What acts, by name: loads, springs, motors and drives, against power balances and formulas."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import mstmm
from mstmm.runtime.result.observations import euler_angles, gimbal_note
from mstmm.runtime.result.result import Result
from tests.support.scenes.results import rod, tree


@pytest.fixture(scope="module")
def run() -> Result:
    return mstmm.compile(tree()).simulate(1.0, rtol=1e-9)


def values(run: Result, name: str) -> np.ndarray:
    return run.quantity(name).values


def test_the_powers_of_all_that_acts_are_the_power_of_the_scene(run: Result) -> None:
    dampers = (
        -(run.speeds("elbow") ** 2 @ [0.2, 0.1]) - 0.4 * values(run, "spring1.length_rate") ** 2
    )
    given = values(run, "load1.power") + values(run, "slider.motor_power")
    np.testing.assert_allclose(given + dampers, run.power(), atol=1e-11 * np.ptp(run.power()))
    every = sum(values(run, f"{name}.power") for name in ("elbow", "slider", "wrist", "space"))
    stiff = run.coordinates("elbow") * run.speeds("elbow") @ [3.0, 2.0]
    np.testing.assert_allclose(
        every, values(run, "slider.motor_power") - stiff - run.speeds("elbow") ** 2 @ [0.2, 0.1],
        atol=1e-12,
    )  # fmt: skip


def test_a_load_in_body_axes_turns_with_the_body(run: Result) -> None:
    own = np.stack([np.cos(2 * run.t), 0.5 + 0 * run.t, 0 * run.t], axis=1)
    w, *v = run.orientation("arm").T
    turned = Rotation.from_quat(np.stack([*v, w], axis=1)).apply(own)
    np.testing.assert_allclose(values(run, "load1.force"), turned, atol=1e-13)
    power = np.sum(turned * run.velocity("arm.tip"), axis=1)
    np.testing.assert_allclose(values(run, "load1.power"), power, atol=1e-12)
    assert "load1.moment" not in run.quantity_names()


def test_a_spring_pulls_along_its_line(run: Result) -> None:
    apart = run.position("paddle") - [1.0, 1.0, 0.0]
    length = np.linalg.norm(apart, axis=1)
    rate = np.sum(apart * run.velocity("paddle"), axis=1) / length
    effort = -8.0 * (length - 0.3) - 0.4 * rate
    force = effort[:, None] * apart / length[:, None]
    np.testing.assert_allclose(values(run, "spring1.force"), force, atol=1e-12)
    np.testing.assert_allclose(values(run, "spring1.power"), effort * rate, atol=1e-11)


@pytest.mark.parametrize("reference", ["arm.tip", "wheel", "wrist"])
def test_euler_angles_are_those_of_scipy(run: Result, reference: str) -> None:
    q = run.coordinates("wrist") if reference == "wrist" else run.orientation(reference)
    known = Rotation.from_quat(q[:, [1, 2, 3, 0]]).as_euler("ZYX")
    found = values(run, f"{reference}.euler")
    np.testing.assert_allclose(found, np.unwrap(known, axis=0), atol=1e-12)
    np.testing.assert_array_equal(found[:, 0], values(run, f"{reference}.yaw"))


def test_where_the_pitch_is_a_right_angle_the_roll_stays() -> None:
    angles = np.array([[0.3, 1.2, 0.7], [0.4, np.pi / 2, 0.7], [0.5, -np.pi / 2, 0.7]])
    turned = Rotation.from_euler("ZYX", angles).as_matrix().reshape(-1, 9)
    found = euler_angles(turned)
    np.testing.assert_allclose(found, angles, atol=1e-7)
    assert "comes within" in gimbal_note(found) and gimbal_note(found[:1]) == ""


DRIVEN = {
    "gravity": [0, -9.81, 0], "body": [rod("a"), rod("b")],
    "hinge": [
        {"name": "first", "type": "pin", "inboard": "ground", "outboard": "a", "drive": ["t^2"]},
        {"name": "second", "type": "pin", "inboard": "a.tip", "outboard": "b",
         "law": {"effort": "motor", "damping": 0.3}},
    ],
    "spring": [{"name": "strut", "from": "a.tip", "to": "b.tip", "law": {"effort": "2*motor"}}],
    "input": [{"name": "motor", "unit": "N m"}],
    "output": [{"name": "heat", "of": "second.power - second.motor_power", "unit": "W"}],
    "controller": [{
        "name": "regulator", "sample_time": 0.1, "inputs": ["second.angle"], "outputs": ["motor"],
        "D": [[-4.0]], "reference": [0.5],
    }],
}  # fmt: skip


def test_motors_follow_what_a_controller_holds_and_drives_what_they_need(tmp_path: Path) -> None:
    run = mstmm.compile(mstmm.Scene.from_data(DRIVEN)).simulate(1.0)
    held = values(run, "motor")
    assert len(np.unique(held)) > 5
    np.testing.assert_array_equal(values(run, "second.motor"), held)
    np.testing.assert_array_equal(values(run, "strut.motor"), 2 * held)
    np.testing.assert_array_equal(values(run, "strut.effort"), 2 * held)
    np.testing.assert_array_equal(values(run, "first.motor"), run.effort("first")[:, 0])
    np.testing.assert_allclose(values(run, "heat"), -0.3 * run.speeds("second")[:, 0] ** 2,
                               atol=1e-13)  # fmt: skip
    put_in = sum(values(run, f"{name}.motor_power") for name in ("first", "second", "strut"))
    np.testing.assert_allclose(put_in + values(run, "heat"), run.power(), atol=1e-11)
    data = run.to_xarray()
    np.testing.assert_array_equal(data["spring_motor"].sel(spring="strut"), 2 * held)
    header = run.save(tmp_path / "run.csv").read_text().splitlines()[0]
    assert "strut.length [m]" in header and "first.motor [N*m]" in header
