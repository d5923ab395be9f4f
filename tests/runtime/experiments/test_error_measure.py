"""Errors of a chart against a closed form and against an integrator of others."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import mstmm
from mstmm.errors import SceneError
from mstmm.runtime.experiments.chart.chart import Chart
from tests.support.scenes.chart import AMPLITUDE, GRAVITY, LENGTH, pendulum, stiff_rods, swing

T_END, SAMPLES = 3.0, 31
TIMES = np.linspace(0.0, T_END, SAMPLES)
METHODS = ("dopri5", "dop853", "rk4", "rodas4p2", "newmark")


@cache
def model() -> mstmm.Model:
    return mstmm.compile(pendulum(), engine="looped")


@cache
def quantity_chart(*quantities: str) -> Chart:
    return mstmm.chart(
        model(),
        T_END,
        quantities=quantities,
        methods=METHODS,
        samples=SAMPLES,
        rounds=1,
        budget=300,
    )


def test_errors_of_all_coordinates_are_those_of_the_closed_form() -> None:
    made = quantity_chart()
    exact = swing(TIMES) - np.pi / 2
    assert made.reference.error < 1e-11
    compared = 0
    for point in made.points:
        if point.error is None or point.error < 1e-9:
            continue
        result = model().simulate(T_END, output_times=TIMES, **point.setting.options)
        true = np.abs(result.q[:, 0] - exact).max()
        assert point.error == pytest.approx(true, abs=1e-10)
        compared += 1
    assert compared > 20
    assert {point.method for point in made.points} == set(METHODS)


def test_errors_of_a_quantity_are_in_its_unit() -> None:
    made = quantity_chart("bob.tip.position")
    assert made.reference.unit == "m"
    exact = LENGTH * np.stack([np.sin(swing(TIMES)), -np.cos(swing(TIMES))], axis=1)
    for point in made.points:
        if point.method != "dopri5" or point.error is None or point.error < 1e-9:
            continue
        result = model().simulate(T_END, output_times=TIMES, **point.setting.options)
        apart = np.linalg.norm(result.position("bob.tip")[:, :2] - exact, axis=1)
        assert point.error == pytest.approx(apart.max(), abs=1e-10)


def test_errors_of_orientations_are_angles() -> None:
    """Of a pendulum the same as those of its angle."""
    turned, angle = quantity_chart("bob.orientation"), quantity_chart("pivot.angle")
    assert turned.reference.unit == angle.reference.unit == "rad"
    errors = {p.setting: p.error for p in angle.points}
    compared = [p for p in turned.points if p.error is not None and 1e-9 < p.error < 1.0]
    assert len(compared) > 20
    for point in compared:
        assert point.error == pytest.approx(errors[point.setting], rel=1e-6, abs=1e-10)


def test_several_quantities_count_in_parts_of_their_excursions() -> None:
    both = quantity_chart("pivot.angle", "energy.kinetic")
    assert both.reference.unit == "1"
    highest = GRAVITY * LENGTH * (1 - np.cos(AMPLITUDE))
    for point in both.points:
        if point.method != "rk4" or point.error is None or point.error < 1e-9:
            continue
        result = model().simulate(T_END, output_times=TIMES, **point.setting.options)
        angle, energy = result.q[:, 0] + np.pi / 2, result.energy_components()["kinetic"]
        true = swing(TIMES)
        kinetic = GRAVITY * LENGTH * (np.cos(true) - np.cos(AMPLITUDE))
        worst = max(
            np.abs(angle - true).max() / np.abs(true - AMPLITUDE).max(),
            np.abs(energy - kinetic).max() / kinetic.max(),
        )
        assert kinetic.max() == pytest.approx(highest, rel=0.05)
        assert point.error == pytest.approx(worst, rel=1e-3, abs=1e-9)


def test_a_stiff_reference_agrees_with_an_integrator_of_others() -> None:
    """SciPy's Radau over the accelerations of the model."""
    made_of = mstmm.compile(stiff_rods(1e5), engine="looped")
    q, u = made_of.initial_state()
    assert made_of.nq == 8

    def rates(_: float, y: np.ndarray) -> np.ndarray:
        """The bushing's position and quaternion, whose speeds are in outboard axes."""
        turn, v, w = y[3:7], y[8:11], y[11:14]
        vector, scalar = turn[1:], turn[0]
        moved = v + 2 * np.cross(vector, np.cross(vector, v) + scalar * v)
        turned = 0.5 * np.append(-vector @ w, scalar * w + np.cross(vector, w))
        return np.concatenate([moved, turned, y[14:15], made_of.accelerations(y[:8], y[8:])])

    end = 0.05
    found = solve_ivp(
        rates, (0.0, end), np.concatenate([q, u]), "Radau", [end], rtol=1e-10, atol=1e-12
    )
    chart = mstmm.chart(
        made_of, end, methods=["rodas5p", "rk4"], samples=3, rounds=0, budget=300,
        quantities=["two.tip.position"],
    )  # fmt: skip
    tight = made_of.simulate(end, "dop853", rtol=1e-12, atol=1e-13, output_times=[end])
    assert tight.q[-1] == pytest.approx(found.y[:8, -1], abs=1e-8)
    best = min((p for p in chart.points if p.error is not None), key=lambda p: p.error or 0.0)
    result = made_of.simulate(end, output_times=[end], **best.setting.options)
    other = made_of.simulate(end, initial=(found.y[:8, -1], found.y[8:, -1]), t_start=end)
    apart = np.linalg.norm(result.position("two.tip")[-1] - other.position("two.tip")[-1])
    assert apart < 1e-8
    assert chart.reference.error < 1e-9
    failed = [p for p in chart.points if p.method == "rk4" and p.failure]
    assert failed  # a step beyond the limit of stability
    assert all(p.error is None and p.cpu_s is None for p in failed)


def test_events_that_stop_a_run_are_met_by_all() -> None:
    scene = pendulum()
    stop = mstmm.Scene(
        gravity=scene.gravity, body=[b.model_dump(by_alias=True) for b in scene.body],
        hinge=[{"name": "pivot", "type": "pin", "inboard": "ground", "outboard": "bob",
                "initial": {"q": [0.0]}}],
        event=[{"when": "bob.tip.y < -0.5", "do": "stop"}],
    )  # fmt: skip
    made = mstmm.chart(stop, T_END, methods=["dop853", "rodas4"], samples=31, rounds=0, budget=300)
    errors = [p.error for p in made.points]
    assert errors and all(error is not None for error in errors)
    assert min(e for e in errors if e is not None) < 1e-8


def test_what_makes_no_sense_is_refused() -> None:
    for name, value, words in (
        ("budget", 0.0, "budget = 0"), ("budget", float("nan"), "budget"),
        ("error", -1.0, "error = -1"), ("t_end", 0.0, "t_end = 0"), ("samples", 1, "samples"),
        ("rounds", -1, "rounds"), ("methods", ["dop854"], 'did you mean "dop853"'),
        ("methods", "dop853", "expected lists"), ("quantities", ["bob.tp"], "quantity"),
        ("quantities", "energy", "expected lists"),
    ):  # fmt: skip
        arguments = {"t_end": 1.0, "budget": 10.0, name: value}
        with pytest.raises(SceneError, match=words):
            mstmm.chart(model(), **arguments)  # type: ignore[arg-type]
    with pytest.raises(SceneError, match="expected a Scene"):
        mstmm.chart("scene.toml")  # type: ignore[arg-type]
