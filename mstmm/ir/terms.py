"""Terms by value numbering: nodes of a graph, and arithmetic that creates and folds them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from functools import cached_property, partial

from .operations import OPERATIONS
from .statements import INNER_INDEX, LOOP_INDEX, Constant, Element

Number = int | float | Fraction

#: Loop variable -> its bit in `Node.loops`.
LOOP_BITS = {LOOP_INDEX: 1, INNER_INDEX: 2}


#: Kinds of constants for folding, determined once: comparisons of fractions are slow.
_ZERO, _ONE, _MINUS_ONE, _POSITIVE, _NEGATIVE = 1, 2, 3, 4, 5


def _constant_kind(value: Fraction) -> int:
    if value.denominator == 1 and -1 <= value.numerator <= 1:
        return (_ZERO, _ONE, _MINUS_ONE)[value.numerator]
    return _POSITIVE if value.numerator > 0 else _NEGATIVE


class Node:
    """Value in a graph, created by methods of the graph and by + - * / ** on other nodes."""

    __slots__ = ("args", "graph", "kind", "leaf", "loops", "number", "op", "value")

    def __init__(
        self,
        graph: Terms,
        number: int,
        op: str,
        args: tuple[Node, ...],
        leaf: Fraction | Element | str | None,
        loops: int,
    ) -> None:
        self.graph, self.number, self.op, self.args = graph, number, op, args
        self.leaf = leaf
        #: Loop variables that the value depends on, as bits.
        self.loops = loops
        #: Exact value of a rational constant, else None.
        self.value: Fraction | None = leaf if isinstance(leaf, Fraction) else None
        self.kind = 0 if self.value is None else _constant_kind(self.value)

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


def dependencies(*roots: Node) -> list[Node]:
    """Nodes that `roots` depend on, themselves included, each after its operands."""
    nodes: dict[int, Node] = {}
    stack = [*roots]
    while stack:
        node = stack.pop()
        if node.number not in nodes:
            nodes[node.number] = node
            stack.extend(node.args)
    return [nodes[number] for number in sorted(nodes)]


class Terms:
    """Hash-consed terms: equal terms are the same node, and constants are folded at once."""

    def __init__(self) -> None:
        self._nodes: dict[tuple[object, ...], Node] = {}
        self._integers: dict[int, Node] = {}
        self._numbers: dict[str, Node] = {}
        self._count = 0
        self._reversed_differences: dict[int, Node] = {}

    # --- leaves ---------------------------------------------------------------------------

    def _make(
        self, op: str, args: tuple[Node, ...] = (), leaf: Fraction | Element | str | None = None
    ) -> Node:
        key = (op, leaf, *(a.number for a in args))
        node = self._nodes.get(key)
        if node is None:
            node = Node(self, self._count, op, args, leaf, _loop_bits(op, args, leaf))
            self._count += 1
            self._nodes[key] = node
        return node

    def constant(self, value: Number) -> Node:
        """Node of an exact rational number (a float becomes the equal fraction)."""
        if type(value) is Fraction:
            return self._make("constant", leaf=value)
        if type(value) is not int:
            return self._make("constant", leaf=Fraction(value))
        node = self._integers.get(value)
        if node is None:
            node = self._integers[value] = self._make("constant", leaf=Fraction(value))
        return node

    def number(self, constant: Constant) -> Node:
        """Node of a constant of a kernel."""
        node = self._numbers.get(constant.text)
        if node is None:
            text = constant.text
            node = self.pi if text == "pi" else self.constant(Fraction(text))
            self._numbers[text] = node
        return node

    @property
    def pi(self) -> Node:
        return self._make("pi", leaf="pi")

    def node(self, value: Node | Number) -> Node:
        """Return `value` if it is a node, else the node of the constant."""
        return value if isinstance(value, Node) else self.constant(value)

    def element(self, port: str, *index: int | str) -> Node:
        """Entry of an array; `LOOP_INDEX` and `INNER_INDEX` mark loop variables."""
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
        return self._commutative_node("add", a, b)

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
            return self.separate_negation(opposite)
        return self._make("sub", (a, b))

    def separate_negation(self, a: Node) -> Node:
        """Separate node for -a, so that `a` stays shared (`neg` would reverse a difference)."""
        return self._make("neg", (a,))

    def mul(self, a: Node, b: Node) -> Node:
        if a.kind or b.kind:
            product = self._fold_product(a, b) if a.kind else self._fold_product(b, a)
            if product is not None:
                return product
        if a.op == "neg":
            return self.neg(self.mul(a.args[0], b))
        if b.op == "neg":
            return self.neg(self.mul(b.args[0], a))
        return self._commutative_node("mul", a, b)

    def _fold_product(self, number: Node, other: Node) -> Node | None:
        """Folded product with a constant; None where nothing can be folded."""
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
            return self._integer_power(a, int(exponent))
        if exponent == Fraction(1, 2):
            return self.call("sqrt", a)
        return self._make("pow", (a, b))

    def _integer_power(self, a: Node, exponent: int) -> Node:
        if exponent < 0:
            return self.div(self.constant(1), self._integer_power(a, -exponent))
        result = self.constant(1)
        square = a
        while exponent:
            if exponent & 1:
                result = self.mul(result, square)
            exponent >>= 1
            if exponent:
                square = self.mul(square, square)
        return result

    def _commutative_node(self, op: str, a: Node, b: Node) -> Node:
        return self._make(op, (a, b) if a.number <= b.number else (b, a))

    def call(self, op: str, *args: Node | Number) -> Node:
        """Apply an operation of `ir.OPERATIONS` by name.  ValueError for a wrong arity."""
        nodes = tuple([a if type(a) is Node else self.node(a) for a in args])
        arithmetic = _ARITHMETIC.get(op)
        if arithmetic is not None:
            return arithmetic(self, *nodes)
        row = OPERATIONS[op]
        if len(nodes) != row.arity:
            raise ValueError(f"{op}: expected {row.arity} operands, found {len(nodes)}")
        if row.at_zero is not None and nodes[0].kind == _ZERO:
            return self.constant(row.at_zero)
        if op == "select" and nodes[0].value is not None:
            return nodes[1] if nodes[0].value != 0 else nodes[2]
        if op == "select" and nodes[1] is nodes[2]:
            return nodes[1]
        return self._commutative_node(op, *nodes) if row.commutative else self._make(op, nodes)

    @cached_property
    def operations(self) -> Mapping[str, Callable[..., Node]]:
        """Operation name -> function of nodes."""
        table = {name: partial(self.call, name) for name in OPERATIONS}
        return table | {name: partial(method, self) for name, method in _ARITHMETIC.items()}

    def sin(self, a: Node) -> Node:
        return self.call("sin", a)

    def cos(self, a: Node) -> Node:
        return self.call("cos", a)

    def sqrt(self, a: Node) -> Node:
        return self.call("sqrt", a)

    def select(self, condition: Node, yes: Node | Number, no: Node | Number) -> Node:
        return self.call("select", condition, yes, no)

    def sum_over_modes(self, term: Node, over: str = LOOP_INDEX) -> Node:
        """Sum of `term` over the loop variable `over` < n.

        A sum that depends on no other loop is rewritten with `LOOP_INDEX`, whatever its letter
        was, so that equal sums are the same node.
        """
        if term.kind == _ZERO:
            return term
        if over != LOOP_INDEX and not term.loops & LOOP_BITS[LOOP_INDEX]:
            return self._make("sum", (self._swap(term),), LOOP_INDEX)
        return self._make("sum", (term,), over)

    def _swap(self, node: Node) -> Node:
        """Node of the same value with the two loop variables exchanged."""
        if not node.loops:
            return node
        swapped = self._reversed_differences.get(node.number)
        if swapped is None:
            if isinstance(node.leaf, Element):
                index = [_swap_letter(e) if isinstance(e, str) else e for e in node.leaf.index]
                swapped = self.element(node.leaf.port, *index)
            elif node.op == "sum":
                swapped = self._make(
                    "sum", (self._swap(node.args[0]),), _swap_letter(str(node.leaf))
                )
            else:
                swapped = self.call(node.op, *(self._swap(a) for a in node.args))
            self._reversed_differences[node.number] = swapped
        return swapped


#: Operations whose folding is a method of Terms.
_ARITHMETIC: dict[str, Callable[..., Node]] = {
    "neg": Terms.neg, "add": Terms.add, "sub": Terms.sub, "mul": Terms.mul, "div": Terms.div,
    "pow": Terms.power,
}  # fmt: skip


def _loop_bits(op: str, args: tuple[Node, ...], leaf: Fraction | Element | str | None) -> int:
    """Loop variables that a node depends on, as bits."""
    if isinstance(leaf, Element):
        bits = 0
        for entry in leaf.index:
            if isinstance(entry, str):
                bits |= LOOP_BITS[entry]
        return bits
    bits = 0
    for a in args:
        bits |= a.loops
    return bits & ~LOOP_BITS[str(leaf)] if op == "sum" else bits


def _swap_letter(letter: str) -> str:
    return INNER_INDEX if letter == LOOP_INDEX else LOOP_INDEX
