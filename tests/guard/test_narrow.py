"""What expressions of the motion do between the steps of a run."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.result_scenes import motor

import mstmm
from mstmm.runtime.integrate.settings import Settings
from mstmm.runtime.result import narrow
from mstmm.runtime.result.narrow import passed_over
from mstmm.runtime.run import execution
from mstmm.runtime.run.trajectory import Trajectory

#: A push at q = 5 rad, 4 mrad wide, and the same where a comparison says so.
PULSE = "100*exp(-((q - 5)/0.004)^2)"
SWITCHED = f"where(q > 4.976, where(q < 5.024, {PULSE}, 0), 0)"


def told(effort: str, speed: float = 1.0, **settings: Any) -> bool:
    run = mstmm.compile(motor(effort, speed=speed), engine="looped").simulate(10.0, **settings)
    found = passed_over(run.model, run.trajectory)
    assert all(r.name == "narrow-load" and 'hinge "motor"' in r.element for r in found)
    assert set(found) <= set(run.risks)
    return bool(found)


@pytest.mark.parametrize("times", [None, [10.0], np.linspace(0, 10, 11)])
@pytest.mark.parametrize("effort, passed", [(PULSE, True), (SWITCHED, False)])
def test_a_pulse_that_was_passed_over(effort: str, passed: bool, times: Any) -> None:
    assert told(effort, output_times=times) == passed


def test_short_steps_see_it() -> None:
    assert not told(PULSE, max_step=1e-3)
    assert not told(PULSE, method="rk4", step=1e-3)
    assert told(PULSE, method="rk4", step=0.05)
    assert told(PULSE, method="rk4", step=0.05, output_times=[10.0])


def test_it_is_where_the_motion_comes_by() -> None:
    assert not told(PULSE, speed=0.1)


def test_a_window_that_is_too_wide_is_no_help() -> None:
    wide = f"where(q > 4, where(q < 6, {PULSE}, 0), 0)"
    run = mstmm.compile(motor(wide, speed=1.0), engine="looped").simulate(10.0)
    assert run.u[-1, 0] == pytest.approx(1.0, abs=1e-6)  # it was missed
    assert told(wide)


@pytest.mark.parametrize("effort", [
    "-3*sin(q)", "1 + 30*exp(-((u - 4)/0.0001)^2)", "-tanh(u/0.001)", "2*tanh((q - 5)/0.001)",
    "-q^3", "sin(40*q)", "sin(3*t)*q",
])  # fmt: skip
def test_what_control_of_the_error_sees_is_let_be(effort: str) -> None:
    assert not told(effort)


def test_a_run_is_made_again_as_far_as_it_came(monkeypatch: pytest.MonkeyPatch) -> None:
    """An event ends it; where its steps were is not in its samples."""
    data = motor(PULSE, speed=1.0).model_dump(by_alias=True, exclude_unset=True)
    scene = mstmm.Scene.from_data(data | {"event": [{"when": "motor.q > 7", "do": "stop"}]})
    run = mstmm.compile(scene, engine="looped").simulate(100.0, output_times=[2.0, 6.0, 100.0])
    assert run.success and run.last_state[0] == pytest.approx(6.7, abs=0.01)
    ends, real = list[float](), execution.first_run

    def again(model: Any, settings: Settings, *rest: Any) -> Trajectory:
        ends.append(settings.t_end)
        return real(model, settings, *rest)

    monkeypatch.setattr(narrow, "first_run", again)
    assert [risk.name for risk in passed_over(run.model, run.trajectory)] == ["narrow-load"]
    assert ends == [run.last_state[0]]


def test_the_remedy_names_the_coordinate() -> None:
    run = mstmm.compile(motor(PULSE, speed=1.0), engine="looped").simulate(10.0)
    (risk,) = passed_over(run.model, run.trajectory)
    assert "near q = 4.9999" in risk.means and "where(q > a" in risk.remedy
    assert risk.figure is not None and risk.limit is not None
    assert risk.figure > risk.limit and risk.limit == pytest.approx(0.016, rel=0.7)
    assert not run.trusted
