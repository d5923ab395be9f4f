"""What is known of expressions of time before a run: every switch, every narrow part."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mstmm.expression.expression import Expression, parse
from mstmm.runtime.discontinuities.active_expressions import ActiveExpression
from mstmm.runtime.discontinuities.interval_enclosures import (
    Interval,
    enclose,
    identity_enclosure,
    terms_of_time,
)
from mstmm.runtime.discontinuities.time_map import TimeMap, time_map

SHAPES = [
    "sin(3*t)^2 - cos(t/2)", "t^3 - 2*t^2 + t", "exp(-t)*tan(t/3)", "sqrt(t)/(1 + t^2)",
    "log(1 + t)*atan(4*t - 2)", "abs(t - 1)*sign(t - 2)", "min(t, 2 - t, sin(t))",
    "where(t^2 < 3, t, -t)", "asin(t/4) - acos(t/5)", "sinh(t - 2)/cosh(t)", "tanh(5*t - 9)",
    "t^(-2)*(t - 1)^3", "(1 + t)^t", "atan2(t - 1, 2 - t)", "max(t - 2, 0)^2.5", "1/(t - 1.7)",
]  # fmt: skip


def map_expression(text: str, end: float, start: float = 0.0, drive: bool = False) -> TimeMap:
    return time_map([ActiveExpression(parse(text), "load", drive=drive)], start, end)


def value_at(expression: Expression, t: float) -> float:
    return expression.evaluate(lambda _: t)


@pytest.mark.parametrize("text", SHAPES)
def test_values_and_slopes_lie_within_their_bounds(text: str) -> None:
    expression = parse(text)
    order, _ = terms_of_time(expression, {})
    edges = np.linspace(0.05, 3.9, 40)
    a, b = edges[:-1], edges[1:]
    found = enclose(expression.terms, order, {}, {"t": identity_enclosure(Interval(a, b))})[
        expression.root
    ]
    inside = a + (b - a) * np.linspace(0, 1, 9)[:, None]
    values = np.array([[value_at(expression, t) for t in row] for row in inside])
    assert np.all((values >= found.value.lo) & (values <= found.value.hi))
    slopes = np.diff(values, axis=0) / np.diff(inside, axis=0)  # a mean value of the slope
    slack = 1e-9 * (1 + np.abs(slopes))
    assert np.all((slopes >= found.slope.lo - slack) & (slopes <= found.slope.hi + slack))


@pytest.mark.parametrize(
    ("text", "end", "times"),
    [
        ("where(sin(t) > 0.5, 1, 0)", 9.0,
         [math.pi / 6, 5 * math.pi / 6, 13 * math.pi / 6, 17 * math.pi / 6]),
        ("where(cos(2*pi*t) > 0.999, 100, 0)", 2.5,
         [k + s * math.acos(0.999) / (2 * math.pi) for k in (0, 1, 2) for s in (-1, 1)][1:]),
        ("where((t - 5)^2 < 1e-8, 1, 0)", 10.0, [4.9999, 5.0001]),
        ("where(t*t*t - 6*t*t + 11*t > 6, 1, 0)", 10.0, [1.0, 2.0, 3.0]),
        ("sign(exp(t) - 10) + abs(log(1 + t) - 1)", 4.0, [math.e - 1, math.log(10)]),
        ("max(t^2, 2)", 3.0, [math.sqrt(2)]),
        ("1/(t^2 - 4)", 3.0, [2.0]),
        ("tan(t)", 6.0, [math.pi / 2, 3 * math.pi / 2]),
        ("sqrt(t - 1)", 3.0, [1.0]),
        ("where(q > 1, 1, 0)*where(sin(t) > 0.5, 1, 0)", 2.0, [math.pi / 6]),
        ("where(q*sin(t) > 0.5, 1, 0)", 9.0, []),
        ("where(t^2 < 5, 1, 0)", 2.0, []),
        ("abs(sin(t)) + 3*t^2 + exp(-t)", 3.0, [0.0]),
    ],
)  # fmt: skip
def test_every_switch_ends_a_step(text: str, end: float, times: list[float]) -> None:
    breaks = map_expression(text, end).breaks
    for time in times:
        assert np.abs(breaks - time).min() < 1e-11
    for time in breaks:
        assert np.abs(np.array(times) - time).min() < 1e-11
    assert len(breaks) <= 2 * len(times)  # one that is known to rounding lies between two breaks


def test_the_open_sign_lies_between_two_breaks() -> None:
    before, after = map_expression("where(sin(t) > 0.9999, 1, 0)", 1.57).breaks
    assert math.sin(before) < 0.9999 < math.sin(after)
    assert after - before < 1e-12


def test_roots_that_touch_are_ends_of_steps() -> None:
    breaks = map_expression("abs(t^2 - 2*t + 1)", 3.0).breaks
    assert breaks[0] < 1.0 < breaks[-1] and breaks[-1] - breaks[0] < 1e-6


@pytest.mark.parametrize(
    ("text", "where", "width"),
    [
        ("100*exp(-((t - 5.03)/0.005)^2)", 5.03, 0.005),
        ("1/(1 + ((t - 2)/1e-4)^2)", 2.0, 1e-4),
        ("cos(t)^10000", math.pi, 0.014),
        ("(t - 5.03)*exp(-((t - 5.03)/1e-7)^2)", 5.03, 1e-7),
        ("exp(-((sin(t) - 0.3)/0.001)^2)", math.asin(0.3), 0.001),
        ("3*tanh((t - 4)/0.002) + q", 4.0, 0.002),
    ],
)  # fmt: skip
def test_narrow_parts_bound_the_step_there_and_nowhere_else(
    text: str, where: float, width: float
) -> None:
    known = map_expression(text, 10.0)
    there = known.longest[np.searchsorted(known.starts, where, side="right") - 1]
    assert 0.1 * width < there < 8 * width
    assert known.longest.max() > 30 * width
    assert not known.notes


def test_even_oscillations_take_no_more_than_their_period() -> None:
    known = map_expression("3*sin(63*t)", 1000.0)
    assert known.longest.tolist() == [pytest.approx(6 / 63)]


def test_slow_expressions_bound_nothing() -> None:
    for text in ("15*t^2/2", "where(t < 1, t, 2 - t)", "2 + 3*t", "q*t"):
        assert np.all(map_expression(text, 10.0).longest > 2.0), text


def test_of_a_drive_the_bends_are_narrow() -> None:
    corner = "sqrt((t - 5)^2 + 1e-8)"
    assert map_expression(corner, 10.0).longest.min(initial=np.inf) > 1.0
    assert map_expression(corner, 10.0, drive=True).longest.min() < 1e-3


def test_what_cannot_be_mapped_is_named() -> None:
    (note,) = map_expression("where(sin(1e6*t) > 0, 1, 0)", 10.0).notes
    assert str(note).startswith("load ('where(sin(1e6*t) > 0, 1, 0)') switches too often")
    (note,) = map_expression("exp(sin(1e6*t))", 10.0).notes
    assert "changes too often" in str(note) and "max_step" in note.remedy


def test_a_switch_at_the_start_is_a_break_there() -> None:
    assert map_expression("sign(sin(t))", 1.0).breaks.tolist() == [0.0]
    assert map_expression("where(t > 0, 1, 0)", 1.0).breaks.tolist() == [0.0]
    assert not len(map_expression("where(t > 1, 1, 0)", 1.0).breaks)


def test_a_fixed_step_that_is_too_long_is_told() -> None:
    known = map_expression("100*exp(-((t - 5.03)/0.005)^2)", 10.0)
    told = str(known.missed_feature_risk(0.1))
    assert "the fixed step of 0.1 s is too long for load, which near t = 5.0" in told
    assert known.missed_feature_risk(0.001) is None
