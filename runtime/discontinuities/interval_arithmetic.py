"""Interval arithmetic on arrays of cells: bounds of a function and of its derivative.

Bounds are rounded outwards, functions of the C library by four units in the last place, so that
every value computed in double precision is inside.  An empty interval, where a function has no
value, is nan.  R. E. Moore, Interval Analysis, Prentice-Hall (1966).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mstmm.array_validation import Array

_LIBRARY_ERROR = 1e-15


@dataclass(frozen=True)
class Interval:
    """Numbers between `lo` and `hi`: arrays of equal shape, or scalars that hold for all cells."""

    lo: Array
    hi: Array

    def __neg__(self) -> Interval:
        return Interval(-self.hi, -self.lo)

    def __add__(self, other: Interval) -> Interval:
        return _round_outward(self.lo + other.lo, self.hi + other.hi)

    def __sub__(self, other: Interval) -> Interval:
        return self + -other

    def __mul__(self, other: Interval) -> Interval:
        corners = (self.lo * other.lo, self.lo * other.hi, self.hi * other.lo, self.hi * other.hi)
        products = [np.where(np.isnan(x), 0.0, x) for x in corners]  # 0 times infinity
        product = _round_outward(np.minimum.reduce(products), np.maximum.reduce(products))
        return product._without(np.isnan(self.lo) | np.isnan(other.lo))

    def __truediv__(self, other: Interval) -> Interval:
        meets_zero = (other.lo <= 0) & (other.hi >= 0)
        safe_bounds = np.where(meets_zero, np.nan, other.lo), np.where(meets_zero, np.nan, other.hi)
        quotient = self * _round_outward(1 / safe_bounds[1], 1 / safe_bounds[0])
        lo, hi = (
            np.where(meets_zero, -np.inf, quotient.lo),
            np.where(meets_zero, np.inf, quotient.hi),
        )
        return Interval(lo, hi)._without(np.isnan(self.lo) | np.isnan(other.lo))

    def _without(self, empty: NDArray[np.bool_]) -> Interval:
        return Interval(np.where(empty, np.nan, self.lo), np.where(empty, np.nan, self.hi))

    @property
    def width(self) -> Array:
        """Width hi - lo; nan where empty."""
        return np.asarray(self.hi - self.lo)

    @property
    def contains_zero(self) -> NDArray[np.bool_]:
        """Mask of the intervals that contain zero."""
        return np.asarray((self.lo <= 0) & (self.hi >= 0))

    @property
    def is_one_sided(self) -> NDArray[np.bool_]:
        """Mask of the intervals whose numbers are all positive or all negative."""
        return np.asarray((self.lo > 0) | (self.hi < 0))

    def within(self, lo: float, hi: float) -> Interval:
        """Intersection with [lo, hi]."""
        clipped = Interval(np.maximum(self.lo, lo), np.minimum(self.hi, hi))
        return clipped._without((self.lo > hi) | (self.hi < lo))

    def hull(self, other: Interval) -> Interval:
        """Smallest interval that contains both intervals."""
        return Interval(np.fmin(self.lo, other.lo), np.fmax(self.hi, other.hi))

    def intersect(self, other: Interval) -> Interval:
        """Intersection of two intervals; where one is empty, the other one."""
        return Interval(np.fmax(self.lo, other.lo), np.fmin(self.hi, other.hi))

    def select(self, a: Interval, b: Interval) -> Interval:
        """`a` where this interval excludes zero, `b` where it is zero, else the hull of both."""
        union, is_nonzero, is_zero = a.hull(b), self.is_one_sided, (self.lo == 0) & (self.hi == 0)
        lo = np.where(is_nonzero, a.lo, np.where(is_zero, b.lo, union.lo))
        return Interval(lo, np.where(is_nonzero, a.hi, np.where(is_zero, b.hi, union.hi)))


def as_interval(value: ArrayLike) -> Interval:
    """Interval of width zero at each number."""
    numbers = np.asarray(value, dtype=np.float64)
    return Interval(numbers, numbers)


EVERYTHING = Interval(np.asarray(-np.inf), np.asarray(np.inf))


def _round_outward(lo: Array, hi: Array) -> Interval:
    return Interval(np.nextafter(lo, -np.inf), np.nextafter(hi, np.inf))


def _widen_library_result(lo: Array, hi: Array) -> Interval:
    """Widen results of the C library by its error, a few units in the last place."""
    return _round_outward(lo - _LIBRARY_ERROR * np.abs(lo), hi + _LIBRARY_ERROR * np.abs(hi))


def bound_increasing(function: Callable[[Array], Array], x: Interval) -> Interval:
    """Bounds of a non-decreasing function."""
    return _widen_library_result(function(x.lo), function(x.hi))


def bound_decreasing(function: Callable[[Array], Array], x: Interval) -> Interval:
    """Bounds of a non-increasing function."""
    return _widen_library_result(function(x.hi), function(x.lo))


def _contains_extremum(x: Interval, first: float) -> NDArray[np.bool_]:
    """Mask of the cells that contain a point first + 2 pi k."""
    tolerance = 4e-16 * np.maximum(np.abs(x.lo), np.abs(x.hi))
    a = np.floor((x.lo - tolerance - first) / (2 * np.pi))
    return np.asarray(np.floor((x.hi + tolerance - first) / (2 * np.pi)) != a)


def cos(x: Interval) -> Interval:
    """Bounds of the cosine."""
    end_values = np.cos(x.lo), np.cos(x.hi)
    bounds = _widen_library_result(np.minimum(*end_values), np.maximum(*end_values))
    lo, hi = (
        np.where(_contains_extremum(x, np.pi), -1.0, bounds.lo),
        np.where(_contains_extremum(x, 0.0), 1.0, bounds.hi),
    )
    return Interval(lo, hi)._without(np.isnan(x.lo))


def sin(x: Interval) -> Interval:
    """Bounds of the sine."""
    end_values = np.sin(x.lo), np.sin(x.hi)
    bounds = _widen_library_result(np.minimum(*end_values), np.maximum(*end_values))
    lo = np.where(_contains_extremum(x, -np.pi / 2), -1.0, bounds.lo)
    hi = np.where(_contains_extremum(x, np.pi / 2), 1.0, bounds.hi)
    return Interval(lo, hi)._without(np.isnan(x.lo))


def absolute(x: Interval) -> Interval:
    """Bounds of the absolute value."""
    abs_lo, abs_hi = np.abs(x.lo), np.abs(x.hi)
    return Interval(
        np.where(x.contains_zero, 0.0, np.minimum(abs_lo, abs_hi)), np.maximum(abs_lo, abs_hi)
    )


def integer_power(x: Interval, n: int) -> Interval:
    """Bounds of x^n for an integer n."""
    if n < 0:
        return as_interval(1.0) / integer_power(x, -n)
    if n % 2 == 0:
        size = absolute(x)
        return _widen_library_result(size.lo**n, size.hi**n).within(0.0, np.inf)
    return _widen_library_result(x.lo**n, x.hi**n)


def log(x: Interval) -> Interval:
    """Bounds of the natural logarithm; empty for negative numbers."""
    return bound_increasing(np.log, x.within(0.0, np.inf))


def sqrt(x: Interval) -> Interval:
    """Bounds of the square root; empty for negative numbers."""
    return bound_increasing(np.sqrt, x.within(0.0, np.inf))


def certainly_less(a: Interval, b: Interval, or_equal: bool) -> Interval:
    """1 where a < b (or a <= b) certainly holds, 0 where it cannot hold, else [0, 1]."""
    is_certain = a.hi <= b.lo if or_equal else a.hi < b.lo
    is_impossible = a.lo > b.hi if or_equal else a.lo >= b.hi
    return Interval(np.where(is_certain, 1.0, 0.0), np.where(is_impossible, 0.0, 1.0))
