"""Quantities of a result against mechanics written out here: derivatives, balances, frames."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import mstmm
from mstmm.runtime.result.result import Result
from tests.reference.closed_forms import pendulum_angle
from tests.support.scenes.results import pins, tree

Array = NDArray[np.float64]


def fine(t: float = 0.5, width: float = 1e-4) -> Array:
    return np.asarray(t + width * np.arange(-2, 3))


@pytest.fixture(scope="module")
def run() -> Result:
    model = mstmm.compile(tree())
    result = model.simulate(1.0, rtol=1e-12, atol=1e-13, output_times=[0, *fine(), 1.0])
    assert result.success, result.message
    return result


def slope(values: Array, width: float = 1e-4) -> Array:
    """Time derivative in the middle of the five fine samples, error of order 4."""
    _, a, b, _, d, e, _ = values
    return np.asarray((a - 8 * b + 8 * d - e) / (12 * width))


def rotate_vectors(q: Array, x: Array) -> Array:
    """Vectors x turned by unit quaternions q (w, x, y, z)."""
    v = q[..., 1:]
    return np.asarray(x + 2 * np.cross(v, q[..., :1] * x + np.cross(v, x)))


REFERENCES = ("base", "base.left", "arm", "arm.tip", "paddle", "wheel", "wheel.rim")


@pytest.mark.parametrize("reference", REFERENCES)
def test_motion_is_the_derivative_of_the_position(run: Result, reference: str) -> None:
    np.testing.assert_allclose(
        slope(run.position(reference)), run.velocity(reference)[3], atol=1e-8
    )
    np.testing.assert_allclose(
        slope(run.velocity(reference)), run.acceleration(reference)[3], atol=1e-7
    )
    np.testing.assert_allclose(
        slope(run.angular_velocity(reference)), run.angular_acceleration(reference)[3], atol=1e-7
    )


@pytest.mark.parametrize("reference", REFERENCES)
def test_orientation_turns_with_the_angular_velocity(run: Result, reference: str) -> None:
    q = run.orientation(reference)
    np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1.0, atol=1e-15)
    w, x, y, z = q[3]
    matrix = 0.5 * np.array([[-x, -y, -z], [w, z, -y], [-z, w, x], [y, -x, w]])
    np.testing.assert_allclose(slope(q), matrix @ run.angular_velocity(reference)[3], atol=1e-8)


def test_ends_are_fixed_in_their_bodies(run: Result) -> None:
    for body in run.model.scene.body:
        for name, end in body.ends.items():
            tip = f"{body.name}.{name}"
            offset = rotate_vectors(run.orientation(body.name), np.array(end.position))
            np.testing.assert_allclose(
                run.position(tip), run.position(body.name) + offset, atol=1e-14
            )
            x = np.array([0.3, -0.2, 0.9])
            np.testing.assert_allclose(
                rotate_vectors(run.orientation(tip), x),
                rotate_vectors(run.orientation(body.name), np.array(end.rotation) @ x),
                atol=1e-14,
            )


def test_rates_of_the_coordinates(run: Result) -> None:
    np.testing.assert_allclose(slope(run.u), run.udot[3], atol=1e-6)
    np.testing.assert_allclose(slope(run.coordinates("elbow")), run.speeds("elbow")[3], atol=1e-7)
    assert run.coordinates("wrist").shape == (7, 4) and run.speeds("wrist").shape == (7, 3)


def loads_on(result: Result, k: int) -> dict[str, tuple[Array, Array, Array]]:
    """Inertial force, moment about the mass centre, and place of it, of every hinge of sample k."""
    found = {}
    for hinge in result.model.scene.hinge:
        place = result.position(hinge.outboard)[k]
        found[hinge.name] = (result.force(hinge.name)[k], result.moment(hinge.name)[k], place)
    return found


def outer(result: Result, k: int) -> dict[str, list[tuple[Array, Array]]]:
    """(force, point) of the load and the spring of the tree."""
    t = result.t[k]
    tip = result.orientation("arm")[k]
    push = rotate_vectors(tip, np.array([np.cos(2 * t), 0.5, 0.0]))
    arm = result.position("paddle")[k] - np.array([1.0, 1.0, 0.0])
    length = float(np.linalg.norm(arm))
    rate = float(result.velocity("paddle")[k] @ arm / length)
    pull = -(8.0 * (length - 0.3) + 0.4 * rate) * arm / length
    return {
        "arm": [(push, result.position("arm.tip")[k])],
        "paddle": [(pull, result.position("paddle")[k])],
    }


@pytest.mark.parametrize("k", [0, 3, 6])
def test_forces_and_moments_move_every_body(run: Result, k: int) -> None:
    """Newton and Euler for each body from the loads of its hinges, inboard on outboard."""
    scene, loads = run.model.scene, loads_on(run, k)
    for body in scene.body:
        turn = np.array([rotate_vectors(run.orientation(body.name)[k], e) for e in np.eye(3)]).T
        arm = turn @ np.array(body.center_of_mass)
        w, alpha = run.angular_velocity(body.name)[k], run.angular_acceleration(body.name)[k]
        a = run.acceleration(body.name)[k] + np.cross(alpha, arm) + np.cross(w, np.cross(w, arm))
        center = run.position(body.name)[k] + arm
        J = turn @ np.array(body.inertia_matrix) @ turn.T
        force = body.mass * (np.array(scene.gravity) - a)
        moment = -J @ alpha - np.cross(w, J @ w)
        for hinge in scene.hinge:
            f, m, place = loads[hinge.name]
            sign = float(hinge.outboard_body == body.name) - float(hinge.inboard_body == body.name)
            if sign < 0:
                place = run.position(hinge.inboard)[k]  # where Q is; d is in the moment at P
                m = m + np.cross(run.position(hinge.outboard)[k] - place, f)
            force = force + sign * f
            moment = moment + sign * (m + np.cross(place - center, f))
        for f, place in outer(run, k).get(body.name, []):
            force, moment = force + f, moment + np.cross(place - center, f)
        np.testing.assert_allclose(force, 0, atol=1e-10)
        np.testing.assert_allclose(moment, 0, atol=1e-10)


def test_energies_and_momentum_are_sums_over_the_bodies(run: Result) -> None:
    kinetic = gravity = np.zeros(len(run.t))
    momentum, turning = np.zeros(3), np.zeros(3)
    for body in run.model.scene.body:
        arm = rotate_vectors(run.orientation(body.name), np.array(body.center_of_mass))
        w = run.angular_velocity(body.name)
        v, x = run.velocity(body.name) + np.cross(w, arm), run.position(body.name) + arm
        back = run.orientation(body.name) * np.array([1, -1, -1, -1])
        own = rotate_vectors(back, w)
        spin = own @ np.array(body.inertia_matrix)
        kinetic = kinetic + body.mass * np.sum(v * v, 1) / 2 + np.sum(own * spin, 1) / 2
        gravity = gravity - body.mass * x @ np.array(run.model.scene.gravity)
        momentum = momentum + body.mass * v
        turning = (
            turning + np.cross(x, body.mass * v) + rotate_vectors(run.orientation(body.name), spin)
        )
    length = np.linalg.norm(run.position("paddle") - [1, 1, 0], axis=1)
    hinge = run.coordinates("elbow") ** 2 @ np.array([3.0, 2.0]) / 2
    parts = run.energy_components()
    np.testing.assert_allclose(parts["kinetic"], kinetic, rtol=1e-12)
    np.testing.assert_allclose(parts["gravity"], gravity, atol=1e-11)
    np.testing.assert_allclose(parts["springs"], 4.0 * (length - 0.3) ** 2 + hinge, atol=1e-12)
    np.testing.assert_allclose(run.energy(), sum(parts.values()), rtol=1e-15)
    np.testing.assert_allclose(run.momentum(), momentum, atol=1e-11)
    np.testing.assert_allclose(run.angular_momentum(), turning, atol=1e-11)


def test_work_is_the_integral_of_the_power(run: Result) -> None:
    np.testing.assert_allclose(slope(run.work), run.power()[3], atol=1e-6)
    assert abs(run.work[-1]) > 0.1
    np.testing.assert_allclose(run.energy() - run.energy()[0], run.work, atol=1e-9)


def test_efforts_are_those_of_the_laws(run: Result) -> None:
    q, u = run.coordinates("elbow"), run.speeds("elbow")
    np.testing.assert_allclose(run.effort("elbow"), -q * [3.0, 2.0] - u * [0.2, 0.1], atol=1e-11)
    t = run.t
    expected = np.stack([0.5 * np.sin(3 * t), 0.2 * np.cos(t)], 1)
    np.testing.assert_allclose(run.effort("slider"), expected, atol=1e-11)
    np.testing.assert_allclose(run.effort("wrist"), 0, atol=1e-11)


def test_orientation_keeps_its_sign_over_many_turns() -> None:
    body = {"name": "disc", "mass": 1.0, "inertia": [0.1, 0.1, 0.2]}
    hinge = {
        "name": "axle", "type": "pin", "inboard": "ground", "outboard": "disc",
        "initial": {"u": [30.0]},
    }  # fmt: skip
    scene = mstmm.Scene(gravity=(0, 0, 0), body=[body], hinge=[hinge])
    t = np.linspace(0, 2, 401)
    q = mstmm.compile(scene).simulate(2.0, output_times=t).orientation("disc")
    np.testing.assert_allclose(q[:, 0], np.cos(15 * t), atol=1e-9)
    np.testing.assert_allclose(q[:, 3], np.sin(15 * t), atol=1e-9)


def test_a_driven_coordinate_is_exact_at_every_output_time() -> None:
    scene = mstmm.Scene.from_data(
        {
            "gravity": [0, -9.81, 0],
            "body": [{"name": "a", "mass": 1.0, "inertia": [1, 1, 1], "ends": {"tip": [1, 0, 0]}},
                     {"name": "b", "mass": 1.0, "inertia": [1, 1, 1], "center_of_mass": [1, 0, 0]}],
            "hinge": [
                {"name": "motor", "type": "pin", "inboard": "ground", "outboard": "a",
                 "drive": "0.5*sin(3*t)"},
                {"name": "free", "type": "ball", "inboard": "a.tip", "outboard": "b"},
            ],
        }
    )  # fmt: skip
    t = np.linspace(0, 2, 33)
    run = mstmm.compile(scene).simulate(2.0, output_times=t, rtol=1e-5)
    np.testing.assert_allclose(run.coordinates("motor")[:, 0], 0.5 * np.sin(3 * t), atol=1e-15)
    np.testing.assert_allclose(run.speeds("motor")[:, 0], 1.5 * np.cos(3 * t), atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(run.coordinates("free"), axis=1), 1, atol=1e-15)
    np.testing.assert_allclose(run.udot[:, 0], -4.5 * np.sin(3 * t), atol=1e-14)


# --- by name --------------------------------------------------------------------------------------


def test_quantities_by_name_have_units(run: Result) -> None:
    expected = {
        "elbow.angle1": ("rad", run.q[:, 7]), "elbow.angle1_rate": ("rad/s", run.u[:, 6]),
        "elbow.angle1_acceleration": ("rad/s2", run.udot[:, 6]),
        "slider.displacement": ("m", run.q[:, 13]),
        "slider.effort[0]": ("N", run.effort("slider")[:, 0]),
        "slider.effort_angle": ("N*m", run.effort("slider")[:, 1]),
        "space.vx": ("m/s", run.u[:, 0]), "space.q[3]": ("", run.q[:, 3]),
        "arm.tip.y": ("m", run.position("arm.tip")[:, 1]),
        "arm.tip.vz": ("m/s", run.velocity("arm.tip")[:, 2]),
        "arm.orientation.w": ("", run.orientation("arm")[:, 0]),
        "wrist.fx": ("N", run.force("wrist")[:, 0]),
        "wrist.moment.z": ("N*m", run.moment("wrist")[:, 2]),
        "energy": ("J", run.energy()), "energy.springs": ("J", run.energy_components()["springs"]),
        "momentum.x": ("kg*m/s", run.momentum()[:, 0]), "work": ("J", run.work),
        "power": ("W", run.power()),
    }  # fmt: skip
    for name, (unit, values) in expected.items():
        quantity = run.quantity(name)
        assert quantity.unit == unit, name
        np.testing.assert_array_equal(quantity.values, values)
    assert set(expected) <= set(run.quantity_names())
    vector = run.quantity("wrist.force")
    assert vector.labels == ("x", "y", "z") and vector.values.shape == (7, 3)


@pytest.mark.parametrize(
    "ask, near",
    [
        (lambda r: r.position("arm.tp"), 'did you mean "arm.tip"'),
        (lambda r: r.orientation("amr"), 'did you mean "arm"'),
        (lambda r: r.force("elbo"), 'did you mean "elbow"'),
        (lambda r: r.effort("writs"), 'did you mean "wrist"'),
        (lambda r: r.coordinates("spce"), 'did you mean "space"'),
        (lambda r: r.quantity("arm.tip.vq"), '"arm.tip.v'),
        (lambda r: r.quantity("enrgy"), 'did you mean "energy"'),
        (lambda r: r.plot("elbow.angel1"), 'did you mean "elbow.angle1"'),
    ],
)
def test_unknown_names_suggest_the_near_one(run: Result, ask: object, near: str) -> None:
    assert callable(ask)
    with pytest.raises(mstmm.SceneError, match=near):
        ask(run)


def test_arrays_that_are_kept_cannot_be_changed(run: Result) -> None:
    with pytest.raises(ValueError, match="read-only"):
        run.position("arm")[0] = 0.0


def test_quantities_come_out_the_same_in_small_batches(
    run: Result, monkeypatch: pytest.MonkeyPatch
) -> None:
    from mstmm.runtime.result import observations

    monkeypatch.setattr(observations, "_MAX_BATCH_NUMBERS", 10)
    other = Result(run.model, run.trajectory)
    for name in ("arm.tip.position", "wrist.force", "energy", "elbow.effort[0]", "space.vx_dot"):
        np.testing.assert_array_equal(run.quantity(name).values, other.quantity(name).values)


def test_table_shows_units_and_both_ends(run: Result) -> None:
    lines = run.table("arm.tip.y", "wrist.force", rows=3).splitlines()
    assert lines[0].split() == ["t", "arm.tip.y", *(f"wrist.force.{x}" for x in "xyz")]
    assert lines[1].split() == ["[s]", "[m]", "[N]", "[N]", "[N]"]
    assert lines[3].split()[0] == "0" and lines[-1].split()[0] == "1" and len(lines) == 6
    assert float(lines[-1].split()[1]) == pytest.approx(run.position("arm.tip")[-1, 1], rel=1e-5)


@pytest.mark.parametrize("rows", [1, 2.5, True, "3"])
def test_a_table_of_no_number_of_rows_is_refused(run: Result, rows: Any) -> None:
    with pytest.raises(mstmm.SceneError, match=r"rows = .*: expected a whole number of rows, 2"):
        run.table("energy", rows=rows)


def test_a_pendulum_swings_as_the_elliptic_functions_say() -> None:
    angle, t = 0.8, np.linspace(0, 10, 101)
    run = mstmm.compile(pins(1, [angle])).simulate(10.0, output_times=t, rtol=1e-11)
    down = pendulum_angle(t, 2 / 3, 9.81, angle + np.pi / 2)
    tip = np.stack([np.sin(down), -np.cos(down), 0 * t], axis=1)
    np.testing.assert_allclose(run.position("rod0.tip"), tip, atol=1e-8)
