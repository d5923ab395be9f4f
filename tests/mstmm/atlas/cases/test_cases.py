"""Every case of the atlas: the failing side fails, the remedy holds, the frontier is where it is
known to be."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

import mstmm
from mstmm.atlas import cases
from mstmm.atlas.atlas import MeasuredCase

#: Case -> between what its frontier is expected (in its unit), and how far the remedy must hold.
#: From where not said otherwise: the growth of tests/system/robustness/test_growth.py.
EXPECTED = {
    "product-length": ((16, 25), 1e5),
    "product-angle": ((80.0, 89.0), 90.0),
    "product-pivot": ((1e-2, 0.1), 1e-10),
    "product-masses": ((0.02, 0.2), 1e-6),
    # about 5e-13 times the ratio: 5e-5 at 1e8
    "product-root": ((1e5, 1e8), 1e20),
    # errors of (0.4 to 4) 1e-16 times the ratio: tests/system/robustness/test_mass_ratios.py
    "heavy-tip": ((1e6, 1e9), 1e20),
    # refined up to four times, of the fifth power of that: as long as it leaves a digit
    "refined-tip": ((1e13, 1e17), 1e20),
    # across its plane a chain resists with the cube of its length, and rounding of that leaks
    "inertial-axes": ((100, 2000), 1e5),
    # one spring between a light and a heavy mass: the square of what is missed is 1 + M/m
    "light-between": ((2.7, 3.3), 1e12),
    # docs/explanation/discrete-time-method.md: 4 welded beams of three shapes at h = 0.001
    "product-beams": ((3, 4), 40),
    # h omega = sqrt 8, omega = sqrt(3 k) of a rod
    "rk4-stiffness": ((0.95 * 8e6 / 3, 1.06 * 8e6 / 3), 1e12),
    # h lambda = 2.785, lambda = 3 c of a rod whose spring does not count
    "rk4-damping": ((0.95 * 928.4, 1.06 * 928.4), 1e10),
    # from below h omega = 3, where collocation at 1.4 h sees less than half a period, to 3
    "wilson-overshoot": ((1.0, 3.2), 1e6),
    "genalpha-overshoot": ((10.0, 100.0), 1e6),
    # amplitude left after ten periods: 0.995 at h omega = 0.5, 0.967 at 1; of rodas5p 0.9989 at 1
    "numerical-damping": ((0.5, 1.0), 1.0),
    # docs/explanation/discrete-time-method.md: lost at 6.0 s
    "newmark-constraints": ((4.0, 6.1), 60.0),
    # of fourth order: 6.2e-7 m at 10 ms
    "wilson-gaps": ((1e-2, 1.3e-2), 0.1),
    "one-iteration": ((2e4, 1e6), 1e6),
    "classical-iteration": ((1e4, 1e6), 1e6),
    "iterated-steps": ((2e6, 1e8), 1e10),
    "order-reduction": ((1e3, 1e5), 1e10),
    # the length falls by (h w / 2)^6 / 144 a step, w = 1.98 rad/s: 1e-6 of 50 s at h = 0.078
    "quaternion-drift": ((0.074, 0.083), 0.5),
    # (h omega / 2)^2 an iteration, 1e-8 of what a step changes within 100: 1.82
    "laws-iterations": ((1.6, 2.0), 30.0),
    # h^3 k on rods of 1 kg that swing at some 4 rad/s, beside their weight: k of 1e5 to 1e6
    "predicted-loads": ((1e5, 2e6), 1e12),
    # derived beside: 1.3e-2 m, and 1.16e-2 of a rigid rod, at rho A g L^3 / EI = 1.96
    "linear-weight": ((0.3, 1.96), 6.0),
    "laws-tangent": ((0.1, 1.0), 1e3),
    # of first order: 7.1e-5 at 3.9 ms
    "laws-order": ((5e-4, 6.1e-4), 2e-2),
    # the oblique entries round to eps of the moment across: eps over the ratio, some ten times
    "thin-rod": ((3e-11, 3e-9), 1e-20),
    # omega^2 is 1 + (l/h)^2 / 2 of the slender bar's where curvature is shear (Cook), l = L/20
    "linear-elements": ((12.3, 14.3), 1000),
    # degree 1 is 5 % too high at 0.1, its mesh alone, and 19 % at 0.01
    "no-compression": ((0.01, 0.1), 1e-10),
    "stiffened-mass": ((0.03, 0.12), 0.6),
    "unstable-motion": ((0.1, 1.0), 8.0),
    # half the square of the slope, 0.5 F L^2/EI, is some hundredths at F L^2/EI = 0.6
    # h lambda = 2.785: 2065 and 4801 /s with three shapes and four (power iteration)
    "tangent-frame": ((3, 4), 8),
    "single-frame": ((0.3, 1.5), 10.0),
    "one-way": ((5.0, 100.0), 0.1),
    # eps e^beta is some thousandths, beta = (n - 1/2) pi
    "mode-shapes": ((9, 13), 1000),
    # z^3 cosh z is more than the largest double, 1.8e308, from z + 3 ln z = 710.5 on: 690.9
    "long-parts": ((670.0, 712.0), 1e5),
    # rounding of a stiffness 12, over z^4 for what cancels in it, beside an inertia of 13/35 z^4:
    # 1e-6 of it at z = 0.096
    "short-parts": ((0.06, 0.16), 1e-6),
    # eps e^beta is 1 at beta = 36, the twelfth mode
    "determinant-search": ((9, 13), 200),
    "end-moment": ((4, 20), 2),
    # h omega_n = sqrt 8 with omega_n = beta^2 sqrt(EI): beta = 20.0, between 17.28 and 20.42
    "rk4-shapes": ((6, 7), 20),
    # R(infinity) = sqrt 3 - 1: 0.01 of it after 14.76 steps
    "lasting-vibration": ((14.0, 15.0), 1.0),
    "old-accelerations": ((3e-3, 1.2e-2), 8e-3),
    # worst for the step in which contact begins: of first order in h omega
    "undamped-stop": ((0.2, 1.0), 1e3),
    # of second order: 2e-7 at 2 ms
    "plain-charts": ((0.03, 0.06), 0.1),
    # of third order: 1.4e-6 at 50 ms
    "single-product": ((0.04, 0.05), 0.2),
    # of second order: 4.3e-6 at 50 ms, 1.1e-6 at 25 ms
    "turn-slope": ((0.022, 0.026), 0.1),
    # lost within the second between steps of 2 and 4 ms, at 6 rad/s
    "plain-turns": ((8e-3, 3e-2), 0.1),
    # -alpha twice is an eigenvalue: nothing of rk4 holds from h alpha = 2.785 on
    "baumgarte": ((1.0, 2.8), 10.0),
    # of fourth order: 1.1e-5 at 5 ms
    "projected-places": ((3e-3, 7e-3), 0.02),
    # G M^-1 G' of rows that repeat others is some d^2: rounding up to d = 1e-8, and times 5 rows
    "repeated-rows": ((1e-8, 2e-7), 5e-4),
    # errors of (0.3 to 1) 1e-16 times the ratio; refined, of its square times (0.3 to 1) 1e-32
    "heavy-link": ((1e6, 1e9), 1e11),
    # 2 rows of each of n pairs wait at the lowest bars, of one less at the next: 4 n^2 / 3 + 3 n
    "grown-tree": ((7, 9), 1000),
    # what is missing is load times 0.577, of 1 + 1.443 load: 0.01 at 0.0178
    "loaded-linkage": ((0.017, 0.019), 1e6),
    # gaps across a coupler weigh 1 + 3 / spread times less than along it: 10 to 100 times
    "least-gap": ((0.03, 0.33), 1e-7),
    # what yields by 1e-8 beside what answers by the square of the angle: 1e-6 near 0.1
    "regularised-rows": ((0.03, 0.15), 1e-4),
    # the row that the coupler answers falls below 1e-6 of the other at that ratio of masses
    "dropped-rows": ((1e5, 1e7), 1e11),
    "friction-steps": ((1e-5, 3e-4), 5e-6),
    "gimbal-passage": ((1e-3, 3e-2), 1e-8),
    "narrow-pulse": ((3e-3, 0.3), 1e-8),
    # order 0: twice what second order leaves after a step shorter by sqrt 2
    "predictor-order": ((4, 8), 4096),
    # of first order, and less than half a step late
    "time-slope": ((2e-3, 0.1), 1.0),
    # omega^2 = 13.7 k: 500 steps in half a second are 8 to 40 in every period
    "usual-norm": ((1.8e3, 4.5e4), 1e16),
    # the first frequency of the clamped beam: 3.516 sqrt(EI / (rho A L^4)) = 3.798 rad/s
    "linear-beam": ((0.8 * 3.798, 3.798), 16.0),
}

#: Quick settings: frontiers to 3 %, or to a sixth of the width within which they are expected.
POINTS, TOLERANCE = 7, 0.03


def bracket_width(name: str) -> float:
    """Relative width to which the frontier of a case is bisected."""
    low, high = EXPECTED[name][0]
    sixth = min(0.5, math.log(high / low) / 6)
    return TOLERANCE if name in POWERS else max(TOLERANCE, sixth)


@cache
def measured_case(name: str) -> MeasuredCase:
    return mstmm.stability([name], points=POINTS, tolerance=bracket_width(name)).cases[0]


def test_every_case_is_expected_somewhere() -> None:
    assert set(EXPECTED) == set(cases.case_names())


@pytest.mark.parametrize("name", EXPECTED)
def test_the_method_fails_where_it_is_known_to(name: str) -> None:
    case, (definition,) = measured_case(name), cases.select_cases([name])
    low, high = EXPECTED[name][0]
    tried = dict(case.points)
    assert low <= min(case.holds_at, case.fails_at) <= max(case.holds_at, case.fails_at) <= high
    assert tried[case.holds_at] <= case.limit < tried[case.fails_at]
    end = definition.high if case.failing_side == "above" else definition.low
    assert tried[end] > case.limit


@pytest.mark.parametrize("name", EXPECTED)
def test_the_remedy_holds_there_and_beyond(name: str) -> None:
    case, reach = measured_case(name), EXPECTED[name][1]
    tried = dict(case.remedy_points)
    assert tried[case.fails_at] <= case.limit
    assert tried[case.remedy_holds_to] <= case.limit
    if case.failing_side == "above":
        assert case.remedy_holds_to >= reach > case.fails_at
    else:
        assert case.remedy_holds_to <= reach < case.fails_at


@pytest.mark.parametrize("name", EXPECTED)
def test_a_case_says_what_a_reader_needs(name: str) -> None:
    (case,) = cases.select_cases([name])
    assert case.name == name
    for text in (case.title, case.cause, case.parameter, case.measured, case.source):
        assert len(text) > 5
    assert len(case.title) < 75
    assert case.method.name != case.remedy.name
    assert case.reach >= case.high or case.reach <= case.low


#: Case -> power of the parameter by which what is measured grows beyond the frontier, and from
#: where to where that is asked.
POWERS = {
    "wilson-overshoot": (2.0, 9.0, 2e3),
    "genalpha-overshoot": (1.0, 900.0, 2e5),
    "numerical-damping": (3.0, 0.03, 0.4),
    "predictor-order": (2.0, 25.0, 1024.0),
    "laws-order": (1.0, 3e-4, 0.04),
    "wilson-gaps": (4.0, 1.9e-3, 0.013),
    "single-product": (3.0, 0.01, 0.11),
    "turn-slope": (2.0, 0.01, 0.11),
    "projected-places": (4.0, 9e-4, 6e-3),
    "grown-tree": (2.0, 30.0, 300.0),
    "regularised-rows": (-2.0, 3e-3, 0.2),
    "loaded-linkage": (1.0, 9e-5, 5e-3),
}


@pytest.mark.parametrize("name", POWERS)
def test_failures_grow_by_the_power_that_is_known(name: str) -> None:
    """Overshoot of displacements by the square of step times frequency, of speeds by the first
    power; the loss of a second-order method by the third; what stalls, beside second order, by the
    square of the steps; the error of a table that is left with first order, by the step; of rows
    that yield by the square of what they answer by; of a frequency without what loads turn, by
    these; of rotation vectors with one product by the third power of the step, and by the second
    where a slope of theirs is left out."""
    power, low, high = POWERS[name]
    inside = [(at, m) for at, m in measured_case(name).points if low <= at <= high]
    (first, least), (last, most) = inside[0], inside[-1]
    assert last > 5 * first
    assert math.log(most / least) / math.log(last / first) == pytest.approx(power, abs=0.1)


def test_same_numbers_every_time() -> None:
    again = mstmm.stability(
        ["product-length"], points=POINTS, tolerance=bracket_width("product-length")
    )
    assert again.cases[0] == measured_case("product-length")


def test_finer_settings_tell_the_same_frontier() -> None:
    fine = mstmm.stability(["product-pivot"], points=9, tolerance=0.003).cases[0]
    rough = measured_case("product-pivot")
    assert math.log(fine.fails_at / rough.fails_at) == pytest.approx(0.0, abs=1.0)
    assert np.log(fine.holds_at / fine.fails_at) < 0.0031
