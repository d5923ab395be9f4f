"""Orders of a straight line: the same statements, each behind what it reads."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import pytest

from mstmm.derive.fuse.instruction_scheduling import Line, interleave, order_for_registers
from mstmm.derive.fuse.sum_balancing import gather
from mstmm.ir import Assign, Guard, KernelIR, Port, Store, Temporary
from mstmm.ir.graph import Graph
from mstmm.ir.interpreter import evaluate_floats
from mstmm.ir.statements import operands
from tests.support.kernels.random_kernels import random_inputs, random_kernel


def lines(kernel: KernelIR) -> list[Line]:
    return [s for s in kernel.statements if isinstance(s, (Assign, Store, Guard))]


Order = Callable[[Sequence[Line]], list[Line]]
ORDERS = pytest.mark.parametrize(
    "order", [interleave, order_for_registers], ids=["interleave", "thrifty"]
)


@ORDERS
@pytest.mark.parametrize("seed", range(8))
def test_the_same_statements_in_an_order_that_can_be_computed(seed: int, order: Order) -> None:
    kernel = random_kernel("drawn", seed, 150)
    ordered = gather(kernel.statements)
    early = [s for level in ordered.levels for s in level.statements]
    angles = [a for level in ordered.levels for a in level.angles]
    found = order(ordered.remaining)
    assert sorted(map(str, found)) == sorted(map(str, ordered.remaining))
    known = {s.number for s in early} | {n for a in angles for n in (*a.sines, *a.cosines)}
    for statement in found:
        read = {a.number for a in operands(statement) if isinstance(a, Temporary)}
        assert read <= known
        if isinstance(statement, Assign):
            known.add(statement.number)


@ORDERS
@pytest.mark.parametrize("seed", range(4))
def test_values_are_untouched(seed: int, order: Order) -> None:
    kernel = random_kernel("drawn", seed, 100, ("add", "sub", "mul", "div", "select", "lt"))
    statements = tuple(order(lines(kernel)))
    again = KernelIR(kernel.name, kernel.inputs, kernel.outputs, statements)
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
    order = interleave(lines(kernel))
    guard = next(k for k, s in enumerate(order) if isinstance(s, Guard))
    at = next(k for k, s in enumerate(kernel.statements) if isinstance(s, Guard))
    assert at < len(order) / 2 < guard


def most_alive(order: Sequence[Line]) -> int:
    """Largest number of values that somebody still reads."""
    left: dict[int, int] = {}
    for statement in order:
        for a in operands(statement):
            if isinstance(a, Temporary):
                left[a.number] = left.get(a.number, 0) + 1
    alive = most = 0
    for statement in order:
        for a in operands(statement):
            if isinstance(a, Temporary):
                left[a.number] -= 1
                alive -= left[a.number] == 0
        alive += isinstance(statement, Assign) and left.get(statement.number, 0) > 0
        most = max(most, alive)
    return most


def test_values_that_can_be_used_up_are() -> None:
    """Twenty products made first and summed afterwards: thrift sums as it goes."""
    graph = Graph()
    x = graph.vector("x", 40)
    products = [x[2 * i] * x[2 * i + 1] for i in range(20)]
    total = graph.constant(0)
    for product in products:
        total = total + graph.sqrt(product)
    kernel = graph.kernel("sum", [Port("x", (40,))], [Port("y")], {"y": total})
    wide = sorted(lines(kernel), key=lambda s: not (isinstance(s, Assign) and s.op == "mul"))
    assert most_alive(wide) >= 20
    assert most_alive(order_for_registers(wide)) <= 4
