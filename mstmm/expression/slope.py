"""Slopes of an expression at a point, by the rules that compiled code follows."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ..ir.graph import Graph
from ..ir.tangent import derivatives
from ..ir.terms import Node
from .drive import value
from .expression import Expression, Name


def slopes(expression: Expression, values: Callable[[Name], float]) -> dict[Name, float]:
    """Derivative by each name in double precision, in the order of the text.

    nan or an infinity where the mathematics has no finite one.
    """
    graph = Graph()
    leaves = {name: graph.element("names", i) for i, name in enumerate(expression.names)}
    numbers = {leaf.number: float(values(name)) for name, leaf in leaves.items()}
    root = expression.build(graph, leaves.__getitem__)

    def number(node: Node) -> float:
        return numbers[node.number]

    still = dict.fromkeys(leaves.values(), 0)
    return {
        name: value(derivatives([root], {**still, leaf: 1})[0], number)
        for name, leaf in leaves.items()
    }


def parted(
    expression: Expression, names: Sequence[Name]
) -> tuple[list[tuple[Name, ...] | None], bool]:
    """What an expression is made of: per name of `names` the names on which the slope by it
    depends, None where that slope is zero everywhere; and whether anything is left where all of
    them are zero."""
    graph = Graph()
    leaves = {name: graph.element("names", i) for i, name in enumerate(expression.names)}
    root = expression.build(graph, leaves.__getitem__)
    still = dict.fromkeys(leaves.values(), 0)
    ways: list[tuple[Name, ...] | None] = []
    for name in names:
        slope = derivatives([root], {**still, leaves[name]: 1})[0]
        zero = slope.value == 0
        used = _under(slope)
        ways.append(None if zero else tuple(n for n, leaf in leaves.items() if leaf.number in used))
    zeros = {name: graph.constant(0) if name in names else leaf for name, leaf in leaves.items()}
    return ways, expression.build(graph, zeros.__getitem__).value != 0


def _under(root: Node) -> set[int]:
    """Numbers of the nodes that a node depends on, itself among them."""
    seen: set[int] = set()
    stack = [root]
    while stack:
        node = stack.pop()
        if node.number not in seen:
            seen.add(node.number)
            stack.extend(node.args)
    return seen
