"""Every operation in one number and in lanes, at special points too, by every compiler there is."""

from __future__ import annotations

import itertools
import math

import pytest

from mstmm.ir import (
    OPERATIONS,
    Assign,
    Constant,
    Element,
    KernelIR,
    Operand,
    Port,
    Store,
    Temporary,
)
from mstmm.ir.interpreter import evaluate_floats
from tests.support.kernels.fused_helpers import COMPILERS, WIDTHS, FusedLab

SPECIAL = (0.0, -0.0, 1.0, -1.0, 0.5, -2.0, 3.0, 1e-310, 710.5, math.inf, -math.inf, math.nan)


def operation_kernel(op: str) -> KernelIR:
    """y[0] = op(x[0], ...), y[1] = the same in an addition, y[2] = with a constant operand."""
    operands: tuple[Operand, ...] = tuple(Element("x", (i,)) for i in range(OPERATIONS[op].arity))
    statements = (
        Assign(0, op, operands),
        Assign(1, "add", (Temporary(0), Constant("1/2"))),
        Assign(2, op, (*operands[:-1], Constant("-1/3"))),
        Store("y", (0,), Temporary(0)),
        Store("y", (1,), Temporary(1)),
        Store("y", (2,), Temporary(2)),
    )
    return KernelIR(f"k_{op}", (Port("x", (3,)),), (Port("y", (3,)),), statements)


KERNELS = {op: operation_kernel(op) for op in OPERATIONS}
CASES = [(compiler, width) for compiler in COMPILERS for width in WIDTHS]


@pytest.fixture(scope="module", params=CASES, ids=["-".join(case) for case in CASES])
def lab(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> FusedLab:
    compiler, width = request.param
    # Rounded operation by operation, as Python does.
    flags = (*WIDTHS[width], "-ffp-contract=off")
    return FusedLab(tmp_path_factory.mktemp("lab"), list(KERNELS.values()), compiler, flags)


def points(op: str) -> list[list[float]]:
    found = itertools.product(SPECIAL, repeat=min(OPERATIONS[op].arity, 2))
    return [[*point, 7.0, 8.0, 9.0][:3] for point in found]


def agree(op: str, got: float, wanted: float) -> bool:
    if math.isnan(wanted) or math.isnan(got):
        return math.isnan(wanted) and math.isnan(got)
    if op in ("sin", "cos"):
        return abs(got - wanted) <= 3.4e-16
    return got == wanted and math.copysign(1, got) == math.copysign(1, wanted)


@pytest.mark.parametrize("op", OPERATIONS)
def test_operations(op: str, lab: FusedLab) -> None:
    states = [{"x": x} for x in points(op)]
    states += [states[-1]] * (-len(states) % lab.lanes)
    for first in range(0, len(states), lab.lanes):
        group = states[first : first + lab.lanes]
        codes, rows = lab.side_by_side(f"k_{op}", group)
        assert not any(codes)
        for state, row in zip(group, rows, strict=True):
            wanted = evaluate_floats(KERNELS[op], state)["y"]
            _, one = lab.evaluate_state(f"k_{op}", state)
            for place in range(3):
                assert agree(op, one["y"][place], wanted[place]), (state, place)
                assert agree(op, row["y"][place], wanted[place]), (state, place)


def test_lanes_are_as_wide_as_asked(lab: FusedLab) -> None:
    assert lab.lanes in (2, 4, 8)
