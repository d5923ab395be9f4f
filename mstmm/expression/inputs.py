"""Inputs and signals in expressions: polynomials in time with coefficients read at run time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from ..ir.terms import Node
from ..numerics.piecewise_polynomial import NUMBERS_PER_PIECE, PiecewisePolynomial
from .expression import Name

#: Inputs and signals by their names.
Inputs = Mapping[str, PiecewisePolynomial]

#: Port of the coefficients of all inputs, COUNT of each.
INPUTS = "inputs"


def polynomial(numbers: Sequence[Node], time: Node) -> Node:
    """Value at `time` of a piece (`mstmm.numerics.piecewise_polynomial`) whose coefficients are
    nodes."""
    t0, c0, c1, c2, c3 = numbers
    s = time - t0
    return c0 + s * (c1 + s * (c2 + s * c3))


def input_node(place: int, time: Node) -> Node:
    """Value at `time` of the input at index `place`, its coefficients read from the port."""
    return polynomial(
        [
            time.graph.element(INPUTS, NUMBERS_PER_PIECE * place + k)
            for k in range(NUMBERS_PER_PIECE)
        ],
        time,
    )


class InputNodes:
    """Nodes of inputs, and the values of their leaves at a given time."""

    def __init__(self, time: Node, inputs: Inputs) -> None:
        self.time, self.inputs = time, inputs
        self._leaves: dict[int, tuple[str, int]] = {}
        self._indices = {name: index for index, name in enumerate(inputs)}

    def node(self, name: Name) -> Node:
        """Build the node of `t` or of an input."""
        if name.text == "t":
            return self.time
        first_index = NUMBERS_PER_PIECE * self._indices[name.text]
        numbers = [
            self.time.graph.element(INPUTS, first_index + k) for k in range(NUMBERS_PER_PIECE)
        ]
        self._leaves.update({node.number: (name.text, k) for k, node in enumerate(numbers)})
        return polynomial(numbers, self.time)

    def input_value(self, t: float) -> Callable[[Node], float]:
        """Function that returns the value of each leaf at time t (s)."""

        def number(node: Node) -> float:
            if node.number not in self._leaves:
                return t
            name, k = self._leaves[node.number]
            return self.inputs[name].piece_at(t)[k]

        return number
