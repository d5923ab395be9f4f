"""Layout tree of expressions, shared by text, LaTeX and MathML.

SymPy's own printers differ in what they can show (dotted derivatives, cross-product matrices,
solves) and its MathML does not escape "<"; here the expression is laid out once, by the printer
below, and each format only renders nine kinds of node.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import sympy as sp
from sympy.core.function import AppliedUndef
from sympy.core.relational import Relational
from sympy.logic.boolalg import BooleanFalse, BooleanTrue
from sympy.matrices.expressions.matexpr import MatrixElement
from sympy.matrices.expressions.slice import MatrixSlice

from ..definition.derivation import Factor, Solve, Triangle, Triangular
from ..definition.notation import Perp, Tilde
from .symbol_names import AuthorName, SymbolName, parse_author_name, parse_name
from .vector_recognition import SymbolPart, recognise_matrix


@dataclass(frozen=True)
class Name:
    """A named quantity; `accent` is "", "tilde" or "perp", `index` follows the subscript."""

    name: SymbolName
    accent: str = ""
    index: str = ""


@dataclass(frozen=True)
class Word:
    """Upright text: numbers, function names, I and 0."""

    text: str


@dataclass(frozen=True)
class Sign:
    """An operator; `has_spaces` adds space around it."""

    text: str
    has_spaces: bool = False


@dataclass(frozen=True)
class Row:
    """Nodes in a row."""

    items: tuple[Node, ...]


@dataclass(frozen=True)
class Fraction:
    """Fraction above / below."""

    numerator: Node
    denominator: Node


@dataclass(frozen=True)
class Superscript:
    """Base with a superscript."""

    base: Node
    exponent: Node


@dataclass(frozen=True)
class Fence:
    """Body between delimiters."""

    left: str
    body: Node
    right: str


@dataclass(frozen=True)
class Root:
    """Square root."""

    body: Node


@dataclass(frozen=True)
class Table:
    """A matrix; with `cases` a left brace replaces the brackets."""

    rows: tuple[tuple[Node, ...], ...]
    cases: bool = False


Node = Name | Word | Sign | Row | Fraction | Superscript | Fence | Root | Table

#: Arrays of coordinates, speeds, parameters, efforts and modal quantities: entries are numbered.
COORDINATE_ARRAYS = frozenset(
    (
        *("q", "qdot", "u", "udot", "p", "g", "s", "tau", "tau_n", "alpha", "effort"),
        *("eta", "etad", "etadd", "eta_I", "eta_O", "eta_p", "eta_N", "eta_pI", "eta_pO"),
        *("S_c", "S_r", "e", "J"),
    )
)

_SUM, _PRODUCT, _POWER, _ATOM = range(4)
_RELATIONS = {"<": "<", "<=": "≤", ">": ">", ">=": "≥", "==": "=", "!=": "≠"}


def layout(expression: sp.Basic, names: Mapping[sp.Basic, Node] | None = None) -> Node:
    """Layout of a scalar, matrix or boolean expression.

    Explicit matrices that are sums of vectors, cross-product matrices and the like are shown as
    such; sub-expressions in `names` are shown by the name given there.
    """
    return _Layout(names or {}).node(expression)


def equation(left: Node, right: Node) -> Row:
    """Layout of left = right."""
    return Row((left, Sign("=", True), right))


def _term_order(term: sp.Basic) -> tuple[bool, int]:
    """Sort key: positive terms first; matrices by decreasing number of time derivatives."""
    symbols = term.atoms(sp.MatrixSymbol) if getattr(term, "is_Matrix", False) else ()
    return _is_negative(term), -max((parse_name(s.name).dots for s in symbols), default=0)


def _is_negative(term: sp.Basic) -> bool:
    if isinstance(term, sp.MatMul):
        return bool(term.as_coeff_matrices()[0].could_extract_minus_sign())
    if isinstance(term, sp.Expr) and not getattr(term, "is_Matrix", False):
        return bool(term.as_coeff_Mul()[0].is_negative)
    return False


class _Layout:
    """Layout by expression class, dispatched along the method resolution order."""

    def __init__(self, names: Mapping[sp.Basic, Node]) -> None:
        self.names = names

    def node(self, e: sp.Basic) -> Node:
        return self._print(e)[0]

    def with_brackets(self, e: sp.Basic, level: int) -> Node:
        node, level_of_node = self._print(e)
        return node if level_of_node >= level else Fence("(", node, ")")

    def _print(self, e: sp.Basic) -> tuple[Node, int]:
        if self.names and e in self.names:
            return self.names[e], _ATOM
        if isinstance(e, sp.MatrixBase):
            return self._matrix(e)
        if isinstance(e, (BooleanTrue, BooleanFalse)):
            return Word("otherwise" if e else "never"), _ATOM
        for kind, rule in _RULES:
            if isinstance(e, kind):
                return rule(self, e)
        raise NotImplementedError(f"no layout for {type(e).__name__}: {e}")

    # --- sums and products ------------------------------------------------------------------

    def sum(self, e: sp.Basic) -> tuple[Node, int]:
        terms = e.as_ordered_terms() if isinstance(e, sp.Add) else e.args
        items: list[Node] = []
        for term in sorted(terms, key=_term_order):
            negative = _is_negative(term)
            if items:
                items.append(Sign("−" if negative else "+", True))
            elif negative:
                items.append(Sign("−"))
            items.append(self.with_brackets(-term if negative else term, _PRODUCT))
        return Row(tuple(items)), _SUM

    def product(self, e: sp.Mul) -> tuple[Node, int]:
        if _is_negative(e):
            return Row((Sign("−"), self.with_brackets(-e, _PRODUCT))), _SUM
        above, below = sp.fraction(e)
        if below != 1:
            return Fraction(self.node(above), self.node(below)), _PRODUCT
        factors = [self.with_brackets(f, _POWER) for f in above.as_ordered_factors()]
        return Row(_space_factors(factors)), _PRODUCT

    def matrix_product(self, e: sp.MatMul) -> tuple[Node, int]:
        factor, matrices = e.as_coeff_matrices()
        if factor.could_extract_minus_sign():
            return Row((Sign("−"), self.with_brackets(-e, _PRODUCT))), _SUM
        factors = [self.with_brackets(m, _POWER) for m in matrices]
        if factor != 1:
            factors = [self.with_brackets(factor, _PRODUCT), *factors]
        return Row(_space_factors(factors)), _PRODUCT

    def power(self, e: sp.Pow) -> tuple[Node, int]:
        if e.exp == sp.Rational(1, 2):
            return Root(self.node(e.base)), _ATOM
        if e.exp.is_number and e.exp.is_negative:
            return Fraction(Word("1"), self.node(e.base**-e.exp)), _PRODUCT
        return Superscript(self.with_brackets(e.base, _ATOM), self.node(e.exp)), _POWER

    # --- matrices ---------------------------------------------------------------------------

    def _matrix(self, e: sp.MatrixBase) -> tuple[Node, int]:
        recognised = recognise_matrix(e)
        if recognised is not None:
            return self._print(recognised)
        if e.shape == (1, 1):
            return self._print(e[0, 0])
        rows = tuple(tuple(self.node(x) for x in e.row(i)) for i in range(e.rows))
        return Table(rows), _ATOM

    def block_matrix(self, e: sp.BlockMatrix) -> tuple[Node, int]:
        blocks = e.blocks
        rows = [[self.node(blocks[i, j]) for j in range(blocks.cols)] for i in range(blocks.rows)]
        return Table(tuple(tuple(row) for row in rows)), _ATOM

    def transpose(self, e: sp.Transpose) -> tuple[Node, int]:
        return Superscript(self.with_brackets(e.arg, _ATOM), Word("T")), _POWER

    def matrix_power(self, e: sp.MatPow) -> tuple[Node, int]:
        return Superscript(self.with_brackets(e.base, _ATOM), self.node(e.exp)), _POWER

    def solve(self, e: Solve) -> tuple[Node, int]:
        inverse = Superscript(self.with_brackets(e.matrix, _ATOM), Word("−1"))
        return Row(_space_factors([inverse, self.with_brackets(e.right, _POWER)])), _PRODUCT

    def factor(self, e: Factor) -> tuple[Node, int]:
        product = Superscript(Word("LDL"), Word("T"))
        return Row((product, Fence("(", self.node(e.matrix), ")"))), _ATOM

    def triangular(self, e: Triangular) -> tuple[Node, int]:
        lower = Row((Word("L"), Fence("(", self.node(e.factor), ")")))
        inverse = Superscript(lower, Word("−T" if e.is_transposed else "−1"))
        return Row(_space_factors([inverse, self.with_brackets(e.right, _POWER)])), _PRODUCT

    def triangle(self, e: Triangle) -> tuple[Node, int]:
        return Row((Word("R"), Fence("(", self.node(e.matrix), ")"))), _ATOM

    def cross(self, e: Tilde | Perp) -> tuple[Node, int]:
        accent = "tilde" if isinstance(e, Tilde) else "perp"
        inner = self.node(e.args[0])
        if isinstance(inner, Name) and not inner.accent and not inner.name.upright:
            return Name(inner.name, accent, inner.index), _ATOM
        mark = Word("∼" if accent == "tilde" else "⊥")
        return Superscript(Fence("(", inner, ")"), mark), _POWER

    def element(self, e: MatrixElement) -> tuple[Node, int]:
        parent = e.parent
        if not isinstance(parent, sp.MatrixSymbol):
            inner, index = self.node(parent), f"{e.i + 1},{e.j + 1}"
            return Row((Fence("(", inner, ")"), Word(f"[{index}]"))), _ATOM
        return Name(parse_name(parent.name), "", element_index(parent, int(e.i), int(e.j))), _ATOM

    def part(self, e: SymbolPart) -> tuple[Node, int]:
        spans = []
        for start, count, extent in zip(e.first_index, e.shape, e.symbol.shape, strict=True):
            if extent != 1:
                stop = start + int(count)
                spans.append(f"{start + 1}…{stop}" if count != 1 else f"{stop}")
        return Name(parse_name(e.symbol.name), "", ",".join(spans)), _ATOM

    def slice_of(self, e: MatrixSlice) -> tuple[Node, int]:
        """Rows or columns of a matrix; complete axes are written only next to partial ones."""
        spans = []
        for bounds, extent in zip((e.rowslice, e.colslice), e.parent.shape, strict=True):
            start, stop, _ = bounds
            span = f"{stop}" if stop == start + 1 else f"{start + 1}…{stop}"
            spans.append("·" if (start, stop) == (0, extent) else span)
        index = ",".join(spans if e.parent.shape[1] != 1 else spans[:1])
        if isinstance(e.parent, sp.MatrixSymbol):
            return Name(parse_name(e.parent.name), "", index), _ATOM
        return Row((Fence("(", self.node(e.parent), ")"), Word(f"[{index}]"))), _ATOM

    # --- functions and logic ------------------------------------------------------------------

    def function(self, e: sp.Function) -> tuple[Node, int]:
        items: list[Node] = []
        for argument in e.args:
            items += [Sign(",", True)] if items else []
            items.append(self.node(argument))
        name = {"Max": "max", "Min": "min"}.get(type(e).__name__, type(e).__name__)
        return Row((Word(name), Fence("(", Row(tuple(items)), ")"))), _ATOM

    def derivative(self, e: sp.Derivative) -> tuple[Node, int]:
        base = self.node(e.expr)
        order = sum(int(count) for _, count in e.variable_count)
        if isinstance(base, Name) and str(e.variables[0]) == "t":
            return replace(base, name=replace(base.name, dots=base.name.dots + order)), _ATOM
        above, below = Word("d" if order == 1 else f"d{order}"), Word(f"d{e.variables[0]}")
        return Row((Fraction(above, below), Fence("(", base, ")"))), _PRODUCT

    def piecewise(self, e: sp.Piecewise) -> tuple[Node, int]:
        rows = []
        for value, condition in e.args:
            condition_node = self.node(condition)
            prefix = () if condition in (True, sp.true) else (Word("if "),)
            rows.append((self.node(value), Row((*prefix, condition_node))))
        return Table(tuple(rows), cases=True), _ATOM

    def relation(self, e: Relational) -> tuple[Node, int]:
        sign = Sign(_RELATIONS[e.rel_op], True)
        return Row((self.node(e.lhs), sign, self.node(e.rhs))), _PRODUCT

    def logic(self, e: sp.Basic) -> tuple[Node, int]:
        connective = " and " if isinstance(e, sp.And) else " or "
        items: list[Node] = []
        for argument in e.args:
            items += [Word(connective)] if items else []
            items.append(self.with_brackets(argument, _PRODUCT))
        return Row(tuple(items)), _SUM


def _space_factors(factors: list[Node]) -> tuple[Node, ...]:
    items: list[Node] = []
    for factor in factors:
        items += [Sign(" ")] if items else []
        items.append(factor)
    return tuple(items)


def element_index(parent: sp.MatrixSymbol, i: int, j: int) -> str:
    """Displayed index of an entry: x y z for a plane or space vector, else from one."""
    shape = int(parent.rows), int(parent.cols)
    return "" if shape == (1, 1) else entry_index(parent.name, shape, i, j)


def entry_index(name: str, shape: tuple[int, int], i: int, j: int) -> str:
    """Displayed index of entry i, j (from zero) of an array of this name and shape."""
    rows, columns = shape
    if columns == 1:
        spatial = rows in (2, 3) and name not in COORDINATE_ARRAYS
        return "xyz"[i] if spatial else str(i + 1)
    return f"{i + 1},{j + 1}"


def _number_layout(_: _Layout, e: sp.Number) -> tuple[Node, int]:
    digits = len(str(e.q)) - 1 if isinstance(e, sp.Rational) and e.p == 1 else 0
    if digits > 2 and e.q == 10**digits:
        return Superscript(Word("10"), Word(f"−{digits}")), _POWER
    if isinstance(e, sp.Rational) and e.q != 1:
        sign: tuple[Node, ...] = (Sign("−"),) if e.p < 0 else ()
        return Row((*sign, Fraction(Word(str(abs(e.p))), Word(str(e.q))))), _PRODUCT
    if e.is_negative:
        return Row((Sign("−"), Word(str(-e)))), _SUM
    return Word(str(e)), _ATOM


def _symbol_layout(_: _Layout, e: sp.Basic) -> tuple[Node, int]:
    make_name = parse_author_name if isinstance(e, AuthorName) else parse_name
    return Name(make_name(str(e.name))), _ATOM


Rule = Callable[[_Layout, sp.Basic], tuple[Node, int]]

_RULES: tuple[tuple[type | tuple[type, ...], Rule], ...] = (
    (SymbolPart, _Layout.part),
    ((Tilde, Perp), _Layout.cross),
    (Solve, _Layout.solve),
    (Factor, _Layout.factor),
    (Triangular, _Layout.triangular),
    (Triangle, _Layout.triangle),
    (MatrixElement, _Layout.element),
    (MatrixSlice, _Layout.slice_of),
    ((sp.MatrixSymbol, sp.Symbol), _symbol_layout),
    ((sp.Add, sp.MatAdd), _Layout.sum),
    (sp.MatMul, _Layout.matrix_product),
    (sp.MatPow, _Layout.matrix_power),
    (sp.Transpose, _Layout.transpose),
    (sp.BlockMatrix, _Layout.block_matrix),
    (sp.Identity, lambda _, e: (Word("I"), _ATOM)),
    (sp.ZeroMatrix, lambda _, e: (Word("0"), _ATOM)),
    (sp.Mul, _Layout.product),
    (sp.Pow, _Layout.power),
    (sp.Number, _number_layout),
    (type(sp.pi), lambda _, e: (Word("π"), _ATOM)),
    (sp.Abs, lambda p, e: (Fence("|", p.node(e.args[0]), "|"), _ATOM)),
    (sp.Derivative, _Layout.derivative),
    (AppliedUndef, lambda _, e: (Name(parse_name(e.func.__name__)), _ATOM)),
    (sp.Piecewise, _Layout.piecewise),
    (Relational, _Layout.relation),
    ((sp.And, sp.Or), _Layout.logic),
    (sp.Not, lambda p, e: (Row((Word("not "), p.with_brackets(e.args[0], _ATOM))), _SUM)),
    ((sp.Function, sp.Max, sp.Min), _Layout.function),
)
