"""How runs end, what they report, and extreme sizes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from mstmm.errors import SceneError
from mstmm.runtime.integrate.c_loop import Integrator, Status
from tests.support.integration.compiled_systems import Lab, same_bits

ADAPTIVE = ("dopri5", "dop853")


def final_message(run: Integrator, status: Status) -> str:
    """The message of a run that ends with `status` and stays ended."""
    assert run.advance(20.0) is status
    state, t = run.y, run.t
    assert run.advance(20.0) is status
    assert same_bits(run.y, state)
    assert run.t == t
    assert np.all(np.isfinite(state))
    return run.message(components=("calm", "wild"))


@pytest.mark.parametrize("method", ADAPTIVE)
def test_overflow_ends_not_finite(lab: Lab, method: str) -> None:
    # y = exp(100 t) leaves the numbers at t = 7.098
    run = lab.problem("growth", 2, 100.0).run(method, 10.0, (1.0, 0.0), rtol=1e-6)
    message = final_message(run, Status.NOT_FINITE)
    assert run.failure is not None
    assert run.failure.component == 0
    assert 7.0 < run.failure.time < 7.1
    assert message.startswith("not finite at t = 7.0")
    assert ": calm;" in message


def test_overflow_with_fixed_steps_keeps_the_last_good_state(lab: Lab) -> None:
    run = lab.problem("growth", 2, 1000.0).run("rk4", 10.0, (0.0, 1.0), step=0.1)
    assert run.advance() is Status.FINISHED
    run = lab.problem("growth", 2, 1000.0).run("rk4", 100.0, (1.0, 1.0), step=0.1)
    message = final_message(run, Status.NOT_FINITE)
    assert "calm" in message
    assert run.t == pytest.approx(run.samples.t[-1])
    assert run.failure is not None
    assert run.failure.time == pytest.approx(run.t + 0.1)


@pytest.mark.parametrize("method", ADAPTIVE)
def test_a_singularity_ends_with_a_step_too_small(lab: Lab, method: str) -> None:
    # y' = y^2 from 1: y = 1 / (1 - t)
    run = lab.problem("blow_up", 2).run(method, 2.0, (1.0, 1.0), rtol=1e-9, atol=1e-9)
    message = final_message(run, Status.STEP_TOO_SMALL)
    assert run.t == pytest.approx(1.0, abs=1e-8)
    assert run.failure is not None
    assert run.failure.component == 1
    assert "wild has the largest error" in message


@pytest.mark.parametrize("method", ADAPTIVE)
def test_a_failing_right_hand_side_is_approached_then_passed_on(lab: Lab, method: str) -> None:
    run = lab.problem("failing", 2, 1.0).run(method, 2.0, (0.0, 0.0), rtol=1e-9)
    message = final_message(run, Status.RHS_FAILED)
    assert run.failure is not None
    assert run.failure.code == 7
    assert run.failure.time == pytest.approx(1.0, abs=1e-9)
    assert run.t == pytest.approx(1.0, abs=1e-9)
    assert run.t <= 1.0
    assert "(code 7)" in message
    assert run.y[0] == pytest.approx(run.t, rel=1e-12)


def test_a_failing_right_hand_side_ends_a_fixed_step_at_once(lab: Lab) -> None:
    run = lab.problem("failing", 2, 1.05).run("rk4", 2.0, (0.0, 0.0), step=0.1)
    final_message(run, Status.RHS_FAILED)
    assert run.t == pytest.approx(1.0)
    assert run.failure is not None
    assert run.failure.time == pytest.approx(1.1)


def test_a_nan_stage_is_approached_then_not_finite(lab: Lab) -> None:
    run = lab.problem("failing", 2, 1.0, 1.0).run("dop853", 2.0, (0.0, 0.0), rtol=1e-9)
    message = final_message(run, Status.NOT_FINITE)
    assert "wild" in message
    assert run.t == pytest.approx(1.0, abs=1e-9)
    first = lab.problem("failing", 2, -1.0, 1.0).run("rk4", 2.0, (0.0, 0.0), step=0.1)
    final_message(first, Status.NOT_FINITE)
    assert first.t == 0.0


def test_a_start_that_is_not_finite_goes_nowhere(lab: Lab) -> None:
    run = lab.problem("growth", 2, 1.0).run("rk4", 1.0, (1.0, math.inf), step=0.1)
    assert run.advance() is Status.NOT_FINITE
    assert run.failure is not None
    assert run.failure.component == 1
    assert len(run.samples.t) == 0


def test_accept_may_fail(lab: Lab) -> None:
    problem = lab.problem("growth", 2, 1.0)
    lab.lib.test_use_accept(problem.system, problem.at)
    problem.at.p[7] = 9.0
    run = problem.run("dop853", 1.0, (1.0, 0.0), rtol=1e-6)
    message = final_message(run, Status.ACCEPT_FAILED)
    assert "(code 9)" in message
    assert run.t == 0.0
    assert problem.at.memory[1] == 0.0  # as before the failing call


def test_steps_can_be_limited(lab: Lab) -> None:
    run = lab.problem("harmonic", 2, 1.0).run("rk4", 100.0, (1, 0), step=0.1, max_steps=25)
    assert "more steps than allowed" in final_message(run, Status.TOO_MANY_STEPS)
    assert run.statistics.steps == 25
    run = lab.problem("harmonic", 2, 1.0).run("dop853", 10.0, (1, 0), max_step=0.01)
    assert run.advance(10.0) is Status.FINISHED
    assert run.statistics.largest_step is not None
    assert run.statistics.largest_step <= 0.01 + 1e-15
    run = lab.problem("harmonic", 2, 1.0).run("dopri5", 10.0, (1, 0), rtol=1e-13, min_step=0.5)
    assert "step too small" in final_message(run, Status.STEP_TOO_SMALL)


def test_a_run_of_no_length_has_one_sample(lab: Lab) -> None:
    run = lab.problem("harmonic", 2, 1.0).finished_run("dop853", 0.0, (1, 0))
    assert run.samples.t.tolist() == [0.0]
    assert run.statistics.steps == 0
    assert run.statistics.largest_step is None
    assert run.message() == "finished at t = 0 s"


def test_a_system_without_state_runs(lab: Lab) -> None:
    problem = lab.problem("nothing", 0, 0.0)
    run = problem.finished_run("dop853", 10.0, np.zeros(0), output_times=[0.0, 5.0, 10.0])
    assert run.samples.t.tolist() == [0.0, 5.0, 10.0]
    assert run.samples.y.shape == (3, 0)


def test_a_hundred_thousand_components(lab: Lab) -> None:
    n = 100_000
    rates = 1.0 + np.arange(n) / n
    problem = lab.problem("linear_many", n, float(n))
    run = problem.finished_run("dop853", 1.0, np.ones(n), rtol=1e-8, output_times=[0.37, 1.0])
    for row, t in enumerate(run.samples.t):
        assert run.samples.y[row] == pytest.approx(np.exp(-rates * t), abs=1e-9)


def test_quadratures_do_not_steer_the_step(lab: Lab) -> None:
    free = lab.problem("quadrature", 2, n_error=1).finished_run("dop853", 3.0, (1, 0), rtol=1e-8)
    tied = lab.problem("quadrature", 2, n_error=2).finished_run("dop853", 3.0, (1, 0), rtol=1e-8)
    alone = lab.problem("quadrature", 2, n_error=1).finished_run("dop853", 3.0, (1, 5), rtol=1e-8)
    assert free.statistics.steps < 0.2 * tied.statistics.steps
    assert np.array_equal(free.samples.t, alone.samples.t)


def test_a_quaternion_stays_of_unit_length(lab: Lab) -> None:
    problem = lab.problem("turning", 4, 1.0, -2.0, 0.5)
    lab.lib.test_use_normalise(problem.system)
    run = problem.run("rk4", 1e4, (1, 0, 0, 0), step=1e-2, output_times=[])
    assert run.advance(60.0) is Status.FINISHED
    assert run.statistics.steps == 10**6
    assert abs(np.linalg.norm(run.y) - 1.0) < 1e-14
    assert run.statistics.evaluations == 4 * 10**6 + 1


@pytest.mark.parametrize("method", ADAPTIVE)
def test_stability_limited_runs_are_told_from_accurate_ones(lab: Lab, method: str) -> None:
    options = {"rtol": 1e-6, "atol": 1e-6}
    for rhs, parameters, y0, t_end, limited in (
        ("van_der_pol", (100.0,), (2, 0), 100.0, True),
        ("harmonic", (300.0, 1.0), (1, 0), 5.0, True),
        ("stiff_spring", (300.0, 0.0), (1, 0, 1, 0), 5.0, True),
        ("harmonic", (1.0, 0.0), (1, 0), 50.0, False),
        ("harmonic", (1e4, 0.0), (1, 0), 5e-3, False),
        ("van_der_pol", (1.0,), (2, 0), 20.0, False),
    ):
        run = lab.problem(rhs, len(y0), *parameters).finished_run(method, t_end, y0, **options)
        assert run.statistics.stability_limited is limited, (rhs, parameters)


def test_the_stiffness_index_is_the_frequency_times_the_step(lab: Lab) -> None:
    for omega in (0.01, 1.0, 1e4):
        problem = lab.problem("harmonic", 2, omega, 0.0)
        run = problem.finished_run("dop853", 60 / omega, (1, 0), step=1 / omega)
        assert run.statistics.largest_stiffness_index == pytest.approx(1.0, rel=0.5)


def test_the_sum_of_local_errors_is_not_below_a_smooth_runs_error(lab: Lab) -> None:
    run = lab.problem("mixed", 2).finished_run("dopri5", 2.0, (1, 1), rtol=1e-7, atol=1e-7)
    exact = np.array([math.exp(math.sin(2.0)), 0.2])
    total = run.statistics.sum_of_local_errors
    assert total is not None
    assert np.abs(run.y - exact).max() < total < 1e-5


def test_arguments_that_make_no_sense_are_named(lab: Lab) -> None:
    cases: list[tuple[dict[str, Any], str]] = [
        ({"t_start": 2.0}, "the times"),
        ({"t_start": math.nan}, "the times"),
        ({"atol": 0.0}, "absolute tolerances above zero"),
        ({"rtol": -1.0}, "tolerances or steps"),
        ({"step": 0.0}, "expected a time above zero"),
        ({"breaks": [0.5, 0.5]}, "strictly increasing"),
        ({"breaks": [math.nan]}, "strictly increasing"),
        ({"output_times": [0.5, 0.2]}, "the output times"),
        ({"output_times": [0.5, 2.0]}, "the output times"),
        ({"capacity": 1}, "the sample buffer"),
    ]
    problem = lab.problem("harmonic", 2, 1.0)
    for options, message in cases:
        with pytest.raises(SceneError, match=message):
            problem.run("dop853", 1.0, (1, 0), **options)
    with pytest.raises(SceneError, match="an error estimate unless the step is fixed"):
        problem.run("rk4", 1.0, (1, 0))
    with pytest.raises(SceneError, match=r"y0 has shape \(3,\), expected \(2,\)"):
        problem.run("dop853", 1.0, (1, 0, 0))
