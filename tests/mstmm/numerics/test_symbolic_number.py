"""Numbers that carry formulas: every operation of the IR, written as SymPy expressions, against
doubles at other values of the symbols."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import pytest
import sympy

import mstmm
from mstmm.errors import SceneError
from mstmm.ir import KernelIR, Port
from mstmm.ir.graph import Graph
from mstmm.ir.interpreter import evaluate_floats, replay_kernel
from mstmm.ir.operations import OPERATIONS
from mstmm.ir.symbolic_arithmetic import FormulaArithmetic
from mstmm.numerics.dual import atan2, hypot
from mstmm.numerics.rotations import from_quaternion, from_rpy, unit_vector
from mstmm.numerics.symbolic_number import Formula, SymbolTable, square_root, to_exact
from mstmm.pipeline.sympy_expressions import SympyWriter

AT, ELSEWHERE = (0.3, 0.55, 0.8), (0.35, 0.5, 0.9)


def kernel_of(op: str) -> KernelIR:
    """One operation on sums and products of three numbers, in the branch x < y < z."""
    graph = Graph()
    x, y, z = graph.vector("p", 3)
    operands = [x * y + z / 4, z * z - y, y / z][: OPERATIONS[op].arity]
    if op == "acos":
        operands = [x * y]
    node = graph.call(op, *operands) * x - y
    return graph.kernel("one", [Port("p", (3,))], [Port("r", (1,))], {"r": [node]})


def symbols(most: int = 100_000) -> list[Formula]:
    book = SymbolTable(most)
    return [book.symbol(name, value) for name, value in zip("xyz", AT, strict=True)]


def value_at(found: Formula, given: list[Formula], values: tuple[float, ...]) -> float:
    """The formula at other values of its symbols."""
    writer = SympyWriter()
    names = [writer.symbol(one) for one in given]
    expression: Any = writer.matrix([[found]])[0, 0]
    return float(expression.subs(dict(zip(names, values, strict=True))))


@pytest.mark.parametrize("op", OPERATIONS)
def test_every_operation(op: str) -> None:
    kernel, given = kernel_of(op), symbols()
    (found,) = replay_kernel(kernel, {"p": given}, FormulaArithmetic(), None)["r"]
    assert found.value == evaluate_floats(kernel, {"p": list(AT)})["r"][0]
    for values in (AT, ELSEWHERE):
        (wanted,) = evaluate_floats(kernel, {"p": list(values)})["r"]
        assert value_at(found, given, values) == pytest.approx(wanted, rel=1e-13, abs=1e-14)


@pytest.mark.parametrize(
    "function",
    [
        lambda v: from_rpy(v)[1],
        lambda v: from_quaternion([*v, 0.2])[2],
        unit_vector,
        lambda v: (hypot(v), atan2(v[0], v[1]), 1 / (v[0] + 2 * v[1]) - abs(-v[2])),
    ],
)
def test_what_packing_asks_of_numbers(function: Any) -> None:
    """Values to the bit, formulas at other values to rounding."""
    given = symbols()
    found = function(given)
    assert [one.value for one in found] == list(function(list(AT)))
    for one, wanted in zip(found, function(list(ELSEWHERE)), strict=True):
        assert value_at(one, given, ELSEWHERE) == pytest.approx(wanted, rel=1e-13)


def test_what_cancels_is_gone() -> None:
    x, y, z = symbols()
    assert ((x + y) * (x - y) - x * x + y * y).terms == {}
    assert (square_root(x * y + z) * square_root(x * y + z) - z - y * x).terms == {}
    assert square_root(x * x * y * y * 4).terms == (2 * x * y).terms
    assert ((x + y) / (2 * z) * z).terms == (x / 2 + y / 2).terms
    turned: Any = from_rpy([x, 0.0, 0.0])  # type: ignore[list-item]
    assert turned[0][0] == 1.0
    assert (turned[1][1] * turned[1][1] + turned[1][2] * turned[1][2]).terms == {(): 1}


def test_a_zero_in_symbols_is_no_zero() -> None:
    book = SymbolTable(10)
    zero = book.symbol("zero", 0.0)
    assert zero and zero != 0 and zero <= 0 and zero >= 0 and not zero < 0 and not zero > 0
    assert zero - zero == 0 and not (zero - zero)
    assert hash(zero) == hash(0.0)
    for wrong in (zero, zero - zero):
        with pytest.raises(TypeError):
            float(wrong)  # type: ignore[arg-type]


def test_a_branch_that_is_not_taken_may_divide_by_zero() -> None:
    """As doubles do: sin(x)/x and its like are series near 0, chosen by a comparison."""
    graph = Graph()
    x, y = graph.vector("p", 2)
    near = graph.call("lt", x * x, 1e-8)
    found = graph.call("select", near, y * 2, graph.call("sqrt", -y) / x)
    kernel = graph.kernel("one", [Port("p", (2,))], [Port("r", (1,))], {"r": [found]})
    y_symbol = SymbolTable(10).symbol("y", 3.0)
    (taken,) = replay_kernel(kernel, {"p": [0.0, y_symbol]}, FormulaArithmetic(), None)["r"]
    assert taken == y_symbol * 2


@pytest.mark.parametrize("hinge", ["ball", "elastic"])
def test_springs_of_a_ball_at_rest(hinge: str) -> None:
    """Swing and twist from a potential, at the place where its angle is 0."""
    stiffness = [1.0, 1.5, 2.0, 2.0, 3.0, 4.0][-3 if hinge == "ball" else -6 :]
    head = {"name": "head", "mass": 2.0, "center_of_mass": [0, 0, 0.5], "inertia": [1, 1, 1]}
    neck = {"name": "neck", "type": hinge, "inboard": "ground", "outboard": "head",
            "law": {"stiffness": stiffness}}  # fmt: skip
    scene = mstmm.Scene(gravity=[0, 0, 0], body=[head], hinge=[neck])
    names = [f"neck.law.stiffness[{k}]" for k in range(len(stiffness))]
    found = mstmm.compile(scene, engine="looped").linearize().symbolic(names)
    assert sympy.diag(*found.symbols.values()) == found.K


@pytest.mark.parametrize(
    ("double", "taken"),
    [(0.1, Fraction(1, 10)), (0.1 + 0.2, Fraction(3, 10)), (1 / 3, Fraction(1, 3)),
     (1e-20, Fraction(1, 10**20)), (2.0**1000, 2.0**1000), (math.pi, math.pi),
     (math.inf, math.inf)],
)  # fmt: skip
def test_doubles_that_stand_for_fractions(double: float, taken: Fraction | float) -> None:
    assert to_exact(double) == taken
    assert type(to_exact(double)) is type(taken)


def test_long_formulas_end_at_the_limit() -> None:
    x, y, z = symbols(most=1000)
    found = x + y + z
    with pytest.raises(SceneError, match=r"the limit of 1000; keep fewer names"):
        for _ in range(20):
            found = found * (x + y + z)
