"""The budget of time, by a clock of the tests' own; interrupts; rounds."""

from __future__ import annotations

import os
import signal
from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.errors import NumericalFailure
from mstmm.runtime.experiments.chart.chart import Chart, chart_request, make_chart
from mstmm.runtime.experiments.error_measure import Coordinates
from mstmm.runtime.experiments.runs import EARLY, REFERENCE, SETTINGS, Budget, Runs
from mstmm.runtime.experiments.trial import Setting
from mstmm.runtime.platform_support.interrupts import record_interrupts
from mstmm.runtime.run.integration_run import advance
from tests.support.scenes.chart import Clock, hub, pendulum, stiff_rods

METHODS = ("dop853", "dopri5", "rodas4")


def chart(seconds: float, each_run: float, said: list[str], rounds: int = 0) -> Chart:
    """A chart within so many seconds of a clock that moves by `each_run` s before every run."""
    clock = Clock(0.0)

    def tell(text: str) -> None:
        said.append(text)
        clock.now += each_run

    model = mstmm.compile(pendulum(), engine="looped")
    asked = chart_request(1.0, (), METHODS, False, 1e-3, seconds, 11, rounds)
    budget = Budget(seconds, clock)
    return make_chart(model, asked, mstmm.compile, "", tell, said.append, budget)


def test_the_budget_is_told_before_the_first_run() -> None:
    said: list[str] = []
    chart(1000.0, 0.0, said)
    assert said[0].startswith("budget 1000 s: up to 350 s for the reference")
    assert said[1].startswith("reference by dop853")
    order = [text for text in said if text.startswith("as given: ")]
    assert order[0] == "as given: dop853, rtol 1e-02"  # all loose settings before tighter ones
    assert order[1] == "as given: dopri5, rtol 1e-02"
    assert order[2] == "as given: dop853, rtol 1e-03"
    assert order.index("as given: rodas4, rtol 1e-02") > 3  # what is less promising comes later


def test_what_time_leaves_out_is_told() -> None:
    """Every run takes two seconds of a hundred, the same at every repetition."""
    whole, part, same = (chart(100.0, each_run, []) for each_run in (0.0, 2.0, 2.0))
    assert not whole.skipped
    assert 0 < len(part.points) < len(whole.points)
    late = [one for one in part.skipped if "too little time left" in one.reason]
    assert {one.method for one in late} == set(METHODS)
    assert all(one.setting.endswith("and tighter") for one in late)
    ran = {(p.method, p.setting.value) for p in part.points}
    assert ran < {(p.method, p.setting.value) for p in whole.points}
    assert [p.setting for p in same.points] == [p.setting for p in part.points]
    assert {p.setting: p.error for p in part.points}.items() <= {
        p.setting: p.error for p in whole.points
    }.items()


def test_methods_that_refuse_a_scene_are_told() -> None:
    made = mstmm.chart(
        hub(), 0.1, methods=["dop853", "dttmm-classical"], samples=3, rounds=0, budget=300
    )
    (refused,) = [one for one in made.skipped if one.is_unsupported]
    assert refused.method == "dttmm-classical"
    assert "its matrices contain no efforts" in refused.reason
    assert {p.method for p in made.points} == {"dop853"}


def test_no_time_for_a_reference() -> None:
    with pytest.raises(NumericalFailure, match="no reference was found within its part"):
        chart(1.0, 0.6, [])


def test_a_run_that_takes_too_long_ends() -> None:
    """Each look at the clock is a second: after the first report of progress time is over."""
    model = mstmm.compile(stiff_rods(1e12), engine="looped")
    runs = Runs(1e4, np.array([0.0, 1e4]), Budget(1e9, Clock(1.0)))
    setting = Setting("dop853", "as given", 1e-9)
    trial = runs.trial(model, setting, Coordinates(model), limit=0.5)
    assert trial.late
    assert trial.numbers is None
    assert "stopped at its time limit of 0.5 s" in trial.failure


def test_an_interrupted_run_is_no_point(monkeypatch: pytest.MonkeyPatch) -> None:
    model = mstmm.compile(pendulum(), engine="looped")
    result = model.simulate(1.0)
    result.status = None  # as Ctrl-C leaves it
    monkeypatch.setattr(mstmm.Model, "simulate", lambda *_, **__: result)
    runs = Runs(1.0, np.array([0.0, 1.0]), Budget(1e9))
    with pytest.raises(KeyboardInterrupt):
        runs.trial(model, Setting("dop853", "as given", 1e-9), Coordinates(model), limit=1e9)


def test_an_interrupt_within_a_short_run_is_heard(
    heard: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run that ends before it looks for interrupts does not hide one from the chart."""
    model = mstmm.compile(pendulum(), engine="looped")

    def interrupt_and_advance(*arguments: Any) -> Any:
        with record_interrupts():  # as runs are, whose end comes first
            os.kill(os.getpid(), signal.SIGINT)
        return advance(*arguments)

    monkeypatch.setattr("mstmm.runtime.run.run_execution.advance", interrupt_and_advance)
    runs = Runs(1e-3, np.array([0.0, 1e-3]), Budget(1e9))
    with pytest.raises(KeyboardInterrupt):
        runs.trial(model, Setting("dop853", "as given", 1e-9), Coordinates(model), limit=1e9)


def test_every_round_times_every_point_again() -> None:
    once, more = (chart(1e6, 0.0, [], n) for n in (0, 2))
    assert all(p.repeats == 1 for p in once.points if p.cpu_s is not None)
    assert all(p.repeats >= 3 for p in more.points if p.cpu_s is not None)
    assert [p.error for p in once.points] == [p.error for p in more.points]


def test_shares_of_the_budget() -> None:
    assert 0 < REFERENCE < EARLY < SETTINGS < 1
    clock = Clock(0.0)
    budget = Budget(100.0, clock)
    assert budget.run_limit(SETTINGS) == pytest.approx(100 * SETTINGS / 6)
    assert budget.run_limit(SETTINGS, waiting=300) == pytest.approx(100 * SETTINGS / 60)
    clock.now = 90.0
    assert budget.remaining(SETTINGS) == 0.0
    assert budget.remaining() == pytest.approx(10.0)
