"""Kernels compiled in a scalar type and called with numpy arrays, against 50 digits."""

from __future__ import annotations

import math
import shutil

import mpmath
import numpy as np
import pytest

from mstmm.abi.scalar_types import SCALARS
from mstmm.derive.verification.kernel_evaluation import evaluate
from mstmm.ir import OPERATIONS, Port
from mstmm.ir.graph import Graph
from mstmm.pipeline.extended_precision import compile_kernel
from mstmm.runtime.kernels.scalar_kernel import fractions
from tests.support.kernels.random_kernels import random_inputs, random_kernel

JUMPS = ("sign", "floor", "lt", "le", "eq", "and", "or", "not", "select")
SMOOTH = random_kernel("smooth", 3, 60, [op for op in OPERATIONS if op not in JUMPS])


@pytest.mark.parametrize("scalar", SCALARS)
def test_values_are_as_exact_as_the_type(scalar: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if scalar == "quadruple" and shutil.which("gcc"):
        monkeypatch.setenv("CC", "gcc")  # libquadmath is gcc's
    inputs = {
        name: [round(x * 256) / 256 for x in row] for name, row in random_inputs(4).items()
    }  # numbers that a float holds
    call = compile_kernel(SMOOTH, scalar)
    code, found = call(inputs, start={"total": np.ones((2, 2))})
    assert code == 0
    exact = evaluate(SMOOTH, inputs)
    with mpmath.workdps(45):
        for name, before in (("y", 0), ("total", 1)):
            array = found[name]
            if scalar == "quadruple":
                assert array.shape[-1] == 2
                values = [mpmath.mpf(f.numerator) / f.denominator for f in fractions(array)]
            else:
                assert array.dtype == SCALARS[scalar].array
                values = [mpmath.mpf(float(v)) for v in array.ravel()]
            errors = [abs(v - e - before) for v, e in zip(values, exact[name], strict=True)]
            assert max(errors) < 2000 * SCALARS[scalar].roundoff


def test_guards_pairs_and_wrong_inputs() -> None:
    graph = Graph()
    x = graph.vector("x", 2)
    graph.guard(graph.call("lt", 0, x[0]), 6, "positive")
    kernel = graph.kernel("root", [Port("x", (2,))], [Port("y")], {"y": x[0] - 1})
    call = compile_kernel(kernel, "double")
    assert call({"x": [2.0, 0.0]}) == (0, {"y": np.array(1.0)})
    assert call({"x": [-1.0, 0.0]})[0] == 6
    assert call({"x": [math.nan, 0.0]})[0] == 6
    with pytest.raises(ValueError, match="root: no value for the input 'x'"):
        call({})
    with pytest.raises(ValueError, match=r"root: x has shape \(3,\), not \(2,\)"):
        call({"x": [1.0, 2.0, 3.0]})
    with pytest.raises(ValueError, match="scalar type 'half'"):
        compile_kernel(kernel, "half")


def test_quadruple_values_travel_as_pairs(monkeypatch: pytest.MonkeyPatch) -> None:
    if shutil.which("gcc"):
        monkeypatch.setenv("CC", "gcc")
    graph = Graph()
    kernel = graph.kernel("less", [Port("x")], [Port("y")], {"y": graph.element("x") - 1})
    call = compile_kernel(kernel, "quadruple")
    _, found = call({"x": np.array([1.0, 2.0**-90])})
    assert found["y"].tolist() == [2.0**-90, 0.0]
    _, found = call({"x": 3.0})
    assert found["y"].tolist() == [2.0, 0.0]
    _, found = call({"x": np.inf})
    assert found["y"].tolist() == [math.inf, 0.0]
