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

from mstmm.arrays import Array

_LIBRARY = 1e-15


@dataclass(frozen=True)
class Interval:
    """Numbers between `lo` and `hi`: arrays of equal shape, or scalars that hold for all cells."""

    lo: Array
    hi: Array

    def __neg__(self) -> Interval:
        return Interval(-self.hi, -self.lo)

    def __add__(self, other: Interval) -> Interval:
        return _outward(self.lo + other.lo, self.hi + other.hi)

    def __sub__(self, other: Interval) -> Interval:
        return self + -other

    def __mul__(self, other: Interval) -> Interval:
        ends = (self.lo * other.lo, self.lo * other.hi, self.hi * other.lo, self.hi * other.hi)
        products = [np.where(np.isnan(x), 0.0, x) for x in ends]  # 0 times infinity
        found = _outward(np.minimum.reduce(products), np.maximum.reduce(products))
        return found._without(np.isnan(self.lo) | np.isnan(other.lo))

    def __truediv__(self, other: Interval) -> Interval:
        meets_zero = (other.lo <= 0) & (other.hi >= 0)
        safe = np.where(meets_zero, np.nan, other.lo), np.where(meets_zero, np.nan, other.hi)
        found = self * _outward(1 / safe[1], 1 / safe[0])
        lo, hi = np.where(meets_zero, -np.inf, found.lo), np.where(meets_zero, np.inf, found.hi)
        return Interval(lo, hi)._without(np.isnan(self.lo) | np.isnan(other.lo))

    def _without(self, empty: NDArray[np.bool_]) -> Interval:
        return Interval(np.where(empty, np.nan, self.lo), np.where(empty, np.nan, self.hi))

    @property
    def width(self) -> Array:
        """Width hi - lo; nan where empty."""
        return np.asarray(self.hi - self.lo)

    @property
    def meets_zero(self) -> NDArray[np.bool_]:
        """Mask of the intervals that contain zero."""
        return np.asarray((self.lo <= 0) & (self.hi >= 0))

    @property
    def is_one_sided(self) -> NDArray[np.bool_]:
        """Mask of the intervals whose numbers are all positive or all negative."""
        return np.asarray((self.lo > 0) | (self.hi < 0))

    def within(self, lo: float, hi: float) -> Interval:
        """Intersection with [lo, hi]."""
        found = Interval(np.maximum(self.lo, lo), np.minimum(self.hi, hi))
        return found._without((self.lo > hi) | (self.hi < lo))

    def hull(self, other: Interval) -> Interval:
        """Smallest interval that contains both intervals."""
        return Interval(np.fmin(self.lo, other.lo), np.fmax(self.hi, other.hi))

    def meet(self, other: Interval) -> Interval:
        """Intersection of two intervals; where one is empty, the other one."""
        return Interval(np.fmax(self.lo, other.lo), np.fmin(self.hi, other.hi))

    def where(self, a: Interval, b: Interval) -> Interval:
        """`a` where this interval excludes zero, `b` where it is zero, else the hull of both."""
        either, surely, never = a.hull(b), self.is_one_sided, (self.lo == 0) & (self.hi == 0)
        lo = np.where(surely, a.lo, np.where(never, b.lo, either.lo))
        return Interval(lo, np.where(surely, a.hi, np.where(never, b.hi, either.hi)))


def point(value: ArrayLike) -> Interval:
    """Interval of width zero at each number."""
    at = np.asarray(value, dtype=np.float64)
    return Interval(at, at)


EVERYTHING = Interval(np.asarray(-np.inf), np.asarray(np.inf))


def _outward(lo: Array, hi: Array) -> Interval:
    return Interval(np.nextafter(lo, -np.inf), np.nextafter(hi, np.inf))


def _library(lo: Array, hi: Array) -> Interval:
    """Widen results of the C library by its error, a few units in the last place."""
    return _outward(lo - _LIBRARY * np.abs(lo), hi + _LIBRARY * np.abs(hi))


def rising(function: Callable[[Array], Array], x: Interval) -> Interval:
    """Bounds of a non-decreasing function."""
    return _library(function(x.lo), function(x.hi))


def falling(function: Callable[[Array], Array], x: Interval) -> Interval:
    """Bounds of a non-increasing function."""
    return _library(function(x.hi), function(x.lo))


def _turns(x: Interval, first: float) -> NDArray[np.bool_]:
    """Mask of the cells that contain a point first + 2 pi k."""
    slack = 4e-16 * np.maximum(np.abs(x.lo), np.abs(x.hi))
    a = np.floor((x.lo - slack - first) / (2 * np.pi))
    return np.asarray(np.floor((x.hi + slack - first) / (2 * np.pi)) != a)


def cos(x: Interval) -> Interval:
    """Bounds of the cosine."""
    ends = np.cos(x.lo), np.cos(x.hi)
    found = _library(np.minimum(*ends), np.maximum(*ends))
    lo, hi = np.where(_turns(x, np.pi), -1.0, found.lo), np.where(_turns(x, 0.0), 1.0, found.hi)
    return Interval(lo, hi)._without(np.isnan(x.lo))


def sin(x: Interval) -> Interval:
    """Bounds of the sine."""
    ends = np.sin(x.lo), np.sin(x.hi)
    found = _library(np.minimum(*ends), np.maximum(*ends))
    lo = np.where(_turns(x, -np.pi / 2), -1.0, found.lo)
    hi = np.where(_turns(x, np.pi / 2), 1.0, found.hi)
    return Interval(lo, hi)._without(np.isnan(x.lo))


def absolute(x: Interval) -> Interval:
    """Bounds of the absolute value."""
    a, b = np.abs(x.lo), np.abs(x.hi)
    return Interval(np.where(x.meets_zero, 0.0, np.minimum(a, b)), np.maximum(a, b))


def whole_power(x: Interval, n: int) -> Interval:
    """Bounds of x^n for an integer n."""
    if n < 0:
        return point(1.0) / whole_power(x, -n)
    if n % 2 == 0:
        size = absolute(x)
        return _library(size.lo**n, size.hi**n).within(0.0, np.inf)
    return _library(x.lo**n, x.hi**n)


def log(x: Interval) -> Interval:
    """Bounds of the natural logarithm; empty for negative numbers."""
    return rising(np.log, x.within(0.0, np.inf))


def sqrt(x: Interval) -> Interval:
    """Bounds of the square root; empty for negative numbers."""
    return rising(np.sqrt, x.within(0.0, np.inf))


def less(a: Interval, b: Interval, or_equal: bool) -> Interval:
    """1 where a < b (or a <= b) certainly holds, 0 where it cannot hold, else [0, 1]."""
    surely = a.hi <= b.lo if or_equal else a.hi < b.lo
    never = a.lo > b.hi if or_equal else a.lo >= b.hi
    return Interval(np.where(surely, 1.0, 0.0), np.where(never, 0.0, 1.0))
