"""The graph's folding and sharing keep the meaning: random trees, naively and through a kernel."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import assume, given, reject
from hypothesis import strategies as st

from mstmm.derive.verification.kernel_evaluation import evaluate
from mstmm.ir import OPERATIONS, Assign, KernelIR, Port
from mstmm.ir.differentiation import derivative
from mstmm.ir.graph import Graph, Node
from tests.support.work import calls

DIGITS = 80
Tree = Any

#: What each operation means, written independently of the evaluator.
MEANING: dict[str, Callable[..., Any]] = {
    "neg": lambda a: -a,
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b,
    "pow": lambda a, b: a**b,
    "abs": lambda a: mpmath.fabs(a),
    "floor": mpmath.floor,
    "sign": mpmath.sign,
    "min": lambda a, b: min(a, b),
    "max": lambda a, b: max(a, b),
    "lt": lambda a, b: mpmath.mpf(a < b),
    "le": lambda a, b: mpmath.mpf(a <= b),
    "eq": lambda a, b: mpmath.mpf(a == b),
    "and": lambda a, b: mpmath.mpf(a != 0 and b != 0),
    "or": lambda a, b: mpmath.mpf(a != 0 or b != 0),
    "not": lambda a: mpmath.mpf(a == 0),
    "select": lambda c, a, b: a if c != 0 else b,
    **{
        name: getattr(mpmath, name)
        for name in (
            "sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh",
            "exp", "log",
        )
    },
}  # fmt: skip
STEPS = {"floor", "sign", "lt", "le", "eq"}
FLAT = STEPS | {"and", "or", "not"}

LEAVES = st.one_of(
    st.tuples(st.just("x"), st.integers(0, 2)),
    st.tuples(st.just("number"), st.sampled_from([0, 1, -1, 2, -3, 0.5, -0.25, 16, 17])),
)


def trees(operations: list[str]) -> st.SearchStrategy[Tree]:
    def extend(inner: st.SearchStrategy[Tree]) -> st.SearchStrategy[Tree]:
        return st.sampled_from(operations).flatmap(
            lambda op: st.tuples(st.just(op), *[inner] * OPERATIONS[op].arity)
        )

    return st.recursive(LEAVES, extend, max_leaves=12)


def on_the_border(tree: Tree, args: list[Any]) -> bool:
    """Where a function ends, it has a value but no slope."""
    if tree[0] == "pow":
        return bool(args[0] == 0) and tree[2][0] != "number"
    if tree[0] == "atan2":
        return bool(args[0] == args[1] == 0)
    return tree[0] in ("asin", "acos") and bool(abs(args[0]) == 1)


def naive(tree: Tree, x: list[mpmath.mpf]) -> Any:
    """Value of the tree; an example that leaves the reals, grows or meets a step is given up."""
    if tree[0] == "x":
        return x[tree[1]]
    if tree[0] == "number":
        return mpmath.mpf(tree[1])
    args = [naive(branch, x) for branch in tree[1:]]
    if tree[0] in STEPS:
        gap = args[0] - (args[1] if len(args) > 1 else 0)
        near = abs(gap - mpmath.nint(gap)) if tree[0] == "floor" else abs(gap)
        assume(near > 1e-30)
    assume(not on_the_border(tree, args))
    try:
        value = MEANING[tree[0]](*args)
    except (ZeroDivisionError, ValueError, OverflowError):
        reject()
    assume(isinstance(value, mpmath.mpf) and mpmath.isfinite(value) and abs(value) < 1e6)
    return value


def build(graph: Graph, tree: Tree, x: list[Node]) -> Node:
    """The tree through Python's operators where there is one, else by name."""
    if tree[0] == "x":
        return x[tree[1]]
    if tree[0] == "number":
        return graph.constant(tree[1])
    args = [build(graph, branch, x) for branch in tree[1:]]
    spelled: dict[str, Callable[..., Node]] = {
        "neg": lambda a: -a, "add": lambda a, b: a + b, "sub": lambda a, b: a - b,
        "mul": lambda a, b: a * b, "div": lambda a, b: a / b, "pow": lambda a, b: a**b,
    }  # fmt: skip
    return spelled[tree[0]](*args) if tree[0] in spelled else graph.call(tree[0], *args)


POINTS = st.lists(st.floats(-3, 3).filter(lambda v: abs(v) > 1e-3), min_size=3, max_size=3)


def value_of(graph: Graph, node: Node, x: list[Any]) -> mpmath.mpf:
    kernel = graph.kernel("tree", [Port("x", (3,))], [Port("y")], {"y": node})
    return evaluate(kernel, {"x": x}, DIGITS)["y"][0]


@given(tree=trees(list(OPERATIONS)), point=POINTS)
def test_folding_keeps_the_value(tree: Tree, point: list[float]) -> None:
    with mpmath.workdps(DIGITS):
        wanted = naive(tree, [mpmath.mpf(v) for v in point])
        graph = Graph()
        got = value_of(graph, build(graph, tree, graph.vector("x", 3)), point)
        assert abs(got - wanted) < 1e-50 * max(1, abs(wanted))


def test_every_operation_has_a_meaning() -> None:
    assert set(MEANING) == set(OPERATIONS)


@given(tree=trees([op for op in OPERATIONS if op not in FLAT]), point=POINTS)
def test_derivative_is_the_slope(tree: Tree, point: list[float]) -> None:
    """Against a central difference with steps of 1e-40 at 160 digits."""
    with mpmath.workdps(2 * DIGITS):
        x = [mpmath.mpf(v) for v in point]
        direction = [mpmath.mpf(v) for v in (1, -2, 0.5)]
        step = mpmath.mpf(10) ** -40
        sides = [
            naive(tree, [a + sign * step * b for a, b in zip(x, direction, strict=True)])
            for sign in (-1, 0, 1)
        ]
        slope = (sides[2] - sides[0]) / (2 * step)
        bend = (sides[2] - 2 * sides[1] + sides[0]) / step**2
        assume(abs(slope) < 1e9 and abs(bend) < 1e12)
        graph = Graph()
        leaves = graph.vector("x", 3)
        seeds = dict(zip(leaves, (1, -2, 0.5), strict=True))
        found = derivative(build(graph, tree, leaves), seeds)
        kernel = graph.kernel("slope", [Port("x", (3,))], [Port("y")], {"y": found})
        got = evaluate(kernel, {"x": point}, 2 * DIGITS)["y"][0]
        assert abs(got - slope) < 1e-20


def test_division_by_a_literal_zero_is_not_folded_away() -> None:
    graph = Graph()
    assert mpmath.isnan(value_of(graph, graph.constant(0) / 0, [0, 0, 0]))
    assert mpmath.isinf(value_of(graph, graph.constant(1) / 0, [0, 0, 0]))


def test_equal_terms_are_one_node_and_dead_terms_vanish() -> None:
    graph = Graph()
    a, b = graph.vector("x", 2)
    assert a * b + 1 is 1 + b * a
    assert -(a - b) is b - a
    graph.sin(a)
    kernel = graph.kernel("k", [Port("x", (2,))], [Port("y", (2,))], {"y": [a * b, (a * b) + 1]})
    assert kernel.operation_counts() == {"add": 1, "mul": 1}


def test_zeros_and_ones_cost_nothing() -> None:
    graph = Graph()
    a = graph.element("x", 0)
    zero, one = graph.constant(0), graph.constant(1)
    assert zero * a is zero and one * a is a and a + zero is a and a - a is zero
    assert a / 1 is a and a**1 is a and a**0 is one and zero / a is zero
    assert graph.sin(zero) is zero and graph.cos(zero) is one
    assert graph.select(one, a, zero) is a


def test_guards_on_constants() -> None:
    graph = Graph()
    graph.guard(graph.constant(1), 2, "always holds")
    with pytest.raises(ValueError, match="this can never be computed: never holds"):
        graph.guard(graph.constant(0), 2, "never holds")
    assert graph.kernel("k", [], [], {}).statements == ()


def test_values_must_fill_their_port() -> None:
    graph = Graph()
    x = graph.vector("x", 2)
    for values in (x[:1], x[0], [x]):
        with pytest.raises(ValueError, match=r"expected values of shape \(2,\)"):
            graph.kernel("k", [Port("x", (2,))], [Port("y", (2,))], {"y": values})


def long_kernel(draws: list[tuple[int, int, int]]) -> KernelIR:
    """The kernel of a graph with an operation for each draw."""
    graph = Graph()
    pool = graph.vector("x", 20)
    for first, second, op in draws:
        a, b = pool[-1 - first], pool[-1 - second]
        pool.append((a + b, a - b, a * b + len(pool))[op % 3])
    return graph.kernel("long", [Port("x", (20,))], [Port("y", (len(draws),))], {"y": pool[20:]})


def test_five_thousand_nodes_are_as_much_work_each_as_a_thousand(rng: np.random.Generator) -> None:
    draws = [(int(a), int(b), int(c)) for a, b, c in rng.integers(0, 20, (5000, 3))]
    few = calls(lambda: long_kernel(draws[:1000])) / 1000
    many = calls(lambda: long_kernel(draws)) / 5000
    assert many < min(1.2 * few, 300)  # about 175 functions called for each
    kernel = long_kernel(draws)
    numbers = [s.number for s in kernel.statements if isinstance(s, Assign)]
    assert numbers == sorted(numbers) and len(numbers) > 3000
