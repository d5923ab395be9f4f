"""Slopes of an expression at a point, by the rules that compiled code follows."""

from __future__ import annotations

from collections.abc import Callable

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
