"""Sample points for comparing kernels: random and critical ones.

All values are doubles, so that exact and rounded evaluation start from the same numbers.  Pairs
of cosine and sine have sixty digits, since doubles would violate c^2 + s^2 = 1.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import mpmath

from mstmm.ir import KernelIR, Port, Solve
from mstmm.ir.element_spec import Param

Numbers = list[float]

#: Index of a quaternion's entry by the name of its coordinate: w, x, y, z or qw, qx, qy, qz.
_QUATERNION_LETTERS = "wxyz"
_SQRT_HALF = math.sqrt(0.5)

#: Angle of every angular coordinate, and the equivalent quaternion.
_ROTATIONS: dict[str, tuple[float, tuple[float, float, float, float]]] = {
    "rest": (0.0, (1.0, 0.0, 0.0, 0.0)),
    "quarter turn": (math.pi / 2, (_SQRT_HALF, _SQRT_HALF, 0.0, 0.0)),
    "quarter turn back": (-math.pi / 2, (_SQRT_HALF, 0.0, 0.0, -_SQRT_HALF)),
    "half turn": (math.pi, (0.0, 0.0, 1.0, 0.0)),
    "half turn back": (-math.pi, (0.0, -_SQRT_HALF, 0.0, _SQRT_HALF)),
}
_MASS_FACTORS = {"tiny masses": 1e-9, "huge masses": 1e9}
#: Ports that are zero at rest.
_MOTION_AND_LOAD_PORTS = frozenset(
    ("u", "s", "motion", "motion_I", "v", "w", "tau", "e", "effort", "eta", "etad")
)
#: Sizes at which kernels with a run-time size are compared.
_RUN_TIME_SIZES = (1, 2, 3, 5)
_INERTIA_PORTS = frozenset({"S", "M", "J", "J_I"})


@dataclass(frozen=True)
class Point:
    """Inputs of one kernel; `n` is its run-time size if it has one."""

    label: str
    inputs: dict[str, Numbers]
    n: int = 0


@dataclass(frozen=True)
class InputSampler:
    """Draws the inputs of an element's kernels."""

    kind: str
    coordinates: tuple[Param, ...]
    parameters: tuple[Param, ...]
    seed: int = 20261

    def points(self, kernel: KernelIR, count: int = 2) -> Iterator[Point]:
        """`count` random points, then the special ones that matter for this kernel.

        A kernel with a run-time size has them at several sizes.
        """
        numbers = random.Random(f"{self.seed} {kernel.name}")
        if kernel.size_symbol is not None:
            for n in _RUN_TIME_SIZES:
                yield Point(f"random, n = {n}", self._draw_inputs(kernel, numbers, n), n)
            rest_point = self._rest_point(kernel, numbers, _RUN_TIME_SIZES[-1])
            yield Point(
                f"{rest_point.label}, n = {_RUN_TIME_SIZES[-1]}",
                rest_point.inputs,
                _RUN_TIME_SIZES[-1],
            )
            return
        names = {port.name for port in kernel.inputs}
        for k in range(count):
            yield Point(f"random {k + 1}", self._draw_inputs(kernel, numbers))
        if {"coulomb", "swing"} & set(_law_kind(kernel)):
            yield from self._law_points(kernel, numbers)
            return
        yield self._rest_point(kernel, numbers)
        if self.kind == "hinge" and "q" in names:
            for label in list(_ROTATIONS)[1:]:
                inputs = self._draw_inputs(kernel, numbers)
                inputs["q"] = self.coordinate_values(numbers, label)
                yield Point(label, inputs)
        if names & _INERTIA_PORTS or (self.kind == "body" and "p" in names):
            for label, factor in _MASS_FACTORS.items():
                drawn = self._draw_inputs(kernel, numbers)
                yield Point(label, self._scale_inputs(drawn, factor))

    def _draw_inputs(
        self, kernel: KernelIR, numbers: random.Random, n: int = 0
    ) -> dict[str, Numbers]:
        return {port.name: self.draw(port, kernel, numbers, n) for port in kernel.inputs}

    def draw(self, port: Port, kernel: KernelIR, numbers: random.Random, n: int = 0) -> Numbers:
        """Draw an admissible random value of a port."""
        length = port.length(n)
        if any(isinstance(extent, str) for extent in port.shape):
            solved_matrices = {s.matrix for s in kernel.statements if isinstance(s, Solve)}
            return (
                _definite_matrix(n, numbers)
                if port.name in solved_matrices
                else _uniform_values(length, numbers)
            )
        if port.name == "p":
            return self.parameter_values(length, numbers)
        if port.name == "q" and self.kind == "hinge":
            return self.coordinate_values(numbers)
        if port.name == "q" and length in (4, 7):  # laws of ball and free hinges
            return [*_uniform_values(length - 4, numbers), *_unit_vector(4, numbers)]
        if port.shape == (3, 3) and port.name != "F_scale":
            return random_rotation(numbers)
        if port.name in ("S", "S_K", "J_I") and length <= 21:
            return _definite_triangle({21: 6, 6: 3, 1: 1}[length], numbers)
        if port.name in ("M", "J", "F_scale", "b"):
            return [numbers.uniform(0.2, 2.0) for _ in range(length)]
        if port.name in ("a", "a_n"):
            return _unit_vector(3, numbers)
        if port.name == "link" and length == 12:
            return [*random_rotation(numbers), *_uniform_values(3, numbers)]
        if port.name in ("turn", "link"):
            return _cosine_and_sine(numbers.uniform(-4.0, 4.0)) + _uniform_values(
                length - 2, numbers
            )
        return _uniform_values(length, numbers)

    def coordinate_values(self, numbers: random.Random, turn: str | None = None) -> Numbers:
        """q of a hinge: at random, or with every angle at one of the special turns."""
        values = []
        for c in self.coordinates:
            low, high = _draw_range(c, -2.0, 2.0)
            entry_index = (
                _QUATERNION_LETTERS.find(c.name[-1])
                if c.name[:-1] in ("", "q") and not c.unit
                else -1
            )
            value = numbers.uniform(low, high)
            if turn is not None and entry_index >= 0:
                value = _ROTATIONS[turn][1][entry_index]
            elif turn is not None and (c.unit == "rad" or turn == "rest"):
                value = min(max(_ROTATIONS[turn][0], low if c.minimum is not None else -math.inf),
                            high if c.maximum is not None else math.inf)  # fmt: skip
            values.append(value)
        return values

    def parameter_values(self, length: int, numbers: random.Random) -> Numbers:
        """p of a kernel with `length` parameters, within the declared bounds."""
        if self.kind == "sweep":
            return _draw_law_parameters(length, numbers)
        values = []
        for p in self.parameters:
            low, high = _draw_range(p, -1.0, 1.0)
            values.append(numbers.uniform(low + (high - low) / 20, high))
        if length == len(values) + 12:  # the frame of a user's body
            values += [*random_rotation(numbers), *_uniform_values(3, numbers)]
        return values

    def _rest_point(self, kernel: KernelIR, numbers: random.Random, n: int = 0) -> Point:
        """Point without motion, rotation or load: only parameters and inertias."""
        inputs = {}
        for port in kernel.inputs:
            values = self.draw(port, kernel, numbers, n)
            if port.name == "q" and self.kind == "hinge":
                values = self.coordinate_values(numbers, "rest")
            elif port.shape == (3, 3) and port.name != "F_scale":
                values = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
            elif port.name in ("turn", "link"):
                values[:2] = [1.0, 0.0]
            elif port.name in _MOTION_AND_LOAD_PORTS:
                values = [0.0] * port.length(n)
            inputs[port.name] = values
        return Point("rest", inputs)

    def _scale_inputs(self, inputs: dict[str, Numbers], factor: float) -> dict[str, Numbers]:
        scaled_ports = _INERTIA_PORTS | ({"p"} if self.kind == "body" else set())
        parameter_count = len(self.parameters)
        return {
            name: [
                factor * v if i < parameter_count or name != "p" else v for i, v in enumerate(row)
            ]
            if name in scaled_ports
            else row
            for name, row in inputs.items()
        }

    # --- laws -----------------------------------------------------------------------------------

    def _law_points(self, kernel: KernelIR, numbers: random.Random) -> Iterator[Point]:
        special = _swing_points if "swing" in _law_kind(kernel) else _limit_points
        for label, change in special():
            inputs = self._draw_inputs(kernel, numbers)
            change(inputs)
            yield Point(label, inputs)


def _law_kind(kernel: KernelIR) -> tuple[str, ...]:
    names = {port.name for port in kernel.inputs}
    if "twist_ref" in names:
        return ("swing",)
    p = next((port for port in kernel.inputs if port.name == "p"), None)
    return ("coulomb",) if p is not None and p.length() == 11 and "q" in names else ()


def _draw_law_parameters(length: int, numbers: random.Random) -> Numbers:
    """Positive numbers; friction (3..6) and limits (7, 8) of the full law are ordered."""
    p = [numbers.uniform(0.2, 2.0) for _ in range(length)]
    if length == 11:
        p[7:9] = [-0.5, 0.75]
    return p


Change = Callable[[dict[str, Numbers]], None]


def _limit_points() -> Iterator[tuple[str, Change]]:
    def state_change(q: float, u: float | None = None) -> Change:
        def change(inputs: dict[str, Numbers]) -> None:
            inputs["q"] = [q]
            if u is not None:
                inputs["u"] = [u]

        return change

    yield "no speed", state_change(0.25, 0.0)
    yield "tiny speed", state_change(0.25, 1e-200)
    yield "fast", state_change(0.25, 1e8)
    yield "into the upper limit", state_change(0.875, 0.5)
    yield "into the lower limit", state_change(-0.875, -0.5)
    yield "thrown off the upper limit", state_change(0.8125, -1e3)
    yield "on the limit", state_change(0.75)
    yield "on the lower limit, still", state_change(-0.5, 0.0)

    def remove_limits(inputs: dict[str, Numbers]) -> None:
        inputs["p"][7:9] = [-1e300, 1e300]

    yield "no limits", remove_limits


def _swing_points() -> Iterator[tuple[str, Change]]:
    def rotation_change(
        share: float, direction: float, twist: float, reference: float = 0.0, still: bool = False
    ) -> Change:
        """Squared half-sine of the swing, its direction, the twist."""

        def change(inputs: dict[str, Numbers]) -> None:
            inputs["B"] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
            outer, inner = math.sqrt(share), math.sqrt(1 - share)
            inputs["q"][-4:] = [
                inner * math.cos(twist / 2), outer * math.cos(direction),
                outer * math.sin(direction), inner * math.sin(twist / 2),
            ]  # fmt: skip
            inputs["twist_ref"] = [reference]
            if still:
                inputs["u"] = [0.0] * len(inputs["u"])

        return change

    yield "no rotation", rotation_change(0.0, 0.0, 0.0, still=True)
    yield "twist alone", rotation_change(0.0, 0.0, 1.25)
    yield "tiny swing", rotation_change(1e-30, 0.5, -0.5)
    yield "below the switch of the series", rotation_change(0.01 * (1 - 1e-9), 0.5, 0.75)
    yield "above the switch of the series", rotation_change(0.01 * (1 + 1e-9), 0.5, 0.75)
    yield "wide swing", rotation_change(0.995, 2.0, 0.5)
    yield "three turns of twist", rotation_change(0.25, 1.0, 0.5, 6 * math.pi + 0.4)
    yield "turns back", rotation_change(0.25, 1.0, -0.5, -8 * math.pi + 0.4)


# --- numbers ----------------------------------------------------------------------------------


def _draw_range(p: Param, low: float, high: float) -> tuple[float, float]:
    low = p.minimum if p.minimum is not None else min(low, (p.maximum or 0.0) - 2.0)
    return low, p.maximum if p.maximum is not None else max(high, low + 2.0)


def _uniform_values(count: int, numbers: random.Random) -> Numbers:
    return [numbers.uniform(-1.0, 1.0) for _ in range(count)]


def _cosine_and_sine(angle: float) -> list[Any]:
    with mpmath.workdps(60):
        return [mpmath.cos(angle), mpmath.sin(angle)]


def _unit_vector(count: int, numbers: random.Random) -> Numbers:
    values = [numbers.gauss(0.0, 1.0) for _ in range(count)]
    size = math.sqrt(sum(v * v for v in values))
    return [v / size for v in values]


def random_rotation(numbers: random.Random) -> Numbers:
    """A random rotation matrix, row by row, orthogonal to 60 digits (some kernels rely on it)."""
    with mpmath.workdps(60):
        w, x, y, z = (mpmath.mpf(numbers.gauss(0.0, 1.0)) for _ in range(4))
        s = 2 / (w * w + x * x + y * y + z * z)
        return [
            1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y),
            s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x),
            s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y),
        ]  # fmt: skip


def _definite_matrix(n: int, numbers: random.Random) -> Numbers:
    """Symmetric matrix with eigenvalues of at least 1, row by row."""
    upper = iter(_definite_triangle(n, numbers))
    rows = [[0.0] * n for _ in range(n)]
    for i in range(n):
        for j in range(i, n):
            rows[i][j] = rows[j][i] = next(upper)
    return [value for row in rows for value in row]


def _definite_triangle(n: int, numbers: random.Random) -> Numbers:
    """Upper triangle of a symmetric matrix with eigenvalues of at least 1."""
    half = [_uniform_values(n, numbers) for _ in range(n)]
    return [
        math.fsum(a * b for a, b in zip(half[i], half[j], strict=True)) + (i == j)
        for i in range(n)
        for j in range(i, n)
    ]
