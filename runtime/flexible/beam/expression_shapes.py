"""Shapes that a user writes as expressions of x, with their exact derivatives."""

from __future__ import annotations

from typing import Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.expression.expression import Expression, Name
from mstmm.ir.differentiation import derivative
from mstmm.ir.graph import Graph, Node

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
    """An expression of x (m) and L (the beam's length, m), with exact derivatives.

    Where a comparison, sign, abs, min or max in it changes sides is a break.
    """

    #: Half-waves per length that the quadrature resolves.
    WAVES = 16.0
    #: Pieces of the beam in which changes of side are looked for, one in each.
    PIECES = 512

    def __init__(self, expression: Expression, length: float) -> None:
        self.text, self.length = expression.text, length
        graph = Graph()
        self._x = graph.element("x")
        at = {"x": self._x, "L": graph.constant(length)}
        nodes = [expression.build(graph, lambda name: at[_plain(name)])]
        for _ in range(4):
            nodes.append(derivative(nodes[-1], {self._x: 1}))
        self._nodes = nodes
        self.breaks = (0.0, *sorted(self._switches(nodes[0])), length)

    def _switches(self, root: Node) -> set[float]:
        """Places at which the expression passes from one smooth piece to the next."""
        found: set[float] = set()
        for side in _sides(root):
            x = np.linspace(0.0, self.length, self.PIECES + 1)
            values = _value(side, x) + np.zeros_like(x)
            for i in np.flatnonzero(np.diff(np.sign(values))):
                low, high = x[i], x[i + 1]
                for _ in range(60):
                    middle = (low + high) / 2
                    same = np.sign(_value(side, np.array([middle]))).item() == np.sign(values[i])
                    low, high = (middle, high) if same else (low, middle)
                found.add(float(high))
        return {x for x in found if 1e-9 < x / self.length < 1 - 1e-9}

    @property
    def density(self) -> float:
        return self.WAVES / self.length

    def __call__(self, x: Array, d: int = 0) -> Array:
        value = _value(self._nodes[d], np.asarray(x, dtype=float))
        return np.broadcast_to(value, np.shape(x))


def _plain(name: Name) -> str:
    return ".".join(name.parts)


def _sides(root: Node) -> list[Node]:
    """What changes its sign where the expression changes its form."""
    sides, seen, stack = [], set(), [root]
    while stack:
        node = stack.pop()
        if node.number in seen:
            continue
        seen.add(node.number)
        stack.extend(node.args)
        if node.op in ("lt", "le", "eq", "min", "max"):
            sides.append(node.args[0] - node.args[1])
        elif node.op in ("abs", "sign"):
            sides.append(node.args[0])
    return sides


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
    with np.errstate(all="ignore"):  # of the branch that is not taken
        return _VECTORISED[node.op](*args)
