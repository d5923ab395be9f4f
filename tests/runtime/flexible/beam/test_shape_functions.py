"""Shapes against 400-digit arithmetic, and their closed forms against Gauss quadrature."""

from __future__ import annotations

from functools import cache
from typing import Any

import mpmath
import numpy as np
import pytest

from mstmm.runtime.flexible.beam.gauss_quadrature import gauss_points
from mstmm.runtime.flexible.beam.shape_functions import (
    Eigenfunction,
    Piecewise,
    Shape,
    Sine,
    wave_number,
)

BENDING = ("clamped-free", "free-free", "clamped-clamped")


@cache
def exact(kind: str, number: int) -> tuple[Any, Any]:
    """(beta, function of (xi, d)) from cosh, sinh, cos, sin at 400 digits."""
    with mpmath.workdps(400):
        sign = 1 if kind == "clamped-free" else -1
        start = (number - 0.5 if sign > 0 else number + 0.5) * mpmath.pi
        beta = mpmath.findroot(lambda b: mpmath.cos(b) + sign / mpmath.cosh(b), start)
        below = mpmath.sinh(beta) + sign * mpmath.sin(beta)
        sigma = (mpmath.cosh(beta) + sign * mpmath.cos(beta)) / below
    s = 1 if kind == "free-free" else -1

    def value(xi: float, d: int) -> float:
        with mpmath.workdps(400):
            y = beta * mpmath.mpf(xi)
            even, odd = mpmath.cosh(y), mpmath.sinh(y)
            if d % 2:
                even, odd = odd, even
            shift = d * mpmath.pi / 2
            wave = mpmath.cos(y + shift) - sigma * mpmath.sin(y + shift)
            return float(even - sigma * odd + s * wave)

    return beta, value


def integral(function: Any) -> float:
    x, w = gauss_points((0.0, 1.0), lambda a, b: 80.0)
    return float(w @ function(x))


@pytest.mark.parametrize("kind", BENDING)
@pytest.mark.parametrize("number", [1, 2, 11, 13, 50, 100])
def test_shapes_and_four_derivatives_keep_all_digits(kind: str, number: int) -> None:
    beta, value = exact(kind, number)
    assert wave_number(kind, number) == pytest.approx(float(beta), rel=4e-16)
    shape = Eigenfunction(kind, number, 0.0, 1.0)
    places = np.array([0.0, 0.013, 0.21, 0.5, 0.77, 0.99, 1.0])
    for d in range(5):
        reference = np.array([value(x, d) for x in places])
        found = shape(places, d) / wave_number(kind, number) ** d
        assert np.abs(found - reference).max() < 5e-14


def test_roots_are_those_of_the_tables() -> None:
    clamped = [1.8751040687, 4.6940911330, 7.8547574382]
    free = [4.7300407449, 7.8532046241, 10.9956078380]
    assert [wave_number("clamped-free", k) for k in (1, 2, 3)] == pytest.approx(clamped, abs=6e-11)
    assert [wave_number("free-free", k) for k in (1, 2, 3)] == pytest.approx(free, abs=6e-11)


@pytest.mark.parametrize("k", [1, 2, 5, 12, 40])
def test_closed_forms_of_the_clamped_beam(k: int) -> None:
    shape, beta = Eigenfunction("clamped-free", k, 0.0, 1.0), wave_number("clamped-free", k)
    sigma = float((mpmath.cosh(beta) + mpmath.cos(beta)) / (mpmath.sinh(beta) + mpmath.sin(beta)))
    end = np.array([1.0])
    assert integral(shape) == pytest.approx(2 * sigma / beta, abs=1e-14)
    assert integral(lambda x: x * shape(x)) == pytest.approx(2 / beta**2, abs=1e-14)
    assert shape(end)[0] == pytest.approx(2 * (-1) ** (k + 1), abs=1e-13)
    assert shape(end, 1)[0] == pytest.approx(2 * sigma * beta * (-1) ** (k + 1), rel=1e-13)
    assert np.abs(shape(end, 2) / beta**2).max() < 2e-13
    assert np.abs(shape(end, 3) / beta**3).max() < 2e-13
    assert np.abs(shape(np.zeros(1), 1)).max() < 1e-13 * beta
    assert integral(lambda x: shape(x, 2) ** 2) == pytest.approx(beta**4, rel=2e-13)


@pytest.mark.parametrize("k", [1, 2, 5, 12, 40])
def test_closed_forms_of_free_and_supported_beams(k: int) -> None:
    free, beta = Eigenfunction("free-free", k, 0.0, 1.0), wave_number("free-free", k)
    assert abs(integral(free)) < 1e-14
    assert abs(integral(lambda x: x * free(x))) < 1e-14
    assert free(np.array([0.0, 1.0])) == pytest.approx([2.0, 2.0 * (-1) ** (k + 1)], abs=1e-13)
    held = Eigenfunction("simply-supported", k, 0.0, 1.0)
    odd = 1 - (-1) ** k
    assert integral(held) == pytest.approx(np.sqrt(2) * odd / (k * np.pi), abs=1e-14)
    assert integral(lambda x: x * held(x)) == pytest.approx(
        -np.sqrt(2) * (-1) ** k / (k * np.pi), abs=1e-14
    )
    for shape, b in ((free, beta), (held, k * np.pi)):
        assert integral(lambda x, s=shape: s(x, 2) ** 2) == pytest.approx(b**4, rel=2e-13)
        assert integral(lambda x, s=shape: s(x) ** 2) == pytest.approx(1.0, rel=1e-13)


@pytest.mark.parametrize("kind", BENDING)
def test_shapes_are_orthonormal_far_beyond_the_textbook_form(kind: str) -> None:
    x, w = gauss_points((0.0, 1.0), lambda a, b: 41.0)
    values = np.array([Eigenfunction(kind, k, 0.0, 1.0)(x) for k in range(1, 41)])
    assert np.abs((values * w) @ values.T - np.eye(40)).max() < 2e-13


def test_a_mirrored_shape_is_the_shape_seen_from_the_other_end() -> None:
    x = np.linspace(2.0, 5.0, 17)
    plain, mirrored = (Eigenfunction("clamped-free", 3, 2.0, 5.0, m) for m in (False, True))
    for d in range(5):
        assert mirrored(x, d) == pytest.approx((-1) ** d * plain(7.0 - x, d), abs=1e-12 * 4**d)
    outside = np.array([1.9, 5.1])
    assert not mirrored(outside).any()


@pytest.mark.parametrize(
    ("kind", "zero_at_start", "zero_at_end"),
    [("fixed-free", 0, 1), ("free-free", 1, 1), ("fixed-fixed", 0, 0)],
)
def test_rods_meet_their_end_conditions(kind: str, zero_at_start: int, zero_at_end: int) -> None:
    for k in (1, 2, 7):
        rod = Sine(kind, k, 1.0, 3.0)
        assert abs(rod(np.array([1.0]), zero_at_start)[0]) < 1e-12
        assert abs(rod(np.array([3.0]), zero_at_end)[0]) < 1e-12 * k
        square = integral(lambda t, r=rod: r(1.0 + 2.0 * t) ** 2)
        assert square == pytest.approx(1.0, rel=1e-13)


@pytest.mark.parametrize(
    "shape",
    [
        Eigenfunction("free-free", 4, 0.5, 2.5),
        Sine("fixed-free", 3, 0.5, 2.5, True),
        Piecewise(np.array([0.5, 1.0, 2.5]), np.array([[1.0, -2, 3, 0.5], [0.3, 1, -1, 2]])),
    ],
)
def test_derivatives_are_those_of_the_function(shape: Shape) -> None:
    x, step = np.linspace(1.1, 2.4, 11), 1e-5
    for d in range(3):
        difference = (shape(x + step, d) - shape(x - step, d)) / (2 * step)
        size = np.abs(shape(x, d + 1)).max()
        assert difference == pytest.approx(shape(x, d + 1), abs=1e-7 * size)
