"""Evaluation of a KernelIR at any precision (mpmath); `mstmm.ir.interpreter` uses floats.

Both execute the same statements in the same order; only the arithmetic differs.  Operations outside
their real domain give NaN or infinity as in IEEE arithmetic, never an exception.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from functools import lru_cache
from typing import Any

import mpmath

from mstmm.ir import OPERATIONS, Constant, KernelIR
from mstmm.ir.interpreter import Values, replay_kernel
from mstmm.ir.operations import Slope, is_true

Function = Callable[..., Any]


def evaluate(
    kernel: KernelIR, inputs: Mapping[str, Values], digits: int = 50, n: int | None = None
) -> dict[str, list[mpmath.mpf]]:
    """Outputs of the kernel at `digits` decimal digits, each a flat list, row-major.

    `inputs[port]` is a number or a nested or flat sequence of int, float, Fraction, str or mpf;
    floats count as exact numbers.  `n` is the run-time size of a kernel that has
    one.  An output flagged `accumulate` holds the increment; an entry that is never stored is 0.
    Values without a port of that name are ignored.
    Raises GuardFailure, and ValueError for a missing input, a wrong length or no `n`.
    """
    arithmetic = PreciseArithmetic(digits)
    results = replay_kernel(kernel, inputs, arithmetic, n)
    return {name: [mpmath.mp.make_mpf(v._mpf_) for v in row] for name, row in results.items()}


# --- arithmetic of mpmath -------------------------------------------------------------------------


@lru_cache(maxsize=16)
def _make_context(digits: int) -> Any:
    """mpmath context with its own precision, leaving the global precision unchanged."""
    context = mpmath.MPContext()
    context.dps = digits
    return context


class PreciseArithmetic:
    """mpmath arithmetic with `digits` decimal digits."""

    def __init__(self, digits: int) -> None:
        self._context = context = _make_context(digits)

        def real(function: Function) -> Function:
            """Return NaN for a complex value and infinity at a pole."""

            def call(*operands: Any) -> Any:
                try:
                    value = function(*operands)
                except ZeroDivisionError:
                    return context.inf
                return value if isinstance(value, context.mpf) else context.nan

            return call

        def divide(a: Any, b: Any) -> Any:
            if b != 0:
                return a / b
            return context.nan if a == 0 or context.isnan(a) else context.sign(a) * context.inf

        def power(a: Any, b: Any) -> Any:
            fractional = context.isinf(b) or b != context.floor(b)
            base = abs(a) if fractional and (context.isinf(a) or context.isinf(b)) else a
            return context.one if base == 1 or b == 0 else real(context.power)(base, b)

        def angle(a: Any, b: Any) -> Any:
            if context.isnan(a) or context.isnan(b):
                return context.nan
            if context.isinf(a) and context.isinf(b):
                a, b = context.sign(a), context.sign(b)
            return real(context.atan2)(a, b)

        library = [name for name, row in OPERATIONS.items() if row.is_c_library_function]
        self.operations: dict[str, Function] = {
            **{name: row.value for name, row in OPERATIONS.items()},
            **{name: real(getattr(context, name)) for name in library},
            "div": divide,
            "pow": power,
            "atan2": angle,
            "log": lambda a: -context.inf if a == 0 else real(context.log)(a),
            "floor": lambda a: context.floor(a) if context.isfinite(a) else a,
        }

    def number(self, value: Any) -> Any:
        if isinstance(value, Fraction):
            return self._context.mpf(value.numerator) / value.denominator
        if hasattr(value, "_mpf_"):
            return self._context.make_mpf(value._mpf_)
        return self._context.mpf(value)

    def constant(self, constant: Constant) -> Any:
        if constant.text == "pi":
            return +self._context.pi
        return self.number(Fraction(constant.text))

    def true(self, value: Any) -> bool:
        return is_true(value)


# --- rounding errors ------------------------------------------------------------------------------
# Each operation in doubles adds at most half a unit in the last place (a library function a whole
# one) and passes on the errors of its operands times its slope.  The sum bounds the
# difference between compiled C and the exact value, so that their comparison needs no tolerance
# chosen by hand (N. J. Higham, Accuracy and Stability of Numerical Algorithms, SIAM 2002, ch. 3).

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
        self._exact = PreciseArithmetic(_DIGITS)
        rows = OPERATIONS.values()
        self.operations: dict[str, Callable[..., BoundedValue]] = {
            **{r.name: self._exactly(r.name) for r in rows if r.slope is None},
            **{
                r.name: self._smooth(r.name, r.slope)
                for r in rows
                if r.slope and r.is_c_library_function
            },
            "neg": lambda a: -a,
            "add": lambda a, b: a + b,
            "sub": lambda a, b: a - b,
            "mul": lambda a, b: a * b,
            "div": self._divide,
            "pow": self._power,
            "atan2": self._angle,
            "abs": abs,
            "min": lambda a, b: a if b > a else b,
            "max": lambda a, b: b if b > a else a,
            "select": lambda c, a, b: a if self.true(c) else b,
        }

    def _value(self, name: str, *operands: Any) -> Any:
        return self._exact.operations[name](*operands)

    def _exactly(self, name: str) -> Callable[..., BoundedValue]:
        return lambda *args: BoundedValue(
            self._value(name, *(a.value for a in args)), self._exact.number(0)
        )

    def _smooth(self, name: str, slope: Slope) -> Callable[[BoundedValue], BoundedValue]:
        def carried_error(value: Any, a: BoundedValue) -> Any:
            # An exact operand adds no error, even where the slope is unbounded.
            try:
                return a.error and abs(slope(self._value, value, (a.value,), (a.error,)))
            except ZeroDivisionError:
                return self._value("div", a.error, self._exact.number(0))

        def bounded_result(a: BoundedValue) -> BoundedValue:
            value = self._value(name, a.value)
            return _round_value(value, carried_error(value, a), 2)

        return bounded_result

    def _divide(self, a: BoundedValue, b: BoundedValue) -> BoundedValue:
        value = self._value("div", a.value, b.value)
        return _round_value(value, self._value("div", a.error + abs(value) * b.error, abs(b.value)))

    def _power(self, a: BoundedValue, b: BoundedValue) -> BoundedValue:
        value = self._value("pow", a.value, b.value)
        base_slope = a.error and abs(self._value("div", b.value * value, a.value))
        exponent_slope = b.error and abs(self._value("log", a.value) * value)
        return _round_value(value, base_slope * a.error + exponent_slope * b.error, 2)

    def _angle(self, a: BoundedValue, b: BoundedValue) -> BoundedValue:
        propagated_error = abs(b.value) * a.error + abs(a.value) * b.error
        propagated_error = propagated_error and propagated_error / (
            a.value * a.value + b.value * b.value
        )
        return _round_value(self._value("atan2", a.value, b.value), propagated_error, 2)

    def number(self, value: Any) -> BoundedValue:
        exact = self._exact.number(value)
        return BoundedValue(exact, self._exact.number(0))

    def constant(self, constant: Constant) -> BoundedValue:
        value = self._exact.constant(constant)
        return _round_value(value, self._exact.number(0), int(value != constant.number))

    def true(self, value: Any) -> bool:
        return self._exact.true(value.value)
