"""Derivatives of an expression by its names, with the same rules as compiled code."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ..ir.differentiation import derivatives
from ..ir.graph import Graph
from ..ir.terms import Node
from .drive import node_value
from .expression import Expression, Name


def expression_derivatives(
    expression: Expression, values: Callable[[Name], float]
) -> dict[Name, float]:
    """Derivatives by each name in double precision, in the order of the text.

    nan or infinity where there is no finite derivative.
    """
    graph = Graph()
    leaves = {name: graph.element("names", i) for i, name in enumerate(expression.names)}
    numbers = {leaf.number: float(values(name)) for name, leaf in leaves.items()}
    root = expression.build(graph, leaves.__getitem__)

    def number(node: Node) -> float:
        return numbers[node.number]

    zero_rates = dict.fromkeys(leaves.values(), 0)
    return {
        name: node_value(derivatives([root], {**zero_rates, leaf: 1})[0], number)
        for name, leaf in leaves.items()
    }


def dependency_parts(
    expression: Expression, names: Sequence[Name]
) -> tuple[list[tuple[Name, ...] | None], bool]:
    """Structure of an expression in `names`: dependence of its derivatives, and a remainder.

    Returns for each of `names` the names on which the derivative by it depends, None where that
    derivative is zero everywhere; and whether the expression is nonzero where all of them are zero.
    """
    graph = Graph()
    leaves = {name: graph.element("names", i) for i, name in enumerate(expression.names)}
    root = expression.build(graph, leaves.__getitem__)
    zero_rates = dict.fromkeys(leaves.values(), 0)
    dependencies: list[tuple[Name, ...] | None] = []
    for name in names:
        name_derivative = derivatives([root], {**zero_rates, leaves[name]: 1})[0]
        is_zero = name_derivative.value == 0
        used_nodes = _dependencies(name_derivative)
        dependencies.append(
            None if is_zero else tuple(n for n, leaf in leaves.items() if leaf.number in used_nodes)
        )
    zeroed_leaves = {
        name: graph.constant(0) if name in names else leaf for name, leaf in leaves.items()
    }
    return dependencies, expression.build(graph, zeroed_leaves.__getitem__).value != 0


def _dependencies(root: Node) -> set[int]:
    """Numbers of the nodes that a node depends on, its own included."""
    visited: set[int] = set()
    stack = [root]
    while stack:
        node = stack.pop()
        if node.number not in visited:
            visited.add(node.number)
            stack.extend(node.args)
    return visited
