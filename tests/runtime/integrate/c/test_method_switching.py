"""A run that goes on by another method, and the signs for it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mstmm.errors import SceneError
from mstmm.runtime.integrate.c_loop import Integrator, Samples, Status
from mstmm.runtime.integrate.steppers import get
from tests.support.integration.compiled_systems import Lab, Problem, same_bits

START = (1.0, 0.0)
OUTPUTS: dict[str, dict[str, Any]] = {
    "every step": {"breaks": [0.2, 0.7]},
    "outputs": {"output_times": np.linspace(0, 1.2, 61)},
}


def bouncing(lab: Lab) -> Problem:
    """A body that falls from 1 m and keeps half its speed at the ground: three bounces in
    1.2 s, endlessly many in 1.35 s."""
    problem = lab.mechanism("fall", 0.5)
    lab.lib.test_use_event(problem.system, b"bounce")
    return problem


def equal(a: Samples, b: Samples) -> bool:
    pairs = ((a.t, b.t), (a.y, b.y), (a.memory, b.memory), (a.event, b.event))
    return all(same_bits(x, y) for x, y in pairs)


def step_by_step(run: Integrator, methods: list[str]) -> None:
    """Another method after every step, in turn."""
    steps = 0
    while run.advance(60.0, steps + 1) is Status.RUNNING:
        steps = run.statistics.steps
        run.switch_method(get(methods[steps % len(methods)]))


@pytest.mark.parametrize("case", OUTPUTS)
def test_the_same_method_again_changes_nothing(lab: Lab, case: str) -> None:
    options = OUTPUTS[case]
    wanted = bouncing(lab).finished_run("dop853", 1.2, START, **options)
    run = bouncing(lab).run("dop853", 1.2, START, **options)
    step_by_step(run, ["dop853"])
    assert equal(run.samples, wanted.samples)
    assert run.statistics.steps == wanted.statistics.steps
    assert run.statistics.events == wanted.statistics.events > 2


@pytest.mark.parametrize("case", OUTPUTS)
def test_methods_in_turn_keep_events_outputs_and_breaks(lab: Lab, case: str) -> None:
    """A body falls on exact parabolas between bounces, whoever makes the steps."""
    options = OUTPUTS[case] | {"rtol": 1e-9, "atol": 1e-11}
    wanted = bouncing(lab).finished_run("dop853", 1.2, START, **options)
    run = bouncing(lab).run("dop853", 1.2, START, **options)
    step_by_step(run, ["rodas5p", "dop853", "esdirk436", "dopri5"])
    assert run.status is Status.FINISHED
    assert run.statistics.events == wanted.statistics.events
    assert run.statistics.tangents > 0
    assert run.y == pytest.approx(wanted.y, abs=1e-7)
    times = [*options.get("breaks", ()), *options.get("output_times", ())]
    assert np.isin(times, run.samples.t).all()


def test_a_change_is_refused_where_it_makes_no_sense(lab: Lab) -> None:
    fixed = bouncing(lab).run("rk4", 1.2, START, step=0.01)
    with pytest.raises(SceneError, match='"dop853" cannot continue this run'):
        fixed.switch_method(get("dop853"))
    adaptive = bouncing(lab).run("dop853", 1.2, START)
    with pytest.raises(SceneError, match='"rk4" cannot continue this run'):
        adaptive.switch_method(get("rk4"))
    without = lab.problem("harmonic", 2, 1.0).run("dop853", 1.2, START)
    with pytest.raises(SceneError, match="needs a tangent"):
        without.switch_method(get("rodas4p2"))
    assert without.advance(60.0) is Status.FINISHED
    with pytest.raises(SceneError, match="cannot continue this run"):
        without.switch_method(get("dopri5"))


def test_a_state_of_a_changed_run_goes_on_bit_for_bit(lab: Lab) -> None:
    def start_run() -> Integrator:
        run = bouncing(lab).run("dop853", 1.2, START)
        run.advance(60.0, 6)
        return run

    whole = start_run()
    whole.switch_method(get("rodas4p2"))
    state, earlier = whole.state(), whole.take_samples()
    assert whole.advance(60.0) is Status.FINISHED
    rest = bouncing(lab).run("dop853", 1.2, START)
    with pytest.raises(SceneError, match="another scene, method or version"):
        rest.restore(state)
    rest.switch_method(get("rodas4p2"))
    rest.restore(state)
    assert rest.advance(60.0) is Status.FINISHED
    assert len(earlier.t) > 5 and equal(rest.samples, whole.samples)
    assert rest.statistics == whole.statistics


def test_a_run_comes_back_for_signs_and_looks(lab: Lab) -> None:
    """An oscillation tied to one that is a thousand times faster and damped away."""
    problem = lab.problem("stiff_spring", 4, 1e3, 1.0)
    run = problem.run("dop853", 1.0, [1.0, 0.0, 1.0, 0.0], rtol=1e-4)
    run.request_return(7)
    assert run.advance(60.0) is Status.RUNNING and run.callback_requested
    assert run.signs == 7 <= run.statistics.stability_limited_steps
    assert run.last_step * 1e3 > 2.5
    steps = run.statistics.steps
    run.request_return(0, look=steps + 11)
    assert run.advance(60.0) is Status.RUNNING and run.callback_requested
    assert run.statistics.steps == steps + 11
    run.request_return(0)
    assert run.advance(60.0) is Status.FINISHED and not run.callback_requested


def test_short_steps_of_implicit_methods_are_signs(lab: Lab) -> None:
    run = lab.mechanism("pendulum", 2e3, 5.0).run("rodas4p2", 1.5, (0.0, 0.4, 0, 0, 0), rtol=1e-9)
    run.request_return(10, short_step=1.0)
    assert run.advance(60.0) is Status.RUNNING and run.callback_requested and run.signs == 10
    run.request_return(20, short_step=1e-9)
    assert run.advance(60.0) is Status.FINISHED and run.signs == 0


def test_a_run_without_a_next_step_goes_on_by_another_method(lab: Lab) -> None:
    """No tangent can be taken after 0.5 s: an explicit method goes on from the last good state."""

    def tangent(context: Any, t: float, *rest: Any) -> int:
        return 1 if t > 0.5 else int(given.tangent(context, t, *rest))

    problem = lab.mechanism("pendulum", 20.0, 0.5)
    given, start = problem.system.implicit, (0.0, 0.4, 0.0, 0.0, 0.0)
    failing = lab.ffi.new("mstmm_implicit *", given[0])
    called = lab.ffi.callback(lab.ffi.typeof(failing.tangent), tangent)
    failing.tangent, problem.system.implicit = called, failing
    run = problem.run("rodas5p", 1.5, start, rtol=1e-9, atol=1e-11)
    assert run.advance(60.0) is Status.TANGENT_FAILED and run.no_step
    failed_at = run.t
    assert 0.5 < failed_at < 0.6
    run.switch_method(get("dop853"))
    assert run.status is Status.RUNNING and not run.no_step and run.t == failed_at
    assert run.advance(60.0) is Status.FINISHED
    wanted = lab.mechanism("pendulum", 20.0, 0.5).finished_run(
        "dop853", 1.5, start, rtol=1e-11, atol=1e-13
    )
    assert run.y == pytest.approx(wanted.y, abs=1e-6)
    limited = lab.mechanism("pendulum", 20.0, 0.5).run("rodas5p", 1.5, start, max_steps=5)
    assert limited.advance(60.0) is Status.TOO_MANY_STEPS and not limited.no_step
    with pytest.raises(SceneError, match="cannot continue this run"):
        limited.switch_method(get("dop853"))
