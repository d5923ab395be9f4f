"""Kernels drawn at random, over every operation of the IR."""

from __future__ import annotations

import random
from collections.abc import Sequence

from mstmm.ir import OPERATIONS, KernelIR, Port
from mstmm.ir.element_spec import ElementSpec, Param
from mstmm.ir.graph import Graph, Node

INPUTS = (Port("x", (4,)), Port("A", (2, 3)))

#: Operations whose value is brought back to order one by a sine.
_GROWING = frozenset({"add", "sub", "mul", "tan", "sinh", "cosh"})


def random_kernel(
    name: str, seed: int, size: int = 60, operations: Sequence[str] = tuple(OPERATIONS)
) -> KernelIR:
    """About `size` operations on values of order one; a guard that only a NaN in x[0] fails.

    No constant is special (no pi), so that steps and kinks are met with probability zero.
    """
    draw = random.Random(seed)
    graph = Graph()
    pool: list[Node] = [*graph.vector("x", 4), *sum(graph.matrix("A", 2, 3), [])]
    pool += [graph.constant(3), graph.constant(-1) / 3, graph.constant(0.1)]
    ends: list[Node] = []
    for _ in range(size):
        op = draw.choice(operations)
        ends.append(
            _value(draw, op, [draw.choice(pool[-20:]) for _ in range(OPERATIONS[op].arity)])
        )
        pool.append(ends[-1])
    graph.guard(graph.call("le", pool[0], pool[0]), 5, "x[0] is a number")
    outputs = (Port("y", (size,)), Port("total", (2, 2), accumulate=True))
    values: dict[str, object] = {"y": ends, "total": [ends[:2], ends[2:4]]}
    return graph.kernel(name, INPUTS, outputs, values)


def _value(draw: random.Random, op: str, args: list[Node]) -> Node:
    """The operation, on operands moved into its domain, of order one."""
    graph = args[0].graph
    call = graph.call
    inside = [call("sin", a) for a in args]
    if op in _GROWING:
        return call("sin", call(op, *args))
    if op in ("asin", "acos", "exp"):
        return call(op, inside[0])
    if op in ("sqrt", "log"):
        return call(op, call("abs", args[0]) + graph.constant(0.5))
    if op == "pow":
        exponent = inside[1] if draw.random() < 0.5 else graph.constant(-2)
        return call(op, inside[0] + 2, exponent)
    if op == "div":
        return call(op, inside[0], inside[1] + 2)
    return call(op, *args)


def random_inputs(seed: int) -> dict[str, list[float]]:
    """Values for `INPUTS`, of order one."""
    draw = random.Random(seed)
    return {port.name: [draw.uniform(-2, 2) for _ in range(port.length())] for port in INPUTS}


def element(name: str, *kernels: KernelIR) -> ElementSpec:
    """A made-up element that carries the kernels."""
    return ElementSpec(
        kind="hinge",
        name=name,
        title="made up for a test",
        coordinates=(Param("angle", "rad"),),
        speeds=(Param("rate", "rad/s"),),
        parameters=(Param("lead", "m", "per turn", 0.1, 0.0),),
        kernels=kernels,
    )
