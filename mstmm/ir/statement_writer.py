"""Conversion of nodes to statements, in dependency order, for the outputs of a graph."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

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
from .terms import LOOP_BITS, Node, Number, Terms


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
        for node in sorted(_dependencies(roots), key=lambda n: n.number):
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


def _dependencies(roots: Iterable[Node]) -> list[Node]:
    """Nodes that `roots` depend on, including themselves."""
    nodes: dict[int, Node] = {}
    stack = list(roots)
    while stack:
        node = stack.pop()
        if node.number not in nodes:
            nodes[node.number] = node
            stack.extend(node.args)
    return list(nodes.values())


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
