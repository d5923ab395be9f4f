"""The evaluator's borders: what it takes, what it refuses, and its precision."""

from __future__ import annotations

from fractions import Fraction

import mpmath
import numpy as np
import pytest

from mstmm.derive.verification.kernel_evaluation import evaluate
from mstmm.errors import NumericalFailure
from mstmm.ir import KernelIR, Port
from mstmm.ir.graph import Graph
from mstmm.ir.interpreter import GuardFailure, evaluate_floats


def kernel() -> KernelIR:
    """y = pi * sqrt(a) / 3 + sum of the entries of B, for a > 0."""
    graph = Graph()
    a = graph.element("a")
    total = graph.constant(0)
    for row in graph.matrix("B", 2, 2):
        for entry in row:
            total = total + entry
    graph.guard(graph.call("lt", 0, a), 4, "a is not positive")
    y = graph.pi * graph.sqrt(a) / 3 + total
    return graph.kernel("area", [Port("a"), Port("B", (2, 2))], [Port("y")], {"y": y})


KERNEL = kernel()
NESTED = [[1, Fraction(1, 3)], [0.5, mpmath.mpf(2)]]


@pytest.mark.parametrize("digits", [15, 50, 120])
def test_values_are_right_to_the_digits_asked(digits: int) -> None:
    value = evaluate(KERNEL, {"a": 2, "B": NESTED}, digits)["y"][0]
    with mpmath.workdps(digits + 10):
        exact = mpmath.pi * mpmath.sqrt(2) / 3 + mpmath.mpf(23) / 6
        assert abs(value - exact) < mpmath.mpf(10) ** (2 - digits)


def test_results_are_ordinary_mpmath_numbers_and_precision_is_left_alone() -> None:
    before = mpmath.mp.dps
    value = evaluate(KERNEL, {"a": "2", "B": [1, 2, 3, 4]}, 80)["y"][0]
    assert isinstance(value, mpmath.mpf)
    assert mpmath.mp.dps == before


def test_arrays_of_numpy_are_taken() -> None:
    inputs = {"a": np.float64(2.0), "B": np.ones((2, 2))}
    assert evaluate_floats(KERNEL, inputs)["y"][0] == pytest.approx(4 + np.pi * np.sqrt(2) / 3)
    assert float(evaluate(KERNEL, inputs)["y"][0]) == pytest.approx(4 + np.pi * np.sqrt(2) / 3)


def test_a_failed_guard_speaks() -> None:
    for run in (evaluate, evaluate_floats):
        for bad in (0, -1, float("nan")):
            with pytest.raises(GuardFailure, match=r"^area: a is not positive \(code 4\)$") as e:
                run(KERNEL, {"a": bad, "B": NESTED})
            assert isinstance(e.value, NumericalFailure)
            assert (e.value.code, e.value.message) == (4, "a is not positive")


def test_missing_and_misfit_inputs_are_named() -> None:
    with pytest.raises(ValueError, match="area: no value for the input 'B'"):
        evaluate(KERNEL, {"a": 1})
    with pytest.raises(ValueError, match=r"area: B: expected 4 numbers \[2, 2\], found 3"):
        evaluate(KERNEL, {"a": 1, "B": [1, 2, 3]})


def test_a_nan_condition_fails_a_guard() -> None:
    graph = Graph()
    graph.guard(graph.element("a"), 4, "a is zero")
    made = graph.kernel("nan", [Port("a")], [], {})
    assert evaluate(made, {"a": float("inf")}) == {}
    for run in (evaluate, evaluate_floats):
        with pytest.raises(GuardFailure):
            run(made, {"a": float("nan")})
