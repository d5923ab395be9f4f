"""Graph that builds KernelIR by value numbering: equal terms share a node, constants fold.

Derivations are lowered through this graph, and expressions of scene files are parsed into it, so
that C, the tape and the interpreter receive both in the same form.  No SymPy.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from .kernel import KernelIR
from .statements import (
    LOOPS,
    Assign,
    Constant,
    Element,
    Guard,
    Inner,
    Operand,
    Port,
    Solve,
    Statement,
    Store,
    Sum,
    Temporary,
)
from .terms import LOOP_BITS, Node, Number, Terms, dependencies


@dataclass(frozen=True)
class GuardRequest:
    """Request to leave the kernel with `code` unless `condition` holds."""

    condition: Node
    code: int
    message: str


@dataclass(frozen=True)
class StoreRequest:
    """Request to write an output; `value` has the form that `Graph.kernel` expects."""

    port: Port
    value: object


class _Level:
    """Statements inside the same loops, and the operands known there."""

    def __init__(self, loops: int, outer: _Level | None, statements: list[Any]) -> None:
        self.loops, self.outer, self.statements = loops, outer, statements
        self.operands: dict[int, Operand] = {}

    def home(self, node: Node) -> _Level:
        """Outermost level inside all loops that `node` depends on."""
        level = self
        while level.outer is not None and not node.loops & ~level.outer.loops:
            level = level.outer
        return level


class Writer:
    """Writer of statements: emits each node once, in dependency order, temporaries from 0."""

    def __init__(self, graph: Terms) -> None:
        self.graph = graph
        self.statements: list[Statement] = []
        self._outside = _Level(0, None, self.statements)
        self._next = 0

    def _number(self) -> int:
        self._next += 1
        return self._next - 1

    def operand(self, node: Node) -> Operand:
        return self._emit(node, self._outside)

    def request(self, request: GuardRequest | Solve | StoreRequest) -> None:
        if isinstance(request, Solve):
            self.statements.append(request)
        elif isinstance(request, StoreRequest):
            self.store(request.port, request.value)
        else:
            condition = self.operand(request.condition)
            self.statements.append(Guard(condition, request.code, request.message))

    def emit_in_creation_order(
        self, guards: Iterable[GuardRequest], outputs: Iterable[Port], values: dict[str, object]
    ) -> None:
        """Emit all statements in the order in which the nodes were created."""
        pending_statements: dict[int, list[Callable[[], Statement]]] = {}
        roots: list[Node] = []

        def schedule(node: Node, statement: Callable[[], Statement]) -> None:
            roots.append(node)
            pending_statements.setdefault(node.number, []).append(statement)

        for g in guards:
            schedule(g.condition, lambda g=g: Guard(self.operand(g.condition), g.code, g.message))  # type: ignore[misc]
        for port in outputs:
            for index, entry in _flatten(values[port.name], port.shape):
                node = self.graph.node(entry)  # type: ignore[arg-type]
                schedule(node, lambda p=port.name, i=index, n=node: Store(p, i, self.operand(n)))  # type: ignore[misc]
        for node in dependencies(*roots):
            self.operand(node)
            self.statements += [
                statement() for statement in pending_statements.get(node.number, ())
            ]

    def _leaf(self, node: Node) -> Operand | None:
        if isinstance(node.leaf, Fraction):
            return Constant(str(node.leaf))
        if isinstance(node.leaf, Element):
            return node.leaf
        return Constant("pi") if node.op == "pi" else None

    def _emit(self, root: Node, level: _Level) -> Operand:
        """Emit a node; terms that do not depend on a loop are computed before it."""
        stack = [root]
        while stack:
            node = stack[-1]
            node_level = level.home(node)
            if node.number in node_level.operands:
                stack.pop()
                continue
            leaf = self._leaf(node)
            if leaf is not None:
                node_level.operands[node.number] = leaf
                continue
            if node.op == "sum":
                node_level.operands[node.number] = self._emit_sum(node, node_level)
                continue
            missing = [a for a in node.args if a.number not in level.home(a).operands]
            if missing:
                stack.extend(reversed(missing))
                continue
            number = self._number()
            operands = tuple([level.home(a).operands[a.number] for a in node.args])
            node_level.statements.append(Assign(number, node.op, operands))
            node_level.operands[node.number] = Temporary(number)
        return level.home(root).operands[root.number]

    def _emit_sum(self, node: Node, home: _Level) -> Operand:
        over = str(node.leaf)
        if home.loops & LOOP_BITS[over]:
            raise ValueError(
                "loops are nested more than two deep; store the inner product as an output first"
            )
        inner = _Level(home.loops | LOOP_BITS[over], home, [])
        value = self._emit(node.args[0], inner)
        number = self._number()
        home.statements.append(Sum(number, tuple(inner.statements), value, over))
        return Temporary(number)

    def store(self, port: Port, value: object) -> None:
        for index, entry in _flatten(value, port.shape):
            if entry is None:
                continue
            node = self.graph.node(entry)
            loops = sum(LOOP_BITS[letter] for letter in LOOPS if letter in index)
            if loops:
                level = _Level(loops, self._outside, [])
                operand = self._emit(node, level)
                body: tuple[Inner, ...] = tuple(level.statements)
                self.statements.append(Store(port.name, index, operand, body))
            else:
                self.statements.append(Store(port.name, index, self.operand(node)))


def _flatten(
    value: object, shape: tuple[int | str, ...], letters: tuple[str, ...] = LOOPS
) -> list[tuple[tuple[int | str, ...], Node | Number | None]]:
    """Entries with their indices; along a run-time size one value holds for all k (l) < n."""
    if not shape:
        return [((), value)]  # type: ignore[list-item]
    if isinstance(shape[0], str):
        inner_entries = _flatten(value, shape[1:], letters[1:])
        return [((letters[0], *rest), v) for rest, v in inner_entries]
    if not isinstance(value, (list, tuple)) or len(value) != shape[0]:
        raise ValueError(f"expected values of shape {shape}, found {value!r}")
    return [
        ((i, *rest), v)
        for i, entry in enumerate(value)
        for rest, v in _flatten(entry, shape[1:], letters)
    ]


__all__ = ["Graph", "Node", "Number"]


class Graph(Terms):
    """Hash-consed expression graph of one kernel: equal expressions are the same node."""

    def __init__(self) -> None:
        super().__init__()
        #: Guards, solves and stores in the order of their requests.
        self._requests: list[GuardRequest | Solve | StoreRequest] = []

    def guard(self, condition: Node, code: int, message: str) -> None:
        """Leave the kernel with `code` unless `condition` holds.

        ValueError if the condition is known to be false.
        """
        if condition.value is None:
            self._requests.append(GuardRequest(condition, code, message))
        elif condition.value == 0:
            raise ValueError(f"this can never be computed: {message}")

    def solve(
        self, output: str, matrix: str, right: str, code: int, message: str, symmetric: bool = True
    ) -> None:
        """Request a run-time sized solve between readable arrays; the result is `output`."""
        self._requests.append(Solve(output, matrix, right, code, message, symmetric=symmetric))

    def store(self, port: Port, value: object) -> None:
        """Write an output at once (kernels with run-time size), so that it can be read afterwards.

        `value` has the form of `values[port]` of `kernel`.  Once a store is requested, guards,
        solves and stores keep the order of their requests.
        """
        self._requests.append(StoreRequest(port, value))

    # --- linearisation: graph -> KernelIR -------------------------------------------------------

    def kernel(
        self,
        name: str,
        inputs: Sequence[Port],
        outputs: Sequence[Port],
        values: dict[str, object],
        size_symbol: str | None = None,
        purpose: str = "",
        sources: Iterable[str] = (),
        keep_order: bool = False,
    ) -> KernelIR:
        """Build a frozen kernel from the terms that the outputs need (others are dropped).

        With `keep_order` values stay in the order of creation, each guard and store right after
        its operands (kernels without run-time size).  Otherwise they are ordered by the first
        guard or output that needs them.

        `values[port]` is a node, or a nested list of nodes in the port's shape; an entry None is
        not stored.  An axis of the size symbol has no list: one value, which may contain
        `LOOP_INDEX` (for a second such axis `INNER_INDEX`), holds for all k < n.
        """
        writer = Writer(self)
        if keep_order:
            guards = [r for r in self._requests if isinstance(r, GuardRequest)]
            writer.emit_in_creation_order(guards, outputs, values)
            return KernelIR(
                name, tuple(inputs), tuple(outputs), tuple(writer.statements), None, purpose,
                tuple(sources),
            )  # fmt: skip
        requests = self._requests
        if not any(isinstance(r, StoreRequest) for r in requests):
            requests = sorted(requests, key=lambda r: not isinstance(r, Solve))  # solves first
        for request in requests:
            writer.request(request)
        for port in outputs:
            if port.name in values:
                writer.store(port, values[port.name])
        return KernelIR(
            name, tuple(inputs), tuple(outputs), tuple(writer.statements), size_symbol, purpose,
            tuple(sources),
        )  # fmt: skip
