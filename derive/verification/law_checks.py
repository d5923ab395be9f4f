"""Mechanical properties of hinge laws: forces from energies, no work on closed paths."""

from __future__ import annotations

import random
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import mpmath
from mpmath import mp

from .mechanics_checks import (
    DIGITS,
    MAX_DIFFERENCE_ERROR,
    Call,
    Matrix,
    Number,
    Property,
    WorstErrors,
    central_differences,
    column_vector,
    matrix_of_rows,
    random_numbers,
    random_rotation,
    rotation_of_quaternion,
)
from .sample_points import InputSampler


def law_properties(
    call: Call, source: InputSampler, kernels: Collection[str]
) -> Iterator[tuple[str, Property]]:
    """Yield (kernel, property) for each hinge law named in `kernels`."""
    for name, count in (("linear", 3), ("full", 11)):
        if name not in kernels:
            continue
        for law_property in _coordinate_law_properties(call, source, name, count):
            yield name, law_property
    for name, count, translation_count in (("rotation", 7, 0), ("six", 16, 3)):
        if name not in kernels:
            continue
        for law_property in _rotation_law_properties(call, source, name, count, translation_count):
            yield name, law_property


def _coordinate_law_properties(
    call: Call, source: InputSampler, name: str, count: int
) -> tuple[Property, ...]:
    errors, numbers = WorstErrors(), random.Random(19)
    with mp.workdps(DIGITS):
        for q in (0.25, 0.9, -0.7, -0.25):  # between the limits, beyond them, between them
            p = source.parameter_values(count, numbers)
            u, effort = random_numbers(2, numbers)
            _check_coordinate_law(call, name, p, (mpmath.mpf(q), u, effort), errors)
    return errors.properties()


def _check_coordinate_law(
    call: Call, name: str, p: list[float], state: tuple[Any, Any, Any], worst: WorstErrors
) -> None:
    q, u, effort = state

    def law(t: Number, speed: Any, given: Any = 0) -> dict[str, list[Any]]:
        return call(name, {"p": p, "q": [q + t * speed], "u": [speed], "effort": [given]})

    start_time = mpmath.mpf(0)
    _, slope, _ = central_differences(lambda t: column_vector(law(t, 1)["V"]))
    worst.record("tau = -dV/dq", law(start_time, 0)["tau"], [-slope[0]], MAX_DIFFERENCE_ERROR)
    _, rate, _ = central_differences(lambda t: column_vector(law(t, u)["V"]))
    values = law(start_time, u, effort)
    worst.record(
        "P = tau u + dV/dt", values["P"], [values["tau"][0] * u + rate[0]], MAX_DIFFERENCE_ERROR
    )
    friction_power = law(start_time, u)["P"][0]
    worst.record("dampers and friction dissipate energy", [max(friction_power, 0)], [0], 0.0)


@dataclass(frozen=True)
class _RotationLaw:
    """Law of a ball hinge (`translation_count` = 0) or of a free hinge (3 translations first)."""

    call: Call
    name: str
    p: list[Any]
    axes: list[Any]
    translation_count: int

    def __call__(
        self, q: Any, u: Any, effort: Any = None, reference: Any = 0
    ) -> dict[str, list[Any]]:
        inputs = {"p": self.p, "q": list(q), "u": list(u), "B": self.axes}
        inputs |= {"effort": list(effort or [0] * len(u)), "twist_ref": [reference]}
        return self.call(self.name, inputs)

    def without_dampers(self) -> _RotationLaw:
        p = self.p
        undamped_parameters = (
            [*p[:4], 0, 0, 0] if len(p) == 7 else [*p[:6], 0, 0, 0, *p[9:13], 0, 0, 0]
        )
        return _RotationLaw(
            self.call, self.name, undamped_parameters, self.axes, self.translation_count
        )

    def advance(self, q: list[Any], u: list[Any], t: Number) -> list[Any]:
        """q after t at the velocity u (outboard axes), to second order."""
        turn, w = q[self.translation_count :], u[self.translation_count :]
        size = mpmath.sqrt(mpmath.fsum(x * x for x in turn))
        inboard = (
            list(rotation_of_quaternion(column_vector(turn) / size) * column_vector(u[:3]))
            if self.translation_count
            else []
        )
        translations = [
            x + t * v for x, v in zip(q[: self.translation_count], inboard, strict=True)
        ]
        return [*translations, *quaternion_product(turn, rotation_quaternion([t * x for x in w]))]


def quaternion_product(a: Sequence[Any], b: Sequence[Any]) -> list[Any]:
    """Product of two quaternions (w, x, y, z)."""
    w, x, y, z = a
    s, i, j, k = b
    return [
        w * s - x * i - y * j - z * k, w * i + x * s + y * k - z * j,
        w * j - x * k + y * s + z * i, w * k + x * j - y * i + z * s,
    ]  # fmt: skip


def rotation_quaternion(vector: Sequence[Any]) -> list[Any]:
    """Quaternion of the rotation vector."""
    angle = mpmath.sqrt(mpmath.fsum(x * x for x in vector))
    if angle == 0:
        return [mpmath.mpf(1), *(mpmath.mpf(0) for _ in range(3))]
    return [mpmath.cos(angle / 2), *(x / angle * mpmath.sin(angle / 2) for x in vector)]


def _rotation_law_properties(
    call: Call, source: InputSampler, name: str, count: int, places: int
) -> tuple[Property, ...]:
    errors, numbers = WorstErrors(), random.Random(23)
    with mp.workdps(DIGITS):
        for swing in (0.0, 0.05, 0.5, 2.0):
            p = [mpmath.mpf(x) for x in source.parameter_values(count, numbers)]
            axes = list(random_rotation(numbers))
            law = _RotationLaw(call, name, p, axes, places)
            q = [
                *random_numbers(places, numbers),
                *_swing_twist_quaternion(matrix_of_rows(axes, 3), swing, numbers),
            ]
            _check_forces_from_energy(law.without_dampers(), q, errors)
            _check_power(law, q, numbers, errors)
        _check_closed_path(law.without_dampers(), errors)
    return errors.properties()


def _swing_twist_quaternion(axis: Matrix, swing: float, numbers: random.Random) -> list[Any]:
    """Quaternion of a random twist about the third column of `axis`, then a swing."""
    twist, size = mpmath.mpf(numbers.uniform(-3, 3)), mpmath.mpf(swing)
    twist_quaternion = rotation_quaternion(list(axis * column_vector([0, 0, twist])))
    return quaternion_product(
        rotation_quaternion(list(axis * column_vector([size * 3 / 5, size * 4 / 5, 0]))),
        twist_quaternion,
    )


def _check_forces_from_energy(law: _RotationLaw, q: list[Any], worst: WorstErrors) -> None:
    nu = law.translation_count + 3
    zero_speeds = [0] * nu
    tau = law(q, zero_speeds)["tau"]

    def slope(k: int) -> Number:
        unit = [int(i == k) for i in range(nu)]
        return central_differences(
            lambda t: column_vector(law(law.advance(q, unit, t), zero_speeds)["V"])
        )[1][0]

    slopes = [-slope(k) for k in range(nu)]
    worst.record("tau = -dV along the speeds", tau, slopes, MAX_DIFFERENCE_ERROR)


def _check_power(
    law: _RotationLaw, q: list[Any], numbers: random.Random, worst: WorstErrors
) -> None:
    u, effort = (
        random_numbers(law.translation_count + 3, numbers),
        random_numbers(law.translation_count + 3, numbers),
    )
    _, rate, _ = central_differences(lambda t: column_vector(law(law.advance(q, u, t), u)["V"]))
    values = law(q, u, effort)
    power = mpmath.fsum(a * b for a, b in zip(values["tau"], u, strict=True)) + rate[0]
    worst.record("P = tau . u + dV/dt", values["P"], [power], MAX_DIFFERENCE_ERROR)
    worst.record("dampers dissipate energy", [max(law(q, u)["P"][0], 0)], [0], 0.0)


#: Points on the closed path; the trapezoidal rule converges exponentially on it.
_PATH_POINT_COUNT = 192


def _check_closed_path(law: _RotationLaw, worst: WorstErrors) -> None:
    """Work on a closed path through three half turns of twist each way, and the twist on it."""
    # In the axes of the law, so that the twist equals the angle along the path.
    identity = [1, 0, 0, 0, 1, 0, 0, 0, 1]
    path = _RotationLaw(law.call, law.name, law.p, identity, law.translation_count)
    translations, zero_speeds = [0] * law.translation_count, [0] * (law.translation_count + 3)
    work, twists = mpmath.mpf(0), [mpmath.mpf(0)]
    with mp.workdps(40):
        for k in range(_PATH_POINT_COUNT):
            turn, spin = _path_point(2 * mpmath.pi * k / _PATH_POINT_COUNT)
            values = path([*translations, *turn], zero_speeds, None, twists[-1])
            twists += values["twist"]
            pairs = zip(values["tau"][law.translation_count :], spin, strict=True)
            work += mpmath.fsum(a * b for a, b in pairs) * 2 * mpmath.pi / _PATH_POINT_COUNT
        scale = law.p[-5] * (3 * mpmath.pi) ** 2 / 2
        worst.record("no work on a closed path", [work / scale], [0], 1e-12)
        full_twist = 5 * mpmath.pi / 2  # well beyond one turn to either side
        is_unwrapped = [max(twists) > full_twist, min(twists) < -full_twist]
        worst.record("twist is unwrapped", is_unwrapped, [True, True], 0.0)


def _path_point(s: Number) -> tuple[list[Any], list[Any]]:
    """(quaternion, angular velocity in body axes) at s of the closed path, 0 <= s < 2 pi."""

    def rotation_at(at: Number) -> list[Any]:
        twist_quaternion = rotation_quaternion([0, 0, 3 * mpmath.pi * mpmath.sin(at)])
        swing_vector = [mpmath.mpf(3) / 4 + mpmath.sin(2 * at) / 2, mpmath.cos(at) / 4, 0]
        return quaternion_product(rotation_quaternion(swing_vector), twist_quaternion)

    step = mpmath.mpf(10) ** -12
    quaternion, neighbours = (
        rotation_at(s),
        zip(rotation_at(s + step), rotation_at(s - step), strict=True),
    )
    rate = [(a - b) / step for a, b in neighbours]  # twice the rate
    return quaternion, quaternion_product([quaternion[0], *(-x for x in quaternion[1:])], rate)[1:]
