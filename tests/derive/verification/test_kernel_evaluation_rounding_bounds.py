"""The error bound holds for random kernels in doubles, and is not so wide that it says nothing."""

from __future__ import annotations

import numpy as np
import pytest

from mstmm.derive.verification.kernel_evaluation import UNIT_ROUNDOFF, evaluate, rounding_bounds
from mstmm.ir import OPERATIONS, Assign, Element, KernelIR, Port, Solve, Store, Temporary
from mstmm.ir.graph import Graph
from mstmm.ir.interpreter import GuardFailure, evaluate_floats
from tests.support.kernels.random_kernels import random_inputs, random_kernel

JUMPS = ("sign", "floor", "lt", "le", "eq", "and", "or", "not", "select")
CONTINUOUS = tuple(op for op in OPERATIONS if op not in JUMPS)


@pytest.mark.parametrize("seed", range(40))
def test_doubles_stay_within_the_bound(seed: int) -> None:
    kernel, inputs = random_kernel("smooth", seed, 60, CONTINUOUS), random_inputs(seed)
    exact, got = evaluate(kernel, inputs), evaluate_floats(kernel, inputs)
    for name, row in rounding_bounds(kernel, inputs).items():
        for (value, bound), reference, number in zip(row, exact[name], got[name], strict=True):
            assert abs(value - reference) <= 1e-35
            assert abs(number - reference) <= bound
            assert bound < 1e-9


@pytest.mark.parametrize("op", OPERATIONS)
def test_every_operation_passes_errors_on(op: str) -> None:
    """op(x0 / 3, ...) with rounded operands: within the bound, and the bound within reason."""
    count = OPERATIONS[op].arity
    thirds = [Assign(i, "div", (Element("x", (i,)), Element("x", (3,)))) for i in range(count)]
    last = Assign(9, op, tuple(Temporary(i) for i in range(count)))
    kernel = KernelIR(
        "k", (Port("x", (4,)),), (Port("y"),), (*thirds, last, Store("y", (), Temporary(9)))
    )
    for x in ([0.7, 1.1, 2.3, 3.0], [2.9, 0.4, 1.3, 3.0]):
        (got,) = evaluate_floats(kernel, {"x": x})["y"]
        (exact,) = evaluate(kernel, {"x": x})["y"]
        ((_, bound),) = rounding_bounds(kernel, {"x": x})["y"]
        assert abs(got - exact) <= bound < 1e-13


def test_cancellation_is_seen() -> None:
    graph = Graph()
    x = graph.element("x")
    kernel = graph.kernel("cancel", [Port("x")], [Port("y")], {"y": (x + 1) - 1})
    ((value, bound),) = rounding_bounds(kernel, {"x": 1e-10})["y"]
    (got,) = evaluate_floats(kernel, {"x": 1e-10})["y"]
    assert float(value) == 1e-10
    assert abs(got - 1e-10) > 1e-18
    assert abs(got - 1e-10) <= bound < 2.1 * UNIT_ROUNDOFF


def test_solves_are_bounded(rng: np.random.Generator) -> None:
    kernel = KernelIR(
        "k",
        (Port("A", ("n", "n")), Port("b", ("n",))),
        (Port("x", ("n",)),),
        (Solve("x", "A", "b", 1, "singular"),),
        size_symbol="n",
    )
    half = rng.normal(size=(6, 6))
    inputs = {"A": half @ half.T + np.eye(6), "b": rng.normal(size=6)}
    got, exact = evaluate_floats(kernel, inputs, 6)["x"], evaluate(kernel, inputs, 50, 6)["x"]
    for (_, bound), number, reference in zip(
        rounding_bounds(kernel, inputs, 6)["x"], got, exact, strict=True
    ):
        assert abs(number - reference) <= bound < 1e-8
    with pytest.raises(GuardFailure):
        rounding_bounds(kernel, inputs | {"A": np.zeros((6, 6))}, 6)
