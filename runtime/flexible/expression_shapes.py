"""Shapes that a user writes as expressions of x, with their exact derivatives."""

from __future__ import annotations

from typing import Any

import numpy as np

from mstmm.expression import Expression, Name
from mstmm.graph import Graph, Node
from mstmm.tangent import derivative

from .modal_body import Array

#: Operations that numpy has under another name than the expressions' own meaning.
_VECTORISED: dict[str, Any] = {
    "neg": np.negative, "add": np.add, "sub": np.subtract, "mul": np.multiply, "div": np.divide,
    "pow": np.power, "sqrt": np.sqrt, "sin": np.sin, "cos": np.cos, "tan": np.tan,
    "asin": np.arcsin, "acos": np.arccos, "atan": np.arctan, "atan2": np.arctan2,
    "sinh": np.sinh, "cosh": np.cosh, "tanh": np.tanh, "exp": np.exp, "log": np.log,
    "abs": np.abs, "sign": np.sign, "floor": np.floor, "min": np.minimum, "max": np.maximum,
    "lt": np.less, "le": np.less_equal, "eq": np.equal, "and": np.logical_and,
    "or": np.logical_or, "not": np.logical_not, "select": np.where,
}  # fmt: skip


class ExpressionShape:
    """An expression of x (m) and L (the beam's length, m); smooth over the whole beam."""

    #: Half-waves per length that the quadrature resolves.
    WAVES = 16.0

    def __init__(self, expression: Expression, length: float) -> None:
        self.text, self.length = expression.text, length
        graph = Graph()
        self._x = graph.element("x")
        at = {"x": self._x, "L": graph.constant(length)}
        nodes = [expression.build(graph, lambda name: at[_plain(name)])]
        for _ in range(4):
            nodes.append(derivative(nodes[-1], {self._x: 1}))
        self._nodes = nodes

    @property
    def breaks(self) -> tuple[float, ...]:
        return (0.0, self.length)

    @property
    def density(self) -> float:
        return self.WAVES / self.length

    def __call__(self, x: Array, d: int = 0) -> Array:
        return np.broadcast_to(_value(self._nodes[d], np.asarray(x, dtype=float)), np.shape(x))


def _plain(name: Name) -> str:
    return ".".join(name.parts)


def _value(root: Node, x: Array) -> Array:
    """Value of a node at every x."""
    known: dict[int, Any] = {}
    stack = [root]
    while stack:
        node = stack[-1]
        missing = [a for a in node.args if a.number not in known]
        if missing and node.number not in known:
            stack.extend(missing)
            continue
        stack.pop()
        if node.number not in known:
            known[node.number] = _one(node, [known[a.number] for a in node.args], x)
    return np.asarray(known[root.number], dtype=float)


def _one(node: Node, args: list[Any], x: Array) -> Any:
    if node.op == "element":
        return x
    if node.op == "pi":
        return np.pi
    if node.value is not None:
        return float(node.value)
    return _VECTORISED[node.op](*args)
