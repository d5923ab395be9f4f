"""Contacts that can only push, by the load of an eccentric wheel in closed form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.integrate

import mstmm

RADIUS, OFF, MASS, INERTIA, G = 0.3, 0.25, 2.0, 0.06, 9.81


def wheel(speed: float) -> mstmm.Model:
    """A wheel that rolls at a speed (rad/s), its mass centre below its middle."""
    body = {
        "name": "wheel", "mass": MASS, "center_of_mass": [0, 0, -OFF],
        "inertia": [0.05, INERTIA, 0.05],
    }  # fmt: skip
    start = {"q": [0, 0, RADIUS, 1, 0, 0, 0], "u": [speed * RADIUS, 0, 0, 0, speed, 0]}
    hinge = {
        "name": "f", "type": "free", "inboard": "ground", "outboard": "wheel", "initial": start,
    }  # fmt: skip
    road = {
        "name": "road", "type": "rolling", "from": "ground", "to": "wheel", "normal": [0, 0, 1],
        "radius": RADIUS,
    }  # fmt: skip
    tables: dict[str, Any] = {
        "gravity": [0, 0, -G], "body": [body], "hinge": [hinge], "constraint": [road],
    }  # fmt: skip
    return mstmm.compile(mstmm.Scene(**tables), engine="looped")


def normal_load(speed: float, times: np.ndarray) -> np.ndarray:
    """(n,) N, by Lagrange in the angle: M(a) a'' + m R d sin(a) a'^2 = -m g d sin(a) with
    M = I + m (R^2 + d^2 - 2 R d cos(a)), and the acceleration of the mass centre."""

    def mass(a: np.ndarray) -> Any:
        return INERTIA + MASS * (RADIUS**2 + OFF**2 - 2 * RADIUS * OFF * np.cos(a))

    def acceleration(a: Any, w: Any) -> Any:
        return -MASS * OFF * np.sin(a) * (RADIUS * w**2 + G) / mass(a)

    run = scipy.integrate.solve_ivp(
        lambda _, y: [y[1], acceleration(y[0], y[1])], (0.0, float(times[-1])), [0.0, speed],
        "DOP853", times, rtol=1e-11, atol=1e-12,
    )  # fmt: skip
    a, w = run.y
    return np.asarray(MASS * (G + OFF * (np.cos(a) * w**2 + np.sin(a) * acceleration(a, w))))


def test_a_wheel_that_would_hop_is_not_trusted() -> None:
    times = np.linspace(0.0, 1.0, 401)
    run = wheel(40.0).simulate(1.0, output_times=times, certify=True)
    expected = normal_load(40.0, times)
    np.testing.assert_allclose(run.quantity("road.load").values, expected, atol=1e-6)
    (risk,) = [one for one in run.risks if one.name == "pulling-contact"]
    assert risk.invalidates and risk.element == 'constraint "road"' and risk.unit == "N"
    assert risk.value == pytest.approx(expected.min(), abs=1e-6) and expected.min() < -40
    assert f"from t = {times[np.argmax(expected < 0)]:.6g} s on" in risk.description
    assert run.success and not run.trusted


def test_a_wheel_that_keeps_to_the_road_is_trusted() -> None:
    times = np.linspace(0.0, 1.0, 401)
    run = wheel(6.0).simulate(1.0, output_times=times, certify=True)
    assert normal_load(6.0, times).min() > 0
    assert run.trusted and not run.warnings


def test_a_road_above_the_wheel_pulls_at_rest() -> None:
    """Gravity turned round: the whole weight hangs on the contact."""
    tables = wheel(0.0).scene.model_dump(by_alias=True, exclude_none=True)
    tables["gravity"] = [0, 0, G]
    tables["body"][0]["center_of_mass"] = [0, 0, OFF]
    run = mstmm.compile(mstmm.Scene(**tables)).simulate(0.2)
    (risk,) = [one for one in run.risks if one.name == "pulling-contact"]
    assert risk.value == pytest.approx(-MASS * G)


@pytest.mark.parametrize(("gravity", "doubt"), [(-G, None), (0.0, None), (G, True)])
def test_of_loads_that_rigid_bodies_leave_open_the_sum_counts(
    gravity: float, doubt: bool | None
) -> None:
    """Four wheels: one of many shares, of which single ones are rounding about zero."""
    places = [(x, y) for x in (1.0, -1.0) for y in (0.5, -0.5)]
    axis = [0, 1, 0]
    start = {"q": [0, 0, 0.2, 1, 0, 0, 0], "u": [1, 0, 0, 0, 0, 0]}
    tables: dict[str, Any] = {
        "gravity": [0, 0, gravity],
        "body": [
            {"name": "cart", "mass": 10.0, "inertia": [1, 1, 1],
             "ends": {f"e{i}": [*place, 0] for i, place in enumerate(places)}},
            *({"name": f"w{i}", "mass": 1.0, "inertia": [0.01] * 3} for i in range(4)),
        ],
        "hinge": [
            {"name": "f", "type": "free", "inboard": "ground", "outboard": "cart",
             "initial": start},
            *({"name": f"p{i}", "type": "pin", "axis": axis, "inboard": f"cart.e{i}",
               "outboard": f"w{i}"} for i in range(4)),
        ],
        "constraint": [
            {"name": f"r{i}", "type": "rolling", "from": "ground", "to": f"w{i}",
             "normal": [0, 0, 1], "radius": 0.2, "axis": axis} for i in range(4)
        ],
    }  # fmt: skip
    run = mstmm.compile(mstmm.Scene(**tables)).simulate(0.5)
    found = [one for one in run.risks if one.name == "pulling-contact"]
    assert bool(found) is (doubt is not None) and all(one.invalidates is doubt for one in found)
    if found:
        assert found[0].value == pytest.approx(-14 * G)
