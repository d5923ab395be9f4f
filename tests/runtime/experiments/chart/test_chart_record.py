"""Pareto's front and the recommendation, on points drawn and points given."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from mstmm.errors import NumericalFailure, SceneError
from mstmm.runtime.experiments.chart.chart import Chart
from mstmm.runtime.experiments.chart.chart_record import (
    Level,
    Point,
    Reference,
    bound_errors,
    pareto_front,
    recommend,
)
from mstmm.runtime.experiments.method_families import all_methods, without_index3_duplicates
from mstmm.runtime.experiments.trial import Setting

REFERENCE = Reference(1e-11, "two runs", "as given", "all coordinates", "1", "none")


def random_points(
    rng: np.random.Generator, curves: int = 6, settings: int = 8
) -> tuple[Point, ...]:
    """Curves whose errors fall on the whole, with hits and misses, ties and failures."""
    found = []
    for c in range(curves):
        for s in range(settings):
            setting = Setting(f"method{c}", "as given", 10.0 ** -(s + 2))
            if rng.random() < 0.1:
                found.append(Point(setting, failure="no"))
                continue
            error = 10.0 ** round(rng.normal(-s - 1, 2), 1)
            seconds = 10.0 ** round(rng.normal(s / 4 - 3, 0.3), 1)
            found.append(Point(setting, error, seconds, 1))
    return bound_errors(found, REFERENCE)


def test_the_front_is_what_no_other_point_beats(rng: np.random.Generator) -> None:
    for _ in range(50):
        points = random_points(rng)
        ran = [p for p in points if p.error is not None]
        numbers = [(p.error_bound or 0.0, p.cpu_s or 0.0) for p in ran]
        best = {
            pair
            for pair in numbers
            if not any(
                other != pair and other[0] <= pair[0] and other[1] <= pair[1] for other in numbers
            )
        }
        found = [(p.error_bound or 0.0, p.cpu_s or 0.0) for p in pareto_front(points)]
        assert set(found) == best
        assert len(found) == len(best)
        assert found == sorted(found, key=lambda pair: pair[1])


def test_sure_errors_are_the_largest_of_tighter_settings(rng: np.random.Generator) -> None:
    for point in (points := random_points(rng)):
        tighter = [
            p.error
            for p in points
            if p.method == point.method and p.setting.value <= point.setting.value
            and p.error is not None
        ]  # fmt: skip
        assert point.error_bound == (None if point.error is None else max(tighter))
        assert point.reference_limited == (point.error is not None and point.error <= 3e-11)


def test_no_setting_is_surely_better_than_its_level_of_model() -> None:
    near = Point(Setting("genalpha", "one shape", 1e-3), 4e-3, 1e-3, 1)
    better = Point(Setting("genalpha", "two shapes", 1e-3), 4e-3, 2e-3, 1)
    reference = replace(REFERENCE, model="two shapes")
    found = bound_errors([near, better], reference, {"one shape": 5e-3})
    assert [point.error_bound for point in found] == [5e-3, 4e-3]
    assert recommend(found, 4.5e-3, reference).model == "two shapes"


def test_what_is_recommended_is_on_the_front_and_meets_the_error(rng: np.random.Generator) -> None:
    met = 0
    for _ in range(30):
        points = random_points(rng)
        for asked in (1e-2, 1e-5, 1e-8):
            enough = [p for p in points if p.error_bound is not None and p.error_bound <= asked]
            if not enough:
                with pytest.raises(NumericalFailure, match="no setting reaches an error of"):
                    recommend(points, asked, REFERENCE)
                continue
            best = recommend(points, asked, REFERENCE)
            assert best in pareto_front(points, REFERENCE.smallest_resolved_error)
            assert best.error_bound is not None and best.error_bound <= asked
            assert best.cpu_s == min(p.cpu_s or 0.0 for p in enough)
            met += 1
    assert met > 30


def test_errors_that_the_reference_cannot_judge() -> None:
    points = bound_errors(
        [
            Point(Setting("a", "m", 1e-9), 2e-12, 1e-3, 1),
            Point(Setting("b", "m", 1e-9), 1e-12, 1, 1),
        ],
        REFERENCE,
    )
    assert all(point.reference_limited for point in points)
    assert [p.method for p in pareto_front(points, REFERENCE.smallest_resolved_error)] == [
        "a"
    ]  # b is no better, and slower
    assert recommend(points, 3.1e-11, REFERENCE).method == "a"
    with pytest.raises(NumericalFailure, match="does not resolve errors below 3"):
        recommend(points, 1e-11, REFERENCE)
    for error in (0.0, -1.0, float("nan")):
        with pytest.raises(SceneError, match="above 0"):
            recommend(points, error, REFERENCE)


def test_what_never_changes_recommends_nothing() -> None:
    """As the origin of a body that turns about it."""
    exact = [Point(Setting("a", "m", 10.0**-i), 0.0, 1e-3, 1) for i in range(3)]
    with pytest.raises(NumericalFailure, match="all runs have zero error of all coordinates"):
        recommend(bound_errors(exact, REFERENCE), 1e-3, REFERENCE)
    some = [*exact, Point(Setting("b", "m", 1e-2), 1e-5, 1e-3, 1)]
    assert recommend(bound_errors(some, REFERENCE), 1e-3, REFERENCE).error == 0.0


def test_json_says_why_nothing_is_recommended() -> None:
    points = bound_errors([Point(Setting("a", "m", 1e-3), 1e-2, 1e-3, 1)], REFERENCE)
    chart = Chart(
        "t", 1.0, 11, REFERENCE, points, (Level("m", 1e-11, 1, "looped"),), (), 1e-6, 10.0, 1.0
    )
    data = json.loads(chart.to_json())
    assert data["recommended"] is None
    assert "the smallest error reached is 1.0e-02" in data["not_recommended"]
    assert [(one["asked"], one["error"]) for one in data["advice"]] == [(0.1, 0.01), (0.01, 0.01)]
    assert data["front"][0]["method"] == "a"
    met = json.loads(replace(chart, target_error=0.5).to_json())
    assert met["recommended"]["setting"] == {"rtol": 1e-3, "atol": 1e-5}
    assert met["not_recommended"] is None


def test_trees_are_charted_without_methods_that_do_the_same_there() -> None:
    left = without_index3_duplicates(all_methods())
    assert set(all_methods()) - set(left) == {"genalpha-index3", "hht-index3"}
    assert without_index3_duplicates(("dop853", "hht-index3")) == ("dop853", "hht-index3")
