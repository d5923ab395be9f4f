"""Which setting counts in the comparison of stiff motions."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import mstmm
from benchmarks.stiff import programs, references
from benchmarks.stiff.cases import CASES
from benchmarks.stiff.cost_measure import accurate_points, cheapest, evaluations, frontier


def point(tolerance: float, error: float, *cpu_ms: float) -> dict[str, Any]:
    return {"tolerance": tolerance, "error_m": error, "cpu_ms": list(cpu_ms)}


def test_a_lucky_point_does_not_count() -> None:
    lucky = point(1e-2, 1e-7, 1.0)
    points = [lucky, point(1e-3, 1e-3, 2.0), point(1e-4, 1e-5, 4.0), point(1e-5, 1e-6, 8.0)]
    assert cheapest(points, 1e-4) is points[2]
    assert cheapest(points, 1e-2) is lucky
    assert [p["tolerance"] for p in accurate_points(points, 1e-4)] == [1e-5, 1e-4]
    assert cheapest(points, 1e-7) is None


def test_the_least_time_counts_and_failures_are_no_points() -> None:
    failed = {"tolerance": 1e-9, "failure": "gave up"}
    slow, quick = point(1e-2, 1e-4, 9.0, 7.0), point(1e-3, 1e-5, 8.0, 3.0)
    assert cheapest([failed, slow, quick], 1e-3) is quick
    assert cheapest([failed], 1.0) is None


def test_the_frontier_leaves_out_what_is_beaten() -> None:
    points = [point(1e-1, 1e-2, 5.0), point(1e-2, 1e-3, 4.0), point(1e-3, 1e-4, 6.0)]
    assert frontier(points) == [points[1], points[2]]


def test_work_is_counted_in_evaluations() -> None:
    counts = {"evaluations": 3, "residuals": 10, "tangents": 2, "solves": 10, "steps": 99}
    assert evaluations({"counts": counts}) == pytest.approx(3 + 6 + 4 + 10)
    assert evaluations({"counts": {"rates": 5}}) is None


def test_a_method_that_does_not_exist_is_left_out_with_a_word() -> None:
    case, heard = CASES["d-quarter"], list[str]()
    model = mstmm.compile(mstmm.Scene(**case.scene()), engine="looped")
    assert programs.method_curve(model, case, "nobody9", heard.append) is None
    assert heard == ['left out: method "nobody9" is not known']
    assert programs.has_fixed_steps(model, "rk4") is True
    assert programs.has_fixed_steps(model, "dop853") is False


@pytest.mark.parametrize("method", ["dop853", "rk4"])
def test_methods_come_nearer_to_the_reference_as_settings_tighten(method: str) -> None:
    case = CASES["e"]
    exact, _ = references.load_reference(case)
    model = mstmm.compile(mstmm.Scene(**case.scene()), engine="looped")
    curve = programs.method_curve(model, case, method, print)
    assert curve is not None
    settings = [setting for setting, _ in curve.settings]
    assert settings == sorted(settings, reverse=True)
    errors = []
    for _, run in curve.settings[3:10:3]:
        read_positions, counts = run()
        assert counts["evaluations"] > 0
        errors.append(float(np.abs(read_positions() - exact).max()))
    assert errors[0] > 10 * errors[1] > 100 * errors[2]


def test_scipy_meets_the_same_motion() -> None:
    case = CASES["d-quarter"]
    exact, _ = references.load_reference(case)
    model = mstmm.compile(mstmm.Scene(**case.scene()), engine="looped")
    curve = programs.radau_curves(model, case)[-1]
    read_positions, counts = dict(curve.settings)[1e-6]()
    assert counts["jacobians"] > 0
    assert np.abs(read_positions() - exact).max() < 1e-5
