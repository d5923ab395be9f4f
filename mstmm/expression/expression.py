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
from .parser import FUNCTIONS, MAX_EXPRESSION_LENGTH, OPERATION_FUNCTIONS, Name, Parser, Term

__all__ = ["FUNCTIONS", "SWITCHES", "Expression", "Name", "number", "parse"]

#: Operations that change branch where their argument, or the difference of both, is zero.
SWITCHES = frozenset({"sign", "abs", "lt", "le", "gt", "ge", "min", "max"})

#: Operations that are not nan where no operand is nan, except after overflow.
_NEVER_NAN = frozenset({
    "number", "pi", "name", "neg", "add", "sub", "mul", "abs", "sign", "min", "max", "sin", "cos",
    "tan", "atan", "atan2", "tanh", "lt", "le", "gt", "ge", "where",
})  # fmt: skip

_COMPARISON_SYMBOLS = {"lt": "<", "le": "<=", "gt": ">", "ge": ">="}
_LinearFunction = tuple[Fraction, Fraction]


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
        return left, _COMPARISON_SYMBOLS[top.op], right

    def _part(self, root: int) -> Expression:
        term = self.terms[root]
        required = self._dependencies(root)
        names = _distinct(t.name for i, t in enumerate(self.terms) if i in required and t.name)
        # `text` was stripped before parsing, so that positions point into it.
        return Expression(
            self.text[term.start : term.end], names, self.terms, root, constants=self.constants
        )

    @property
    def required_terms(self) -> frozenset[int]:
        """Indices of the terms that the value depends on."""
        return frozenset(self._dependencies(self.root))

    def _dependencies(self, root: int) -> set[int]:
        required: set[int] = set()
        stack = [root]
        while stack:
            number = stack.pop()
            required.add(number)
            stack.extend(self.terms[number].args)
        return required

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
        never_nan: set[int] = set()  # terms that are never nan while names are finite
        for number in sorted(self._dependencies(self.root)):
            term = self.terms[number]
            args = [nodes[i] for i in term.args]
            is_total = term.op in _NEVER_NAN and never_nan.issuperset(term.args)
            if is_total or term.constant is not None:
                never_nan.add(number)
            elif term.op == "where":
                args[2] = _false_branch(graph, self.terms[term.args[0]], nodes, args[2])
            nodes[number] = _node(graph, term, args, resolve)
        return nodes

    def evaluate(self, values: Callable[[Name], float]) -> float:
        """Evaluate in double precision; nan or infinity where there is no finite value."""
        term_values: dict[int, float] = {}
        required = self._dependencies(self.root)
        for number, term in enumerate(self.terms):
            if number not in required:
                continue
            if term.constant is not None:
                term_values[number] = term.constant
            elif term.name is not None:
                term_values[number] = float(values(term.name))
            else:
                term_values[number] = float(
                    OPERATION_FUNCTIONS[term.op](*(term_values[i] for i in term.args))
                )
        return term_values[self.root]

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
        linear_functions: list[_LinearFunction | None] = []
        required = self._dependencies(self.root)
        times_by_term: dict[int, float | None] = {}
        for number, term in enumerate(self.terms):
            args = [linear_functions[i] for i in term.args]
            linear_functions.append(_linear_function(term, args))
            linear_args = [linear_arg for linear_arg in args if linear_arg is not None]
            is_switch = term.op in SWITCHES and term.constant is None and number in required
            if is_switch and len(linear_args) == len(args):
                times_by_term[number] = _switching_time(term.op, linear_args)
        return times_by_term


def parse(text: str, where: str = "", constants: Mapping[str, float] | None = None) -> Expression:
    """Parse the text of an expression.

    `where` (file, element, key) begins every message; `constants` are named numbers.  Raises
    ExpressionError with the position marked and a remedy.
    """
    try:
        return _parse(_require_text(text), tuple((constants or {}).items()))
    except ExpressionError as error:
        raise ExpressionError(f"{where}: {error}" if where else str(error)) from None


def _require_text(text: object) -> str:
    if not isinstance(text, str):
        raise ExpressionError(f"expected an expression as text, found {type(text).__name__}")
    if len(text) > MAX_EXPRESSION_LENGTH:
        raise ExpressionError(
            f"the expression has {len(text)} characters, the limit is {MAX_EXPRESSION_LENGTH}; "
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
    used_constants = tuple(parser.used_constants.items())
    return Expression(text, names, tuple(parser.terms), root, constants=used_constants)


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


def _false_branch(graph: Terms, comparison: Term, nodes: Mapping[int, Node], no: Node) -> Node:
    """False branch of a `where`: `no`, or nan if a side of the comparison is nan."""
    a, b = (nodes[i] for i in comparison.args)
    if comparison.op in ("gt", "ge"):
        a, b = b, a
    opposite = graph.call("le" if comparison.op in ("lt", "gt") else "lt", b, a)
    return graph.select(opposite, no, a + b)


def _linear_function(term: Term, args: list[_LinearFunction | None]) -> _LinearFunction | None:
    """Slope and offset of a term that is linear in `t` alone; None for others."""
    if term.constant is not None:
        return Fraction(0), term.exact if term.exact is not None else Fraction(term.constant)
    if term.name is not None:
        is_time = term.name.parts == ("t",) and term.name.index is None
        return (Fraction(1), Fraction(0)) if is_time else None
    linear_args = [line for line in args if line is not None]
    if len(linear_args) < len(args) or any(_is_long(line) for line in linear_args):
        return None
    if term.op == "neg":
        return -linear_args[0][0], -linear_args[0][1]
    if term.op in ("add", "sub"):
        sign = 1 if term.op == "add" else -1
        return linear_args[0][0] + sign * linear_args[1][0], linear_args[0][1] + sign * linear_args[
            1
        ][1]
    if term.op == "mul":
        constant_line, other_line = linear_args if linear_args[0][0] == 0 else reversed(linear_args)
        return (
            (constant_line[1] * other_line[0], constant_line[1] * other_line[1])
            if constant_line[0] == 0
            else None
        )
    if term.op == "div" and linear_args[1][0] == 0 and linear_args[1][1] != 0:
        return linear_args[0][0] / linear_args[1][1], linear_args[0][1] / linear_args[1][1]
    return None


def _is_long(line: _LinearFunction) -> bool:
    """Whether a coefficient is too long for an exact switching time."""
    return any(max(abs(x.numerator), x.denominator).bit_length() > 8000 for x in line)


def _switching_time(op: str, lines: list[_LinearFunction]) -> float | None:
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
