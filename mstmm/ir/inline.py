"""Kernels run symbolically: the statements of a KernelIR replayed on the nodes of another graph.

What is known of the arguments (zeros, ones, terms already computed) folds as the statements are
replayed, so a general kernel becomes the special one that its place needs.  Loops of a run-time
size are replayed as often as the size says, and its solves unrolled.  No SymPy.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from itertools import product

from .graph import Graph, Node
from .kernel import KernelIR
from .replay import Counted
from .statements import Constant, Guard, Port, Solve
from .unrolled import solve_by_rows, solve_symmetric

Nodes = list[Node]
Guarding = Callable[[Node, int], None]
#: Takes a condition, and the guard or the solve that asks for it.
Judge = Callable[[Node, Guard | Solve], None]


class Inliner:
    """Replays kernels into one graph."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self.zero, self.one = graph.constant(0), graph.constant(1)

    def run(
        self,
        kernel: KernelIR,
        inputs: Mapping[str, Sequence[Node]],
        guard: Guarding | None = None,
        n: int = 0,
    ) -> dict[str, Nodes]:
        """Outputs by port, flat and row-major; accumulating outputs give their increment.

        `inputs[port]` holds the port's numbers, flat; `n` is the size of a kernel that has one.
        `guard(condition, code)` receives every guard that is not decided by what is known; without
        it they are dropped.
        """

        def judge(condition: Node, judged: Guard | Solve) -> None:
            if guard is not None and not (condition.value or 0):
                guard(condition, judged.code)

        return _Replay(self.graph, kernel, inputs, judge, n).run()

    def constant(self, operand: Constant) -> Node:
        """The node of a constant."""
        return self.graph.number(operand)


def unrolled(kernel: KernelIR, n: int) -> KernelIR:
    """The kernel for one value of its run-time size: no loops, solves by elimination.

    Guards and failure codes are those of `kernel`; a guard behind a store stands before it.
    """

    def fixed(port: Port) -> Port:
        return replace(port, shape=tuple(n if isinstance(e, str) else e for e in port.shape))

    graph = Graph()
    inputs, outputs = map(fixed, kernel.inputs), [fixed(port) for port in kernel.outputs]
    taken = tuple(inputs)
    given = {port.name: [graph.element(port.name, *i) for i in _places(port)] for port in taken}

    def judge(condition: Node, judged: Guard | Solve) -> None:
        graph.guard(condition, judged.code, judged.message)

    found = _Replay(graph, kernel, given, judge, n).run()
    values = {port.name: _nested(port.shape, found[port.name]) for port in outputs}
    return graph.kernel(
        kernel.name, taken, outputs, values, purpose=kernel.purpose, sources=kernel.sources
    )


class _Replay(Counted):
    """One run of one kernel."""

    def __init__(
        self,
        graph: Graph,
        kernel: KernelIR,
        inputs: Mapping[str, Sequence[Node]],
        judge: Judge,
        n: int,
    ) -> None:
        super().__init__(kernel, graph.operations, n, inputs, graph.constant(0))
        self.graph, self._judge = graph, judge

    def constant(self, constant: Constant) -> Node:
        return self.graph.number(constant)

    def judge(self, condition: Node, judged: Guard | Solve) -> None:
        self._judge(condition, judged)

    def solve(self, solve: Solve) -> None:
        """Elimination as `Solve` has it."""
        n, a, b = self.n, self.arrays[solve.matrix], self.arrays[solve.right]
        width = len(b) // n if n else 0
        right = [list(b[width * i : width * (i + 1)]) for i in range(n)]
        if solve.symmetric:
            found = solve_symmetric(
                self.graph,
                [[a[n * j + i] for j in range(n)] for i in range(n)],
                right,
                lambda condition, i: self.judge(condition, solve),
                Fraction(str(solve.relative_pivot)),
            )
        else:
            found = solve_by_rows(
                self.graph, [list(a[n * i : n * (i + 1)]) for i in range(n)], right
            )
        self.results[solve.port][:] = [node for row in found for node in row]


def _places(port: Port) -> list[tuple[int, ...]]:
    return list(product(*(range(int(extent)) for extent in port.shape)))


def _nested(shape: tuple[int | str, ...], row: Nodes) -> object:
    """Nested lists in a port's shape of its numbers, row-major."""
    if not shape:
        return row[0]
    step = len(row) // int(shape[0]) if shape[0] else 0
    return [_nested(shape[1:], row[step * i : step * (i + 1)]) for i in range(int(shape[0]))]
