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
from mstmm.ir.operations import is_true

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
