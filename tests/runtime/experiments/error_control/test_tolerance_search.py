"""`simulate(error=...)`: what is reached, as others see it; what is told, kept and refused."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.integrate
from scipy.special import ellipj, ellipk

import mstmm
from mstmm.runtime.experiments.error_control import method_choice, tolerance_search
from mstmm.runtime.experiments.error_control.method_choice import starts_vibrating
from mstmm.runtime.experiments.tuning import ERROR_CONTROL
from mstmm.runtime.integrate.c_loop import Statistics, Status
from mstmm.runtime.integrate.settings import Settings
from mstmm.runtime.result.export.provenance import file_attributes
from mstmm.runtime.run import run_execution

G = 9.81


def _counts(run: mstmm.Result) -> Statistics:
    assert run.statistics is not None
    return run.statistics


def pendulums(count: int, angle: float, **law: Any) -> mstmm.Model:
    """Rods of 1 m and 1 kg in a row, let go at an angle to the vertical, in rad."""
    rod = {
        "mass": 1.0, "center_of_mass": [0.5, 0.0, 0.0], "inertia": [0.0, 1 / 12, 1 / 12],
        "ends": {"tip": [1.0, 0.0, 0.0]},
    }  # fmt: skip
    hinges: list[dict[str, Any]] = [
        {
            "name": f"pin{i}", "type": "pin", "axis": [0.0, 0.0, 1.0], "outboard": f"rod{i}",
            "inboard": f"rod{i - 1}.tip" if i else "ground", "law": law,
            "initial": {"q": [0.0 if i else angle - math.pi / 2]},
        }
        for i in range(count)
    ]  # fmt: skip
    bodies = [{"name": f"rod{i}", **rod} for i in range(count)]
    tables: dict[str, Any] = {
        "schema_version": 1, "gravity": [0.0, -G, 0.0], "body": bodies, "hinge": hinges,
    }  # fmt: skip
    return mstmm.compile(mstmm.Scene(**tables), engine="looped")


def swing(t: np.ndarray, angle: float) -> np.ndarray:
    """Angle from the vertical of a rod of 1 m let go at rest: Whittaker 1937, section 44."""
    k, w = math.sin(angle / 2), math.sqrt(1.5 * G)
    sn = ellipj(ellipk(k * k) - w * t, k * k)[0]
    return np.asarray(2 * np.arcsin(k * sn))


@pytest.mark.parametrize("angle", [1.0, 2.5, 3.0])
def test_a_pendulum_is_as_near_to_its_closed_form_as_asked(angle: float) -> None:
    """Errors of single runs scatter: in 19 of 20 requests the estimate tells the error."""
    model, told, kept = pendulums(1, angle), [], []
    for asked in np.geomspace(1e-2, 1e-9, 29).tolist():
        run = model.simulate(10.0, error=asked)
        known = run.achieved_error
        assert known is not None and known.is_met and known.estimate is not None
        assert known.estimate <= asked
        true = np.abs(run.q[:, 0] + math.pi / 2 - swing(run.t, angle)).max()
        told.append(true <= 10 * known.estimate)
        kept.append(true <= 3 * asked)
    assert np.mean(told) >= 0.95 and np.mean(kept) >= 0.9


def test_an_error_near_rounding_is_told() -> None:
    run = pendulums(1, 2.5).simulate(10.0, error=1e-10)
    known = run.achieved_error
    assert known is not None and known.is_met and known.estimate is not None
    true = np.abs(run.q[:, 0] + math.pi / 2 - swing(run.t, 2.5)).max()
    assert true <= 10 * known.estimate <= 1e-9
    assert run.trusted


@pytest.mark.parametrize("asked", [1e-3, 1e-6])
def test_a_double_pendulum_against_another_integrator(asked: float) -> None:
    model = pendulums(2, 1.8, damping=0.02)
    q, u = model.initial_state()
    times = np.linspace(0.0, 5.0, 60)
    other = scipy.integrate.solve_ivp(
        lambda t, y: np.concatenate([y[2:], model.accelerations(y[:2], y[2:], t)]), (0.0, 5.0),
        np.concatenate([q, u]), "DOP853", times, rtol=1e-12, atol=1e-13,
    )  # fmt: skip
    run = model.simulate(5.0, output_times=times, error=asked)
    known = run.achieved_error
    assert known is not None and known.is_met and known.estimate is not None
    true = np.abs(run.q - other.y[:2].T).max()
    assert true <= 10 * known.estimate <= 10 * asked
    np.testing.assert_array_equal(run.t, times)


def stiff_row_model(count: int, k: float, zeta: float) -> mstmm.Model:
    """Rods in a row on bushings of k N/m."""
    model = pendulums(count, math.pi / 2)
    c = 2 * zeta * math.sqrt(k)
    law = {"stiffness": [k, k, 0.0], "damping": [c, c, 0.0]}
    tables = model.scene.model_dump(by_alias=True, include={"gravity", "body"})
    hinges = [
        {
            "name": f"pin{i}", "type": "planar", "outboard": f"rod{i}", "law": law,
            "inboard": f"rod{i - 1}.tip" if i else "ground",
        }
        for i in range(count)
    ]  # fmt: skip
    return mstmm.compile(mstmm.Scene(**tables, hinge=hinges), engine="looped")


def test_stiff_motion_is_reached_by_an_implicit_method() -> None:
    model = stiff_row_model(4, 1e8, 1.0)
    run = model.simulate(1.0, error=mstmm.ErrorRequest(1e-3, of="rod3.tip.position"))
    known = run.achieved_error
    assert known is not None and known.is_met
    assert known.method in ("rodas4p2", "rodas5p")
    assert known.unit == "m" and known.quantity == "rod3.tip.position"
    best = model.simulate(1.0, "dop853", rtol=1e-9, atol=1e-11, output_times=run.t)
    way = run.position("rod3.tip") - best.position("rod3.tip")
    assert known.estimate is not None
    assert np.linalg.norm(way, axis=1).max() <= 10 * known.estimate <= 1e-2
    assert sum(one.evaluations for one in known.runs) < _counts(best).evaluations / 3


def boom(torque: float, modes: int = 3, zeta: float = 0.0) -> mstmm.Model:
    """A beam of 2 m on a pin that a torque (N m) turns from the start."""
    beam = {
        "name": "boom", "length": 2.0, "mass_per_length": 1.0, "bending_stiffness": 1e3,
        "modes": {"y": modes}, "damping": zeta,
    }  # fmt: skip
    hinge = {
        "name": "hub", "type": "pin", "axis": [0.0, 0.0, 1.0], "inboard": "ground",
        "outboard": "boom", "law": {"effort": torque},
    }  # fmt: skip
    tables: dict[str, Any] = {
        "schema_version": 1, "gravity": [0.0] * 3, "beam": [beam], "hinge": [hinge],
    }  # fmt: skip
    return mstmm.compile(mstmm.Scene(**tables), engine="looped")


@pytest.mark.parametrize("asked", [1e-3, 1e-5])
def test_a_beam_that_begins_to_vibrate_is_tried_by_the_exponential_method(asked: float) -> None:
    model, t_end = boom(1.0), 2.0
    run = model.simulate(t_end, error=mstmm.ErrorRequest(asked, of="boom.tip.position"))
    known = run.achieved_error
    assert known is not None and known.is_met and known.estimate is not None
    assert known.runs[0].method == "exprb32" and not known.runs[0].failure
    best = model.simulate(t_end, "dop853", rtol=1e-11, atol=1e-13, output_times=run.t)
    way = run.position("boom.tip") - best.position("boom.tip")
    assert np.linalg.norm(way, axis=1).max() <= 10 * known.estimate <= 10 * asked


def test_a_beam_that_nothing_shakes_is_followed_by_others() -> None:
    q, u = boom(0.0).initial_state()
    assert not starts_vibrating(boom(0.0), 0.0, q, u)
    assert starts_vibrating(boom(5.0), 0.0, q, u)
    assert starts_vibrating(boom(0.0), 0.0, q, np.array([0.0, 0.0, 0.0, 0.1]))
    many = boom(5.0, modes=6)
    assert not starts_vibrating(many, 0.0, *many.initial_state())
    known = boom(0.0).simulate(2.0, error=1e-3).achieved_error
    assert known is not None and "exprb32" not in {one.method for one in known.runs}


def test_an_exponential_run_that_takes_too_many_steps_is_given_up(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    few = replace(ERROR_CONTROL, exponential_steps=2, exponential_steps_per_radian=0.0)
    monkeypatch.setattr(method_choice, "TUNING", few)
    known = boom(5.0).simulate(2.0, error=1e-3).achieved_error
    assert known is not None and known.is_met
    assert [one.method for one in known.runs if one.failure] == ["exprb32"]
    assert "exprb32" not in {one.method for one in known.runs if not one.failure}


@pytest.mark.parametrize(("t_end", "method"), [(2.5, "exprb32"), (5.0, "rodas4p2")])
def test_vibration_that_is_gone_soon_is_left_to_implicit_steps(t_end: float, method: str) -> None:
    """|lambda| T of 3200 and 6400, where implicit steps, which follow it while it counts, pay from
    1100 on."""
    known = boom(1.0, zeta=0.05).simulate(t_end, error=1e-3).achieved_error
    assert known is not None and known.is_met
    assert known.runs[0].method == method


def test_a_short_one_is_followed_by_explicit_steps() -> None:
    known = boom(5.0).simulate(0.3, error=1e-3).achieved_error
    assert known is not None and known.is_met
    assert {one.method for one in known.runs} <= {"dopri5", "dop853"}


def test_beyond_the_horizon_it_says_that_nothing_is_known() -> None:
    run = pendulums(3, 2.9).simulate(40.0, error=1e-6)
    known = run.achieved_error
    assert known is not None and not known.is_met
    assert run.success and not run.trusted
    assert "the motion is unpredictable" in known.reason
    assert known.warning in run.warnings
    assert known.warning in run.certificate.verdict().objections
    assert run.certificate.predictable_until is not None
    assert 2 < run.certificate.predictable_until < 40


def test_the_asked_times_are_those_of_the_result_and_others_are_looked_at() -> None:
    model = pendulums(1, 2.5)
    run = model.simulate(10.0, error=1e-6, output_times=[10.0])
    assert run.t.tolist() == [10.0] and run.settings.output_times == (10.0,)
    assert len(run.q) == len(run.u) == len(run.work) == len(run.event) == 1
    whole = model.simulate(10.0, error=1e-6, output_times=np.linspace(0, 10, 101))
    assert run.achieved_error is not None and whole.achieved_error is not None
    assert run.achieved_error.estimate == whole.achieved_error.estimate
    np.testing.assert_array_equal(run.q[-1], whole.q[-1])


def test_without_times_there_are_two_hundred_samples() -> None:
    run = pendulums(1, 1.0).simulate(3.0, error=1e-4)
    np.testing.assert_allclose(run.t, np.linspace(0, 3, 201), atol=1e-15)


def test_the_same_again_to_the_last_bit() -> None:
    runs = [pendulums(2, 2.0).simulate(4.0, error=1e-5) for _ in range(2)]
    a, b = (run.achieved_error for run in runs)
    assert a is not None and b is not None
    np.testing.assert_array_equal(runs[0].q, runs[1].q)
    bare = [replace(x, runs=tuple(replace(one, cpu_s=0.0) for one in x.runs)) for x in (a, b)]
    assert bare[0] == bare[1]


def test_its_method_and_tolerances_give_it_again_but_for_the_first_step() -> None:
    """Which is shorter than that of a run alone, so that the runs have no steps in common."""
    model = pendulums(2, 2.0)
    run = model.simulate(4.0, error=1e-5)
    known = run.achieved_error
    assert known is not None and known.estimate is not None
    again = model.simulate(4.0, known.method, rtol=known.rtol, atol=known.atol, output_times=run.t)
    np.testing.assert_allclose(run.q, again.q, rtol=0, atol=2 * known.estimate)
    assert run.settings.first_step > 0
    assert again.settings.first_step == 0


def test_a_method_that_was_named_is_kept() -> None:
    run = pendulums(1, 2.0).simulate(2.0, "dopri5", error=1e-5)
    assert run.achieved_error is not None and run.achieved_error.is_met
    assert {one.method for one in run.achieved_error.runs} == {"dopri5"}


def test_an_event_that_stops_the_run() -> None:
    tables = pendulums(1, 1.0).scene.model_dump(by_alias=True, include={"gravity", "body", "hinge"})
    event = {"when": "rod0.tip.x < 0", "do": "stop"}
    model = mstmm.compile(mstmm.Scene(**tables, event=[event]), engine="looped")
    run = model.simulate(5.0, error=1e-7)
    assert run.success and run.achieved_error is not None and run.achieved_error.is_met
    fall = 2 * ellipk(math.sin(0.5) ** 2) / math.sqrt(1.5 * G) / 2
    assert run.last_state[0] == pytest.approx(fall, abs=1e-6)


def test_a_run_that_fails_is_returned_as_it_is() -> None:
    run = pendulums(2, 2.0).simulate(5.0, mstmm.methods.Method(max_steps=3), error=1e-5)
    known = run.achieved_error
    assert known is not None and known.estimate is None and not run.success
    assert known.runs[0].failure == run.message
    assert not run.trusted


def test_a_later_run_that_fails_leaves_the_one_before() -> None:
    model = pendulums(2, 2.0)
    first = model.simulate(5.0, error=1e-8).achieved_error
    assert first is not None
    loose = first.runs[0]
    alone = model.simulate(5.0, rtol=loose.rtol, atol=loose.atol)
    run = model.simulate(5.0, mstmm.methods.Method(max_steps=_counts(alone).steps + 1), error=1e-8)
    known = run.achieved_error
    assert known is not None and not known.is_met and run.success
    assert "failed" in known.reason and known.runs[-1].failure
    assert not run.trusted


def test_an_implicit_run_that_finds_no_step_gives_way(monkeypatch: pytest.MonkeyPatch) -> None:
    """The first run of a stiff scene, by an implicit method, is made to fail."""
    model = stiff_row_model(2, 1e8, 1.0)
    real = run_execution.first_run

    def first_run(model: Any, settings: Settings, *rest: Any, **more: Any) -> Any:
        run = real(model, settings, *rest, **more)
        failing = settings.method == "rodas4p2"
        return replace(run, status=Status.STEP_TOO_SMALL) if failing else run

    monkeypatch.setattr(tolerance_search, "first_run", first_run)
    known = model.simulate(0.3, error=1e-3).achieved_error
    assert known is not None and known.is_met
    assert [one.method for one in known.runs if one.failure] == ["rodas4p2"]
    assert {one.method for one in known.runs if not one.failure} == {"auto"}


def test_a_first_run_that_takes_too_many_steps_is_given_up_to_auto(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(method_choice, "TUNING", replace(ERROR_CONTROL, pilot_steps=10))
    run = pendulums(2, 2.0).simulate(4.0, error=1e-5)
    known = run.achieved_error
    assert known is not None and known.is_met
    assert [one.method for one in known.runs if one.failure] == ["dop853"]
    assert {one.method for one in known.runs if not one.failure} == {"auto"}
    assert run.settings.max_steps == 0


def test_a_run_of_no_length() -> None:
    run = pendulums(1, 1.0).simulate(0.0, error=1e-6)
    assert run.achieved_error is not None and run.achieved_error.estimate == 0.0


def test_progress_never_falls() -> None:
    told: list[float] = []
    model = pendulums(3, 2.0)
    run = model.simulate(
        8.0, error=1e-4, execution=mstmm.Execution(progress=lambda t, end: told.append(t / end))
    )
    assert run.success
    assert told == sorted(told) and all(0 <= part <= 1 for part in told)


def test_a_saved_result_tells_it(tmp_path: Path) -> None:
    run = pendulums(1, 2.0).simulate(
        3.0, error=mstmm.ErrorRequest(1e-6, of=["rod0.tip.x", "energy.kinetic"])
    )
    again = mstmm.load_result(run.save(tmp_path / "run.nc"))
    assert again.achieved_error == run.achieved_error
    assert again.trusted == run.trusted
    assert json.loads(file_attributes(run)["error_estimate"])["asked"] == 1e-6


def test_a_run_without_it_tells_nothing() -> None:
    assert pendulums(1, 1.0).simulate(1.0).achieved_error is None


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"error": 0.0}, "above zero"),
        ({"error": -1e-3}, "above zero"),
        ({"error": math.nan}, "above zero"),
        ({"error": "small"}, "above zero"),
        ({"error": True}, "above zero"),
        ({"error": 1.0}, "less than 1"),
        ({"error": 1e-15}, "rounding"),
        ({"error": 1e-6, "rtol": 1e-9}, "rtol = 1e-09 together with error"),
        ({"error": 1e-6, "atol": 1e-9}, "atol = 1e-09 together with error"),
        ({"error": 1e-6, "step": 0.01}, "step = 0.01 together with error"),
        ({"error": 1e-6, "method": "rk4"}, "has fixed steps"),
        ({"error": 1e-6, "method": "dttmm-classical"}, "has fixed steps"),
        ({"error": 1e-6, "method": "dop835"}, "not known"),
        ({"error": 1e-6, "execution": mstmm.Execution(checkpoint="x")}, "no checkpoint"),
        ({"error": 1e-6, "execution": mstmm.Execution(resume=True)}, "no checkpoint"),
        ({"error": mstmm.ErrorRequest(1e-6, of="rod0.tipp.x")}, "did you mean"),
    ],
)
def test_what_makes_no_sense_is_refused(options: dict[str, Any], words: str) -> None:
    with pytest.raises(mstmm.SceneError, match=words):
        pendulums(1, 1.0).simulate(1.0, **options)


def test_an_error_in_a_unit_may_be_above_one() -> None:
    run = pendulums(1, 1.5).simulate(3.0, error=mstmm.ErrorRequest(2.0, of="pin0.force"))
    known = run.achieved_error
    assert known is not None and known.is_met and known.unit == "N"
    again = pendulums(1, 1.5).simulate(3.0, output_times=run.t)
    way = np.linalg.norm(run.force("pin0") - again.force("pin0"), axis=1)
    assert known.estimate is not None
    assert way.max() <= 10 * known.estimate <= 20.0
