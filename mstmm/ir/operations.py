"""Table of the operations of the IR, one row each, with all their properties.

C, the tape, numpy, SymPy, the listing, folding, differentiation, expressions and the passes over
fused code read this table.  A new operation needs a row here, a function in each of the C texts
`fused_scalar_type.c` and `fused_lanes.c`, and an entry in derive/verification/kernel_evaluation.py
if mpmath computes it in another way.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

#: Applies an operation by its name.
Call = Callable[..., Any]
#: (call, y, a, d) -> derivative of y = op(*a), given the derivatives d of a.
Slope = Callable[[Call, Any, Sequence[Any], Sequence[Any]], Any]


@dataclass(frozen=True)
class Operation:
    """Operation of the IR.  Texts refer to the operands as {0}, {1}, {2}."""

    name: str
    arity: int
    #: Cycles until the result is available, on current processors; only ratios matter.
    latency: int
    #: Function of doubles, as in C; comparisons and signs accept any type of real number.
    value: Callable[..., Any]
    #: Derivative along a direction, of the active branch at kinks; None where it is zero.
    slope: Slope | None = None
    #: C text; {t0}, {t1} test whether an operand is true, that is neither zero nor NaN.
    c: str = ""
    #: Text in the listing, if it differs from C.
    text: str = ""
    #: Names of the functions of numpy and SymPy; "" for SymPy where it is built from other terms.
    numpy: str = ""
    sympy: str = ""
    #: Whether its value is 0 or 1.
    truth: bool = False
    #: Number of leading operands that are used as conditions.
    conditions: int = 0
    commutative: bool = False
    #: Exact value where the first operand is 0, if it is unique.
    at_zero: int | None = None

    def __post_init__(self) -> None:
        default_text = f"{self.name}({', '.join(f'{{{k}}}' for k in range(self.arity))})"
        object.__setattr__(self, "c", self.c or default_text)
        object.__setattr__(self, "text", self.text or self.c)
        object.__setattr__(self, "numpy", self.numpy or self.name)

    @cached_property
    def sign(self) -> str:
        """Operator of C between the two operands; "" if it is not a binary operator."""
        match = re.fullmatch(r"\{t?0\} (\S+) \{t?1\}", self.c)
        return match[1] if match else ""

    @cached_property
    def is_c_library_function(self) -> bool:
        """Whether it is a C library function of one argument with this name."""
        return self.c == f"{self.name}({{0}})"


# --- doubles with the values of C where Python would raise an exception ---------------------------
#
# NaN outside the domain, infinities at poles and on overflow.

_Function = Callable[[float], float]


def _with_c_limits(function: _Function, overflow: _Function | None = None) -> _Function:
    """Wrap `function`: NaN outside its domain, an infinity on overflow."""

    def call(a: float) -> float:
        try:
            return float(function(a))
        except ValueError:
            return math.nan
        except OverflowError:
            return overflow(a) if overflow is not None else math.inf

    return call


def _divide(a: float, b: float) -> float:
    """Quotient a / b, NaN or an infinity for b = 0."""
    if b != 0:
        return a / b
    if a == 0 or math.isnan(a):
        return math.nan
    return math.copysign(math.inf, a) * math.copysign(1.0, b)


def _log(a: float) -> float:
    """Natural logarithm, minus infinity at 0."""
    return -math.inf if a == 0 else _with_c_limits(math.log)(a)


def _floor(a: float) -> float:
    """Largest integer not above `a`, as a double with the sign of `a`."""
    return math.copysign(float(math.floor(a)), a) if math.isfinite(a) else a


def _power(a: float, b: float) -> float:
    """Power a ** b; NaN where no real value exists."""
    try:
        return math.pow(a, b)
    except ValueError:
        if a == 0:
            return math.copysign(math.inf, a) if _is_odd(b) else math.inf
        return math.nan
    except OverflowError:
        return -math.inf if a < 0 and _is_odd(b) else math.inf


def _is_odd(a: float) -> bool:
    return math.isfinite(a) and a == math.floor(a) and math.fmod(a, 2.0) != 0


# --- the table ------------------------------------------------------------------------------------


def is_true(value: Any) -> bool:
    """Whether a number is neither zero nor NaN."""
    return bool(abs(value) > 0)


def _truth_function(condition: Callable[..., bool]) -> Callable[..., Any]:
    """Wrap a condition so that it returns 1 or 0 in the type of the operands."""
    return lambda *a: type(a[0])(condition(*a))


def _power_slope(call: Call, y: Any, a: Sequence[Any], d: Sequence[Any]) -> Any:
    base, exponent = a
    slope = exponent * call("pow", base, exponent - 1) * d[0]
    if d[1].value == 0:
        return slope
    # For a constant exponent a negative base has a derivative but no logarithm.
    is_exponent_constant = call("eq", d[1], 0)
    return call("select", is_exponent_constant, slope, slope + y * call("log", base) * d[1])


def _arc_slope(call: Call, y: Any, a: Sequence[Any], d: Sequence[Any]) -> Any:
    """Derivative of asin; that of acos is its negative."""
    return d[0] / call("sqrt", 1 - a[0] * a[0])


_ROWS = (
    Operation("neg", 1, 1, operator.neg, lambda call, y, a, d: -d[0], "-{0}", numpy="negative"),
    Operation("add", 2, 4, operator.add, lambda call, y, a, d: d[0] + d[1], "{0} + {1}",
              commutative=True),
    Operation("sub", 2, 4, operator.sub, lambda call, y, a, d: d[0] - d[1], "{0} - {1}",
              numpy="subtract"),
    Operation("mul", 2, 4, operator.mul, lambda call, y, a, d: d[0] * a[1] + a[0] * d[1],
              "{0} * {1}", numpy="multiply", commutative=True),
    Operation("div", 2, 13, _divide, lambda call, y, a, d: (d[0] - y * d[1]) / a[1], "{0} / {1}",
              numpy="divide"),
    Operation("pow", 2, 20, _power, _power_slope, text="{0} ** {1}"),
    Operation("sqrt", 1, 20, _with_c_limits(math.sqrt), lambda call, y, a, d: d[0] / (2 * y),
              at_zero=0),
    Operation("sin", 1, 30, _with_c_limits(math.sin),
              lambda call, y, a, d: call("cos", a[0]) * d[0], sympy="sin", at_zero=0),
    Operation("cos", 1, 30, _with_c_limits(math.cos),
              lambda call, y, a, d: -(call("sin", a[0]) * d[0]), sympy="cos", at_zero=1),
    Operation("tan", 1, 20, _with_c_limits(math.tan), lambda call, y, a, d: (1 + y * y) * d[0],
              sympy="tan", at_zero=0),
    Operation("asin", 1, 20, _with_c_limits(math.asin), _arc_slope, sympy="asin", at_zero=0),
    Operation("acos", 1, 20, _with_c_limits(math.acos), lambda *given: -_arc_slope(*given),
              sympy="acos"),
    Operation("atan", 1, 20, math.atan, lambda call, y, a, d: d[0] / (1 + a[0] * a[0]),
              sympy="atan", at_zero=0),
    Operation("atan2", 2, 20, math.atan2,
              lambda call, y, a, d: (d[0] * a[1] - a[0] * d[1]) / (a[1] * a[1] + a[0] * a[0]),
              sympy="atan2"),
    Operation("sinh", 1, 20, _with_c_limits(math.sinh, lambda a: math.copysign(math.inf, a)),
              lambda call, y, a, d: call("cosh", a[0]) * d[0], sympy="sinh", at_zero=0),
    Operation("cosh", 1, 20, _with_c_limits(math.cosh),
              lambda call, y, a, d: call("sinh", a[0]) * d[0], sympy="cosh", at_zero=1),
    Operation("tanh", 1, 20, math.tanh, lambda call, y, a, d: (1 - y * y) * d[0], sympy="tanh",
              at_zero=0),
    Operation("exp", 1, 20, _with_c_limits(math.exp), lambda call, y, a, d: y * d[0], sympy="exp",
              at_zero=1),
    Operation("log", 1, 20, _log, lambda call, y, a, d: d[0] / a[0], sympy="log"),
    Operation("abs", 1, 1, abs, lambda call, y, a, d: call("sign", a[0]) * d[0], "fabs({0})",
              "abs({0})", sympy="Abs"),
    Operation("sign", 1, 3, lambda a: type(a)((a > 0) - (a < 0)) if is_true(a) else a,
              c="{0} > 0 ? 1 : ({0} < 0 ? -1 : {0})", text="sign({0})", sympy="sign"),
    Operation("floor", 1, 8, _floor, sympy="floor"),
    Operation("min", 2, 3, lambda a, b: a if a < b or a != a else b,
              lambda call, y, a, d: call("select", call("lt", *a), d[0], d[1]),
              "({0} < {1} || isnan({0})) ? {0} : {1}", "min({0}, {1})", numpy="minimum",
              commutative=True),
    Operation("max", 2, 3, lambda a, b: b if a < b or b != b else a,
              lambda call, y, a, d: call("select", call("lt", *a), d[1], d[0]),
              "({0} < {1} || isnan({1})) ? {1} : {0}", "max({0}, {1})", numpy="maximum",
              commutative=True),
    Operation("lt", 2, 1, _truth_function(operator.lt), c="{0} < {1}", numpy="less", truth=True),
    Operation("le", 2, 1, _truth_function(operator.le), c="{0} <= {1}", numpy="less_equal",
              truth=True),
    Operation("eq", 2, 1, _truth_function(operator.eq), c="{0} == {1}", numpy="equal", truth=True,
              commutative=True),
    Operation("and", 2, 1, _truth_function(lambda a, b: is_true(a) and is_true(b)),
              c="{t0} && {t1}", text="{0} and {1}", numpy="logical_and", truth=True, conditions=2,
              commutative=True),
    Operation("or", 2, 1, _truth_function(lambda a, b: is_true(a) or is_true(b)),
              c="{t0} || {t1}", text="{0} or {1}", numpy="logical_or", truth=True, conditions=2,
              commutative=True),
    Operation("not", 1, 1, _truth_function(lambda a: a == 0), c="{0} == 0", text="not {0}",
              numpy="logical_not", truth=True),
    Operation("select", 3, 2, lambda c, a, b: a if is_true(c) else b,
              lambda call, y, a, d: call("select", a[0], d[1], d[2]), "{t0} ? {1} : {2}",
              "{1} if {0} else {2}", numpy="where", conditions=1),
)  # fmt: skip

#: Operation name -> row.  The order is that of the tape's instructions.
OPERATIONS: dict[str, Operation] = {row.name: row for row in _ROWS}
