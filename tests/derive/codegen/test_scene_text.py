"""Random kernels: one state, lanes and 40 digits agree within the bound of rounding."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from mstmm.derive.codegen import scene_text, straight_line
from mstmm.derive.verification.kernel_evaluation import rounding_bounds
from mstmm.ir import OPERATIONS, Port
from mstmm.ir.graph import Graph
from tests.support.kernels.fused_helpers import COMPILERS, FusedLab
from tests.support.kernels.random_kernels import random_inputs, random_kernel

JUMPS = ("sign", "floor", "lt", "le", "eq", "and", "or", "not", "select")
CONTINUOUS = tuple(op for op in OPERATIONS if op not in JUMPS)
SEEDS = range(5)
SMOOTH = [random_kernel(f"smooth{seed}", seed, 60, CONTINUOUS) for seed in SEEDS]
#: Only these have jumps, so that rounding can turn a comparison: lanes against one state alone.
MIXED = [random_kernel(f"mixed{seed}", seed, 60) for seed in range(2)]


def guarded_kernel() -> Any:
    """y = x0 x1; fails with 3 unless x0 < 1, with 4 unless x1 < 1, with 7 where x1 is zero."""
    graph = Graph()
    x = graph.vector("x", 2)
    graph.guard(graph.call("lt", x[0], 1), 3, "first")
    graph.guard(graph.call("lt", x[1], 1), 4, "second")
    graph.guard(x[1], 7, "third")
    return graph.kernel("guarded", [Port("x", (2,))], [Port("y")], {"y": x[0] * x[1]})


#: Compilers, and lines printed whole or in parts of so many statements.
PRINTED = [(compiler, size) for compiler in COMPILERS for size in (0, 7)]


@pytest.fixture(scope="module", params=PRINTED, ids=lambda one: f"{one[0]} {one[1] or 'whole'}")
def lab(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> FusedLab:
    compiler, size = request.param
    folder = tmp_path_factory.mktemp("lab")
    with pytest.MonkeyPatch.context() as patch:
        if size:
            patch.setattr(scene_text, "MAX_UNSPLIT_SIZE", 0)
            patch.setattr(straight_line, "PART_SIZE", size)
        return FusedLab(folder, [*SMOOTH, *MIXED, guarded_kernel()], compiler)


@pytest.mark.parametrize("seed", SEEDS)
def test_one_state_and_lanes_stay_within_the_bound(seed: int, lab: FusedLab) -> None:
    kernel = SMOOTH[seed]
    states = [random_inputs(1000 * seed + k) for k in range(lab.lanes)]
    codes, rows = lab.side_by_side(kernel.name, states)
    assert not any(codes)
    for state, row in zip(states, rows, strict=True):
        code, one = lab.evaluate_state(kernel.name, state)
        assert code == 0
        for name, bounds in rounding_bounds(kernel, state).items():
            for (value, bound), got, lane in zip(bounds, one[name], row[name], strict=True):
                # Inlined sines are exact to 2.3e-16, not to one unit in the last place.
                allowed = 4 * bound + 4e-16
                assert abs(float(got - value)) <= allowed
                assert abs(float(lane - value)) <= allowed


@pytest.mark.parametrize("kernel", MIXED, ids=lambda kernel: kernel.name)
def test_kernels_with_jumps(kernel: Any, lab: FusedLab) -> None:
    states = [random_inputs(k) for k in range(lab.lanes)]
    _, rows = lab.side_by_side(kernel.name, states)
    for state, row in zip(states, rows, strict=True):
        _, one = lab.evaluate_state(kernel.name, state)
        assert np.allclose(one["y"], row["y"], rtol=1e-12, atol=1e-12)


def test_a_lane_knows_nothing_of_its_neighbours(lab: FusedLab) -> None:
    """Neighbours that are NaN, infinite or beyond the range of the sines change no bit."""
    name, mine = MIXED[0].name, random_inputs(77)
    _, calm = lab.side_by_side(name, [mine] * lab.lanes)
    values = (math.nan, math.inf, 5e4, -1e300, 0.0)
    for k in range(lab.lanes):
        states = [
            {port: [values[(k + j) % 5]] * len(row) for port, row in mine.items()}
            for j in range(lab.lanes)
        ]
        states[k] = mine
        codes, rows = lab.side_by_side(name, states)
        assert codes[k] == 0
        for port in ("y", "total"):
            assert rows[k][port].tobytes() == calm[0][port].tobytes()


def test_guards_of_every_lane(lab: FusedLab) -> None:
    cases = [
        ((0.5, 0.5), 0), ((2.0, 0.5), 3), ((0.5, 2.0), 4), ((2.0, 2.0), 3), ((math.nan, 0.5), 3),
        ((0.5, 0.0), 7), ((0.5, math.nan), 4), ((-3.0, -3.0), 0),
    ]  # fmt: skip
    for shift in range(len(cases)):
        turned = (cases[shift:] + cases[:shift])[: lab.lanes]
        codes, rows = lab.side_by_side("guarded", [{"x": x} for x, _ in turned])
        assert codes == [code for _, code in turned]
        for (x, code), row in zip(turned, rows, strict=True):
            assert lab.evaluate_state("guarded", {"x": x})[0] == code
            assert code or row["y"][0] == x[0] * x[1]
