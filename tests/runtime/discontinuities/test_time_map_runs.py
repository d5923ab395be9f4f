"""Forces that depend on time alone: every method sees them, whatever the motion does."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm

MASS = {"name": "m", "mass": 1.0, "inertia": [1, 1, 1]}
RAIL = {
    "name": "h", "type": "prismatic", "axis": [1, 0, 0], "inboard": "ground", "outboard": "m",
}  # fmt: skip


def on_a_rail(force: str, u: float = 0.0) -> mstmm.Scene:
    """One kilogram on a rail, at q = 0, under a force along it."""
    return mstmm.Scene.from_data({
        "gravity": [0, 0, 0], "body": [MASS], "hinge": [RAIL | {"initial": {"u": [u]}}],
        "load": [{"on": "m", "force": [force, 0, 0]}],
    })  # fmt: skip


def simulate_force(force: str, t_end: float, **options: Any) -> mstmm.Result:
    """Run of the mass on its rail under a force, on the looped engine."""
    return mstmm.compile(on_a_rail(force), engine="looped").simulate(t_end, **options)


@pytest.mark.parametrize("method", ["dopri5", "dop853", "pirk13", "scipy-RK45"])
def test_an_oscillating_force_is_seen(method: str) -> None:
    result = simulate_force("100*sin(200*t)", 1.0, method=method)
    assert result.u[-1, 0] == pytest.approx((1 - np.cos(200.0)) / 2, abs=1e-7)


METHODS = ("dopri5", "dop853", "pirk13", "scipy-RK45", "scipy-Radau")

#: Force -> speed that it gives within ten seconds, exactly.
PULSES = {
    "100*exp(-((t - 5.03)/0.005)^2)": 0.5 * np.sqrt(np.pi),
    "where(sin(t) > 0.9999, 100, 0)": 400 * np.arccos(0.9999),
    "where(cos(2*pi*t) > 0.999, 100, 0)": 1000 * np.arccos(0.999) / np.pi,
    "where((t - 5)^2 < 0.000001, 100, 0)": 0.2,
    "100*max(0, 0.001 - abs(t - 7))*1000": 0.1,
    "1/(1 + ((t - 3)/0.0001)^2)": 1e-4 * (np.arctan(7e4) + np.arctan(3e4)),
    "exp(-((t - 0.00001)/0.000001)^2)*1e5": 0.1 * np.sqrt(np.pi),
}  # fmt: skip


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("force", PULSES)
def test_a_narrow_pulse_moves_a_body_at_rest(force: str, method: str) -> None:
    result = simulate_force(force, 10.0, method=method)
    assert result.success
    assert result.u[-1, 0] == pytest.approx(PULSES[force], rel=2e-6 if "Radau" in method else 1e-7)


@pytest.mark.parametrize("force", PULSES)
def test_the_estimate_covers_the_error(force: str) -> None:
    result = simulate_force(force, 10.0, certify=True)
    error = result.certificate.error
    assert error is not None
    assert abs(result.u[-1, 0] - PULSES[force]) <= error.largest("u")["m/s"] + 1e-11


def test_batches_in_lanes_see_pulses() -> None:
    model = mstmm.compile(on_a_rail("100*exp(-((t - 5.03)/0.005)^2)"))
    batch = model.simulate_batch(([[0.0], [1.0]], [[0.0]]), t_end=10.0)
    np.testing.assert_allclose(batch.u[:, -1, 0], 0.5 * np.sqrt(np.pi), rtol=1e-7)


def test_a_drive_moves_at_once_and_is_followed() -> None:
    """A driven pivot that turns within 20 ms: the work done is what the rod gains."""
    rod = {"name": "rod", "mass": 1.0, "inertia": [0.1, 0.1, 0.1], "center_of_mass": [0.5, 0, 0]}
    pivot = {"name": "pivot", "type": "pin", "axis": [0, 0, 1], "inboard": "ground",
             "outboard": "rod", "drive": ["0.5*tanh((t - 5.3)/0.005)"]}  # fmt: skip
    scene = mstmm.Scene.from_data({"gravity": [0, -9.81, 0], "body": [rod], "hinge": [pivot]})
    result = mstmm.compile(scene, engine="looped").simulate(10.0)
    energy = result.energy()
    np.testing.assert_allclose(result.work[-1], energy[-1] - energy[0], rtol=1e-6)
    assert result.work[-1] == pytest.approx(9.81 * np.sin(0.5), rel=1e-6)


def test_a_pole_is_not_passed() -> None:
    for method in ("dopri5", "dop853", "pirk13"):
        result = simulate_force("1/(t - 0.5)", 1.0, method=method)
        assert not result.success and result.last_state[0] <= 0.5


def test_a_fixed_step_that_may_miss_a_pulse_is_told() -> None:
    force = "100*exp(-((t - 5.03)/0.005)^2)"
    result = simulate_force(force, 10.0, method="rk4", step=0.1, certify=True)
    (text,) = [t for t in result.warnings if "fixed" in t]
    assert not result.trusted
    assert 'too long for load "load1", which near t = 5.0' in text
    assert not simulate_force(force, 10.0, method="rk4", step=0.001).warnings


def test_the_second_run_looks_elsewhere() -> None:
    """Nothing moves: the first run makes long steps, the second one shorter ones."""
    from mstmm.runtime.run.error_estimate import reference_settings

    run = simulate_force("0*t", 10.0).trajectory
    second, _ = reference_settings(run)
    assert run.statistics.largest_step is not None
    assert 0 < second.max_step < 0.4 * run.statistics.largest_step


def test_max_step_bounds_every_step() -> None:
    result = simulate_force("0*t", 10.0, method=mstmm.methods.Method(max_step=0.1))
    assert np.diff(result.t).max() <= 0.1 * (1 + 1e-12)


def test_a_huge_force_that_switches_is_met() -> None:
    """Where the time of a switch is known to rounding alone, no error is asked for."""
    result = simulate_force("where(sin(t) > 0.5, 1e12, 0)", 3.0)
    assert result.success
    assert result.u[-1, 0] == pytest.approx(1e12 * 2 * np.pi / 3, rel=1e-9)


def test_compiled_code_sees_pulses_as_the_loop_does() -> None:
    model = mstmm.compile(on_a_rail("where(sin(t) > 0.9999, 100, 0)"), engine="fused")
    result = model.simulate(10.0)
    assert result.u[-1, 0] == pytest.approx(400 * np.arccos(0.9999), rel=1e-9)


@pytest.mark.parametrize(
    ("drive", "jumps"),
    [
        ("where(sin(3*t) > 0.5, 0.1, 0)", "jumps in position at t = 0.174533 s, from 0 to 0.1"),
        ("abs(sin(t - 0.5))", "jumps in speed at t = 0.5 s, from -1 to 1"),
        ("abs(sin(t - 0.5))^3", ""),
        ("where(sin(3*t) > 0.5, (sin(3*t) - 0.5)^3, 0)", ""),
    ],
)
def test_a_drive_that_jumps_on_the_way_is_refused(drive: str, jumps: str) -> None:
    """Found where the run is known; before the jump there is a motion."""
    scene = mstmm.Scene(gravity=(0, 0, 0), body=[MASS], hinge=[RAIL | {"drive": drive}])
    model = mstmm.compile(scene, engine="looped")
    assert model.simulate(0.1).success
    if jumps:
        with pytest.raises(mstmm.SceneError, match=f'drive of hinge "h": .* {jumps}'):
            model.simulate(1.0)
    else:
        assert model.simulate(1.0, certify=True).trusted
