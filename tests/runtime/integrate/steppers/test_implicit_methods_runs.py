"""Runs of implicit methods: restarts, events, failures, tolerances and what they count."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from mstmm.errors import SceneError
from mstmm.runtime.integrate.c_loop import Integrator, Samples, Status
from mstmm.runtime.integrate.settings import Settings, validate
from mstmm.runtime.integrate.steppers import IMPLICIT, get
from tests.support.integration.compiled_systems import Lab, Problem, same_bits

ADAPTIVE = [name for name in IMPLICIT if get(name).adaptive]


def bouncing(lab: Lab) -> Problem:
    """A body that falls from 1 m and keeps half its speed at the ground."""
    problem = lab.mechanism("fall", 0.5)
    lab.lib.test_use_event(problem.system, b"bounce")
    return problem


def hanging(lab: Lab) -> Problem:
    """A double pendulum with a stiff joint."""
    return lab.mechanism("pendulum", 2e3, 5.0)


CASES: dict[str, tuple[str, dict[str, Any]]] = {
    "rosenbrock": ("rodas4p2", {"rtol": 1e-6, "breaks": [0.3]}),
    "outputs": ("rodas5p", {"rtol": 1e-7, "output_times": np.linspace(0, 1.5, 61)}),
    "diagonal": ("esdirk436", {"rtol": 1e-6}),
    "alpha": ("genalpha", {"rtol": 1e-4, "output_times": np.linspace(0, 1.5, 61)}),
    "fixed": ("genalpha", {"step": 0.01, "breaks": [0.305]}),
    "one iteration": ("dttmm", {"step": 0.01}),
    "collocation": ("wilson", {"step": 0.01}),
    "exponential": (
        "exprb32",
        {"rtol": 1e-6, "breaks": [0.3], "output_times": np.linspace(0, 1.5, 61)},
    ),
    "history": ("houbolt", {"step": 0.01, "breaks": [0.305]}),
}
SYSTEMS = {"bouncing": (bouncing, (1.0, 0.0)), "hanging": (hanging, (0.0, 0.4, 0, 0, 0))}


def test_a_tangent_by_laws_is_asked_of_systems_that_have_one(lab: Lab) -> None:
    with pytest.raises(SceneError, match="has no approximate tangent by laws"):
        hanging(lab).run("ros34pw2", 1.0, (0.0, 0.4, 0, 0, 0), tangent="laws")


def equal(a: Samples, b: Samples) -> bool:
    pairs = ((a.t, b.t), (a.y, b.y), (a.memory, b.memory), (a.event, b.event))
    return all(same_bits(x, y) for x, y in pairs)


@pytest.mark.parametrize("system", SYSTEMS)
@pytest.mark.parametrize("case", CASES)
def test_a_run_continues_bit_for_bit_from_every_step(lab: Lab, case: str, system: str) -> None:
    make, start = SYSTEMS[system]
    method, options = CASES[case]
    whole = make(lab).finished_run(method, 1.5, start, **options)
    assert whole.samples.event.any() == (system == "bouncing")
    parts, steps = [], 0
    run = make(lab).run(method, 1.5, start, **options)
    while run.advance(60.0, steps + 1) is Status.RUNNING:
        steps = run.statistics.steps
        parts.append(run.take_samples())
        state, fresh = run.state(), make(lab)
        run = fresh.run(method, 1.5, start, **options)
        run.restore(state)
    assert run.status is Status.FINISHED
    assert equal(Samples.join([*parts, run.samples]), whole.samples)
    assert run.statistics == whole.statistics
    assert same_bits(run.y, whole.y)


@pytest.mark.parametrize("case", CASES)
def test_slices_and_small_buffers_change_nothing(lab: Lab, case: str) -> None:
    method, options = CASES[case]
    whole = bouncing(lab).finished_run(method, 1.5, (1.0, 0.0), **options)
    run = bouncing(lab).run(method, 1.5, (1.0, 0.0), capacity=2, **options)
    while run.advance(0.0) is Status.RUNNING:
        pass
    assert equal(run.samples, whole.samples)
    assert run.statistics == whole.statistics


@pytest.mark.parametrize("case", ["outputs", "alpha", "exponential"])
def test_a_run_continues_bit_for_bit_from_within_a_step(lab: Lab, case: str) -> None:
    method, options = CASES[case]
    options = options | {"output_times": np.linspace(0, 0.3, 181)}  # several in a step
    start = (0.0, 0.4, 0, 0, 0)
    whole = hanging(lab).finished_run(method, 0.3, start, **options)
    parts, inside, before = [], 0, -1
    run = hanging(lab).run(method, 0.3, start, capacity=2, **options)
    while run.advance(0.0) is Status.RUNNING:
        inside += run.statistics.steps == before
        before = run.statistics.steps
        parts.append(run.take_samples())
        state = run.state()
        run = hanging(lab).run(method, 0.3, start, capacity=2, **options)
        run.restore(state)
    assert inside > 2
    assert equal(Samples.join([*parts, run.samples]), whole.samples)
    assert run.statistics == whole.statistics


@pytest.mark.parametrize("method", IMPLICIT)
def test_a_falling_body_bounces_when_it_should(lab: Lab, method: str) -> None:
    options: dict[str, Any] = {"rtol": 1e-9, "atol": 1e-10} if method in ADAPTIVE else {}
    if method not in ADAPTIVE or get(method).order == 2:
        options = {"step": 1e-3}
    run = bouncing(lab).finished_run(method, 1.3, (1.0, 0.0), **options)
    fall = math.sqrt(2.0 / 9.81)
    exact = [fall * (1 + 2 * sum(0.5**j for j in range(1, k + 1))) for k in range(8)]
    exact = [t for t in exact if t < 1.3]
    found = run.samples.t[run.samples.event == 1]
    # motion of second degree: exact, but for Houbolt's differences
    assert found == pytest.approx(exact, abs=1e-4 if method == "houbolt" else 1e-8)


@pytest.mark.parametrize(
    ("method", "hw"),
    [("rodas4p2", 1.0), ("rodas5p", 1.0), ("esdirk436", 1.0), ("genalpha", 1.0),
     ("esdirk436", 3.0), ("genalpha", 3.0)],
)  # fmt: skip
def test_a_stop_gives_back_no_more_than_it_took(lab: Lab, method: str, hw: float) -> None:
    # 1 kg at 1 m/s meets a stop without damping, at ten phases of the step h.
    # (At h omega = 3 the whole contact fits into a step; dense output of a Rosenbrock step does not
    # show it then, and its error estimate must.)
    k, h = 1e6, hw * 1e-3
    rebounds = []
    for phase in np.linspace(0.05, 0.95, 10):
        problem = lab.mechanism("stop", k)
        lab.lib.test_use_event(problem.system, b"gap")
        run = problem.finished_run(method, 20 * h, ((5.0 + phase) * h, -1.0), step=h)
        assert run.statistics.switch_crossings == 2
        rebounds.append(run.y[1])
    assert max(rebounds) < 1.05
    assert min(rebounds) > 0.95


@pytest.mark.parametrize("method", ADAPTIVE)
def test_a_stop_is_met_to_the_tolerance(lab: Lab, method: str) -> None:
    problem = lab.mechanism("stop", 1e4)
    lab.lib.test_use_event(problem.system, b"gap")
    tolerance = 1e-6 if get(method).order > 2 else 1e-5
    run = problem.finished_run(method, 0.3, (0.1, -1.0), rtol=tolerance, atol=1e-2 * tolerance)
    # 0.1 s of approach, pi / 100 s of contact
    assert run.y == pytest.approx([0.2 - math.pi / 100, 1.0], abs=2e-3)


@pytest.mark.parametrize("method", ADAPTIVE)
def test_achieved_errors_follow_the_tolerance(lab: Lab, method: str) -> None:
    problem = hanging(lab)
    start, t_end = (0.0, 0.0, 0, 0, 0), 1.0
    exact = problem.finished_run("dop853", t_end, start, rtol=1e-11, atol=1e-12).y[:2]
    errors = []
    for tolerance in (1e-3, 1e-5):
        run = problem.finished_run(method, t_end, start, rtol=tolerance, atol=1e-2 * tolerance)
        errors.append(float(np.abs(run.y[:2] - exact).max()))
        assert errors[-1] < (10 if get(method).order > 2 else 100) * tolerance
    assert errors[1] < errors[0]


def test_the_vibration_of_a_slack_stiff_spring_costs_nothing(lab: Lab) -> None:
    # the joint vibrates at 4e3 rad/s; explicit steps must resolve it
    problem, start = lab.mechanism("pendulum", 1e6, 50.0), (0.0, 0.0, 0, 0, 0)
    explicit = problem.finished_run("dop853", 1.0, start, rtol=1e-4, atol=1e-6)
    reference = problem.finished_run("dop853", 1.0, start, rtol=1e-10, atol=1e-12)
    for method in ("rodas4p2", "rodas5p", "esdirk436", "genalpha"):
        run = problem.finished_run(method, 1.0, start, rtol=1e-4, atol=1e-6)
        assert run.statistics.steps < 0.1 * explicit.statistics.steps, method
        assert np.abs(run.y[:2] - reference.y[:2]).max() < 3e-3


def test_counts_are_those_of_the_method(lab: Lab) -> None:
    problem, start = hanging(lab), (0.0, 0.4, 0, 0, 0)
    problem.system.n_error = 4  # the work is not asked
    run = problem.finished_run("rodas4p2", 1.0, start, rtol=1e-5)
    s = run.statistics
    tries = s.steps + s.rejected_steps
    assert (s.tangents, s.iterations) == (tries, 0)
    # the first stage is common to both forms; both evaluate at the step's end, quadratures at its
    # middle; what it matters that accelerations carried to the end are off may take a solution
    carried, none = divmod(s.residuals, 5)
    evaluated, nothing = divmod(s.evaluations - 1 - s.steps - carried, 6)
    assert carried > 0
    assert evaluated > 0
    assert (none, nothing) == (0, 0)
    assert tries <= carried + evaluated < 2 * tries
    assert 0 <= s.solves - tries - 5 * (carried + evaluated) <= carried
    assert s.sum_of_local_errors is not None
    s = problem.finished_run("dttmm", 1.0, start, step=0.01).statistics
    assert (s.tangents, s.solves, s.iterations, s.rejected_steps) == (100, 100, 100, 0)
    s = problem.finished_run("genalpha", 1.0, start, step=0.01).statistics
    assert s.solves == s.iterations
    assert s.tangents < 0.5 * s.steps
    assert 100 < s.iterations < 500
    assert problem.finished_run("dop853", 1.0, start).statistics.residuals == 0


def test_fixed_steps_iterate_no_more_than_they_are_worth(lab: Lab) -> None:
    problem, start = lab.mechanism("pendulum", 3.0, 0.3), (-0.3, 0.1, 0, 0, 0)
    exact = problem.finished_run("dop853", 1.0, start, rtol=1e-11, atol=1e-12).y[:2]
    found = []
    for method in ("genalpha", "dttmm"):
        run = problem.finished_run(method, 1.0, start, step=0.005, rtol=1e-9, atol=1e-12)
        found.append((np.abs(run.y[:2] - exact).max(), run.statistics))
    (iterated, many), (once, one) = found
    assert many.iterations < 2.5 * many.steps
    assert many.tangents < 0.1 * one.tangents
    assert iterated == pytest.approx(once, rel=0.1)


def test_a_state_that_accept_changes_starts_afresh(lab: Lab) -> None:
    start = (-0.3, 0.1, 0, 0, 0)
    for method in ("rodas4p2", "esdirk436", "newmark"):
        kept = lab.mechanism("pendulum", 3.0, 0.3).finished_run(method, 1.0, start, step=0.01)
        problem = lab.mechanism("pendulum", 3.0, 0.3)
        lab.lib.test_use_accept(problem.system, problem.at)
        problem.at.p[7] = -1.0  # accept says that the first stage is invalid
        fresh = problem.finished_run(method, 1.0, start, step=0.01)
        again = fresh.statistics.evaluations - kept.statistics.evaluations
        assert again == fresh.statistics.steps - 1
        assert fresh.y == pytest.approx(kept.y, abs=1e-5)


@pytest.mark.parametrize("method", ADAPTIVE)
def test_work_steers_the_step_where_nothing_else_does(lab: Lab, method: str) -> None:
    # 1 kg is driven as sin 3 t: the work is the kinetic energy, and nothing is there to be solved
    problem = lab.mechanism("carried", 1.0)
    tolerance = 1e-6 if get(method).order > 2 else 1e-4
    errors = []
    for n_error in (2, 3):
        problem.system.n_error = n_error
        run = problem.finished_run(method, 2.0, (0, 3, 0), rtol=tolerance, atol=tolerance)
        errors.append(abs(run.y[2] - 4.5 * (math.cos(6.0) ** 2 - 1.0)))
    assert errors[1] < 200 * tolerance
    assert errors[1] < 0.5 * errors[0]


def test_a_tangent_that_does_not_change_is_made_once(lab: Lab) -> None:
    # Newton's iteration on linear equations with steps of one length
    problem = lab.mechanism("chain", 100.0, 1.0, 1.0, 2.0)
    for method in ("genalpha", "newmark", "esdirk436", "kvaerno5"):
        assert problem.finished_run(method, 1.0, np.zeros(7), step=0.01).statistics.tangents == 1


@pytest.mark.parametrize("method", ["rodas4p2", "esdirk436", "genalpha", "dttmm"])
def test_a_failing_tangent_is_approached_then_passed_on(lab: Lab, method: str) -> None:
    def failing() -> Problem:
        problem = lab.mechanism("inverted", 2.0)
        problem.at.p[7], problem.at.memory[3] = 1.05, 9.0
        return problem

    run = failing().run(method, 2.0, (0.1, 0.0), rtol=1e-6, max_step=0.1)
    # a tangent that is kept serves beyond
    assert run.advance(60.0) is Status.TANGENT_FAILED, run.message()
    assert run.failure is not None
    assert run.failure.code == 9
    assert run.t > 1.0
    assert "no regular tangent" in run.message()
    assert "(code 9)" in run.message()
    run = failing().run(method, 2.0, (0.1, 0.0), step=0.1)
    if run.advance(60.0) is Status.TANGENT_FAILED:
        assert run.t == pytest.approx(1.0 if method in ("esdirk436", "dttmm") else 1.1)
    else:  # one tangent serves the whole run
        assert run.statistics.tangents == 1


def test_what_does_not_converge_says_so(lab: Lab) -> None:
    # 1 kg pulled over friction of 1 N that changes its sign within 1e-9 m/s
    problem = lab.mechanism("friction", 10.0, 0.3, 1.0, 1e-9)
    run = problem.run("genalpha", 2.0, (0.0, 0.1), step=0.01)
    assert run.advance(60.0) is Status.NOT_CONVERGED
    assert "Newton's iteration does not converge" in run.message()
    assert np.all(np.isfinite(run.y))
    shorter = problem.run("genalpha", 2.0, (0.0, 0.1), rtol=1e-3, atol=1e-5)
    assert shorter.advance(60.0) is Status.FINISHED, shorter.message()
    assert shorter.statistics.rejected_steps > 0
    rosenbrock = problem.finished_run("rodas4p2", 2.0, (0.0, 0.1), rtol=1e-4, atol=1e-6)
    assert shorter.y[0] == pytest.approx(rosenbrock.y[0], abs=3e-3)


def test_unstable_positions_are_left_as_they_should(lab: Lab) -> None:
    # q'' = 4 q: h lambda is small, and the motion grows as cosh 2 t
    for method in IMPLICIT:
        y = lab.mechanism("inverted", 2.0).finished_run(method, 1.0, (0.1, 0.0), step=1e-3).y
        assert y[0] == pytest.approx(0.1 * math.cosh(2.0), rel=1e-4), method


def test_a_system_without_a_tangent_refuses(lab: Lab) -> None:
    with pytest.raises(SceneError, match='method "rodas4" is implicit and needs a tangent'):
        lab.problem("harmonic", 2, 1.0).run("rodas4", 1.0, (1, 0))


def test_a_state_of_another_method_is_refused(lab: Lab) -> None:
    start = SYSTEMS["hanging"][1]
    state = hanging(lab).run("rodas4", 1.0, start).state()
    for method in ("rodas5p", "genalpha", "dop853"):
        run: Integrator = hanging(lab).run(method, 1.0, start)
        with pytest.raises(SceneError, match="another scene, method or version"):
            run.restore(state)


def test_arguments_that_make_no_sense_are_named(lab: Lab) -> None:
    start = SYSTEMS["hanging"][1]
    with pytest.raises(SceneError, match="absolute tolerances above zero"):
        hanging(lab).run("genalpha", 1.0, start, atol=0.0, step=0.1)
    with pytest.raises(SceneError, match="an error estimate unless the step is fixed"):
        hanging(lab).run("wilson", 1.0, start)
    for radius in (-0.1, 1.5, math.nan):
        with pytest.raises(SceneError, match="radius"):
            validate(Settings(1.0, method="genalpha", radius=radius))
    assert validate(Settings(1.0, method="genalpha", radius=1)).radius == 1.0
