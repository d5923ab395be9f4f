"""Expressions of scene files: parsing, evaluation and conversion into an expression graph.

`parse` turns text into a frozen `Expression`; `Expression.build` converts it to nodes of a
`mstmm.ir.graph.Graph`.  From there it is compiled and differentiated exactly, as every derived
equation is.  Text is never evaluated as Python.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import lru_cache

from ..errors import ExpressionError
from ..ir.terms import Node, Terms
from .parser import FUNCTIONS, MAX_LENGTH, MEANING, Name, Parser, Term

__all__ = ["FUNCTIONS", "SWITCHES", "Expression", "Name", "number", "parse"]

#: Operations that change branch where their argument, or the difference of both, is zero.
SWITCHES = frozenset({"sign", "abs", "lt", "le", "gt", "ge", "min", "max"})

#: Operations that are not nan where no operand is nan, except after overflow.
_NEVER_NAN = frozenset({
    "number", "pi", "name", "neg", "add", "sub", "mul", "abs", "sign", "min", "max", "sin", "cos",
    "tan", "atan", "atan2", "tanh", "lt", "le", "gt", "ge", "where",
})  # fmt: skip

_SYMBOLS = {"lt": "<", "le": "<=", "gt": ">", "ge": ">="}
_Line = tuple[Fraction, Fraction]


@dataclass(frozen=True)
class Expression:
    """Parsed expression.

    Expressions with equal text and equal constants are equal.  `names` are the names in it, each
    once, in the order of the text.  `terms` is the flat syntax tree (arguments before the
    operation), `root` the index of the outermost term.
    """

    text: str
    names: tuple[Name, ...] = field(compare=False)
    terms: tuple[Term, ...] = field(compare=False, repr=False)
    root: int = field(compare=False, repr=False)
    #: The named constants in it with their values, which the terms contain.
    constants: tuple[tuple[str, float], ...] = field(default=(), kw_only=True)

    # --- dependencies -------------------------------------------------------------------------

    @property
    def is_constant(self) -> bool:
        """Whether the expression contains no name."""
        return not self.names

    @property
    def constant(self) -> float | None:
        """Value of a constant expression, else None."""
        return self.terms[self.root].constant

    @property
    def is_zero(self) -> bool:
        """Whether the expression is exactly the constant zero."""
        return self.terms[self.root].constant == 0

    @property
    def depends_on_time_only(self) -> bool:
        """Whether no name but `t` occurs in the expression; true for constants."""
        return all(name.parts == ("t",) and name.index is None for name in self.names)

    @property
    def is_condition(self) -> bool:
        """Whether the whole expression is a comparison."""
        return self.terms[self.root].is_condition

    @property
    def comparison(self) -> tuple[Expression, str, Expression] | None:
        """Parts (left, "<" | "<=" | ">" | ">=", right) of a top-level comparison, else None."""
        top = self.terms[self.root]
        if not top.is_condition:
            return None
        left, right = (self._part(i) for i in top.args)
        return left, _SYMBOLS[top.op], right

    def _part(self, root: int) -> Expression:
        term = self.terms[root]
        needed = self._needed(root)
        names = _distinct(t.name for i, t in enumerate(self.terms) if i in needed and t.name)
        # `text` was stripped before parsing, so that positions point into it.
        return Expression(
            self.text[term.start : term.end], names, self.terms, root, constants=self.constants
        )

    @property
    def needed(self) -> frozenset[int]:
        """Indices of the terms that the value depends on."""
        return frozenset(self._needed(self.root))

    def _needed(self, root: int) -> set[int]:
        needed: set[int] = set()
        stack = [root]
        while stack:
            number = stack.pop()
            needed.add(number)
            stack.extend(self.terms[number].args)
        return needed

    # --- meaning --------------------------------------------------------------------------------

    def build(self, graph: Terms, resolve: Callable[[Name], Node]) -> Node:
        """Build the expression as a node of `graph`; `resolve` returns the node of each name.

        A comparison is 1 where it is true and 0 elsewhere.  A `where` whose comparison has nan on
        either side is nan.
        """
        return self.nodes(graph, resolve)[self.root]

    def nodes(self, graph: Terms, resolve: Callable[[Name], Node]) -> dict[int, Node]:
        """Build the nodes of all terms that the value depends on, by term index."""
        nodes: dict[int, Node] = {}
        numbers: set[int] = set()  # terms that are never nan while names are finite
        for number in sorted(self._needed(self.root)):
            term = self.terms[number]
            args = [nodes[i] for i in term.args]
            total = term.op in _NEVER_NAN and numbers.issuperset(term.args)
            if total or term.constant is not None:
                numbers.add(number)
            elif term.op == "where":
                args[2] = _where_false(graph, self.terms[term.args[0]], nodes, args[2])
            nodes[number] = _node(graph, term, args, resolve)
        return nodes

    def evaluate(self, values: Callable[[Name], float]) -> float:
        """Evaluate in double precision; nan or infinity where there is no finite value."""
        known: dict[int, float] = {}
        needed = self._needed(self.root)
        for number, term in enumerate(self.terms):
            if number not in needed:
                continue
            if term.constant is not None:
                known[number] = term.constant
            elif term.name is not None:
                known[number] = float(values(term.name))
            else:
                known[number] = float(MEANING[term.op](*(known[i] for i in term.args)))
        return known[self.root]

    def time_breaks(self) -> tuple[float, ...]:
        """Exact switching times (s), ascending.

        A comparison, sign, abs, min or max of terms that are linear in `t` alone switches there.
        """
        times = (time for time in self.linear_switches().values() if time is not None)
        return tuple(sorted(set(times)))

    def linear_switches(self) -> dict[int, float | None]:
        """Switching time (s) by term index, of terms that compare linear functions of `t` alone.

        None for a term that never switches.
        """
        lines: list[_Line | None] = []
        needed = self._needed(self.root)
        found: dict[int, float | None] = {}
        for number, term in enumerate(self.terms):
            args = [lines[i] for i in term.args]
            lines.append(_line(term, args))
            known = [line for line in args if line is not None]
            switches = term.op in SWITCHES and term.constant is None and number in needed
            if switches and len(known) == len(args):
                found[number] = _switch(term.op, known)
        return found


def parse(text: str, where: str = "", constants: Mapping[str, float] | None = None) -> Expression:
    """Parse the text of an expression.

    `where` (file, element, key) begins every message; `constants` are named numbers.  Raises
    ExpressionError with the position marked and a remedy.
    """
    try:
        return _parse(_checked(text), tuple((constants or {}).items()))
    except ExpressionError as error:
        raise ExpressionError(f"{where}: {error}" if where else str(error)) from None


def _checked(text: object) -> str:
    if not isinstance(text, str):
        raise ExpressionError(f"expected an expression as text, found {type(text).__name__}")
    if len(text) > MAX_LENGTH:
        raise ExpressionError(
            f"the expression has {len(text)} characters, the limit is {MAX_LENGTH}; "
            "shorten it, or split it into several loads"
        )
    stripped = text.strip(" \t\r\n")
    if not stripped:
        raise ExpressionError("the expression is empty; write 0 for zero")
    return stripped


def number(value: float) -> Expression:
    """Constant expression of a finite number."""
    return _parse(repr(float(value)))


@lru_cache(maxsize=4096)
def _parse(text: str, constants: tuple[tuple[str, float], ...] = ()) -> Expression:
    parser = Parser(text, dict(constants))
    root = parser.run()
    names = _distinct(term.name for term in parser.terms if term.name is not None)
    used = tuple(parser.used.items())
    return Expression(text, names, tuple(parser.terms), root, constants=used)


def _distinct(names: object) -> tuple[Name, ...]:
    return tuple(dict.fromkeys(names))  # type: ignore[call-overload]


# --- terms as nodes, numbers and straight lines ---------------------------------------------------


def _node(graph: Terms, term: Term, args: list[Node], resolve: Callable[[Name], Node]) -> Node:
    if term.exact is not None:
        return graph.constant(term.exact)
    if term.name is not None:
        return resolve(term.name)
    if term.op == "pi":
        return graph.pi
    if term.op == "where":
        return graph.select(*args)
    if term.op in ("gt", "ge"):
        return graph.call("lt" if term.op == "gt" else "le", args[1], args[0])
    return graph.call(term.op, *args)


def _where_false(graph: Terms, comparison: Term, nodes: Mapping[int, Node], no: Node) -> Node:
    """False branch of a `where`: `no`, or nan if a side of the comparison is nan."""
    a, b = (nodes[i] for i in comparison.args)
    if comparison.op in ("gt", "ge"):
        a, b = b, a
    opposite = graph.call("le" if comparison.op in ("lt", "gt") else "lt", b, a)
    return graph.select(opposite, no, a + b)


def _line(term: Term, args: list[_Line | None]) -> _Line | None:
    """Slope and offset of a term that is linear in `t` alone; None for others."""
    if term.constant is not None:
        return Fraction(0), term.exact if term.exact is not None else Fraction(term.constant)
    if term.name is not None:
        is_time = term.name.parts == ("t",) and term.name.index is None
        return (Fraction(1), Fraction(0)) if is_time else None
    lines = [line for line in args if line is not None]
    if len(lines) < len(args) or any(_is_long(line) for line in lines):
        return None
    if term.op == "neg":
        return -lines[0][0], -lines[0][1]
    if term.op in ("add", "sub"):
        sign = 1 if term.op == "add" else -1
        return lines[0][0] + sign * lines[1][0], lines[0][1] + sign * lines[1][1]
    if term.op == "mul":
        one, other = lines if lines[0][0] == 0 else reversed(lines)
        return (one[1] * other[0], one[1] * other[1]) if one[0] == 0 else None
    if term.op == "div" and lines[1][0] == 0 and lines[1][1] != 0:
        return lines[0][0] / lines[1][1], lines[0][1] / lines[1][1]
    return None


def _is_long(line: _Line) -> bool:
    """Whether a coefficient is too long for an exact switching time."""
    return any(max(abs(x.numerator), x.denominator).bit_length() > 8000 for x in line)


def _switch(op: str, lines: list[_Line]) -> float | None:
    """Time (s) at which an operation on linear functions of time changes branch."""
    if op in ("sign", "abs"):
        slope, offset = lines[0]
    else:
        slope, offset = lines[0][0] - lines[1][0], lines[0][1] - lines[1][1]
    if slope == 0:
        return None
    try:
        return float(-offset / slope)
    except OverflowError:
        return None
