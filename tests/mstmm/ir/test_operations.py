"""Every row of the table of operations is complete, and its columns say the same.

That C, the tape, lanes and fifty digits compute what the column `value` does is held by
`test_operations_agreement` here and
`test_straight_line` in tests/derive/codegen.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
import sympy as sp

from mstmm.derive.definition.derivation import FUNCTIONS
from mstmm.ir import OPERATIONS, Port
from mstmm.ir.differentiation import derivative
from mstmm.ir.graph import Graph
from mstmm.ir.interpreter import evaluate_floats
from mstmm.ir.operations import Operation

ROWS = pytest.mark.parametrize("row", OPERATIONS.values(), ids=lambda row: row.name)

#: What the listing may call; it reads as Python does.
PYTHON: dict[str, Any] = vars(math) | {
    "abs": abs, "min": min, "max": max, "sign": lambda a: (a > 0) - (a < 0),
}  # fmt: skip
#: Operations that lowering knows by the form of a SymPy expression, not by a function.
FORMS = {
    "neg", "add", "sub", "mul", "div", "pow", "sqrt", "min", "max", "lt", "le", "eq", "and", "or",
    "not", "select",
}  # fmt: skip


def points(row: Operation, least: float = 0.1) -> Iterator[list[float]]:
    """Operands where every operation has a value, none on a step."""
    draw = random.Random(row.name)
    for _ in range(8):
        yield [draw.uniform(least, 0.9) for _ in range(row.arity)]


def agree(found: Any, wanted: float) -> bool:
    return math.isclose(float(found), wanted, rel_tol=1e-14)


@ROWS
def test_every_operation_takes_time(row: Operation) -> None:
    assert 1 <= row.latency <= 100, "latency"


@ROWS
def test_texts_name_every_operand(row: Operation) -> None:
    asked = [f"{{t{k}}}" in row.c for k in range(row.arity)]
    named = [f"{{{k}}}" in row.c for k in range(row.arity)]
    assert asked == [k < row.conditions for k in range(row.arity)], "conditions, or {t} in c"
    assert all(a != b for a, b in zip(asked, named, strict=True)), "c"
    assert all(f"{{{k}}}" in row.text for k in range(row.arity)), "text"


@ROWS
def test_the_listing_reads_as_what_is_computed(row: Operation) -> None:
    for x in points(row):
        text = row.text.format(*"abc")
        found = eval(text, PYTHON | dict(zip("abc", x, strict=False)))
        assert agree(bool(found) if row.truth else found, row.value(*x)), (text, x)


@ROWS
def test_numpy_computes_the_same(row: Operation) -> None:
    function: Callable[..., Any] = getattr(np, row.numpy)
    for x in points(row):
        assert agree(function(*x), row.value(*x)), ("numpy", x)


@ROWS
def test_sympy_computes_the_same(row: Operation) -> None:
    assert (row.name in FORMS) == (row.sympy == "") == (row.name not in FUNCTIONS.values()), "sympy"
    for x in points(row) if row.sympy else ():
        assert agree(getattr(sp, row.sympy)(*map(sp.Float, x)), row.value(*x)), ("sympy", x)


@ROWS
def test_slope_is_that_of_the_value(row: Operation) -> None:
    """Along a direction, against a central difference."""
    graph, step = Graph(), 1e-6
    leaves, direction = graph.vector("x", row.arity), [1.0, -2.0, 0.5][: row.arity]
    slope = derivative(graph.call(row.name, *leaves), dict(zip(leaves, direction, strict=True)))
    kernel = graph.kernel("slope", [Port("x", (row.arity,))], [Port("y")], {"y": slope})
    for x in points(row):
        sides = [[a + s * b for a, b in zip(x, direction, strict=True)] for s in (-step, step)]
        below, above = (row.value(*side) for side in sides)
        found = evaluate_floats(kernel, {"x": x})["y"][0]
        assert abs(found - (above - below) / (2 * step)) < 1e-7 * max(1, abs(found)), ("slope", x)


@ROWS
def test_what_folding_takes_for_true_holds(row: Operation) -> None:
    if row.at_zero is not None:
        assert row.value(0.0) == row.at_zero, "at_zero"
    if row.is_c_library_function and row.slope:
        assert (row.at_zero is None) == (row.value(0.0) not in (0, 1)), "at_zero"
    if row.arity == 2:
        alike = all(row.value(a, b) == row.value(b, a) for a, b in points(row))
        assert alike == row.commutative, "commutative"


@ROWS
def test_truths_are_one_or_zero_and_conditions_ask_for_no_more(row: Operation) -> None:
    values = [row.value(*x) for x in points(row, -0.9)]
    assert all(value in (0, 1) for value in values) == row.truth, "truth"
    for x in points(row):
        for k in range(row.conditions):
            scaled, none, undefined = ([*x[:k], a, *x[k + 1 :]] for a in (-3 * x[k], 0.0, math.nan))
            assert row.value(*scaled) == row.value(*x), "conditions"
            assert row.value(*undefined) == row.value(*none), "conditions"
