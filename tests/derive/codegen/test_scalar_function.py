"""Kernels in float, double and quadruple against evaluation at 50 digits."""

from __future__ import annotations

from pathlib import Path

import mpmath
import pytest

from mstmm.derive.codegen.scalar_function import SCALARS, scalar_source
from mstmm.derive.verification.kernel_evaluation import evaluate
from mstmm.ir import KernelIR, Port
from mstmm.ir.graph import Graph
from mstmm.ir.interpreter import evaluate_floats
from tests.support.kernels.random_kernels import random_inputs, random_kernel
from tests.support.kernels.scalar_kernels import ScalarKernel

#: What the type can hold, times the operations of a kernel and their conditioning.
ACCURACY = {"float": 1e-4, "double": 1e-12, "quadruple": 1e-30}


@pytest.mark.parametrize("scalar", SCALARS)
def test_all_operations(scalar: str, tmp_path: Path) -> None:
    assert set(ACCURACY) == set(SCALARS)
    for seed in range(4):
        kernel = random_kernel(f"all{seed}", seed, size=60)
        folder = tmp_path / str(seed)
        folder.mkdir()
        compiled = ScalarKernel(kernel, scalar, folder)
        # Numbers that a float holds, so that all types see the same.
        inputs = {
            name: [round(x * 1024) / 1024 for x in row]
            for name, row in random_inputs(seed + 50).items()
        }
        found, wanted = compiled(inputs), evaluate(kernel, inputs)
        for name, row in wanted.items():
            for a, b in zip(found[name], row, strict=True):
                with mpmath.workdps(50):
                    error = abs(a.numerator - b * a.denominator) / a.denominator
                    assert error <= ACCURACY[scalar] * max(1, abs(b)), (seed, name)
        if scalar == "double":
            floats = evaluate_floats(kernel, inputs)
            assert {name: [float(x) for x in row] for name, row in found.items()} == floats


def constant_kernel() -> KernelIR:
    """y = [1/3, 10^-14, -pi, 2^70 + 1], for x > 0."""
    graph = Graph()
    graph.guard(graph.call("lt", 0, graph.element("x")), 6, "x is not positive")
    third, small = graph.constant(1) / 3, graph.constant(1) / 10**14
    values: dict[str, object] = {"y": [third, small, -graph.pi, graph.constant(2**70 + 1)]}
    return graph.kernel("constants", [Port("x")], [Port("y", (4,))], values)


def test_constants_have_the_precision_of_the_type(tmp_path: Path) -> None:
    compiled = ScalarKernel(constant_kernel(), "quadruple", tmp_path)
    found = compiled({"x": [1.0]})["y"]
    assert abs(3 * found[0] - 1) < 1e-31 and abs(10**14 * found[1] - 1) < 1e-31
    with mpmath.workdps(50):
        assert abs(found[2].numerator / mpmath.mpf(found[2].denominator) + mpmath.pi) < 1e-31
    assert found[3] == 2**70 + 1
    with pytest.raises(ValueError, match="guard 6"):
        compiled({"x": [-1.0]})


def test_an_unknown_type_is_refused() -> None:
    with pytest.raises(
        ValueError, match="unknown scalar type 'half'; expected one of float, double"
    ):
        scalar_source(constant_kernel(), "half")
