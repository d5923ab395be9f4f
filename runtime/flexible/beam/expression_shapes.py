"""Shape functions given as expressions of x, with exact derivatives."""

from __future__ import annotations

from typing import Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.expression.expression import Expression, Name
from mstmm.ir.differentiation import derivative
from mstmm.ir.graph import Graph
from mstmm.ir.operations import OPERATIONS
from mstmm.ir.terms import Node, dependencies


class ExpressionShape:
    """Shape function given as an expression of x (m) and L (length of the beam, m).

    Breaks are where a comparison, sign, abs, min or max in the expression switches.
    """

    #: Half-waves per length that the quadrature resolves.
    WAVES = 16.0
    #: Pieces of the beam that are searched for switches, at most one in each.
    PIECES = 512

    def __init__(self, expression: Expression, length: float) -> None:
        self.text, self.length = expression.text, length
        graph = Graph()
        self._x = graph.element("x")
        variables = {"x": self._x, "L": graph.constant(length)}
        nodes = [expression.build(graph, lambda name: variables[_dotted_name(name)])]
        for _ in range(4):
            nodes.append(derivative(nodes[-1], {self._x: 1}))
        self._nodes = nodes
        self.breaks = (0.0, *sorted(self._breaks(nodes[0])), length)

    def _breaks(self, root: Node) -> set[float]:
        """Positions (m) at which the expression changes from one smooth piece to the next."""
        places: set[float] = set()
        for switch in _switch_functions(root):
            x = np.linspace(0.0, self.length, self.PIECES + 1)
            values = _evaluate(switch, x) + np.zeros_like(x)
            for i in np.flatnonzero(np.diff(np.sign(values))):
                low, high = x[i], x[i + 1]
                for _ in range(60):
                    middle = (low + high) / 2
                    sign = np.sign(_evaluate(switch, np.array([middle]))).item()
                    is_left = sign == np.sign(values[i])
                    low, high = (middle, high) if is_left else (low, middle)
                places.add(float(high))
        return {x for x in places if 1e-9 < x / self.length < 1 - 1e-9}

    @property
    def density(self) -> float:
        return self.WAVES / self.length

    def __call__(self, x: Array, d: int = 0) -> Array:
        value = _evaluate(self._nodes[d], np.asarray(x, dtype=float))
        return np.broadcast_to(value, np.shape(x))


def _dotted_name(name: Name) -> str:
    return ".".join(name.parts)


def _switch_functions(root: Node) -> list[Node]:
    """Nodes whose sign change switches the expression."""
    switches = []
    for node in dependencies(root):
        if node.op in ("lt", "le", "eq", "min", "max"):
            switches.append(node.args[0] - node.args[1])
        elif node.op in ("abs", "sign"):
            switches.append(node.args[0])
    return switches


def _evaluate(root: Node, x: Array) -> Array:
    """Value of a node at every x (m)."""
    known_values: dict[int, Any] = {}
    for node in dependencies(root):
        arguments = [known_values[a.number] for a in node.args]
        known_values[node.number] = _evaluate_node(node, arguments, x)
    return np.asarray(known_values[root.number], dtype=float)


def _evaluate_node(node: Node, args: list[Any], x: Array) -> Any:
    if node.op == "element":
        return x
    if node.op == "pi":
        return np.pi
    if node.value is not None:
        return float(node.value)
    with np.errstate(all="ignore"):  # the branch not selected may be undefined
        return getattr(np, OPERATIONS[node.op].numpy)(*args)
