"""Frontiers of functions whose frontiers are known."""

from __future__ import annotations

import math

import pytest

from mstmm.atlas.atlas import measure_case
from mstmm.atlas.case_definition import (
    COUNT_SCALE,
    LINEAR_SCALE,
    LOG_SCALE,
    CaseDefinition,
    MethodDefinition,
    Scale,
)
from mstmm.atlas.frontier import MeasuredMethod, find_end, find_frontier
from mstmm.errors import NumericalFailure

ENDS = {
    "linear": (LINEAR_SCALE, 0.0, 8.0),
    "log": (LOG_SCALE, 1e-3, 1e5),
    "count": (COUNT_SCALE, 1.0, 900.0),
}


@pytest.mark.parametrize("name", ENDS)
@pytest.mark.parametrize("below", [False, True])
def test_the_frontier_of_a_power_is_found(name: str, below: bool) -> None:
    scale, low, high = ENDS[name]
    values = scale.grid(low, high, 7)
    assert (values[0], values[-1]) == (low, high)
    if below:
        tried = MeasuredMethod(lambda x: 1 / max(x, 1e-9), 1 / math.pi)
        found = find_frontier(tried, values[::-1], scale, 1e-3)
    else:
        found = find_frontier(MeasuredMethod(lambda x: x, math.pi), values, scale, 1e-3)
    assert found.fails_at is not None
    inner, outer = sorted((found.holds_at, found.fails_at))
    assert inner <= math.pi <= outer
    assert outer - inner <= (1 if scale is COUNT_SCALE else 1e-3 * outer)
    assert found.monotone
    assert (found.holds_at > found.fails_at) == below
    assert [at for at, _ in found.points] == sorted({at for at, _ in found.points})


def test_whole_numbers_stay_whole_and_come_once() -> None:
    values = COUNT_SCALE.grid(1, 12, 40)
    assert values == tuple(range(1, 13))
    assert COUNT_SCALE.middle(3, 4, 1e-9) is None
    assert COUNT_SCALE.middle(4, 9, 0.5) == 6


@pytest.mark.parametrize("scale", [LINEAR_SCALE, LOG_SCALE])
def test_a_bracket_ends_where_no_number_lies_between(scale: Scale) -> None:
    assert scale.middle(1.0, math.nextafter(1.0, 2.0), 0.0) is None


def test_no_answer_and_no_number_are_failures() -> None:
    def failing_measure(x: float) -> float:
        if x > 5:
            raise NumericalFailure("none")
        return math.nan if x > 3 else 0.0

    tried = MeasuredMethod(failing_measure, 1.0)
    found = find_frontier(tried, (0.0, 4.0, 6.0), LINEAR_SCALE, 1e-6)
    assert found.fails_at == pytest.approx(3.0, rel=1e-5)
    assert found.points[-1] == (6.0, math.inf)


def test_other_errors_are_not_swallowed() -> None:
    def divide_by_zero(x: float) -> float:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        MeasuredMethod(divide_by_zero, 1.0).is_within_limit(0.0)


def test_islands_are_told() -> None:
    tried = MeasuredMethod(lambda x: abs(math.sin(x)), 0.5)
    found = find_frontier(tried, (0.0, 1.0, 3.0, 4.5), LINEAR_SCALE, 1e-6)
    assert not found.monotone
    assert found.fails_at == pytest.approx(math.pi / 6, rel=1e-5)


@pytest.mark.parametrize("limit", [0.5, 20.0])
def test_a_bracket_needs_both_sides(limit: float) -> None:
    with pytest.raises(NumericalFailure, match="no frontier between 1 and 10"):
        find_frontier(MeasuredMethod(lambda x: x, limit), (1.0, 10.0), LINEAR_SCALE, 0.01)


def test_how_far_a_remedy_holds() -> None:
    held = find_end(MeasuredMethod(lambda x: x, 4.0), (1.0, 3.0, 9.0), LINEAR_SCALE, 1e-6)
    assert held.holds_at == pytest.approx(4.0, rel=1e-5)
    assert held.fails_at == pytest.approx(4.0, rel=1e-5)
    ever = find_end(MeasuredMethod(lambda x: x, 40.0), (1.0, 3.0, 9.0), LINEAR_SCALE, 1e-6)
    assert (ever.holds_at, ever.fails_at) == (9.0, None)
    with pytest.raises(NumericalFailure, match="the remedy fails"):
        find_end(MeasuredMethod(lambda x: x, 0.5), (1.0, 3.0), LINEAR_SCALE, 1e-6)


def made_up(**changes: object) -> CaseDefinition:
    values = {
        "name": "made-up",
        "title": "Made up",
        "cause": "So.",
        "parameter": "x",
        "unit": "m",
        "low": 1.0,
        "high": 100.0,
        "scale": LOG_SCALE,
        "measured": "x",
        "limit": 10.0,
        "method": MethodDefinition("one", lambda x: x),
        "remedy": MethodDefinition("other", lambda x: x / 50),
        "reach": 1e4,
        "source": "none",
    }
    return CaseDefinition(**(values | changes))  # type: ignore[arg-type]


def test_a_case_holds_what_was_tried() -> None:
    case = measure_case(made_up(), points=5, tolerance=0.01)
    assert case.failing_side == "above"
    assert case.holds_at <= 10.0 < case.fails_at < 10.2
    assert case.remedy_holds_to <= 500.0 < (case.remedy_fails_at or 0.0) < 510.0
    assert all(measured == at for at, measured in case.points)
    below = measure_case(
        made_up(method=MethodDefinition("one", lambda x: 100 / x), reach=1e-3), 5, 0.01
    )
    assert below.failing_side == "below"
    assert below.fails_at < 10.0 <= below.holds_at
    assert (below.remedy_holds_to, below.remedy_fails_at) == (1e-3, None)


def test_a_case_that_does_not_come_out_is_named() -> None:
    with pytest.raises(NumericalFailure, match='case "made-up": no frontier'):
        measure_case(made_up(limit=1e9), 5, 0.01)
    with pytest.raises(NumericalFailure, match='case "made-up": the remedy fails'):
        measure_case(made_up(remedy=MethodDefinition("other", lambda x: x)), 5, 0.01)
