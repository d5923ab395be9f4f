"""Observed orders, and agreement with SciPy's runs of the same methods."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.integrate import RK23, solve_ivp

from mstmm.runtime.integrate.c_loop import Status
from mstmm.runtime.integrate.steppers import Tableau, from_monomials, get, to_read_only
from tests.support.integration.compiled_systems import Lab

ARENSTORF = (0.994, 0.0, 0.0, -2.00158510637908252240537862224)
PERIOD = 17.0652165601579625588917206249

# Steps at which truncation is far above rounding
STEPS = {
    "rk4": (0.1, 0.05, 0.025),
    "dopri5": (0.1, 0.05, 0.025),
    "dop853": (0.4, 0.2, 0.1),
    "pirk13": (1.0, 0.5, 0.4),
}


def mixed_solution(t: Any) -> Any:
    """Solution of the system `mixed` from (1, 1)."""
    return np.stack([np.exp(np.sin(t)), 1.0 / (1.0 + np.asarray(t) ** 2)], axis=-1)


def observed_order(errors: list[float], ratio: float = 2.0) -> float:
    """Order from the last two errors, whose steps differ by a ratio."""
    return math.log(errors[-2] / errors[-1]) / math.log(ratio)


@pytest.mark.parametrize("method", STEPS)
def test_fixed_steps_show_the_order(lab: Lab, method: str) -> None:
    problem = lab.problem("mixed", 2)
    errors = [
        float(
            np.abs(problem.finished_run(method, 2.0, (1, 1), step=h).y - mixed_solution(2.0)).max()
        )
        for h in STEPS[method]
    ]
    *_, before, last = STEPS[method]
    assert observed_order(errors, before / last) == pytest.approx(get(method).order, abs=0.45), (
        errors
    )


@pytest.mark.parametrize("method", STEPS)
def test_dense_output_shows_its_order_within_a_step(lab: Lab, method: str) -> None:
    problem = lab.problem("mixed", 2)
    errors = []
    for h in (0.4, 0.2) if method == "pirk13" else (0.4, 0.2, 0.1):
        t = 0.3 + h * np.linspace(0.1, 0.9, 9)
        run = problem.finished_run(
            method, 0.3 + h, mixed_solution(0.3), t_start=0.3, step=h, output_times=t, capacity=3
        )
        assert np.array_equal(run.samples.t, t)
        errors.append(float(np.abs(run.samples.y - mixed_solution(t)).max()))
    assert observed_order(errors) > get(method).dense_order + 0.3, errors


@pytest.mark.parametrize("tolerance", [1e-6, 1e-9, 1e-12])
def test_dop853_takes_scipys_steps(lab: Lab, tolerance: float) -> None:
    run = lab.problem("arenstorf", 4).finished_run(
        "dop853", PERIOD, ARENSTORF, rtol=tolerance, atol=tolerance
    )
    theirs = solve_ivp(
        arenstorf, (0, PERIOD), ARENSTORF, method="DOP853", rtol=tolerance, atol=tolerance
    )
    # the orbit amplifies rounding, so times agree to a part of the error, not to rounding
    assert run.statistics.steps == pytest.approx(len(theirs.t) - 1, abs=1)
    assert run.statistics.evaluations == pytest.approx(theirs.nfev, rel=0.02)
    ours = np.abs(run.y - ARENSTORF).max()
    assert ours < 1.1 * np.abs(theirs.y[:, -1] - ARENSTORF).max()


@pytest.mark.parametrize("tolerance", [1e-6, 1e-9])
def test_dopri5_costs_no_more_than_scipys(lab: Lab, tolerance: float) -> None:
    run = lab.problem("arenstorf", 4).finished_run(
        "dopri5", PERIOD, ARENSTORF, rtol=tolerance, atol=tolerance
    )
    theirs = solve_ivp(
        arenstorf, (0, PERIOD), ARENSTORF, method="RK45", rtol=tolerance, atol=tolerance
    )
    assert run.statistics.evaluations == pytest.approx(theirs.nfev, rel=0.05)
    ours = np.abs(run.y - ARENSTORF).max()
    assert ours < 3.0 * np.abs(theirs.y[:, -1] - ARENSTORF).max()


def test_dopri5_saves_evaluations_where_stability_limits(lab: Lab) -> None:
    problem = lab.problem("harmonic", 2, 300.0, 1.0)
    run = problem.finished_run("dopri5", 5.0, (1, 0), rtol=1e-6, atol=1e-6)
    theirs = solve_ivp(
        lambda t, y: [y[1], -9e4 * y[0] - 600.0 * y[1]], (0, 5), (1, 0), rtol=1e-6, atol=1e-6
    )
    assert run.statistics.evaluations < 0.92 * theirs.nfev


def arenstorf(t: float, y: np.ndarray[Any, Any]) -> list[float]:
    """The restricted three-body problem, for SciPy."""
    mu = 0.012277471
    r1 = ((y[0] + mu) ** 2 + y[1] ** 2) ** 1.5
    r2 = ((y[0] - 1 + mu) ** 2 + y[1] ** 2) ** 1.5
    ax = y[0] + 2 * y[3] - (1 - mu) * (y[0] + mu) / r1 - mu * (y[0] - 1 + mu) / r2
    ay = y[1] - 2 * y[2] - (1 - mu) * y[1] / r1 - mu * y[1] / r2
    return [y[2], y[3], ax, ay]


def piecewise(t: float, at: float) -> float:
    """Solution of the system `piecewise` from 0."""
    return math.sin(t) if t < at else math.sin(at) * math.exp(t - at)


@pytest.mark.parametrize("method", ["rk4", "dopri5", "dop853"])
def test_a_break_keeps_the_order(lab: Lab, method: str) -> None:
    at, t_end = 1.0, 2.4
    problem = lab.problem("piecewise", 1, at)
    exact = piecewise(t_end, at)
    h = STEPS[method]
    errors = [
        abs(problem.finished_run(method, t_end, [0.0], step=x, breaks=[at]).y[0] - exact) for x in h
    ]
    assert observed_order(errors) > get(method).order - 0.6, errors
    # off the grid: 0.4 does not divide the break's time any more
    moved = lab.problem("piecewise", 1, math.pi / 3)
    exact = piecewise(t_end, math.pi / 3)
    error = abs(
        moved.finished_run(method, t_end, [0.0], step=h[-1], breaks=[math.pi / 3]).y[0] - exact
    )
    assert error < 3.0 * errors[-1]
    # and without the break the order is lost
    rough = abs(moved.finished_run(method, t_end, [0.0], step=h[-1]).y[0] - exact)
    assert rough > 100.0 * error


def test_an_adaptive_run_passes_a_break_smoothly(lab: Lab) -> None:
    problem = lab.problem("piecewise", 1, 1.0)
    options = {"rtol": 1e-10, "atol": 1e-12}
    with_break = problem.finished_run("dop853", 2.4, [0.0], breaks=[1.0], **options)
    without = problem.finished_run("dop853", 2.4, [0.0], **options)
    assert with_break.y[0] == pytest.approx(piecewise(2.4, 1.0), rel=1e-9)
    assert 1.0 in with_break.samples.t
    assert with_break.statistics.rejected_steps <= 1  # the first step, chosen too long
    assert without.statistics.rejected_steps > 5


def test_the_right_hand_side_never_sees_a_break(lab: Lab) -> None:
    problem = lab.problem("piecewise", 1, 1.0)
    for method in ("dop853", "pirk13"):
        for options in ({"step": 0.25}, {"step": 0.3}, {"rtol": 1e-6}):
            problem.at.calls = 0
            problem.finished_run(method, 2.0, [0.0], breaks=[0.0, 1.0, 2.0], **options)
            assert problem.at.calls == 0
    problem.finished_run("rk4", 2.0, [0.0], step=0.25)
    assert problem.at.calls > 0


def test_fixed_steps_stay_on_the_grid(lab: Lab) -> None:
    problem = lab.problem("harmonic", 2, 1.0, 0.0)
    run = problem.finished_run("rk4", 100.05, (1, 0), step=0.1, breaks=[33.333, 50.0])
    grid = np.array([i * 0.1 for i in range(1001)])
    grid[500] = 50.0  # a break within rounding of the grid is that grid point
    wanted = np.sort(np.concatenate([grid, [33.333, 100.05]]))
    assert np.array_equal(run.samples.t, wanted)
    assert run.statistics.smallest_step == pytest.approx(0.1, abs=1e-12)
    assert run.statistics.sum_of_local_errors is None


def limits() -> list[tuple[float, float]]:
    """Damping ratio, and stable h omega of the classical method (theory: 2.828 and 2.785)."""
    return [(0.0, 2.828), (1.0, 2.785), (5.0, 2.785 / (5.0 + math.sqrt(24.0)))]


@pytest.mark.parametrize(("zeta", "limit"), limits())
def test_rk4_is_stable_up_to_its_boundary(lab: Lab, zeta: float, limit: float) -> None:
    omega = 1e3
    problem = lab.problem("harmonic", 2, omega, zeta)
    sizes = []
    for part in (0.95, 1.05):
        h = part * limit / omega
        run = problem.finished_run("rk4", 2000 * h, (1e-3, 0.0), step=h)
        sizes.append(abs(run.y[0]) + abs(run.y[1]) / omega)
        assert run.statistics.largest_stiffness_index > 0.85 * 2.785
    assert sizes[0] < 1e-3
    assert sizes[1] > 1.0
    assert run.statistics.stability_limited


def method_from_outside() -> Tableau:
    """Bogacki and Shampine's 3(2) pair, written as a user would."""
    s = RK23.n_stages
    a = np.zeros((s, s))
    a[:, : RK23.A.shape[1]] = RK23.A
    return Tableau(
        name="bogacki-shampine",
        order=3,
        A=to_read_only(a),
        B=to_read_only(RK23.B),
        C=to_read_only(RK23.C),
        dense=from_monomials(RK23.P),
        dense_order=3,
        E=to_read_only(RK23.E),
        error_order=2,
        source="Applied Mathematics Letters 2 (1989) 321-325",
    )


def test_a_method_from_outside_runs(lab: Lab) -> None:
    tableau: Callable[[], Tableau] = method_from_outside
    problem = lab.problem("mixed", 2)
    errors = [
        float(
            np.abs(
                problem.finished_run(tableau(), 2.0, (1, 1), step=h).y - mixed_solution(2.0)
            ).max()
        )
        for h in (0.05, 0.025)
    ]
    assert observed_order(errors) == pytest.approx(3.0, abs=0.3)
    run = problem.run(tableau(), 2.0, (1, 1), rtol=1e-6, atol=1e-9)
    assert run.advance() is Status.FINISHED
    theirs = solve_ivp(
        lambda t, y: [y[0] * np.cos(t), -2 * t * y[1] ** 2],
        (0, 2), (1, 1), method="RK23", rtol=1e-6, atol=1e-9,
    )  # fmt: skip
    assert run.statistics.evaluations == theirs.nfev
    assert run.y == pytest.approx(theirs.y[:, -1], rel=1e-13)
