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

from mstmm.ir import (
    INNER_INDEX,
    LOOP_INDEX,
    LOOPS,
    Assign,
    Constant,
    Guard,
    Inner,
    KernelIR,
    Operand,
    Port,
    Solve,
    Statement,
    Store,
    Sum,
    Temporary,
)
from mstmm.ir.graph import Graph, Node
from mstmm.ir.unrolled import solve_symmetric

Nodes = list[Node]
Guarding = Callable[[Node, int], None]
Refusal = Callable[[Node, int, str], None]


class Inliner:
    """Replays kernels into one graph."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self.zero, self.one = graph.constant(0), graph.constant(1)
        self._constants: dict[str, Node] = {}

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

        def refuse(condition: Node, code: int, message: str) -> None:
            if guard is not None and not (condition.value or 0):
                guard(condition, code)

        return _Replay(self, kernel, inputs, refuse, n).run()

    def constant(self, operand: Constant) -> Node:
        """The node of a constant."""
        found = self._constants.get(operand.text)
        if found is None:
            graph = self.graph
            found = graph.pi if operand.text == "pi" else graph.constant(Fraction(operand.text))
            self._constants[operand.text] = found
        return found


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
    found = _Replay(Inliner(graph), kernel, given, graph.guard, n).run()
    values = {port.name: _nested(port.shape, found[port.name]) for port in outputs}
    return graph.kernel(
        kernel.name, taken, outputs, values, purpose=kernel.purpose, sources=kernel.sources
    )


class _Replay:
    """One run of one kernel."""

    def __init__(
        self,
        inliner: Inliner,
        kernel: KernelIR,
        inputs: Mapping[str, Sequence[Node]],
        refuse: Refusal,
        n: int,
    ) -> None:
        self.inliner, self.kernel, self.refuse, self.n = inliner, kernel, refuse, n
        self.ports = {port.name: port for port in (*kernel.inputs, *kernel.outputs)}
        self.outputs = {port.name: [inliner.zero] * port.length(n) for port in kernel.outputs}
        self.arrays: dict[str, Sequence[Node]] = {**inputs, **self.outputs}
        for port in kernel.inputs:
            if len(inputs[port.name]) != port.length(n):
                raise ValueError(f"{kernel.name}: {port.name} takes {port.length(n)} numbers")
        self.known: dict[int, Node] = {}
        self.at = dict.fromkeys(LOOPS, 0)

    def run(self) -> dict[str, Nodes]:
        for statement in self.kernel.statements:
            self._statement(statement)
        return self.outputs

    def _statement(self, statement: Statement) -> None:
        if isinstance(statement, (Assign, Sum)):
            self._inner(statement)
        elif isinstance(statement, Store):
            self._store(statement)
        elif isinstance(statement, Guard):
            self.refuse(self._value(statement.condition), statement.code, statement.message)
        else:
            self._solve(statement)

    def _inner(self, statement: Inner) -> None:
        if isinstance(statement, Assign):
            operands = map(self._value, statement.args)
            self.known[statement.number] = self.inliner.graph.call(statement.op, *operands)
            return
        total = self.inliner.zero
        for place in range(self.n):
            self.at[statement.over] = place
            for inner in statement.body:
                self._inner(inner)
            total = total + self._value(statement.value)
        self.known[statement.number] = total

    def _value(self, operand: Operand) -> Node:
        if isinstance(operand, Temporary):
            return self.known[operand.number]
        if isinstance(operand, Constant):
            return self.inliner.constant(operand)
        return self.arrays[operand.port][self._place(operand.port, operand.index)]

    def _place(self, port: str, index: tuple[int | str, ...]) -> int:
        return self.ports[port].offset(index, self.n, self.at[LOOP_INDEX], self.at[INNER_INDEX])

    def _store(self, store: Store) -> None:
        row, accumulate = self.outputs[store.port], self.ports[store.port].accumulate
        loops = store.loops
        for places in product(range(self.n), repeat=len(loops)):
            self.at.update(zip(loops, places, strict=True))
            for inner in store.body:
                self._inner(inner)
            place, value = self._place(store.port, store.index), self._value(store.value)
            row[place] = row[place] + value if accumulate else value

    def _solve(self, solve: Solve) -> None:
        """Elimination as `Solve` has it, which reads the lower half of the matrix."""
        n, a, b = self.n, self.arrays[solve.matrix], self.arrays[solve.right]
        width = len(b) // n if n else 0
        found = solve_symmetric(
            self.inliner.graph,
            [[a[n * j + i] for j in range(n)] for i in range(n)],
            [list(b[width * i : width * (i + 1)]) for i in range(n)],
            lambda condition, i: self.refuse(condition, solve.code, solve.message),
            Fraction(str(solve.relative_pivot)),
        )
        self.outputs[solve.port][:] = [node for row in found for node in row]


def _places(port: Port) -> list[tuple[int, ...]]:
    return list(product(*(range(int(extent)) for extent in port.shape)))


def _nested(shape: tuple[int | str, ...], row: Nodes) -> object:
    """Nested lists in a port's shape of its numbers, row-major."""
    if not shape:
        return row[0]
    step = len(row) // int(shape[0]) if shape[0] else 0
    return [_nested(shape[1:], row[step * i : step * (i + 1)]) for i in range(int(shape[0]))]
