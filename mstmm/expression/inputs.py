"""Inputs and signals in expressions: polynomials in time with coefficients read at run time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from ..ir.terms import Node
from ..numbers.pieces import COUNT, Pieces
from .expression import Name

#: Inputs and signals by their names.
Inputs = Mapping[str, Pieces]

#: Port of the coefficients of all inputs, COUNT of each.
INPUTS = "inputs"


def polynomial(numbers: Sequence[Node], time: Node) -> Node:
    """Value at `time` of a piece (`mstmm.numbers.pieces`) whose coefficients are nodes."""
    t0, c0, c1, c2, c3 = numbers
    s = time - t0
    return c0 + s * (c1 + s * (c2 + s * c3))


def input_at(place: int, time: Node) -> Node:
    """Value at `time` of the input at index `place`, its coefficients read from the port."""
    return polynomial([time.graph.element(INPUTS, COUNT * place + k) for k in range(COUNT)], time)


class Resolved:
    """Nodes of inputs, and the values of their leaves at a given time."""

    def __init__(self, time: Node, inputs: Inputs) -> None:
        self.time, self.inputs = time, inputs
        self._leaves: dict[int, tuple[str, int]] = {}
        self._places = {name: place for place, name in enumerate(inputs)}

    def node(self, name: Name) -> Node:
        """Build the node of `t` or of an input."""
        if name.text == "t":
            return self.time
        first = COUNT * self._places[name.text]
        numbers = [self.time.graph.element(INPUTS, first + k) for k in range(COUNT)]
        self._leaves.update({node.number: (name.text, k) for k, node in enumerate(numbers)})
        return polynomial(numbers, self.time)

    def leaf(self, t: float) -> Callable[[Node], float]:
        """Function that returns the value of each leaf at time t (s)."""

        def number(node: Node) -> float:
            if node.number not in self._leaves:
                return t
            name, k = self._leaves[node.number]
            return self.inputs[name].at(t)[k]

        return number
