"""Finds vectors in explicit matrices: [0 -z y; ...] is shown as r~, [f_x - M b_x; ...] as f - M b.

Only what agrees identically, entry by entry, is replaced; anything else stays explicit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import sympy as sp
from sympy.matrices.expressions.matexpr import MatrixElement

from ..language.notation import Matrix, Perp, Tilde, explicit

#: Matrices with more operations than this are shown as they are.
LIMIT = 1500


class Part(sp.MatrixExpr):
    """Consecutive rows and columns of a matrix symbol, kept by name (first row, first column)."""

    def __new__(
        cls, symbol: sp.MatrixSymbol, row: int, column: int, rows: int, columns: int
    ) -> Part:
        numbers = (sp.Integer(int(n)) for n in (row, column, rows, columns))
        instance: Part = super().__new__(cls, symbol, *numbers)
        return instance

    @property
    def symbol(self) -> sp.MatrixSymbol:
        return self.args[0]

    @property
    def first(self) -> tuple[int, int]:
        return int(self.args[1]), int(self.args[2])

    @property
    def shape(self) -> tuple[sp.Expr, sp.Expr]:
        return (self.args[3], self.args[4])

    def _entry(self, i: sp.Expr, j: sp.Expr, **kwargs: object) -> sp.Expr:
        return self.symbol[self.first[0] + i, self.first[1] + j]


def recognise(matrix: sp.MatrixBase) -> sp.MatrixExpr | None:
    """The matrix as an expression in whole vectors and matrices, or None if it is not one."""
    rows, columns = matrix.shape
    if (rows, columns) == (1, 1):
        return None
    if all(entry == 0 for entry in matrix):
        return sp.ZeroMatrix(rows, columns)
    if rows == columns and matrix == sp.eye(rows):
        return sp.Identity(rows)
    part = _part(matrix)
    if part is not None:
        return part
    if (rows, columns) not in _CANDIDATES or sp.count_ops(matrix) > LIMIT:
        return None
    if not all(_is_multilinear(entry) for entry in matrix):
        return None
    rest = Matrix(matrix).applyfunc(sp.expand)
    found: list[sp.MatrixExpr] = []
    for term in _terms(rest):
        if all(entry == 0 for entry in rest):
            break
        for candidate in _CANDIDATES[rows, columns](term):
            coefficient = _coefficient(rest, candidate)
            if coefficient != 0:
                rest = (rest - coefficient * explicit(candidate)).applyfunc(sp.expand)
                found.append(coefficient * candidate)
    if any(entry != 0 for entry in rest) or not found:
        return None
    return sp.MatAdd(*found) if len(found) > 1 else found[0]


def _is_multilinear(entry: sp.Expr) -> bool:
    """Sums and products of entries and symbols only: nothing that would grow when expanded."""
    if isinstance(entry, (sp.Add, sp.Mul)):
        return all(_is_multilinear(part) for part in entry.args)
    if isinstance(entry, sp.Abs):
        return _is_multilinear(entry.args[0]) and not _owned(entry)
    if isinstance(entry, sp.Pow):
        return not entry.base.args or isinstance(entry.base, MatrixElement)
    return isinstance(entry, (sp.Number, sp.Symbol, MatrixElement))


def _part(matrix: sp.MatrixBase) -> sp.MatrixExpr | None:
    """The matrix as a symbol or as consecutive rows and columns of one."""
    corner = matrix[0, 0]
    if not isinstance(corner, MatrixElement) or not isinstance(corner.parent, sp.MatrixSymbol):
        return None
    symbol, row, column = corner.parent, int(corner.i), int(corner.j)
    rows, columns = matrix.shape
    if row + rows > symbol.rows or column + columns > symbol.cols:
        return None
    whole = Part(symbol, row, column, rows, columns)
    if matrix != explicit(whole):
        return None
    return symbol if whole.shape == symbol.shape else whole


def _terms(matrix: sp.MatrixBase) -> Iterator[tuple[sp.Basic, ...]]:
    """Sets of vectors and matrices that occur together in a term of some entry."""
    seen: set[tuple[sp.Basic, ...]] = set()
    for entry in matrix:
        for term in sp.Add.make_args(entry):
            owners = []
            for factor in sp.Mul.make_args(term):
                base, power = factor.as_base_exp()
                if isinstance(base, MatrixElement) and power.is_Integer and power > 0:
                    owner = _owner(base)
                    owners += [owner] * int(power) if owner is not None else []
            key = tuple(sorted(owners, key=_lever_first))
            if key not in seen and len(key) <= 3:
                seen.add(key)
                yield key


def _lever_first(owner: sp.Basic) -> tuple[bool, str]:
    """Levers and angular velocities before what they are crossed with."""
    name = str(owner.symbol.name if isinstance(owner, Part) else owner.name)
    return not name.startswith(("r_", "omega", "w")), name


def _owner(element: MatrixElement) -> sp.MatrixExpr | None:
    """The vector or matrix an entry belongs to; None for scalars stored as 1 x 1."""
    parent = element.parent
    if not isinstance(parent, sp.MatrixSymbol):
        return None
    rows, columns = int(parent.rows), int(parent.cols)
    if columns == 1 and rows > 3 and rows % 3 == 0:
        return Part(parent, 3 * (int(element.i) // 3), 0, 3, 1)
    return parent if rows * columns > 1 else None


def _coefficient(matrix: Matrix, candidate: sp.MatrixExpr) -> sp.Expr:
    """Scalar c for which c candidate may be a part of the matrix: read off one leading term."""
    spelled = explicit(candidate).applyfunc(sp.expand)
    # Off the diagonal a~ b~ and b~ a~ have no term in common, so look there first.
    order = sorted(
        range(len(spelled)), key=lambda k: spelled.rows > 1 and k % (spelled.cols + 1) == 0
    )
    for position in order:
        entry = spelled[position]
        if entry != 0:
            leading = sp.Add.make_args(entry)[0]
            number, symbols = leading.as_coeff_Mul()
            if symbols == 1:
                constant = [t for t in sp.Add.make_args(matrix[position]) if not _owned(t)]
                return sp.Add(*constant) / number
            found = [t for t in sp.Add.make_args(matrix[position]) if _divides(symbols, t)]
            return sp.Add(*(t / symbols for t in found)) / number
    return sp.Integer(0)


def _divides(symbols: sp.Expr, term: sp.Expr) -> bool:
    """Whether the term is `symbols` times scalars."""
    return not _owned(term / symbols)


def _owned(term: sp.Expr) -> bool:
    return any(_owner(e) is not None for e in term.atoms(MatrixElement))


def _columns(term: tuple[sp.Basic, ...]) -> Iterator[sp.MatrixExpr]:
    """Candidates for a 3 x 1 column: a, a~ b, A b, A^T b, a~ a~ b, a~ A a."""
    vectors, matrices = _kinds(term)
    if len(vectors) == 1 and not matrices:
        yield vectors[0]
    elif len(vectors) == 2 and vectors[0] != vectors[1]:
        yield Tilde(vectors[0]) * vectors[1]
    elif len(vectors) == 1 and len(matrices) == 1:
        yield matrices[0] * vectors[0]
        yield matrices[0].T * vectors[0]
    elif len(vectors) == 3:
        yield from (Tilde(a) * Tilde(a) * b for a, b in _twice(vectors))
    elif len(matrices) == 1 and len(vectors) == 2 and vectors[0] == vectors[1]:
        yield Tilde(vectors[0]) * matrices[0] * vectors[0]


def _twice(vectors: list[sp.Basic]) -> Iterator[tuple[sp.Basic, sp.Basic]]:
    """The vector that occurs twice among three, and the other one."""
    for a in set(vectors):
        others = [v for v in vectors if v != a]
        if len(others) == 1:
            yield a, others[0]


def _squares(term: tuple[sp.Basic, ...]) -> Iterator[sp.MatrixExpr]:
    """Candidates for a 3 x 3 block: I, a~, A, A^T, a~ b~, b~ a~."""
    vectors, matrices = _kinds(term)
    if not term:
        yield sp.Identity(3)
    elif len(vectors) == 1 and not matrices:
        yield Tilde(vectors[0])
    elif len(matrices) == 1 and not vectors:
        yield matrices[0]
        yield matrices[0].T
    elif len(vectors) == 2:
        yield Tilde(vectors[0]) * Tilde(vectors[1])
        if vectors[0] != vectors[1]:
            yield Tilde(vectors[1]) * Tilde(vectors[0])


def _plane_columns(term: tuple[sp.Basic, ...]) -> Iterator[sp.MatrixExpr]:
    if len(term) == 1 and term[0].shape == (2, 1):
        yield term[0]
        yield Perp(term[0])


def _plane_rows(term: tuple[sp.Basic, ...]) -> Iterator[sp.MatrixExpr]:
    yield from (candidate.T for candidate in _plane_columns(term))


def _plane_squares(term: tuple[sp.Basic, ...]) -> Iterator[sp.MatrixExpr]:
    if not term:
        yield sp.Identity(2)


def _kinds(term: tuple[sp.Basic, ...]) -> tuple[list[sp.Basic], list[sp.Basic]]:
    vectors = [x for x in term if tuple(x.shape) == (3, 1)]
    matrices = [x for x in term if tuple(x.shape) == (3, 3)]
    known = len(vectors) + len(matrices) == len(term)
    return (vectors, matrices) if known else ([], [])


_CANDIDATES: dict[
    tuple[int, int], Callable[[tuple[sp.Basic, ...]], Iterator[sp.MatrixExpr]]
] = {
    (3, 1): _columns,
    (3, 3): _squares,
    (1, 3): lambda term: (candidate.T for candidate in _columns(term)),
    (2, 1): _plane_columns,
    (1, 2): _plane_rows,
    (2, 2): _plane_squares,
}  # fmt: skip
