"""Drives: exact first and second derivatives against 40-digit differentiation by mpmath."""

from __future__ import annotations

import math
from collections.abc import Callable

import mpmath as mp
import pytest

from mstmm.expression.derivatives import motion_at
from mstmm.expression.expression import parse
from mstmm.expression.parser import Term

MP: dict[str, Callable[..., mp.mpf]] = {
    "neg": lambda a: -a, "add": lambda a, b: a + b, "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b, "div": lambda a, b: a / b, "pow": mp.power,
    "lt": lambda a, b: a < b, "le": lambda a, b: a <= b, "gt": lambda a, b: a > b,
    "ge": lambda a, b: a >= b, "where": lambda c, a, b: a if c else b, "abs": abs, "sign": mp.sign,
    "min": min, "max": max, "sqrt": mp.sqrt, "sin": mp.sin, "cos": mp.cos, "tan": mp.tan,
    "asin": mp.asin, "acos": mp.acos, "atan": mp.atan, "atan2": mp.atan2, "sinh": mp.sinh,
    "cosh": mp.cosh, "tanh": mp.tanh, "exp": mp.exp, "log": mp.log,
}  # fmt: skip


def in_high_precision(text: str, t: mp.mpf) -> mp.mpf:
    """The text's syntax tree evaluated by mpmath, apart from graph and derivative rules."""
    expression = parse(text)
    known: list[mp.mpf] = []

    def term_value(term: Term) -> mp.mpf:
        if term.op == "number":
            assert term.exact is not None
            return mp.mpf(term.exact.numerator) / term.exact.denominator
        if term.op in ("name", "pi"):
            return t if term.op == "name" else mp.pi
        return MP[term.op](*(known[i] for i in term.args))

    for term in expression.terms:
        known.append(term_value(term))
    return known[expression.root]


SMOOTH = [
    "0.5*sin(3*t)",
    "t^3 - 2*t^2 + 1/7",
    "(1 + t)^2.5",
    "2^t",
    "t^t",
    "t^-3",
    "exp(-t)*cos(2*pi*t)",
    "log(1 + t^2)/sqrt(2 + t)",
    "tan(t/3) + tanh(5*t)",
    "asin(t/4) + acos(t/5) + atan(t)",
    "atan2(sin(t), 2 + cos(t))",
    "sinh(t) - cosh(t)^2",
    "abs(t - 3) + sign(t)*t",
    "min(t, t^2) + max(t, 1/t, 2)",
    "where(t < 1, t^2, 2*t - 1)",
    "where(t > 10, 0, where(2*t >= 1, sin(t), cos(t)))",
    "1e300*t*1e-300",
    "7",
]


@pytest.mark.parametrize("text", SMOOTH)
@pytest.mark.parametrize("t", [0.3, 0.7, 1.9])
def test_derivatives_agree_with_high_precision(text: str, t: float) -> None:
    with mp.workdps(40):
        exact = [
            float(mp.diff(lambda s: in_high_precision(text, s), mp.mpf(t), n)) for n in (0, 1, 2)
        ]
    for computed, expected in zip(motion_at(parse(text), t), exact, strict=True):
        assert computed == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_no_finite_derivative_is_seen() -> None:
    q, u, a = motion_at(parse("sqrt(t)"), 0.0)
    assert q == 0 and not math.isfinite(u) and not math.isfinite(a)
    q, u, a = motion_at(parse("t^1.5"), 0.0)
    assert (q, u) == (0, 0) and not math.isfinite(a)


def test_only_the_chosen_branch_is_evaluated() -> None:
    drive = parse("where(t < 1, sqrt(1 - t), (t - 1)^2)")
    assert motion_at(drive, 3.0) == (4.0, 4.0, 2.0)


def test_long_products_differentiate() -> None:
    q, u, a = motion_at(parse("t" + "*1.1" * 900), 2.0)
    assert (q, u, a) == pytest.approx((2 * 1.1**900, 1.1**900, 0.0), rel=1e-9)
