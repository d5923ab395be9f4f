"""Estimated errors beside true ones: never smaller than a third before the horizon."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import mstmm
from mstmm.runtime.result.observations import quaternions
from mstmm.runtime.result.result import Result
from mstmm.runtime.run.error_estimate import SAFETY, ErrorEstimate, compare
from tests.reference.closed_forms import damped_oscillator, free_top_attitude, pendulum_angle
from tests.reference.random_scenes import random_scene, random_state
from tests.support.scenes.results import motor, pins, rod

Array = NDArray[np.float64]

SETTINGS: list[dict[str, Any]] = [
    {"method": "dop853", "rtol": 1e-6, "atol": 1e-9},
    {"method": "dop853", "rtol": 1e-9, "atol": 1e-12},
    {"method": mstmm.methods.Method("dop853", max_step=0.05), "rtol": 1e-6, "atol": 1e-9},
    {"method": "dopri5", "rtol": 1e-5, "atol": 1e-8},
    {"method": "dopri5", "rtol": 1e-9, "atol": 1e-12},
    {"method": "rk4", "step": 0.02},
    {"method": "rk4", "step": 0.1},
    {"method": "scipy-RK45", "rtol": 1e-6, "atol": 1e-9},
]


def pendulum() -> tuple[mstmm.Scene, Callable[[Array], Array]]:
    def exact(t: Array) -> Array:
        return pendulum_angle(t, 2 / 3, 9.81, 1.0 + np.pi / 2)[:, None] - np.pi / 2

    return pins(1, [1.0]), exact


def oscillator() -> tuple[mstmm.Scene, Callable[[Array], Array]]:
    hinge = {"name": "rail", "type": "prismatic", "inboard": "ground", "outboard": "rod",
             "axis": [1, 1, 0], "initial": {"q": [0.3]},
             "law": {"stiffness": 40.0, "damping": 0.5}}  # fmt: skip
    scene = mstmm.Scene(gravity=(0, 0, 0), body=[rod("rod", 2.0)], hinge=[hinge])
    return scene, lambda t: damped_oscillator(t, 2.0, 40.0, 0.5, 0.3)[:, None]


OMEGA = np.array([0.3, 1.0, 5.0])


def top() -> tuple[mstmm.Scene, Callable[[Array], Array]]:
    body = {"name": "top", "mass": 1.0, "inertia": [1.0, 1.0, 0.4]}
    hinge = {"name": "ball", "type": "ball", "inboard": "ground", "outboard": "top",
             "initial": {"u": list(OMEGA)}}  # fmt: skip

    def exact(t: Array) -> Array:
        turns = [free_top_attitude(x, 1.0, 0.4, np.eye(3), OMEGA) for x in t]
        return quaternions(np.array(turns).reshape(-1, 9))

    return mstmm.Scene(gravity=(0, 0, 0), body=[body], hinge=[hinge]), exact


def true_errors(run: Result, exact: Array) -> Array:
    """Largest error of q so far; of a quaternion its rotation angle."""
    difference = np.abs(run.q - exact).max(axis=1)
    if run.q.shape[1] == 4:
        chord = np.minimum(
            np.linalg.norm(run.q - exact, axis=1), np.linalg.norm(run.q + exact, axis=1)
        )
        difference = 4 * np.arcsin(chord / 2)
    return np.asarray(np.maximum.accumulate(difference))


def estimate(run: Result) -> ErrorEstimate:
    error = run.certificate.error
    assert error is not None
    return error


@pytest.mark.parametrize("settings", SETTINGS, ids=str)
@pytest.mark.parametrize("case", [pendulum, oscillator, top])
def test_the_estimate_bounds_a_third_of_the_true_error(
    case: Callable[[], tuple[mstmm.Scene, Callable[[Array], Array]]], settings: dict[str, Any]
) -> None:
    scene, exact = case()
    model = mstmm.compile(scene)
    for times in (None, np.linspace(0, 10, 201)):
        run = model.simulate(10.0, certify=True, output_times=times, **settings)
        error = estimate(run)
        (estimated,) = error.q.values()
        true = true_errors(run, exact(run.t))
        within = error.t <= (error.divergence_time or np.inf)
        last = int(within.nonzero()[0][-1])
        assert estimated[last] >= true[last] / 3
        assert estimated[last] <= 30 * true[last] + 1e-13  # and it is no empty bound
        serious = within & (true > 0.01 * true[last]) & (true > 1e-13)
        assert np.all(estimated[serious] >= true[serious] / 3)


def double_pendulum(t: float, y: Array) -> Array:
    """Two uniform rods (1 m, 1 kg), relative angles from the x axis; written out by hand."""
    a, b = y[0], y[0] + y[1]
    wa, wb = y[2], y[2] + y[3]
    c, s = 0.5 * np.cos(a - b), 0.5 * np.sin(a - b)
    matrix = np.array([[4 / 3, c], [c, 1 / 3]])
    force = np.array([-1.5 * 9.81 * np.cos(a) - s * wb**2, -0.5 * 9.81 * np.cos(b) + s * wa**2])
    alpha = np.linalg.solve(matrix, force)
    return np.array([y[2], y[3], alpha[0], alpha[1] - alpha[0]])


def test_a_double_pendulum_past_its_horizon() -> None:
    """At 1e-9 to t = 20 the sum of local errors says nothing; the estimate holds to the horizon."""
    t = np.linspace(0, 20, 401)
    model = mstmm.compile(pins(2, [0.3, 0.5]))
    run = model.simulate(20.0, certify=True, output_times=t, rtol=1e-9, atol=1e-12)
    best = model.simulate(20.0, output_times=t, rtol=1e-13, atol=1e-15)
    other = solve_ivp(
        double_pendulum, (0, 20), [0.3, 0.5, 0, 0], "DOP853", t, rtol=3e-14, atol=1e-15
    )
    reference = float(np.abs(best.q - other.y[:2].T).max())
    true = true_errors(run, best.q)
    assert reference < 0.02 * true[-1]  # both references agree far better than the run does
    error, certificate = estimate(run), run.certificate
    assert error.divergence_time is not None and 10 < error.divergence_time < 19
    assert certificate.predictable_until == error.divergence_time
    assert "predictable until" in str(certificate)
    before = (error.t <= error.divergence_time) & (true > 1e-12)
    assert np.all(error.q["rad"][before] >= true[before] / 3)
    assert true[-1] > 0.1 > 0.02 > true[error.t <= error.divergence_time][-1]
    assert certificate.sum_of_local_errors is not None
    assert certificate.sum_of_local_errors < 1e-4 * true[-1]
    assert error.tenfold_time is not None and 1 < error.tenfold_time < 5
    assert run.success and certificate.energy.relative < 1e-7  # energy shows nothing of it


def test_regular_motion_has_no_horizon_and_no_exponential_growth() -> None:
    run = mstmm.compile(pins(1, [0.3])).simulate(30.0, certify=True)
    error = estimate(run)
    assert error.divergence_time is None and error.tenfold_time is None and not run.warnings
    assert set(error.largest("q")) == {"rad"} and set(error.largest("u")) == {"rad/s"}
    assert error.reference == "rtol 1e-11" and "rtol 1e-11" in str(run.certificate)


def test_a_run_at_the_tightest_tolerance_is_judged_by_a_looser_one() -> None:
    scene, exact = pendulum()
    run = mstmm.compile(scene).simulate(10.0, certify=True, rtol=3e-14, atol=1e-15)
    error = estimate(run)
    assert error.reference == "rtol 3e-13"
    assert error.q["rad"][-1] >= true_errors(run, exact(run.t))[-1] / 3


def test_driven_and_released_hinges_keep_their_estimate() -> None:
    hinge = {"name": "motor", "type": "pin", "inboard": "ground", "outboard": "rod",
             "drive": "0.5*sin(3*t)", "release": "t >= 1"}  # fmt: skip
    model = mstmm.compile(mstmm.Scene(gravity=(0, -9.81, 0), body=[rod("rod")], hinge=[hinge]))
    run = model.simulate(4.0, certify=True, method="dopri5", rtol=1e-6)
    best = model.simulate(4.0, rtol=1e-13, atol=1e-15, output_times=np.unique(run.t))
    _, ours = np.unique(run.t, return_index=True)
    true = np.abs(run.q[ours] - best.q).max()
    assert true / 3 < estimate(run).q["rad"][-1] < 30 * true


@pytest.mark.parametrize("method", ["dop853", "dopri5"])
def test_estimates_of_random_scenes(method: str, rng: np.random.Generator) -> None:
    """All hinges mixed, friction, stops, springs, loads; the truth is a run at 1e-13."""
    compared = 0
    for _ in range(8):
        seed = int(rng.integers(10**6))
        data = random_scene(seed, most=4)
        model, start = mstmm.compile(mstmm.Scene.from_data(data)), random_state(data, seed)
        run = model.simulate(
            0.3,
            mstmm.methods.Method(method, max_steps=2000),
            rtol=1e-6,
            certify=True,
            initial=start,
        )
        if not run.success:
            continue
        best = model.simulate(
            0.3,
            mstmm.methods.Method(max_steps=20_000),
            rtol=1e-13,
            atol=1e-15,
            initial=start,
            output_times=np.unique(run.t),
        )
        if not best.success:
            continue
        true = compare(model.coordinate_layout, run.trajectory, best.trajectory, "")
        error = estimate(run)
        within = error.t <= (error.divergence_time or np.inf)
        for unit, values in error.q.items():
            size = true.q[unit][within][-1] / SAFETY
            assert values[within][-1] >= size / 3 - 1e-12, (seed, unit)
            compared += size > 1e-12
    assert compared > 4


def test_without_certify_there_is_no_second_run() -> None:
    scene = motor("sin(t)")
    assert mstmm.compile(scene).simulate(1.0).certificate.error is None


def test_what_moves_by_rounding_alone_is_no_motion_to_lose() -> None:
    """A rod that hangs plumb but for the last digit of pi / 2, beside one that swings."""
    scene = mstmm.Scene(
        gravity=(0, -9.81, 0),
        body=[rod("swing", 0.7), rod("plumb", 0.4)],
        hinge=[
            {"name": "high", "type": "pin", "inboard": "ground", "outboard": "swing"},
            {"name": "low", "type": "pin", "inboard": "ground", "outboard": "plumb",
             "initial": {"q": -np.pi / 2}},
        ],
    )  # fmt: skip
    result = mstmm.compile(scene, engine="looped").simulate(0.5, certify=True)
    moved = np.ptp(result.q[:, 1])
    speed = np.abs(result.u[:, 1]).max()
    assert 0 < max(moved, speed) < 1e-12
    assert result.certificate.error is not None and result.certificate.error.divergence_time is None
    assert result.certificate.verdict().trusted
