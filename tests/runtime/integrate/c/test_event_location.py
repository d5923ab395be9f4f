"""Events: located to rounding, fired in order, never missed silently between step ends.

Whole scenes are in `tests/system/events`, SciPy and SUNDIALS in
`tests/runtime/run/test_external_integrators.py`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from mstmm.runtime.integrate.c_loop import Integrator, Status
from tests.support.integration.compiled_systems import Lab, Problem

NEVER = 1e300
IGNORE, RESTART, STOP, CONTINUE = 0, 1, 2, 3


def rotation(
    lab: Lab, answer: int, *, y1: float = NEVER, t: float = NEVER, y0: float = NEVER
) -> Problem:
    """y = (cos t, -sin t) from (1, 0); events 0: y[1] >= y1, 1: time >= t, 2: y[0] >= y0."""
    problem = lab.problem("harmonic", 2, 1.0, 0.0, 0.0, y1, t, y0, answer)
    lab.lib.test_use_three(problem.system, problem.at)
    return problem


def event_samples(run: Integrator) -> tuple[list[int], Any]:
    """Events and times of the samples just after a change."""
    after = run.samples.event > 0
    return list(run.samples.event[after] - 1), run.samples.t[after]


@pytest.mark.parametrize("method", ["dopri5", "dop853"])
def test_event_times_are_exact_to_the_tolerance_of_the_run(lab: Lab, method: str) -> None:
    problem = rotation(lab, RESTART, y1=0.5)
    run = problem.finished_run(method, 20.0, (1, 0), rtol=1e-13, atol=1e-14)
    exact = [(2 * k + 1) * math.pi + math.asin(0.5) for k in range(3)]
    numbers, times = event_samples(run)
    assert numbers == [0, 0, 0]
    assert times == pytest.approx(exact, abs=1e-12)


def test_events_are_located_to_rounding_on_the_dense_output(lab: Lab) -> None:
    # the condition t >= p is known exactly, whatever the tolerance
    for p in (0.1234567890123, 7.5, 1.0 / 3.0, 11.999999999):
        run = rotation(lab, STOP, t=p).run("dop853", 12.0, (1, 0), rtol=1e-3, atol=1e-3)
        assert run.advance(10.0) is Status.STOPPED
        assert run.t == pytest.approx(p, abs=2 * np.spacing(12.0))
        assert run.t >= p
        assert run.samples.t[-1] == run.t
        assert list(run.samples.event[-2:]) == [0, 2]  # nothing changed: one sample
        assert run.message(events=("a", "the clock", "c")).startswith("stopped by the clock at t =")


def test_a_falling_body_bounces_when_it_should(lab: Lab) -> None:
    problem = lab.problem("falling", 2, 0.5)
    lab.lib.test_use_bounce(problem.system, problem.at)
    run = problem.finished_run("dopri5", 1.3, (1.0, 0.0), rtol=1e-12, atol=1e-14)
    fall = math.sqrt(2.0 / 9.81)
    exact = [fall * (1 + 2 * sum(0.5**j for j in range(1, k + 1))) for k in range(8)]
    exact = [t for t in exact if t < 1.3]
    before, after = run.samples.event == -1, run.samples.event == 1
    assert len(exact) == 5
    assert run.samples.t[after] == pytest.approx(exact, abs=1e-12)
    assert np.array_equal(run.samples.t[before], run.samples.t[after])
    assert run.samples.y[after, 1] == pytest.approx(-0.5 * run.samples.y[before, 1], rel=1e-15)
    assert np.array_equal(run.samples.memory[before, 0], np.arange(5.0))
    assert np.array_equal(run.samples.memory[after, 0], np.arange(1.0, 6.0))


def test_ever_smaller_bounces_are_followed_far(lab: Lab) -> None:
    # the bounces accumulate at fall (1 + e) / (1 - e); the 40th is 1e-6 s long
    problem = lab.problem("falling", 2, 0.7)
    lab.lib.test_use_bounce(problem.system, problem.at)
    fall = math.sqrt(2.0 / 9.81)
    lengths = 2 * fall * 0.7 ** np.arange(1, 41)
    t_end = fall + lengths.sum() + 0.5 * lengths[-1] * 0.7
    run = problem.finished_run("dop853", t_end, (1.0, 0.0), rtol=1e-10, atol=1e-13)
    assert problem.at.memory[0] == 41.0
    assert run.y[0] > -1e-12


def test_several_events_in_one_step_fire_in_time_order(lab: Lab) -> None:
    # one step of 1.0 from t = 4: y1 = -sin t passes 0.9 at 4.2612, the clock 4.5, y0 0.1 at 4.8126
    problem = rotation(lab, CONTINUE, y1=0.9, t=4.5, y0=0.1)
    run = problem.run("dop853", 5.0, (math.cos(4), -math.sin(4)), t_start=4.0, step=1.0)
    assert run.advance() is Status.FINISHED
    assert problem.at.calls == 123
    assert run.statistics.steps == 1
    problem = rotation(lab, CONTINUE, y1=0.9, t=4.1, y0=0.1)
    problem.finished_run("dop853", 5.0, (math.cos(4), -math.sin(4)), t_start=4.0, step=1.0)
    assert problem.at.calls == 213


def test_simultaneous_events_all_fire(lab: Lab) -> None:
    # at t = 5 pi / 4 both the clock and y1 = -sin t pass their thresholds, to rounding
    at = 5.0 * math.pi / 4.0
    for answer in (RESTART, CONTINUE, IGNORE):
        problem = rotation(lab, answer, y1=math.sqrt(0.5), t=at)
        run = problem.finished_run("dop853", 4.2, (1, 0), rtol=1e-13, atol=1e-15)
        assert sorted(str(problem.at.calls)) == ["1", "2"]
        assert run.statistics.events == 2
    # and exactly: three conditions on the clock alone, in their order
    problem = rotation(lab, RESTART, t=1.0)
    clocks = problem.system.events = lab.ffi.callback(
        "int(void *, double, const double *, double *)", three_clocks
    )
    run = problem.finished_run("dopri5", 2.0, (1, 0), rtol=1e-6)
    del clocks
    assert problem.at.calls == 123
    assert list(run.samples.event[run.samples.event != 0]) == [-1, 1, 2, 3]


def three_clocks(context: Any, t: float, y: Any, g: Any) -> int:
    """Three events at t = 1."""
    g[0] = g[1] = g[2] = t - 1.0
    return 0


def test_an_event_true_at_the_start_fires_there_once(lab: Lab) -> None:
    problem = rotation(lab, RESTART, y0=0.5)
    run = problem.finished_run("dopri5", 2.0, (1, 0), rtol=1e-9)
    assert problem.at.calls == 3
    assert list(run.samples.event[:3]) == [0, 3, 0]
    assert list(run.samples.t[:2]) == [0.0, 0.0]
    problem = rotation(lab, STOP, y0=0.5)
    run = problem.run("dopri5", 2.0, (1, 0), rtol=1e-9)
    assert run.advance() is Status.STOPPED
    assert run.t == 0.0
    assert list(run.samples.event) == [0, 3]


def test_answers_of_fire(lab: Lab) -> None:
    # y1 = -sin t is above 0.5 three times until t = 20
    for answer, count in ((IGNORE, 1), (RESTART, 3), (CONTINUE, 3)):
        problem = rotation(lab, answer, y1=0.5)
        run = problem.finished_run("dop853", 20.0, (1, 0), rtol=1e-9)
        assert run.statistics.events == count
        changed = answer == RESTART
        assert np.count_nonzero(run.samples.event) == (2 * count if changed else 0)
    plain = rotation(lab, IGNORE).finished_run("dop853", 20.0, (1, 0), rtol=1e-9)
    watched = rotation(lab, CONTINUE, y1=0.5).finished_run("dop853", 20.0, (1, 0), rtol=1e-9)
    assert np.array_equal(plain.samples.y, watched.samples.y)  # a mere look changes no step


def test_an_ignored_event_leaves_memory_alone(lab: Lab) -> None:
    problem = lab.problem("falling", 2, 0.5, 0.0)
    lab.lib.test_use_bounce(problem.system, problem.at)
    problem.at.p[1] = CONTINUE
    problem.finished_run("dopri5", 0.5, (1.0, 0.0), rtol=1e-9)
    assert problem.at.memory[0] == 0.0


def test_a_short_true_interval_within_a_step_is_found(lab: Lab) -> None:
    # y0 = cos t exceeds 1 - 1e-4 for 0.028 s around each turn; steps are up to 0.8 s long
    problem = rotation(lab, CONTINUE, y0=1 - 1e-4)
    run = problem.finished_run("dop853", 63.0, (0, -1), t_start=math.pi / 2, rtol=1e-7, atol=1e-9)
    assert run.statistics.largest_step is not None
    assert run.statistics.largest_step > 0.7
    assert problem.at.calls == int("3" * 10)
    problem = rotation(lab, RESTART, y0=1 - 1e-4)
    run = problem.finished_run("dop853", 63.0, (0, -1), t_start=math.pi / 2, rtol=1e-12, atol=1e-12)
    exact = 2 * math.pi * np.arange(1, 11) - math.acos(1 - 1e-4)
    assert event_samples(run)[1] == pytest.approx(exact, abs=1e-8)


def test_a_clock_event_at_a_break_fires_exactly_there(lab: Lab) -> None:
    for options in ({"step": 0.3}, {"rtol": 1e-6}):
        problem = rotation(lab, RESTART, t=1.0)
        run = problem.finished_run("dop853", 2.0, (1, 0), breaks=[1.0], **options)
        assert list(run.samples.t[run.samples.event != 0]) == [1.0, 1.0]
        assert problem.at.calls == 2


def test_events_and_output_times_together(lab: Lab) -> None:
    times = np.linspace(0.0, 5.0, 51)
    problem = rotation(lab, RESTART, y1=0.5)
    run = problem.finished_run("dop853", 5.0, (1, 0), rtol=1e-11, atol=1e-12, output_times=times)
    regular = run.samples.event == 0
    assert np.array_equal(run.samples.t[regular], times)
    assert np.all(np.diff(run.samples.t) >= 0.0)
    assert run.samples.y[:, 0] == pytest.approx(np.cos(run.samples.t), abs=1e-9)
    assert list(run.samples.event[~regular]) == [-1, 1]


def test_output_times_are_all_there_where_events_coincide(lab: Lab) -> None:
    # events at the start, at an output time, at a break and at the end
    for answer in (RESTART, CONTINUE):
        problem = rotation(lab, answer, t=1.5, y0=0.99)
        run = problem.finished_run(
            "dop853", 2.0, (1, 0), output_times=[0.0, 1.0, 1.5, 2.0], breaks=[1.5], rtol=1e-9
        )
        regular = run.samples.event == 0
        assert run.samples.t[regular].tolist() == [0.0, 1.0, 1.5, 2.0]
        assert problem.at.calls == 32
    problem = rotation(lab, RESTART, t=2.0)
    run = problem.finished_run("dop853", 2.0, (1, 0), output_times=[2.0], rtol=1e-9)
    assert run.samples.event.tolist() == [0, -2, 2]
    assert run.samples.t.tolist() == [2.0, 2.0, 2.0]


def test_an_event_that_never_rests_is_reported(lab: Lab) -> None:
    def always(context: Any, t: float, y: Any, g: Any) -> int:
        g[0], g[1] = y[0], -y[0]
        return 0

    def flip(context: Any, event: int, t: float, y: Any) -> int:
        y[0] = -y[0]
        return RESTART

    problem = lab.problem("nothing", 1, 1.0)
    kept = (
        lab.ffi.callback("int(void *, double, const double *, double *)", always),
        lab.ffi.callback("int(void *, int, double, double *)", flip),
    )
    problem.system.n_events = 2
    problem.system.events, problem.system.fire = kept
    run = problem.run("rk4", 1.0, [1.0], step=0.1)
    assert run.advance(1.0) is Status.EVENT_CHATTER
    assert run.failure is not None
    assert run.failure.time == 0.0
    assert "fires without end at t = 0 s" in run.message()


def test_a_failing_fire_names_its_event(lab: Lab) -> None:
    run = rotation(lab, -4, t=1.0).run("dopri5", 2.0, (1, 0), rtol=1e-6)
    assert run.advance() is Status.FIRE_FAILED
    assert run.message(events="abc").startswith("b failed at t = 1 s (code -4); last good state")
    assert run.t < 1.0


def test_event_functions_may_fail(lab: Lab) -> None:
    def not_a_number(context: Any, t: float, y: Any, g: Any) -> int:
        g[0], g[1], g[2] = -1.0, math.nan if t > 1.5 else -1.0, -1.0
        return 0

    def failing(context: Any, t: float, y: Any, g: Any) -> int:
        g[0] = g[1] = g[2] = -1.0
        return 6 if t > 1.5 else 0

    for function, words in (
        (not_a_number, "the condition of event 1 is not a number"),
        (failing, "an event condition cannot be evaluated"),
    ):
        problem = rotation(lab, CONTINUE)
        problem.system.events = kept = lab.ffi.callback(
            "int(void *, double, const double *, double *)", function
        )
        run = problem.run("dopri5", 3.0, (1, 0), rtol=1e-6)
        assert run.advance() is Status.EVENT_FAILED
        assert words in run.message()
        assert run.failure is not None
        assert run.t <= 1.5 < run.failure.time
        del kept


def test_an_event_that_fails_beside_switches_is_named(lab: Lab) -> None:
    problem = rotation(lab, CONTINUE)
    problem.system.n_events, problem.system.n_switches = 2, 1

    def not_a_number(context: Any, t: float, y: Any, g: Any) -> int:
        g[0], g[1], g[2] = -1.0, math.nan if t > 1.5 else -1.0, -1.0
        return 0

    problem.system.events = kept = lab.ffi.callback(
        "int(void *, double, const double *, double *)", not_a_number
    )
    run = problem.run("dopri5", 3.0, (1, 0), rtol=1e-6)
    assert run.advance() is Status.EVENT_FAILED
    assert "the condition of event 1 is not a number" in run.message()
    del kept
