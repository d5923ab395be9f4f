"""Every operation: the C, the tape and the float evaluator agree to the bit, at special points too.

The evaluator at 50 digits agrees to the accuracy of a double wherever the value is smooth.
"""

from __future__ import annotations

import itertools
import math
import random
from pathlib import Path

import pytest

from mstmm.derive.verification.kernel_evaluation import evaluate
from mstmm.ir import OPERATIONS, Assign, Element, KernelIR, Port, Store, Temporary
from mstmm.ir.interpreter import evaluate_floats
from mstmm.ir.tape import compile_tape
from tests.support.kernels.c_library import CLibrary, are_same_numbers, build
from tests.support.kernels.random_kernels import element

SPECIAL = (0.0, -0.0, 1.0, -1.0, 0.5, -2.0, 3.0, 1e-310, 710.5, math.inf, -math.inf, math.nan)
REGULAR = (0.3, 0.7, 0.9)


def operation_kernel(op: str) -> KernelIR:
    """y = op(x[0], ...), built without the graph so that nothing folds."""
    args = tuple(Element("x", (i,)) for i in range(OPERATIONS[op].arity))
    statements = (Assign(0, op, args), Store("y", (), Temporary(0)))
    return KernelIR(f"k_{op}", (Port("x", (3,)),), (Port("y"),), statements)


KERNELS = {op: operation_kernel(op) for op in OPERATIONS}


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> CLibrary:
    folder: Path = tmp_path_factory.mktemp("operations")
    return build(folder, element("operations", *KERNELS.values()))


@pytest.mark.parametrize("op", OPERATIONS)
def test_c_tape_and_floats_agree_at_special_points(op: str, library: CLibrary) -> None:
    tape = compile_tape(KERNELS[op])
    operands = OPERATIONS[op].arity
    drawn = random.Random(op)
    more = [tuple(drawn.uniform(-2, 2) for _ in range(3)) for _ in range(20)]
    for point in (*itertools.product(SPECIAL, repeat=min(operands, 2)), *more):
        x = [*point, *(7.0, 8.0, 9.0)][:3]
        wanted = evaluate_floats(KERNELS[op], {"x": x})["y"]
        got = library.call("operations", f"k_{op}", {"x": x}).outputs["y"]
        assert are_same_numbers(got, wanted), (op, x, got, wanted)
        assert math.copysign(1, got[0]) == math.copysign(1, wanted[0]) or got[0] != got[0], (op, x)
        code, (interpreted,) = library.run_tape(tape, [x])
        assert code == 0
        assert are_same_numbers(interpreted, got), (op, x, interpreted, got)


@pytest.mark.parametrize("op", OPERATIONS)
def test_fifty_digits_agree_with_floats(op: str) -> None:
    for x in itertools.permutations(REGULAR):
        wanted = evaluate(KERNELS[op], {"x": x}, digits=50)["y"][0]
        got = evaluate_floats(KERNELS[op], {"x": x})["y"][0]
        assert abs(got - wanted) <= 1e-15 * max(1.0, abs(float(wanted))), (op, x)


@pytest.mark.parametrize("op", OPERATIONS)
def test_fifty_digits_know_the_same_special_values(op: str) -> None:
    """NaN, infinities and signs at poles; mpmath has no negative zero and no overflow."""
    skip = {-0.0: True}
    for point in itertools.product(SPECIAL, repeat=min(OPERATIONS[op].arity, 2)):
        if any(math.copysign(1, v) < 0 and v in skip for v in point) or 710.5 in point:
            continue
        x = [*point, *(7.0, 8.0, 9.0)][:3]
        wanted = evaluate_floats(KERNELS[op], {"x": x})["y"][0]
        got = float(evaluate(KERNELS[op], {"x": x})["y"][0])
        assert math.isclose(got, wanted, rel_tol=1e-14, abs_tol=1e-307) or (
            got != got and wanted != wanted
        ), (op, x, got, wanted)


def test_nan_is_never_hidden(library: CLibrary) -> None:
    for op in ("min", "max", "sign", "abs", "floor"):
        for x in ([math.nan, 1.0, 0.0], [1.0, math.nan, 0.0])[: OPERATIONS[op].arity]:
            assert math.isnan(library.call("operations", f"k_{op}", {"x": x}).outputs["y"][0])
