"""Orders of the implicit methods on mechanisms, against closed solutions and explicit runs."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mstmm.array_validation import Array
from mstmm.runtime.integrate.steppers import IMPLICIT, get
from tests.support.integration.compiled_systems import Lab, Problem

#: So tight that Newton's iteration leaves nothing to be seen beside the error of the step.
TIGHT = {"rtol": 1e-12, "atol": 1e-13}

#: A stage of these lies behind the step's end: where a break is near it sees the break's other side
#: no more than anybody, and the step is of second order.
BEHIND = ("esdirk436", "kvaerno5", "wilson")

#: Mechanism, parameters and start.
CASES: dict[str, tuple[tuple[float, ...], tuple[float, ...]]] = {
    "chain": ((4.0, 0.3, 1.0, 2.0), (0.1, 0, 0.3, 0, 0, 0, 0)),
    "pendulum": ((3.0, 0.3), (-0.3, 0.1, 0, 0, 0)),
    "slide": ((0.3,), (0, 0.5, 0.9, 0, 0)),
    "ball": ((5.0,), (1, 0, 0, 0, 3, 2, -1)),
}


def mechanism(lab: Lab, name: str) -> tuple[Problem, tuple[float, ...]]:
    parameters, start = CASES[name]
    return lab.mechanism(name, *parameters), start


def steps_for(order: int) -> tuple[float, float]:
    return (1 / 32, 1 / 64) if order > 3 else (1 / 128, 1 / 256)


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("method", IMPLICIT)
def test_fixed_steps_show_the_order(lab: Lab, method: str, name: str) -> None:
    problem, start = mechanism(lab, name)
    n = problem.system.implicit.n_q + problem.system.implicit.n_u
    exact = problem.finished_run("dop853", 1.0, start, rtol=1e-13, atol=1e-14).y[:n]
    errors = [
        np.abs(problem.finished_run(method, 1.0, start, step=h, **TIGHT).y[:n] - exact).max()
        for h in steps_for(get(method).order)
    ]
    assert math.log2(errors[0] / errors[1]) > get(method).order - 0.3, errors


@pytest.mark.parametrize("name", ["chain", "pendulum", "slide"])
@pytest.mark.parametrize("method", IMPLICIT)
def test_work_is_integrated_to_the_order_of_the_motion(lab: Lab, method: str, name: str) -> None:
    assert work_order(lab, method, name) > get(method).order - 0.3


def work_order(lab: Lab, method: str, name: str) -> float:
    """Order of the largest error at the ends of steps: at one time errors may happen to vanish."""
    problem, start = mechanism(lab, name)
    t = {"output_times": np.linspace(0.0, 1.0, 17)}
    exact = problem.finished_run("dop853", 1.0, start, rtol=1e-13, atol=1e-14, **t).samples.y[:, -1]
    errors = [
        np.abs(
            problem.finished_run(method, 1.0, start, step=h, **t, **TIGHT).samples.y[:, -1] - exact
        )
        for h in steps_for(get(method).order)
    ]
    return math.log2(errors[0].max() / errors[1].max())


@pytest.mark.parametrize("method", IMPLICIT)
def test_dense_output_shows_its_order_within_a_step(lab: Lab, method: str) -> None:
    problem, start = mechanism(lab, "pendulum")
    errors = []
    for h in (0.1, 0.05) if get(method).order > 2 else (0.02, 0.01):
        t = h * np.linspace(0.1, 0.9, 9)
        run = problem.finished_run(method, h, start, step=h, output_times=t, **TIGHT)
        exact = problem.finished_run("dop853", h, start, rtol=1e-13, atol=1e-14, output_times=t)
        errors.append(np.abs(run.samples.y[:, :4] - exact.samples.y[:, :4]).max())
    wanted = min(get(method).order, get(method).dense_order) + 1
    assert math.log2(errors[0] / errors[1]) > wanted - 0.45, errors


def test_drives_hold_inside_steps(lab: Lab) -> None:
    problem, start = mechanism(lab, "slide")
    t = np.linspace(0.0, 1.0, 37)
    for method in ("rodas4p2", "esdirk436", "genalpha"):
        found = problem.finished_run(
            method, 1.0, start, step=0.2, output_times=t, **TIGHT
        ).samples.y
        assert found[:, 0] == pytest.approx(0.3 * np.sin(3 * t), abs=1e-15)
        assert found[:, 2] == pytest.approx(0.9 * np.cos(3 * t), abs=1e-15)


def moving_base(lab: Lab, k: float) -> tuple[Problem, Array]:
    """A stiff, critically damped spring whose foot moves as sin t; amplitudes of the forced motion
    A sin t + B cos t."""
    damping = 2 * math.sqrt(k)
    matrix = [[k - 1, -damping], [damping, k - 1]]
    return lab.mechanism("base", k, damping), np.asarray(np.linalg.solve(matrix, [k, damping]))


@pytest.mark.parametrize(
    ("method", "largest", "order"),
    [("rodas4p2", 1e-9, 2.8), ("rodas5p", 1e-9, 2.8), ("rodas4pw", 1e-9, 2.7),
     ("rodas4", 1e-6, 0.7), ("esdirk436", 1e-7, 1.8), ("kvaerno5", 1e-7, 1.8),
     ("genalpha", 1e-7, 1.8)],
)  # fmt: skip
def test_stiff_prescribed_motion(lab: Lab, method: str, largest: float, order: float) -> None:
    problem, (a, b) = moving_base(lab, 1e8)
    exact = a * math.sin(2.0) + b * math.cos(2.0)
    errors = [
        abs(problem.finished_run(method, 2.0, (b, a), step=h, rtol=1e-12, atol=1e-14).y[0] - exact)
        for h in (1 / 20, 1 / 80)
    ]
    assert errors[0] < largest
    assert math.log2(errors[0] / errors[1]) / 2 > order, errors


def test_stiff_rotations_keep_their_length(lab: Lab) -> None:
    problem, start = mechanism(lab, "ball")
    for method in ("rodas5p", "kvaerno5", "genalpha"):
        y = problem.finished_run(method, 5.0, start, step=1 / 50).y
        assert np.linalg.norm(y[:4]) == pytest.approx(1.0, abs=1e-15)


def test_without_its_tangent_the_method_is_explicit_in_name_only(lab: Lab) -> None:
    # k h^2 = 1e6: an explicit method of the same cost would be lost by far
    problem = lab.mechanism("chain", 1e10, 2e3, 1.0, 2.0)
    start = np.zeros(7)
    for method in IMPLICIT:
        y = problem.finished_run(method, 1.0, start, step=0.01).y
        static = 1e-10 * math.cos(2.0) * np.array([1, 2, 3])
        assert y[:3] == pytest.approx(static, abs=2e-10), method


@pytest.mark.parametrize("method", IMPLICIT)
@pytest.mark.parametrize("at", [0.5, math.pi / 5])
def test_a_break_keeps_the_order(lab: Lab, method: str, at: float) -> None:
    problem = lab.mechanism("piecewise", at)
    t_end = 1.2  # u' = cos t, then u' = -u
    rest = t_end - at
    exact = np.array(
        [1 - math.cos(at) + math.sin(at) * -math.expm1(-rest), math.sin(at) * math.exp(-rest)]
    )
    order = get(method).order
    steps = (1 / 8, 1 / 16) if order > 3 else (1 / 40, 1 / 80)
    errors = [
        np.abs(
            problem.finished_run(method, t_end, (0, 0), step=h, breaks=[at], **TIGHT).y - exact
        ).max()
        for h in steps
    ]
    if method in BEHIND:
        assert all(error < 0.3 * h**2 for error, h in zip(errors, steps, strict=True)), errors
    else:
        assert math.log2(errors[0] / errors[1]) > order - 0.7, errors


@pytest.mark.parametrize("method", [m for m in IMPLICIT if get(m).adaptive])
def test_the_order_survives_changes_of_the_step(lab: Lab, method: str) -> None:
    problem, start = mechanism(lab, "pendulum")
    exact = problem.finished_run("dop853", 2.0, start, rtol=1e-13, atol=1e-14).y[:4]
    tolerances, errors, steps = (1e-5, 1e-7), [], []
    for tolerance in tolerances:
        run = problem.finished_run(method, 2.0, start, rtol=tolerance, atol=1e-2 * tolerance)
        errors.append(np.abs(run.y[:4] - exact).max())
        steps.append(run.statistics.steps)
    found = math.log(errors[0] / errors[1]) / math.log(steps[1] / steps[0])
    assert found > get(method).order - 1.4, (errors, steps)
