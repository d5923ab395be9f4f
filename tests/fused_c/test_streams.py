"""Merging the parts of a straight line: the same statements, each behind what it reads."""

from __future__ import annotations

import pytest
from support.random_kernels import random_inputs, random_kernel

from mstmm.derive.evaluate import evaluate_floats
from mstmm.derive.fused_sincos import gather
from mstmm.derive.straight_c import operands
from mstmm.derive.streams import merged
from mstmm.graph import Graph
from mstmm.ir import Assign, Guard, KernelIR, Port, Temporary


@pytest.mark.parametrize("seed", range(8))
def test_the_same_statements_in_an_order_that_can_be_computed(seed: int) -> None:
    kernel = random_kernel("drawn", seed, 150)
    ordered = gather(kernel.statements)
    early = [s for level in ordered.levels for s in level.statements]
    angles = [a for level in ordered.levels for a in level.angles]
    found = merged(ordered.rest)
    assert sorted(map(str, found)) == sorted(map(str, ordered.rest))
    known = {s.number for s in early} | {n for a in angles for n in (*a.sines, *a.cosines)}
    for statement in found:
        read = {a.number for a in operands(statement) if isinstance(a, Temporary)}
        assert read <= known
        if isinstance(statement, Assign):
            known.add(statement.number)


@pytest.mark.parametrize("seed", range(4))
def test_values_are_untouched(seed: int) -> None:
    kernel = random_kernel("drawn", seed, 100, ("add", "sub", "mul", "div", "select", "lt"))
    again = KernelIR(kernel.name, kernel.inputs, kernel.outputs, tuple(merged(kernel.statements)))  # type: ignore[arg-type]
    inputs = random_inputs(seed)
    assert evaluate_floats(again, inputs) == evaluate_floats(kernel, inputs)


def test_a_part_that_waits_for_nothing_is_not_kept_waiting() -> None:
    """A long chain behind a guard, and another that is independent: they alternate."""
    graph = Graph()
    judged, free = graph.vector("x", 2)
    for _ in range(40):
        judged, free = judged * judged + 1, free * free - 3
    graph.guard(graph.call("lt", 0, judged), 1, "judged")
    kernel = graph.kernel("two", [Port("x", (2,))], [Port("y")], {"y": free + judged})
    order = merged(kernel.statements)  # type: ignore[arg-type]
    guard = next(k for k, s in enumerate(order) if isinstance(s, Guard))
    at = next(k for k, s in enumerate(kernel.statements) if isinstance(s, Guard))
    assert at < len(order) / 2 < guard
