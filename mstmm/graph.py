"""Builds KernelIR by value numbering: equal terms are one node, constants fold as they arise.

Derivations are lowered through this graph, and expressions of scene files are parsed into it, so
that both reach C, the tape and the evaluator in the same form.  No SymPy.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction

from .ir import (
    LOOP_INDEX,
    OPERATIONS,
    Assign,
    Constant,
    Element,
    Guard,
    KernelIR,
    Operand,
    Port,
    Solve,
    Statement,
    Store,
    Sum,
    Temporary,
)

Number = int | float | Fraction
_COMMUTATIVE = frozenset({"add", "mul", "min", "max", "eq", "and", "or"})


#: What folding asks of a constant, answered once: comparing fractions is slow.
_ZERO, _ONE, _MINUS_ONE, _POSITIVE, _NEGATIVE = 1, 2, 3, 4, 5


def _kind(value: Fraction) -> int:
    if value.denominator == 1 and -1 <= value.numerator <= 1:
        return (_ZERO, _ONE, _MINUS_ONE)[value.numerator]
    return _POSITIVE if value.numerator > 0 else _NEGATIVE


class Node:
    """One value of a `Graph`.  Made by the graph's methods and by + - * / ** on other nodes."""

    __slots__ = ("args", "graph", "kind", "leaf", "looped", "number", "op", "value")

    def __init__(
        self,
        graph: Graph,
        number: int,
        op: str,
        args: tuple[Node, ...],
        leaf: Fraction | Element | str | None,
        looped: bool,
    ) -> None:
        self.graph, self.number, self.op, self.args = graph, number, op, args
        self.leaf, self.looped = leaf, looped
        #: The exact number if this node is a rational constant, else None.
        self.value: Fraction | None = leaf if isinstance(leaf, Fraction) else None
        self.kind = 0 if self.value is None else _kind(self.value)

    def __add__(self, other: Node | Number) -> Node:
        return self.graph.add(self, self.graph.node(other))

    def __sub__(self, other: Node | Number) -> Node:
        return self.graph.sub(self, self.graph.node(other))

    def __mul__(self, other: Node | Number) -> Node:
        return self.graph.mul(self, self.graph.node(other))

    def __truediv__(self, other: Node | Number) -> Node:
        return self.graph.div(self, self.graph.node(other))

    def __pow__(self, other: Node | Number) -> Node:
        return self.graph.power(self, self.graph.node(other))

    def __radd__(self, other: Number) -> Node:
        return self.graph.node(other) + self

    def __rsub__(self, other: Number) -> Node:
        return self.graph.node(other) - self

    def __rmul__(self, other: Number) -> Node:
        return self.graph.node(other) * self

    def __rtruediv__(self, other: Number) -> Node:
        return self.graph.node(other) / self

    def __neg__(self) -> Node:
        return self.graph.neg(self)


@dataclass(frozen=True)
class _GuardRequest:
    condition: Node
    code: int
    message: str


class Graph:
    """Hash-consed expression graph of one kernel."""

    def __init__(self) -> None:
        self._nodes: dict[tuple[object, ...], Node] = {}
        self._whole: dict[int, Node] = {}
        self._count = 0
        self._guards: list[_GuardRequest] = []
        self._solves: list[Solve] = []
        self._solve_inputs: set[str] = set()

    # --- leaves ---------------------------------------------------------------------------

    def _make(
        self, op: str, args: tuple[Node, ...] = (), leaf: Fraction | Element | str | None = None
    ) -> Node:
        key = (op, leaf, *(a.number for a in args))
        found = self._nodes.get(key)
        if found is None:
            looped = any(a.looped for a in args) and op != "sum"
            if isinstance(leaf, Element):
                looped = LOOP_INDEX in leaf.index
            found = Node(self, self._count, op, args, leaf, looped)
            self._count += 1
            self._nodes[key] = found
        return found

    def constant(self, value: Number) -> Node:
        """An exact rational (a float becomes the fraction it is)."""
        if type(value) is Fraction:
            return self._make("constant", leaf=value)
        if type(value) is not int:
            return self._make("constant", leaf=Fraction(value))
        found = self._whole.get(value)
        if found is None:
            found = self._whole[value] = self._make("constant", leaf=Fraction(value))
        return found

    @property
    def pi(self) -> Node:
        return self._make("pi", leaf="pi")

    def node(self, value: Node | Number) -> Node:
        """The value itself if it is a node, else the constant."""
        return value if isinstance(value, Node) else self.constant(value)

    def element(self, port: str, *index: int | str) -> Node:
        """Entry of an input array; `LOOP_INDEX` marks the loop variable."""
        return self._make("element", leaf=Element(port, index))

    def vector(self, port: str, length: int) -> list[Node]:
        return [self.element(port, i) for i in range(length)]

    def matrix(self, port: str, rows: int, columns: int) -> list[list[Node]]:
        return [[self.element(port, i, j) for j in range(columns)] for i in range(rows)]

    # --- arithmetic with folding ------------------------------------------------------------

    def neg(self, a: Node) -> Node:
        if a.value is not None:
            return a if a.kind == _ZERO else self.constant(-a.value)
        if a.op == "neg":
            return a.args[0]
        if a.op == "sub":
            return self._make("sub", (a.args[1], a.args[0]))
        return self._make("neg", (a,))

    def add(self, a: Node, b: Node) -> Node:
        if a.kind or b.kind:
            if a.kind == _ZERO:
                return b
            if b.kind == _ZERO:
                return a
            if a.value is not None and b.value is not None:
                return self.constant(a.value + b.value)
        if b.op == "neg":
            return self.sub(a, b.args[0])
        if a.op == "neg":
            return self.sub(b, a.args[0])
        return self._ordered("add", a, b)

    def sub(self, a: Node, b: Node) -> Node:
        if a.kind or b.kind:
            if b.kind == _ZERO:
                return a
            if a.kind == _ZERO:
                return self.neg(b)
            if a.value is not None and b.value is not None:
                return self.constant(a.value - b.value)
        if a is b:
            return self.constant(0)
        if b.op == "neg":
            return self.add(a, b.args[0])
        if a.op == "neg":
            return self.neg(self.add(a.args[0], b))
        opposite = self._nodes.get(("sub", None, b.number, a.number))
        if opposite is not None and ("sub", None, a.number, b.number) not in self._nodes:
            return self.neg_of(opposite)
        return self._make("sub", (a, b))

    def neg_of(self, a: Node) -> Node:
        """-a as its own node, keeping `a` shared (a difference would be flipped by `neg`)."""
        return self._make("neg", (a,))

    def mul(self, a: Node, b: Node) -> Node:
        if a.kind or b.kind:
            folded = self._scaled(a, b) if a.kind else self._scaled(b, a)
            if folded is not None:
                return folded
        if a.op == "neg":
            return self.neg(self.mul(a.args[0], b))
        if b.op == "neg":
            return self.neg(self.mul(b.args[0], a))
        return self._ordered("mul", a, b)

    def _scaled(self, number: Node, other: Node) -> Node | None:
        """Product with a constant, folded; None where nothing folds."""
        if number.kind == _ZERO or other.kind == _ZERO:
            return self.constant(0)
        if number.value is not None and other.value is not None:
            return self.constant(number.value * other.value)
        if number.kind == _ONE:
            return other
        if number.kind == _MINUS_ONE:
            return self.neg(other)
        if number.kind == _NEGATIVE and number.value is not None:
            return self.neg(self.mul(self.constant(-number.value), other))
        return None

    def div(self, a: Node, b: Node) -> Node:
        if b.value is not None and b.value != 0:
            if a.value is not None:
                return self.constant(a.value / b.value)
            if b.value.numerator in (1, -1):
                return self.mul(a, self.constant(1 / b.value))
        if a.value == 0 and b.value != 0:
            return a
        if a.op == "neg":
            return self.neg(self.div(a.args[0], b))
        if b.op == "neg":
            return self.neg(self.div(a, b.args[0]))
        return self._make("div", (a, b))

    def power(self, a: Node, b: Node) -> Node:
        exponent = b.value
        if exponent is not None and exponent.denominator == 1 and abs(exponent.numerator) <= 16:
            return self._whole_power(a, int(exponent))
        if exponent == Fraction(1, 2):
            return self.call("sqrt", a)
        return self._make("pow", (a, b))

    def _whole_power(self, a: Node, exponent: int) -> Node:
        if exponent < 0:
            return self.div(self.constant(1), self._whole_power(a, -exponent))
        result = self.constant(1)
        square = a
        while exponent:
            if exponent & 1:
                result = self.mul(result, square)
            exponent >>= 1
            if exponent:
                square = self.mul(square, square)
        return result

    def _ordered(self, op: str, a: Node, b: Node) -> Node:
        return self._make(op, (a, b) if a.number <= b.number else (b, a))

    def call(self, op: str, *args: Node | Number) -> Node:
        """Any operation of `ir.OPERATIONS` by name."""
        nodes = tuple([a if type(a) is Node else self.node(a) for a in args])
        arithmetic = _ARITHMETIC.get(op)
        if arithmetic is not None:
            return arithmetic(self, *nodes)
        if len(nodes) != OPERATIONS[op]:
            raise ValueError(f"{op} takes {OPERATIONS[op]} operands, not {len(nodes)}")
        if nodes[0].value == 0 and op in ("sin", "tan", "asin", "atan", "sinh", "tanh", "sqrt"):
            return nodes[0]
        if nodes[0].value == 0 and op in ("cos", "cosh", "exp"):
            return self.constant(1)
        if op == "select" and nodes[0].value is not None:
            return nodes[1] if nodes[0].value != 0 else nodes[2]
        if op == "select" and nodes[1] is nodes[2]:
            return nodes[1]
        if op in _COMMUTATIVE:
            return self._ordered(op, *nodes)
        return self._make(op, nodes)

    def sin(self, a: Node) -> Node:
        return self.call("sin", a)

    def cos(self, a: Node) -> Node:
        return self.call("cos", a)

    def sqrt(self, a: Node) -> Node:
        return self.call("sqrt", a)

    def select(self, condition: Node, yes: Node | Number, no: Node | Number) -> Node:
        return self.call("select", condition, yes, no)

    def sum_over_modes(self, term: Node) -> Node:
        """Sum of `term` (which contains `LOOP_INDEX`) over k < n."""
        return self._make("sum", (term,))

    # --- requests that are not values ---------------------------------------------------------

    def guard(self, condition: Node, code: int, message: str) -> None:
        """Leave with `code` unless `condition` holds."""
        if condition.value is None:
            self._guards.append(_GuardRequest(condition, code, message))
        elif condition.value == 0:
            raise ValueError(f"this can never be computed: {message}")

    def solve(self, output: str, matrix: str, right: str, code: int, message: str) -> None:
        """Run-time sized solve between input arrays; the result is the named output."""
        self._solves.append(Solve(output, matrix, right, code, message))

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
        as_made: bool = False,
    ) -> KernelIR:
        """Order what the outputs need (dead terms drop out) into a frozen kernel.

        With `as_made` values stand in the order in which they were made, each guard and store
        right behind what it waits for (kernels without run-time size); otherwise in the order in
        which guards and outputs ask for them.

        `values[port]` is a node, or a nested list of nodes in the port's shape; an entry None is
        not stored.  An axis of the size symbol has no list: one value, which may contain
        `LOOP_INDEX`, stands for all k < n.
        """
        writer = _Writer(self)
        if as_made:
            writer.as_made(self._guards, outputs, values)
            return KernelIR(
                name, tuple(inputs), tuple(outputs), tuple(writer.statements), None, purpose,
                tuple(sources),
            )  # fmt: skip
        writer.statements.extend(self._solves)
        for request in self._guards:
            condition = writer.operand(request.condition)
            writer.statements.append(Guard(condition, request.code, request.message))
        for port in outputs:
            if port.name in values:
                writer.store(port, values[port.name])
        return KernelIR(
            name, tuple(inputs), tuple(outputs), tuple(writer.statements), size_symbol, purpose,
            tuple(sources),
        )  # fmt: skip


#: Operations that fold by methods of their own.
_ARITHMETIC: dict[str, Callable[..., Node]] = {
    "neg": Graph.neg, "add": Graph.add, "sub": Graph.sub, "mul": Graph.mul, "div": Graph.div,
    "pow": Graph.power,
}  # fmt: skip


class _Writer:
    """Emits nodes in dependency order, each once, with temporaries numbered densely."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self.statements: list[Statement] = []
        self._operands: dict[int, Operand] = {}
        self._next = 0

    def _number(self) -> int:
        self._next += 1
        return self._next - 1

    def operand(self, node: Node) -> Operand:
        return self._emit(node, self.statements, self._operands)

    def as_made(
        self, guards: Iterable[_GuardRequest], outputs: Iterable[Port], values: dict[str, object]
    ) -> None:
        """Everything in the order of the nodes' numbers."""
        waiting: dict[int, list[Callable[[], Statement]]] = {}
        roots: list[Node] = []

        def wait(node: Node, statement: Callable[[], Statement]) -> None:
            roots.append(node)
            waiting.setdefault(node.number, []).append(statement)

        for g in guards:
            wait(g.condition, lambda g=g: Guard(self.operand(g.condition), g.code, g.message))  # type: ignore[misc]
        for port in outputs:
            for index, entry in _flatten(values[port.name], port.shape):
                node = self.graph.node(entry)  # type: ignore[arg-type]
                wait(node, lambda p=port.name, i=index, n=node: Store(p, i, self.operand(n)))  # type: ignore[misc]
        for node in sorted(_behind(roots), key=lambda n: n.number):
            self.operand(node)
            self.statements += [statement() for statement in waiting.get(node.number, ())]

    def _leaf(self, node: Node) -> Operand | None:
        if isinstance(node.leaf, Fraction):
            return Constant(str(node.leaf))
        if isinstance(node.leaf, Element):
            return node.leaf
        return Constant("pi") if node.op == "pi" else None

    def _emit(self, root: Node, into: list[Statement], known: dict[int, Operand]) -> Operand:
        stack = [root]
        while stack:
            node = stack[-1]
            if node.number in known:
                stack.pop()
                continue
            leaf = self._leaf(node)
            if leaf is not None:
                known[node.number] = leaf
                continue
            if node.op == "sum":
                known[node.number] = self._emit_sum(node)
                continue
            missing = [a for a in node.args if a.number not in known]
            if missing:
                stack.extend(reversed(missing))
                continue
            number = self._number()
            into.append(Assign(number, node.op, tuple(known[a.number] for a in node.args)))
            known[node.number] = Temporary(number)
        return known[root.number]

    def _loop_body(self, term: Node) -> tuple[tuple[Assign, ...], Operand]:
        """What depends on k goes inside; what does not is computed before the loop."""
        for node in _walk(term):
            if not node.looped:
                self.operand(node)
        body: list[Statement] = []
        value = self._emit(term, body, dict(self._operands))
        return tuple(s for s in body if isinstance(s, Assign)), value

    def _emit_sum(self, node: Node) -> Operand:
        body, value = self._loop_body(node.args[0])
        number = self._number()
        self.statements.append(Sum(number, body, value))
        return Temporary(number)

    def store(self, port: Port, value: object) -> None:
        for index, entry in _flatten(value, port.shape):
            if entry is None:
                continue
            node = self.graph.node(entry)
            if LOOP_INDEX in index:
                body, operand = self._loop_body(node)
                self.statements.append(Store(port.name, index, operand, body))
            else:
                self.statements.append(Store(port.name, index, self.operand(node)))


def _behind(roots: Iterable[Node]) -> list[Node]:
    """`roots` and everything that they are made of."""
    found: dict[int, Node] = {}
    stack = list(roots)
    while stack:
        node = stack.pop()
        if node.number not in found:
            found[node.number] = node
            stack.extend(node.args)
    return list(found.values())


def _walk(root: Node) -> list[Node]:
    """Maximal loop-free sub-terms of `root`, in a fixed order."""
    found: dict[int, Node] = {}
    stack = [root]
    while stack:
        node = stack.pop()
        if not node.looped:
            found.setdefault(node.number, node)
        else:
            stack.extend(reversed(node.args))
    return list(found.values())


def _flatten(
    value: object, shape: tuple[int | str, ...]
) -> list[tuple[tuple[int | str, ...], Node | Number | None]]:
    """Entries with their indices; along the run-time size one value stands for all k < n."""
    if not shape:
        return [((), value)]  # type: ignore[list-item]
    if isinstance(shape[0], str):
        return [((LOOP_INDEX, *rest), v) for rest, v in _flatten(value, shape[1:])]
    if not isinstance(value, (list, tuple)) or len(value) != shape[0]:
        raise ValueError(f"{value!r} does not fill the shape {shape}")
    entries = enumerate(value)
    return [((i, *rest), v) for i, entry in entries for rest, v in _flatten(entry, shape[1:])]
