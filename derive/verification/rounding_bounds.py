"""Running first-order bound of the rounding error of a kernel's outputs.

Each operation in doubles adds at most half a unit in the last place (a library function a whole
one) and passes on the errors of its operands times its slope.  The sum bounds the
difference between compiled C and the exact value, so that their comparison needs no tolerance
chosen by hand (N. J. Higham, Accuracy and Stability of Numerical Algorithms, SIAM 2002, ch. 3).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import mpmath

from mstmm.ir import OPERATIONS, Constant, KernelIR
from mstmm.ir.interpreter import Values, replay_kernel
from mstmm.ir.operations import Slope

from .kernel_evaluation import PreciseArithmetic

#: Unit roundoff of a double.
UNIT_ROUNDOFF = 2.0**-53

_DIGITS = 40


class BoundedValue:
    """An exact value and a bound of its absolute error, in units of the unit roundoff."""

    __slots__ = ("error", "value")

    def __init__(self, value: Any, error: Any) -> None:
        self.value, self.error = value, error

    def __add__(self, other: BoundedValue) -> BoundedValue:
        return _round_value(self.value + other.value, self.error + other.error)

    def __sub__(self, other: BoundedValue) -> BoundedValue:
        return _round_value(self.value - other.value, self.error + other.error)

    def __mul__(self, other: BoundedValue) -> BoundedValue:
        propagated_error = abs(self.value) * other.error + abs(other.value) * self.error
        return _round_value(self.value * other.value, propagated_error)

    def __neg__(self) -> BoundedValue:
        return BoundedValue(-self.value, self.error)

    def __abs__(self) -> BoundedValue:
        return BoundedValue(abs(self.value), self.error)

    def __gt__(self, other: BoundedValue) -> bool:
        return bool(self.value > other.value)


def _round_value(value: Any, error: Any, steps: int = 1) -> BoundedValue:
    return BoundedValue(value, error + steps * abs(value))


def rounding_bounds(
    kernel: KernelIR, inputs: Mapping[str, Values], n: int | None = None
) -> dict[str, list[tuple[mpmath.mpf, float]]]:
    """(value at 40 digits, bound) of every output: C computes the value to within the bound.

    Inputs count as exact.  Valid to first order, while rounding changes no comparison.
    Arguments and errors raised are those of `evaluate`.
    """
    results = replay_kernel(kernel, inputs, _BoundedArithmetic(), n)
    slack = 1.001 * UNIT_ROUNDOFF
    return {
        name: [(mpmath.mp.make_mpf(v.value._mpf_), slack * float(v.error) + 1e-300) for v in row]
        for name, row in results.items()
    }


class _BoundedArithmetic:
    """The operations of the IR on `BoundedValue` numbers."""

    def __init__(self) -> None:
        self._exact = exact = PreciseArithmetic(_DIGITS)
        operations = exact.operations

        def call(name: str, *args: Any) -> Any:
            return operations[name](*args)

        def carried_error(slope: Slope, value: Any, a: BoundedValue) -> Any:
            # An exact operand adds no error, even where the slope is unbounded.
            try:
                return a.error and abs(slope(call, value, (a.value,), (a.error,)))
            except ZeroDivisionError:
                return operations["div"](a.error, exact.number(0))

        def smooth(name: str, slope: Slope) -> Callable[[BoundedValue], BoundedValue]:
            def bounded_result(a: BoundedValue) -> BoundedValue:
                value = operations[name](a.value)
                return _round_value(value, carried_error(slope, value, a), 2)

            return bounded_result

        def divide(a: BoundedValue, b: BoundedValue) -> BoundedValue:
            value = operations["div"](a.value, b.value)
            return _round_value(
                value, operations["div"](a.error + abs(value) * b.error, abs(b.value))
            )

        def power(a: BoundedValue, b: BoundedValue) -> BoundedValue:
            value = operations["pow"](a.value, b.value)
            propagated_error = (
                a.error and abs(operations["div"](b.value * value, a.value)) * a.error
            )
            propagated_error += b.error and abs(operations["log"](a.value) * value) * b.error
            return _round_value(value, propagated_error, 2)

        def angle(a: BoundedValue, b: BoundedValue) -> BoundedValue:
            propagated_error = abs(b.value) * a.error + abs(a.value) * b.error
            propagated_error = propagated_error and propagated_error / (
                a.value * a.value + b.value * b.value
            )
            return _round_value(operations["atan2"](a.value, b.value), propagated_error, 2)

        def exactly(name: str) -> Callable[..., BoundedValue]:
            return lambda *args: BoundedValue(
                operations[name](*(a.value for a in args)), exact.number(0)
            )

        def choose(c: BoundedValue, a: BoundedValue, b: BoundedValue) -> BoundedValue:
            return a if self.true(c) else b

        rows = OPERATIONS.values()
        self.operations: dict[str, Callable[..., BoundedValue]] = {
            **{r.name: exactly(r.name) for r in rows if r.slope is None},
            **{
                r.name: smooth(r.name, r.slope) for r in rows if r.slope and r.is_c_library_function
            },
            "neg": lambda a: -a,
            "add": lambda a, b: a + b,
            "sub": lambda a, b: a - b,
            "mul": lambda a, b: a * b,
            "div": divide,
            "pow": power,
            "atan2": angle,
            "abs": abs,
            "min": lambda a, b: a if b > a else b,
            "max": lambda a, b: b if b > a else a,
            "select": choose,
        }

    def number(self, value: Any) -> BoundedValue:
        exact = self._exact.number(value)
        return BoundedValue(exact, self._exact.number(0))

    def constant(self, constant: Constant) -> BoundedValue:
        value = self._exact.constant(constant)
        return _round_value(value, self._exact.number(0), int(value != constant.number))

    def true(self, value: Any) -> bool:
        return self._exact.true(value.value)
