"""Every case of the atlas: the failing side fails, the remedy holds, the frontier is where it is
known to be."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

import mstmm
from mstmm.atlas import cases
from mstmm.atlas.case import Case

#: Case -> between what its frontier is expected (in its unit), and how far the remedy must hold.
#: From where not said otherwise: the growth of tests/stability/test_growth.py.
EXPECTED = {
    "product-length": ((16, 25), 1e5),
    "product-angle": ((80.0, 89.0), 90.0),
    "product-pivot": ((1e-2, 0.1), 1e-10),
}

#: Quick settings: frontiers to 3 %.
POINTS, TOLERANCE = 7, 0.03


@cache
def measured(name: str) -> Case:
    return mstmm.stability([name], points=POINTS, tolerance=TOLERANCE).cases[0]


def test_every_case_is_expected_somewhere() -> None:
    assert set(EXPECTED) == set(cases.names())


@pytest.mark.parametrize("name", EXPECTED)
def test_the_method_fails_where_it_is_known_to(name: str) -> None:
    case, (definition,) = measured(name), cases.chosen([name])
    low, high = EXPECTED[name][0]
    tried = dict(case.points)
    assert low <= min(case.holds_at, case.fails_at) <= max(case.holds_at, case.fails_at) <= high
    assert tried[case.holds_at] <= case.limit < tried[case.fails_at]
    end = definition.high if case.fails == "above" else definition.low
    assert tried[end] > case.limit


@pytest.mark.parametrize("name", EXPECTED)
def test_the_remedy_holds_there_and_beyond(name: str) -> None:
    case, reach = measured(name), EXPECTED[name][1]
    tried = dict(case.remedy_points)
    assert tried[case.fails_at] <= case.limit
    assert tried[case.remedy_holds_to] <= case.limit
    if case.fails == "above":
        assert case.remedy_holds_to >= reach > case.fails_at
    else:
        assert case.remedy_holds_to <= reach < case.fails_at


@pytest.mark.parametrize("name", EXPECTED)
def test_a_case_says_what_a_reader_needs(name: str) -> None:
    (case,) = cases.chosen([name])
    assert case.name == name
    for text in (case.title, case.why, case.parameter, case.measured, case.source):
        assert len(text) > 5
    assert len(case.title) < 75
    assert case.method.name != case.remedy.name
    assert case.reach >= case.high or case.reach <= case.low


def test_same_numbers_every_time() -> None:
    again = mstmm.stability(["product-length"], points=POINTS, tolerance=TOLERANCE)
    assert again.cases[0] == measured("product-length")


def test_finer_settings_tell_the_same_frontier() -> None:
    fine = mstmm.stability(["product-pivot"], points=9, tolerance=0.003).cases[0]
    rough = measured("product-pivot")
    assert math.log(fine.fails_at / rough.fails_at) == pytest.approx(0.0, abs=1.0)
    assert np.log(fine.holds_at / fine.fails_at) < 0.0031
