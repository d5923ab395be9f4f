"""Kernels run symbolically: the statements of a KernelIR replayed on the nodes of another graph.

What is known of the arguments (zeros, ones, terms already computed) folds as the statements are
replayed, so a general kernel becomes the special one that its place needs.  No SymPy.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction

from mstmm.graph import Graph, Node
from mstmm.ir import Assign, Constant, Guard, KernelIR, Operand, Port, Store, Temporary

Nodes = list[Node]
Guarding = Callable[[Node, int], None]


class Inliner:
    """Replays kernels into one graph."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self.zero, self.one = graph.constant(0), graph.constant(1)
        self._constants: dict[str, Node] = {}

    def run(
        self, kernel: KernelIR, inputs: Mapping[str, Sequence[Node]], guard: Guarding | None = None
    ) -> dict[str, Nodes]:
        """Outputs by port, flat and row-major; accumulating outputs give their increment.

        `inputs[port]` holds the port's numbers, flat.  `guard(condition, code)` receives every
        guard that is not decided by what is known; without it they are dropped.
        """
        names: dict[str, Sequence[Node]] = dict(inputs)
        ports: dict[str, Port] = {port.name: port for port in (*kernel.inputs, *kernel.outputs)}
        for port in kernel.inputs:
            if len(names[port.name]) != port.length():
                raise ValueError(f"{kernel.name}: {port.name} takes {port.length()} numbers")
        outputs = {port.name: [self.zero] * port.length() for port in kernel.outputs}
        known: dict[int, Node] = {}
        call = self.graph.call

        def value(operand: Operand) -> Node:
            if isinstance(operand, Temporary):
                return known[operand.number]
            if isinstance(operand, Constant):
                return self._constant(operand)
            return names[operand.port][ports[operand.port].offset(operand.index)]

        for statement in kernel.statements:
            if isinstance(statement, Assign):
                known[statement.number] = call(statement.op, *map(value, statement.args))
            elif isinstance(statement, Store):
                place = ports[statement.port].offset(statement.index)
                outputs[statement.port][place] = value(statement.value)
            elif isinstance(statement, Guard):
                condition = value(statement.condition)
                if guard is not None and not (condition.value or 0):
                    guard(condition, statement.code)
            else:
                raise ValueError(f"{kernel.name}: a run-time sized kernel cannot be fused")
        return outputs

    def _constant(self, operand: Constant) -> Node:
        found = self._constants.get(operand.text)
        if found is None:
            graph = self.graph
            found = graph.pi if operand.text == "pi" else graph.constant(Fraction(operand.text))
            self._constants[operand.text] = found
        return found
