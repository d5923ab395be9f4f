"""Mechanical properties of hinge laws: forces from energies, no work on closed paths."""

from __future__ import annotations

import random
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import mpmath
from mpmath import mp

from .properties import (
    DIFFERENCES,
    DIGITS,
    Call,
    Matrix,
    Number,
    Property,
    Worst,
    column,
    derivatives,
    rotation,
    rows,
    some,
    turn_of,
)
from .samples import Source


def law_properties(
    call: Call, source: Source, kernels: Collection[str]
) -> Iterator[tuple[str, Property]]:
    """Yield (kernel, property) for each hinge law named in `kernels`."""
    for name, count in (("linear", 3), ("full", 11)):
        if name not in kernels:
            continue
        for found in _coordinate_law(call, source, name, count):
            yield name, found
    for name, count, places in (("rotation", 7, 0), ("six", 16, 3)):
        if name not in kernels:
            continue
        for found in _rotation_law(call, source, name, count, places):
            yield name, found


def _coordinate_law(call: Call, source: Source, name: str, count: int) -> tuple[Property, ...]:
    worst, numbers = Worst(), random.Random(19)
    with mp.workdps(DIGITS):
        for q in (0.25, 0.9, -0.7, -0.25):  # between the limits, beyond them, between them
            p = source.parameter_values(count, numbers)
            u, effort = some(2, numbers)
            _one_coordinate(call, name, p, (mpmath.mpf(q), u, effort), worst)
    return worst.properties()


def _one_coordinate(
    call: Call, name: str, p: list[float], state: tuple[Any, Any, Any], worst: Worst
) -> None:
    q, u, effort = state

    def law(t: Number, speed: Any, given: Any = 0) -> dict[str, list[Any]]:
        return call(name, {"p": p, "q": [q + t * speed], "u": [speed], "effort": [given]})

    now = mpmath.mpf(0)
    _, slope, _ = derivatives(lambda t: column(law(t, 1)["V"]))
    worst.see("tau = -dV/dq", law(now, 0)["tau"], [-slope[0]], DIFFERENCES)
    _, rate, _ = derivatives(lambda t: column(law(t, u)["V"]))
    here = law(now, u, effort)
    worst.see("P = tau u + dV/dt", here["P"], [here["tau"][0] * u + rate[0]], DIFFERENCES)
    lost = law(now, u)["P"][0]
    worst.see("dampers and friction dissipate energy", [max(lost, 0)], [0], 0.0)


@dataclass(frozen=True)
class _Rotational:
    """Law of a ball hinge (`places` = 0) or of a free hinge (3 translations first)."""

    call: Call
    name: str
    p: list[Any]
    axes: list[Any]
    places: int

    def __call__(
        self, q: Any, u: Any, effort: Any = None, reference: Any = 0
    ) -> dict[str, list[Any]]:
        inputs = {"p": self.p, "q": list(q), "u": list(u), "B": self.axes}
        inputs |= {"effort": list(effort or [0] * len(u)), "twist_ref": [reference]}
        return self.call(self.name, inputs)

    def without_dampers(self) -> _Rotational:
        p = self.p
        kept = [*p[:4], 0, 0, 0] if len(p) == 7 else [*p[:6], 0, 0, 0, *p[9:13], 0, 0, 0]
        return _Rotational(self.call, self.name, kept, self.axes, self.places)

    def moved(self, q: list[Any], u: list[Any], t: Number) -> list[Any]:
        """q after t at the velocity u (outboard axes), to second order."""
        turn, w = q[self.places :], u[self.places :]
        size = mpmath.sqrt(mpmath.fsum(x * x for x in turn))
        inboard = list(turn_of(column(turn) / size) * column(u[:3])) if self.places else []
        place = [x + t * v for x, v in zip(q[: self.places], inboard, strict=True)]
        return [*place, *times(turn, exponential([t * x for x in w]))]


def times(a: Sequence[Any], b: Sequence[Any]) -> list[Any]:
    """Product of two quaternions (w, x, y, z)."""
    w, x, y, z = a
    s, i, j, k = b
    return [
        w * s - x * i - y * j - z * k, w * i + x * s + y * k - z * j,
        w * j - x * k + y * s + z * i, w * k + x * j - y * i + z * s,
    ]  # fmt: skip


def exponential(vector: Sequence[Any]) -> list[Any]:
    """Quaternion of the rotation vector."""
    angle = mpmath.sqrt(mpmath.fsum(x * x for x in vector))
    if angle == 0:
        return [mpmath.mpf(1), *(mpmath.mpf(0) for _ in range(3))]
    return [mpmath.cos(angle / 2), *(x / angle * mpmath.sin(angle / 2) for x in vector)]


def _rotation_law(
    call: Call, source: Source, name: str, count: int, places: int
) -> tuple[Property, ...]:
    worst, numbers = Worst(), random.Random(23)
    with mp.workdps(DIGITS):
        for swing in (0.0, 0.05, 0.5, 2.0):
            p = [mpmath.mpf(x) for x in source.parameter_values(count, numbers)]
            axes = list(rotation(numbers))
            law = _Rotational(call, name, p, axes, places)
            q = [*some(places, numbers), *_turned(rows(axes, 3), swing, numbers)]
            _forces_from_energy(law.without_dampers(), q, worst)
            _power(law, q, numbers, worst)
        _closed_path(law.without_dampers(), worst)
    return worst.properties()


def _turned(axis: Matrix, swing: float, numbers: random.Random) -> list[Any]:
    """Quaternion of a random twist about the third column of `axis`, then a swing."""
    twist, size = mpmath.mpf(numbers.uniform(-3, 3)), mpmath.mpf(swing)
    twisted = exponential(list(axis * column([0, 0, twist])))
    return times(exponential(list(axis * column([size * 3 / 5, size * 4 / 5, 0]))), twisted)


def _forces_from_energy(law: _Rotational, q: list[Any], worst: Worst) -> None:
    nu = law.places + 3
    still = [0] * nu
    tau = law(q, still)["tau"]

    def slope(k: int) -> Number:
        unit = [int(i == k) for i in range(nu)]
        return derivatives(lambda t: column(law(law.moved(q, unit, t), still)["V"]))[1][0]

    slopes = [-slope(k) for k in range(nu)]
    worst.see("tau = -dV along the speeds", tau, slopes, DIFFERENCES)


def _power(law: _Rotational, q: list[Any], numbers: random.Random, worst: Worst) -> None:
    u, effort = some(law.places + 3, numbers), some(law.places + 3, numbers)
    _, rate, _ = derivatives(lambda t: column(law(law.moved(q, u, t), u)["V"]))
    here = law(q, u, effort)
    power = mpmath.fsum(a * b for a, b in zip(here["tau"], u, strict=True)) + rate[0]
    worst.see("P = tau . u + dV/dt", here["P"], [power], DIFFERENCES)
    worst.see("dampers dissipate energy", [max(law(q, u)["P"][0], 0)], [0], 0.0)


#: Points on the closed path; the trapezoidal rule converges exponentially on it.
_PATH = 192


def _closed_path(law: _Rotational, worst: Worst) -> None:
    """Work on a closed path through three half turns of twist each way, and the twist on it."""
    # In the axes of the law, so that the twist equals the angle along the path.
    identity = [1, 0, 0, 0, 1, 0, 0, 0, 1]
    path = _Rotational(law.call, law.name, law.p, identity, law.places)
    place, still = [0] * law.places, [0] * (law.places + 3)
    work, twists = mpmath.mpf(0), [mpmath.mpf(0)]
    with mp.workdps(40):
        for k in range(_PATH):
            turn, spin = _on_path(2 * mpmath.pi * k / _PATH)
            found = path([*place, *turn], still, None, twists[-1])
            twists += found["twist"]
            pairs = zip(found["tau"][law.places :], spin, strict=True)
            work += mpmath.fsum(a * b for a, b in pairs) * 2 * mpmath.pi / _PATH
        scale = law.p[-5] * (3 * mpmath.pi) ** 2 / 2
        worst.see("no work on a closed path", [work / scale], [0], 1e-12)
        beyond = 5 * mpmath.pi / 2  # well beyond one turn to either side
        unwrapped = [max(twists) > beyond, min(twists) < -beyond]
        worst.see("twist is unwrapped", unwrapped, [True, True], 0.0)


def _on_path(s: Number) -> tuple[list[Any], list[Any]]:
    """(quaternion, angular velocity in body axes) at s of the closed path, 0 <= s < 2 pi."""

    def turn(at: Number) -> list[Any]:
        wide = exponential([0, 0, 3 * mpmath.pi * mpmath.sin(at)])
        tilted = [mpmath.mpf(3) / 4 + mpmath.sin(2 * at) / 2, mpmath.cos(at) / 4, 0]
        return times(exponential(tilted), wide)

    step = mpmath.mpf(10) ** -12
    here, ends = turn(s), zip(turn(s + step), turn(s - step), strict=True)
    rate = [(a - b) / step for a, b in ends]  # twice the rate
    return here, times([here[0], *(-x for x in here[1:])], rate)[1:]
