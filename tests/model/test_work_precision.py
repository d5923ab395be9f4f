"""What accuracy costs: the cheapest setting that is accurate enough."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest
from support.result_scenes import motor
from support.rod_scenes import chain

import mstmm
from mstmm.errors import NumericalFailure
from mstmm.runtime.integrate.settings import Settings
from mstmm.runtime.model.work_precision import WorkPoint, cheapest, run_once, work_precision

TOLERANCES = (1e-5, 1e-7, 1e-9, 1e-11)


@cache
def points() -> list[WorkPoint]:
    """Two rods in a plane for 2 s."""
    model = mstmm.compile(mstmm.Scene.from_data(chain(["pin", "pin"])), engine="looped")
    tight = Settings(2.0, method="dop853", rtol=1e-13, atol=1e-14, output_times=(2.0,))
    reference, _, _ = run_once(model, tight)
    return work_precision(model, 2.0, reference, ("dop853", "pirk13"), TOLERANCES, repeat=2)


def test_tighter_tolerances_cost_more_and_err_less() -> None:
    for method in ("dop853", "pirk13"):
        found = [point for point in points() if point.method == method]
        assert [point.tolerance for point in found] == list(TOLERANCES)
        assert found[0].error > 30 * found[-1].error
        assert found[0].evaluations < found[-1].evaluations
        assert found[-1].error < 1e-8


def test_the_cheapest_is_accurate_enough() -> None:
    for goal in (1e-4, 1e-7):
        best = cheapest(points(), goal)
        assert best.error <= goal
        surely = [p for p in points() if p.method == best.method and p.tolerance <= best.tolerance]
        assert all(p.error <= goal for p in surely)


def test_a_choice_among_methods_is_measured_too() -> None:
    model = mstmm.compile(motor("sin(t)", damping=3e4), engine="looped")
    auto = Settings(2.0, method="auto", rtol=1e-4, output_times=(2.0,))
    plain = replace(auto, method="dop853")
    (found, evaluations, _), (wanted, many, _) = run_once(model, auto), run_once(model, plain)
    assert found == pytest.approx(wanted, abs=1e-4)
    assert evaluations < many / 10


def test_a_lucky_hit_is_no_accuracy() -> None:
    lucky = WorkPoint("dopri5", 1e-4, 1e-9, 10, 1e-6)
    tighter = WorkPoint("dopri5", 1e-5, 1e-5, 20, 2e-6)
    assert cheapest([*points(), lucky, tighter], 1e-6).method != "dopri5"
    with pytest.raises(NumericalFailure, match="no setting errs by at most 1e-20; the best is"):
        cheapest(points(), 1e-20)
