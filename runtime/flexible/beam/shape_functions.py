"""Shapes along a beam: functions of x with their derivatives, stable for any number of half-waves.

The eigenfunctions of the uniform beam are sums of cos, sin, cosh and sinh of beta x/l.  The growing
exponential of cosh and sinh cancels but for a remainder that the end conditions fix, so it is
written as one that decays from the far end:

    phi = g e^(-beta (1 - xi)) + (1 + sigma)/2 e^(-beta xi) + s (cos(beta xi) - sigma sin(beta xi))

with xi = x/l.  From cosh - sigma sinh = (1 - sigma)/2 e^(beta xi) + (1 + sigma)/2 e^(-beta xi)
follows g = (1 - sigma)/2 e^beta, which is formed from sigma's quotient without the difference.
Each is scaled to int phi^2 dxi = 1.  Euler-Bernoulli theory, e.g. Rao, Vibration of Continuous
Systems, ch. 11.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array

_SQRT2 = math.sqrt(2.0)


class Shape(Protocol):
    """A function of x on 0 <= x <= length and its derivatives by x."""

    @property
    def breaks(self) -> tuple[float, ...]:
        """Places (m) between which the function is smooth, its own ends included."""

    @property
    def density(self) -> float:
        """Half-waves per metre between breaks, 0 for a low polynomial: how many Gauss points."""

    def __call__(self, x: Array, d: int = 0) -> Array:
        """Derivative number `d` (0 to 4) at every x (m)."""


@dataclass(frozen=True)
class _Constants:
    beta: float
    sigma: float
    growing: float  #: g
    sign: float  #: s


@lru_cache(maxsize=4096)
def root(kind: str, number: int) -> float:
    """beta: root of cos b = -sech b ("clamped-free") or cos b = +sech b ("free-free",
    "clamped-clamped"), by Newton's method on the equation without growing terms."""
    sign = 1.0 if kind == "clamped-free" else -1.0
    b = (number - 0.5 if kind == "clamped-free" else number + 0.5) * math.pi
    for _ in range(60):
        decaying = math.exp(-b)
        sech = 2.0 * decaying / (1.0 + decaying * decaying)
        step = (math.cos(b) + sign * sech) / (math.sin(b) + sign * sech * math.tanh(b))
        b += step
        if abs(step) <= 4e-16 * b:
            break
    return b


@lru_cache(maxsize=4096)
def _constants(kind: str, number: int) -> _Constants:
    b = root(kind, number)
    e, c, s = math.exp(-b), math.cos(b), math.sin(b)
    if kind == "clamped-free":
        below = 1.0 - e * e + 2.0 * e * s
        return _Constants(b, (1.0 + e * e + 2.0 * e * c) / below, (s - c - e) / below, -1.0)
    below = 1.0 - e * e - 2.0 * e * s
    return _Constants(
        b,
        (1.0 + e * e - 2.0 * e * c) / below,
        (c - s - e) / below,
        1.0 if kind == "free-free" else -1.0,
    )


#: sin(k pi/2) and cos(k pi/2).
_QUARTER = (0.0, 1.0, 0.0, -1.0)


@dataclass(frozen=True)
class Eigenfunction:
    """Bending shape number `number` of a uniform beam on start <= x <= end (m), zero outside.

    `kind` is "clamped-free" (clamped at `start`, or at `end` if `mirrored`), "free-free",
    "clamped-clamped" or "simply-supported".
    """

    kind: str
    number: int
    start: float
    end: float
    mirrored: bool = False
    closed: bool = True  #: its last section counts as inside

    @property
    def breaks(self) -> tuple[float, ...]:
        return (self.start, self.end)

    @property
    def density(self) -> float:
        return (self.number + 1.0) / (self.end - self.start)

    @property
    def beta(self) -> float:
        """Wave number times the length of the span."""
        if self.kind == "simply-supported":
            return self.number * math.pi
        return root(self.kind, self.number)

    def __call__(self, x: Array, d: int = 0) -> Array:
        span = self.end - self.start
        xi = ((self.end - x) if self.mirrored else (x - self.start)) / span
        scale = (-1.0 if self.mirrored and d % 2 else 1.0) / span**d
        inside = _inside(x, self.start, self.end, self.closed)
        return np.where(inside, scale * self._unit(np.clip(xi, 0.0, 1.0), d), 0.0)

    def _unit(self, xi: Array, d: int) -> Array:
        if self.kind == "simply-supported":
            b = self.beta
            return _SQRT2 * b**d * _wave(b * xi, d, 0.0, 1.0)
        k = _constants(self.kind, self.number)
        decaying = 0.5 * (1.0 + k.sigma) * (-1.0) ** d * np.exp(-k.beta * xi)
        growing = k.growing * np.exp(-k.beta * (1.0 - xi))
        return k.beta**d * (growing + decaying + k.sign * _wave(k.beta * xi, d, 1.0, -k.sigma))


def _wave(angle: Array, d: int, cosine: float, sine: float) -> Array:
    """Derivative number d of cosine cos(angle) + sine sin(angle) by the angle."""
    c, s = _QUARTER[(d + 1) % 4], _QUARTER[d % 4]
    return (cosine * c + sine * s) * np.cos(angle) + (sine * c - cosine * s) * np.sin(angle)


def _inside(x: Array, start: float, end: float, closed: bool) -> NDArray[np.bool_]:
    return (x >= start) & ((x <= end) if closed else (x < end))


@dataclass(frozen=True)
class Sine:
    """sqrt2 sin or sqrt2 cos of a rod in twist or in tension on start <= x <= end, zero outside.

    `kind`: "fixed-free" sin((k - 1/2) pi xi) (fixed at `end` if `mirrored`), "free-free"
    cos(k pi xi), "fixed-fixed" sin(k pi xi).
    """

    kind: str
    number: int
    start: float
    end: float
    mirrored: bool = False
    closed: bool = True  #: its last section counts as inside

    @property
    def breaks(self) -> tuple[float, ...]:
        return (self.start, self.end)

    @property
    def density(self) -> float:
        return self.number / (self.end - self.start)

    @property
    def beta(self) -> float:
        """Wave number times the length of the span."""
        return (self.number - 0.5 * (self.kind == "fixed-free")) * math.pi

    def __call__(self, x: Array, d: int = 0) -> Array:
        span = self.end - self.start
        xi = ((self.end - x) if self.mirrored else (x - self.start)) / span
        scale = (-1.0 if self.mirrored and d % 2 else 1.0) * _SQRT2 * (self.beta / span) ** d
        wave = (1.0, 0.0) if self.kind == "free-free" else (0.0, 1.0)
        inside = _inside(x, self.start, self.end, self.closed)
        return np.where(inside, scale * _wave(self.beta * np.clip(xi, 0.0, 1.0), d, *wave), 0.0)


class Piecewise:
    """Polynomials between nodes: `coefficients[i, j]` of (x - nodes[i])^j on piece i."""

    density = 0.0

    def __init__(self, nodes: Array, coefficients: Array) -> None:
        self.nodes = np.asarray(nodes, dtype=float)
        self.coefficients = np.asarray(coefficients, dtype=float)

    @property
    def breaks(self) -> tuple[float, ...]:
        return tuple(float(x) for x in self.nodes)

    def __call__(self, x: Array, d: int = 0) -> Array:
        piece = np.clip(np.searchsorted(self.nodes, x, side="right") - 1, 0, len(self.nodes) - 2)
        t = x - self.nodes[piece]
        value = np.zeros_like(t)
        for j in reversed(range(d, self.coefficients.shape[1])):
            value = value * t + math.perm(j, d) * self.coefficients[piece, j]
        return value


class ShiftedShape:
    """A shape less a rigid part: shape(x) - a - b x, which puts the floating frame elsewhere."""

    def __init__(self, shape: Shape, a: float, b: float) -> None:
        self.shape, self.a, self.b = shape, a, b

    @property
    def breaks(self) -> tuple[float, ...]:
        return self.shape.breaks

    @property
    def density(self) -> float:
        return self.shape.density

    def __call__(self, x: Array, d: int = 0) -> Array:
        value = self.shape(x, d)
        if d == 0:
            return value - self.a - self.b * x
        return value - self.b if d == 1 else value
