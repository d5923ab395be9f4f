"""The rule of the search on runs whose errors are known by construction."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from mstmm.runtime.experiments.error_control.error_extrapolation import (
    TIGHTEST,
    Kind,
    ToleranceRun,
    estimate_error,
    first_rtol,
    next_rtol,
    no_gain_reason,
)
from mstmm.runtime.experiments.tuning import ERROR_CONTROL


def looks(
    error: Callable[[float], float], *rtols: float, kind: Kind = Kind.EXPLICIT
) -> list[ToleranceRun]:
    """Runs whose error is a function of the tolerance; they err all the same way."""
    tightest = error(rtols[-1])
    return [
        ToleranceRun(rtol, kind, abs(error(rtol) - tightest), local_error_sum=10.0 * rtol)
        for rtol in rtols
    ]


def search(error: Callable[[float], float], asked: float, kind: Kind) -> tuple[float, float]:
    """(true, estimated) error at the end of a search by one kind of method."""
    rtols = [first_rtol(asked, kind)]
    while True:
        found = looks(error, *rtols, kind=kind)
        known = estimate_error(found)
        if known is not None and (known <= asked or no_gain_reason(found)):
            return error(rtols[-1]), known
        rtols.append(next_rtol(found, asked, kind))


@pytest.mark.parametrize("kind", Kind)
@pytest.mark.parametrize("asked", [1e-2, 1e-4, 1e-6, 1e-8])
@pytest.mark.parametrize("growth", [0.03, 1.0, 50.0, 3e3])
@pytest.mark.parametrize("power", [0.7, 0.9, 1.0, 1.2])
def test_errors_that_follow_a_power_are_reached_and_told(
    kind: Kind, asked: float, growth: float, power: float
) -> None:
    if kind is Kind.EXPLICIT:
        power = max(power, 0.8)  # their local errors are held to the tolerance
    true, told = search(lambda rtol: growth * rtol**power, asked, kind)
    assert true <= 10 * told
    if growth * TIGHTEST**power < asked / 1000:  # within reach of numbers of 16 digits
        assert told <= asked


def test_one_run_tells_nothing() -> None:
    assert estimate_error(looks(lambda rtol: rtol, 1e-3)) is None
    assert no_gain_reason(looks(lambda rtol: rtol, 1e-3)) == ""


def test_an_error_that_stays_ends_the_search() -> None:
    """Rounding: about 1e-9, whatever the tolerance, now this way and now that."""
    true, told = search(
        lambda rtol: 1e-9 * math.sin(1 / rtol) + 1e-3 * rtol, 1e-12, kind=Kind.EXPLICIT
    )
    assert told > 1e-12
    assert abs(true) <= 10 * told


def test_motion_that_cannot_be_told_ends_at_the_tightest_tolerance() -> None:
    """Errors of the size of the motion however tight, as of chaos."""
    rtols = [first_rtol(1e-6, kind=Kind.EXPLICIT)]
    while not no_gain_reason(found := looks(lambda rtol: 1.0 + 0.3 * math.sin(1 / rtol), *rtols)):
        rtols.append(next_rtol(found, 1e-6, kind=Kind.EXPLICIT))
    assert rtols[-1] == TIGHTEST
    assert len(rtols) < ERROR_CONTROL.max_runs


@pytest.mark.parametrize(("kind", "leap"), [(Kind.EXPLICIT, 1e-2), (Kind.IMPLICIT, 1e-1)])
def test_runs_that_part_early_leap_no_farther_than_is_known(kind: Kind, leap: float) -> None:
    """Growth to the end at the pace of the first tenth is more than there is; and where implicit
    runs part early they do not follow a vibration, and nothing grows."""
    found = [
        ToleranceRun(1e-3, kind, 2.0, 0.1, divergence_fraction=0.1),
        ToleranceRun(1e-6, kind, 0.0, 1e-4),
    ]
    assert next_rtol(found, 1e-6, kind) == pytest.approx(leap * 1e-6)


def test_runs_that_end_elsewhere_have_no_estimate() -> None:
    found = [
        ToleranceRun(1e-3, Kind.EXPLICIT, math.inf, None),
        ToleranceRun(1e-5, Kind.EXPLICIT, 0.0, None),
    ]
    assert estimate_error(found) == math.inf
    assert next_rtol(found, 1e-6, kind=Kind.EXPLICIT) == pytest.approx(1e-6)


def test_an_explicit_run_after_an_implicit_one_begins_anew() -> None:
    implicit = [ToleranceRun(1e-4, Kind.IMPLICIT, 0.05, 1e-4)]
    first = next_rtol(implicit, 1e-7, kind=Kind.EXPLICIT)
    assert first == first_rtol(1e-7, kind=Kind.EXPLICIT)
    found = [*implicit, ToleranceRun(first, Kind.EXPLICIT, 0.0, 1e-2)]
    assert estimate_error(found) == pytest.approx(4.0 * 0.05)
    assert next_rtol(found, 1e-7, kind=Kind.EXPLICIT) == pytest.approx(
        max(first * (0.2 * 1e-5 / 3) ** (1 / 0.9), 3e-6 * first)
    )


def test_an_explicit_run_after_implicit_ones_that_are_known_is_known_by_them() -> None:
    """It errs by little where stability sets its steps: what it costs to compare it with another
    of its kind is saved."""
    implicit = looks(lambda rtol: 20.0 * rtol**0.8, 1e-2, 1e-4, kind=Kind.IMPLICIT)
    first = next_rtol(implicit, 1e-3, kind=Kind.EXPLICIT)
    apart = 20.0 * implicit[-1].rtol ** 0.8
    implicit[-1] = ToleranceRun(implicit[-1].rtol, Kind.IMPLICIT, apart, 1e-3)
    told = estimate_error([*implicit, ToleranceRun(first, Kind.EXPLICIT, 0.0, 1e-2)])
    assert told is not None and told <= 1e-3
    assert first < first_rtol(1e-3, kind=Kind.EXPLICIT)


def test_a_third_run_suffices_where_the_second_errs_twice_as_much_as_was_believed() -> None:
    rtols = [1e-3, 1e-6]

    def error(rtol: float) -> float:
        return (2.0 if rtol <= rtols[1] else 1.0) * 0.1 * rtol

    known = estimate_error(looks(error, *rtols))
    assert known is not None
    rtols.append(next_rtol(looks(error, *rtols), known / 3, Kind.EXPLICIT))
    told = estimate_error(looks(error, *rtols))
    assert told is not None and told <= known / 3


def test_local_errors_where_stability_sets_the_steps_count_for_less() -> None:
    kind = Kind.EXPLICIT
    free, held = (
        next_rtol([ToleranceRun(3e-3, kind, 0.0, 1e-1, h)], 1e-3, kind) for h in (False, True)
    )
    assert free < held < 3e-3


def test_vibration_that_is_followed_implicitly_errs_by_more_than_local_errors() -> None:
    """Its phase goes on to err: the first tolerance is tighter for each radian of it, and the
    second one by what they make of the same local errors."""
    kind = Kind.IMPLICIT
    still, waving = (first_rtol(1e-5, kind, radians) for radians in (0.0, 300.0))
    assert waving == pytest.approx(10.0 * 1e-5 / 300.0)
    assert waving < still
    rtols = [
        next_rtol([ToleranceRun(1e-6, kind, 0.0, 1e-5, radians=radians)], 1e-5, kind)
        for radians in (0.0, 40.0)
    ]
    assert rtols[1] == pytest.approx(1e-6 * (0.6 * 1e-5 / (11.0 * 1e-5)) ** (1 / 0.9))
    assert rtols[1] < rtols[0]


def test_an_estimate_is_the_same_whatever_was_asked_and_covers_the_scatter_of_runs() -> None:
    """Errors of 0.01 have fallen by 2.25 of the three decades of the tolerance, times two, and by
    chance two runs alone are as near to each other."""
    found = [
        ToleranceRun(1e-3, Kind.EXPLICIT, 0.01, None),
        ToleranceRun(1e-6, Kind.EXPLICIT, 0.0, None),
    ]
    assert estimate_error(found) == pytest.approx(2 * 2.0 * 0.01 * 10**-2.25)
    before = ToleranceRun(1e-1, Kind.EXPLICIT, 0.6, None)
    assert estimate_error([before, *found]) == pytest.approx(2.0 * 0.01 * 10**-2.25)


def test_of_another_method_of_the_kind_less_is_believed() -> None:
    """Errors at the same tolerance may be larger by another method, and shown powers are none."""
    found = [
        ToleranceRun(1e-3, Kind.EXPLICIT, 0.01, None, method="dopri5"),
        ToleranceRun(1e-6, Kind.EXPLICIT, 0.0, None, method="dop853"),
    ]
    assert estimate_error(found) == pytest.approx(2 * 2.0 * 0.01 * 10**-1.5)
    before = ToleranceRun(1e-1, Kind.EXPLICIT, 0.6, None, method="dopri5")
    assert estimate_error([before, *found]) == pytest.approx(2.0 * 0.01 * 10**-1.5)


@pytest.mark.parametrize(
    ("before", "fallen"),
    [(Kind.EXPLICIT, 0.1**0.5), (Kind.IMPLICIT, 0.1**0.5), (Kind.EXPONENTIAL, 1)],
)
def test_of_another_kind_less_is_believed(before: Kind, fallen: float) -> None:
    kind = Kind.IMPLICIT if before is Kind.EXPLICIT else Kind.EXPLICIT
    safety = 2.0 * {Kind.IMPLICIT: 1.5, Kind.EXPLICIT: 2.0}[kind]
    known = estimate_error(
        [ToleranceRun(1e-3, before, 0.05, 1e-3), ToleranceRun(1e-4, kind, 0.0, 1e-4)]
    )
    assert known == pytest.approx(safety * 0.05 * fallen)
