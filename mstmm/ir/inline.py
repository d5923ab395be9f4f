"""Inlining of kernels: statements of a KernelIR interpreted on nodes of another graph.

Known arguments (zeros, ones, terms already computed) are folded on the way, so that a general
kernel becomes the special one that its caller needs.  Loops over a run-time size are unrolled, and
so are its solves.  No SymPy.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from itertools import product

from .graph import Graph, Node
from .interpreter import LoopingInterpreter
from .kernel import KernelIR
from .statements import Constant, Guard, Port, Solve
from .unrolled_solve import solve_pivoted, solve_symmetric

Nodes = list[Node]
GuardHandler = Callable[[Node, int], None]
#: Receives a condition, and the guard or the solve that requires it.
ConditionHandler = Callable[[Node, Guard | Solve], None]


class Inliner:
    """Interpreter that inlines kernels into one graph."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self.zero, self.one = graph.constant(0), graph.constant(1)

    def run(
        self,
        kernel: KernelIR,
        inputs: Mapping[str, Sequence[Node]],
        guard: GuardHandler | None = None,
        n: int = 0,
    ) -> dict[str, Nodes]:
        """Outputs by port, flat and row-major; accumulating outputs give their increment.

        `inputs[port]` holds the port's numbers, flat; `n` is the size of a kernel that has one.
        `guard(condition, code)` receives every guard that the known values do not decide; without
        it such guards are dropped.
        """

        def handle_condition(condition: Node, judged: Guard | Solve) -> None:
            if guard is not None and not (condition.value or 0):
                guard(condition, judged.code)

        return _GraphInterpreter(self.graph, kernel, inputs, handle_condition, n).run()

    def constant(self, operand: Constant) -> Node:
        """The node of a constant."""
        return self.graph.number(operand)


def unroll(kernel: KernelIR, n: int) -> KernelIR:
    """Specialise a kernel for one run-time size: no loops, solves by elimination."""
    return specialise(kernel, element_nodes, lambda _, found: found, n)


def element_nodes(graph: Graph, port: Port) -> Nodes:
    """Nodes of the entries of an array, row-major."""
    indices = product(*(range(int(extent)) for extent in port.shape))
    return [graph.element(port.name, *place) for place in indices]


def specialise(
    kernel: KernelIR,
    given: Callable[[Graph, Port], Nodes],
    kept: Callable[[Port, Nodes], Sequence[Node] | None],
    n: int = 0,
    laid: Callable[[Port], Port] = lambda port: port,
) -> KernelIR:
    """Specialise a kernel for known arguments and one value of its run-time size.

    `given` returns the numbers of an input, flat; an input of which all numbers are known is no
    input of the instance.  `kept` returns the entries to write of an output, None for an output
    that is not needed.  `laid` returns the port of the instance for an array, in whose layout
    `given` reads and `kept` writes.  Guards and failure codes are those of `kernel`; a guard after
    a store moves before it.
    """

    def with_fixed_size(port: Port) -> Port:
        return replace(port, shape=tuple(n if isinstance(e, str) else e for e in port.shape))

    graph = Graph()
    input_ports, output_ports = (
        [*map(with_fixed_size, ports)] for ports in (kernel.inputs, kernel.outputs)
    )
    input_values = {port.name: given(graph, port) for port in input_ports}

    def add_guard(condition: Node, judged: Guard | Solve) -> None:
        graph.guard(condition, judged.code, judged.message)

    results = _GraphInterpreter(graph, kernel, input_values, add_guard, n).run()
    written = {laid(port): kept(port, results[port.name]) for port in output_ports}
    values = {port.name: _nest(port.shape, row) for port, row in written.items() if row is not None}
    inputs = [
        laid(port)
        for port in input_ports
        if not input_values[port.name]
        or any(node.value is None for node in input_values[port.name])
    ]
    written_ports = [port for port in written if port.name in values]
    return graph.kernel(
        kernel.name, inputs, written_ports, values, purpose=kernel.purpose, sources=kernel.sources
    )


class _GraphInterpreter(LoopingInterpreter):
    """Interpretation of one kernel on the nodes of a graph."""

    def __init__(
        self,
        graph: Graph,
        kernel: KernelIR,
        inputs: Mapping[str, Sequence[Node]],
        judge: ConditionHandler,
        n: int,
    ) -> None:
        super().__init__(kernel, graph.operations, n, inputs, graph.constant(0))
        self.graph, self._condition_handler = graph, judge

    def constant(self, constant: Constant) -> Node:
        return self.graph.number(constant)

    def handle_condition(self, condition: Node, judged: Guard | Solve) -> None:
        self._condition_handler(condition, judged)

    def solve(self, solve: Solve) -> None:
        """Unroll the elimination that `Solve` specifies."""
        n, a, b = self.n, self.arrays[solve.matrix], self.arrays[solve.right]
        width = len(b) // n if n else 0
        right = [list(b[width * i : width * (i + 1)]) for i in range(n)]
        if solve.symmetric:
            solution = solve_symmetric(
                self.graph,
                [[a[n * j + i] for j in range(n)] for i in range(n)],
                right,
                lambda condition, i: self.handle_condition(condition, solve),
                Fraction(str(solve.relative_pivot)),
            )
        else:
            solution = solve_pivoted(
                self.graph, [list(a[n * i : n * (i + 1)]) for i in range(n)], right
            )
        self.results[solve.port][:] = [node for row in solution for node in row]


def _nest(shape: tuple[int | str, ...], row: Sequence[Node]) -> object:
    """Nest the numbers of a port (row-major) in lists of its shape."""
    if not shape:
        return row[0]
    step = len(row) // int(shape[0]) if shape[0] else 0
    return [_nest(shape[1:], row[step * i : step * (i + 1)]) for i in range(int(shape[0]))]
