"""What expressions of the motion do between the steps of a run."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from mstmm.runtime.integrate.settings import Settings
from mstmm.runtime.result.checks import narrow_features
from mstmm.runtime.result.checks.narrow_features import missed_feature_risks
from mstmm.runtime.result.result import Result
from mstmm.runtime.run import run_execution
from mstmm.runtime.run.trajectory import Trajectory
from tests.support.scenes.results import motor

#: A push at q = 5 rad, 4 mrad wide, and the same where a comparison says so.
PULSE = "100*exp(-((q - 5)/0.004)^2)"
SWITCHED = f"where(q > 4.976, where(q < 5.024, {PULSE}, 0), 0)"


def has_missed_feature(effort: str, speed: float = 1.0, **settings: Any) -> bool:
    run = mstmm.compile(motor(effort, speed=speed), engine="looped").simulate(10.0, **settings)
    found = missed_feature_risks(run.model, run.trajectory)
    assert all(r.name == "narrow-load" and 'hinge "motor"' in r.element for r in found)
    assert set(found) <= set(run.risks)
    return bool(found)


@pytest.mark.parametrize("times", [None, [10.0], np.linspace(0, 10, 11)])
@pytest.mark.parametrize("effort, passed", [(PULSE, True), (SWITCHED, False)])
def test_a_pulse_that_was_passed_over(effort: str, passed: bool, times: Any) -> None:
    assert has_missed_feature(effort, output_times=times) == passed


def test_short_steps_see_it() -> None:
    assert not has_missed_feature(PULSE, method=mstmm.methods.Method(max_step=1e-3))
    assert not has_missed_feature(PULSE, method="rk4", step=1e-3)
    assert has_missed_feature(PULSE, method="rk4", step=0.05)
    assert has_missed_feature(PULSE, method="rk4", step=0.05, output_times=[10.0])


def test_it_is_where_the_motion_comes_by() -> None:
    assert not has_missed_feature(PULSE, speed=0.1)


def test_a_window_that_is_too_wide_is_no_help() -> None:
    wide = f"where(q > 4, where(q < 6, {PULSE}, 0), 0)"
    run = mstmm.compile(motor(wide, speed=1.0), engine="looped").simulate(10.0)
    assert run.u[-1, 0] == pytest.approx(1.0, abs=1e-6)  # it was missed
    assert has_missed_feature(wide)


@pytest.mark.parametrize("effort", [
    "-3*sin(q)", "-tanh(u/0.001)", "2*tanh((q - 5)/0.001)", "-q^3", "sin(40*q)", "sin(3*t)*q",
    "5*sin(2*t) - (1 + 2*exp(-(u/0.1)^2))*tanh(u/0.01)", "-q - 0.01*(exp(8*u) - 1)",
    "10*(1 - q^2)*u - q", "-2*u - 0.5*u*abs(u)", "-q + 0.2*sin(5*q)*cos(2*u)",
])  # fmt: skip
def test_what_control_of_the_error_sees_is_let_be(effort: str) -> None:
    assert not has_missed_feature(effort)


SLIDE: dict[str, Any] = {"name": "h", "type": "prismatic", "axis": [1, 0, 0],
                         "inboard": "ground", "outboard": "b"}  # fmt: skip
FLAT: dict[str, Any] = {"name": "h", "type": "planar", "inboard": "ground", "outboard": "b"}
BODY: dict[str, Any] = {"name": "b", "mass": 1.0, "inertia": [1, 1, 1]}


def warning_and_run(hinge: dict[str, Any], t_end: float = 10.0, **more: Any) -> tuple[bool, Result]:
    """Whether a run of one body warns that its steps passed over a load, and that run."""
    options = more.pop("options", {})
    scene = mstmm.Scene(gravity=(0, 0, 0), body=[BODY], hinge=[hinge], **more)
    run = mstmm.compile(scene, engine="looped").simulate(t_end, certify=True, **options)
    found = any(risk.name == "narrow-load" for risk in run.risks)
    assert not (found and run.trusted)
    return found, run


OUTPUTS: list[dict[str, Any]] = [
    {}, {"output_times": [10.0]}, {"output_times": [0.0, 5.0, 10.0]}, {"method": "rodas5p"},
    {"method": "pirk13"}, {"method": "scipy-RK45"}, {"method": "rk4", "step": 0.05},
]  # fmt: skip


@pytest.mark.parametrize("options", OUTPUTS)
def test_a_law_that_is_narrow_in_a_speed(options: dict[str, Any]) -> None:
    """It holds the speed where 100 exp(-x^2) = 0.1, which steps of seconds do not see."""
    hinge = SLIDE | {"law": {"effort": "-100*exp(-((u-0.5)/1e-4)^2)+0.1"}}
    found, run = warning_and_run(hinge, options=options)
    assert (found and run.u[-1, 0] > 0.51) or options.get("step")
    found, run = warning_and_run(hinge, options={"method": mstmm.methods.Method(max_step=1e-3)})
    assert not found
    assert run.u[-1, 0] == pytest.approx(0.5 - 1e-4 * np.sqrt(np.log(1000)), abs=1e-8)


def test_a_speed_that_a_pulse_would_have_changed() -> None:
    """From 4 m/s on it is ahead by the time that the pulse saves, 1.2e-4 s, times 1 m/s^2."""
    found, run = warning_and_run(SLIDE | {"law": {"effort": "1 + 30*exp(-((u - 4)/1e-4)^2)"}})
    assert found and run.u[-1, 0] == pytest.approx(10.0, abs=1e-9)  # it was missed


@pytest.mark.parametrize("options", OUTPUTS)
@pytest.mark.parametrize("y, there", [(2.5, True), (2.6, False)])
def test_a_load_that_is_narrow_in_two_coordinates(
    options: dict[str, Any], y: float, there: bool
) -> None:
    force = f"-300*exp(-(((h.q[0]-5)^2+(h.q[1]-{y})^2)/1e-4))"
    hinge = FLAT | {"initial": {"u": [1, 0.5, 0]}}
    found, _ = warning_and_run(hinge, options=options, load=[{"on": "b", "force": [force, 0, 0]}])
    assert found == there


def test_a_load_on_an_orbit_that_output_times_do_not_show() -> None:
    """A turn about the origin in 2 pi s, seen once a turn; the load stands opposite."""
    force = ["-h.q[0]", "-h.q[1]"]
    force[0] += " + 50*exp(-((h.q[0]+1)^2+(h.q[1]-0.02)^2)/1e-5)"
    hinge = FLAT | {"initial": {"q": [1, 0, 0], "u": [0, 1, 0]}}
    turns = 2 * np.pi * np.arange(4)
    found, _ = warning_and_run(
        hinge, turns[-1], options={"output_times": turns},
        load=[{"on": "b", "force": [*force, 0]}],
    )  # fmt: skip
    assert found


def test_a_spring_whose_effort_is_narrow_in_its_length() -> None:
    spring = {"name": "s", "from": "ground", "to": "b", "law": {"effort": PULSE}}
    hinge = SLIDE | {"initial": {"q": [1.0], "u": [1.0]}}
    found, _ = warning_and_run(hinge, spring=[spring])
    assert found
    found, _ = warning_and_run(hinge, spring=[spring | {"law": {"effort": "0.1*sin(q)"}}])
    assert not found


def test_a_law_in_a_speed_that_an_input_moves() -> None:
    channel = {"name": "where_", "value": 0.5}
    hinge = SLIDE | {"law": {"effort": "-100*exp(-((u-where_)/1e-4)^2)+0.1"}}
    found, _ = warning_and_run(hinge, input=[channel])
    assert found


def test_a_run_is_made_again_as_far_as_it_came(monkeypatch: pytest.MonkeyPatch) -> None:
    """An event ends it; where its steps were is not in its samples."""
    data = motor(PULSE, speed=1.0).model_dump(by_alias=True, exclude_unset=True)
    scene = mstmm.Scene.from_data(data | {"event": [{"when": "motor.q > 7", "do": "stop"}]})
    run = mstmm.compile(scene, engine="looped").simulate(100.0, output_times=[2.0, 6.0, 100.0])
    assert run.success and run.last_state[0] == pytest.approx(6.7, abs=0.01)
    ends, real = list[float](), run_execution.first_run

    def record_end_and_run(model: Any, settings: Settings, *rest: Any) -> Trajectory:
        ends.append(settings.t_end)
        return real(model, settings, *rest)

    monkeypatch.setattr(narrow_features, "first_run", record_end_and_run)
    assert [risk.name for risk in missed_feature_risks(run.model, run.trajectory)] == [
        "narrow-load"
    ]
    assert ends == [run.last_state[0]]


def test_the_remedy_names_the_coordinate() -> None:
    run = mstmm.compile(motor(PULSE, speed=1.0), engine="looped").simulate(10.0)
    (risk,) = missed_feature_risks(run.model, run.trajectory)
    assert "near q = 4.9999" in risk.description and "where(q > a" in risk.remedy
    assert risk.value is not None and risk.limit is not None
    assert risk.value > risk.limit and risk.limit == pytest.approx(0.016, rel=0.7)
    assert not run.trusted
