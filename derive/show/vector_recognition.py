"""Recognition of vectors in explicit matrices: [0 -z y; ...] is shown as r~.

Also [f_x - M b_x; ...] as f - M b.  Only identities that hold entry by entry are replaced; anything
else stays explicit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import sympy as sp
from sympy.matrices.expressions.matexpr import MatrixElement

from ..definition.notation import Matrix, Perp, Tilde, explicit

#: Matrices with more operations than this are shown unchanged.
MAX_OPERATIONS = 1500


class SymbolPart(sp.MatrixExpr):
    """Consecutive rows and columns of a matrix symbol, by name (first row, first column)."""

    def __new__(
        cls, symbol: sp.MatrixSymbol, row: int, column: int, rows: int, columns: int
    ) -> SymbolPart:
        numbers = (sp.Integer(int(n)) for n in (row, column, rows, columns))
        instance: SymbolPart = super().__new__(cls, symbol, *numbers)
        return instance

    @property
    def symbol(self) -> sp.MatrixSymbol:
        return self.args[0]

    @property
    def first_index(self) -> tuple[int, int]:
        return int(self.args[1]), int(self.args[2])

    @property
    def shape(self) -> tuple[sp.Expr, sp.Expr]:
        return (self.args[3], self.args[4])

    def _entry(self, i: sp.Expr, j: sp.Expr, **kwargs: object) -> sp.Expr:
        return self.symbol[self.first_index[0] + i, self.first_index[1] + j]


def recognise_matrix(matrix: sp.MatrixBase) -> sp.MatrixExpr | None:
    """The matrix as an expression in whole vectors and matrices, or None if it is not one."""
    rows, columns = matrix.shape
    if (rows, columns) == (1, 1):
        return None
    if all(entry == 0 for entry in matrix):
        return sp.ZeroMatrix(rows, columns)
    if rows == columns and matrix == sp.eye(rows):
        return sp.Identity(rows)
    part = _symbol_part(matrix)
    if part is not None:
        return part
    if (rows, columns) not in _CANDIDATES or sp.count_ops(matrix) > MAX_OPERATIONS:
        return None
    if not all(_is_multilinear(entry) for entry in matrix):
        return None
    remainder = Matrix(matrix).applyfunc(sp.expand)
    summands: list[sp.MatrixExpr] = []
    for term in _term_owners(remainder):
        if all(entry == 0 for entry in remainder):
            break
        for candidate in _CANDIDATES[rows, columns](term):
            coefficient = _coefficient(remainder, candidate)
            if coefficient != 0:
                remainder = (remainder - coefficient * explicit(candidate)).applyfunc(sp.expand)
                summands.append(coefficient * candidate)
    if any(entry != 0 for entry in remainder) or not summands:
        return None
    return sp.MatAdd(*summands) if len(summands) > 1 else summands[0]


def _is_multilinear(entry: sp.Expr) -> bool:
    """Whether an entry has only sums and products of symbols, which do not grow on expansion."""
    if isinstance(entry, (sp.Add, sp.Mul)):
        return all(_is_multilinear(part) for part in entry.args)
    if isinstance(entry, sp.Abs):
        return _is_multilinear(entry.args[0]) and not _has_owner(entry)
    if isinstance(entry, sp.Pow):
        return not entry.base.args or isinstance(entry.base, MatrixElement)
    return isinstance(entry, (sp.Number, sp.Symbol, MatrixElement))


def _symbol_part(matrix: sp.MatrixBase) -> sp.MatrixExpr | None:
    """The matrix as a symbol or as consecutive rows and columns of one."""
    corner = matrix[0, 0]
    if not isinstance(corner, MatrixElement) or not isinstance(corner.parent, sp.MatrixSymbol):
        return None
    symbol, row, column = corner.parent, int(corner.i), int(corner.j)
    rows, columns = matrix.shape
    if row + rows > symbol.rows or column + columns > symbol.cols:
        return None
    block = SymbolPart(symbol, row, column, rows, columns)
    if matrix != explicit(block):
        return None
    return symbol if block.shape == symbol.shape else block


def _term_owners(matrix: sp.MatrixBase) -> Iterator[tuple[sp.Basic, ...]]:
    """Sets of vectors and matrices that occur together in a term of some entry."""
    visited: set[tuple[sp.Basic, ...]] = set()
    for entry in matrix:
        for term in sp.Add.make_args(entry):
            owners = []
            for factor in sp.Mul.make_args(term):
                base, power = factor.as_base_exp()
                if isinstance(base, MatrixElement) and power.is_Integer and power > 0:
                    owner = _entry_owner(base)
                    owners += [owner] * int(power) if owner is not None else []
            key = tuple(sorted(owners, key=_owner_order))
            if key not in visited and len(key) <= 3:
                visited.add(key)
                yield key


def _owner_order(owner: sp.Basic) -> tuple[bool, str]:
    """Sort key: lever arms and angular velocities before the vectors that they multiply."""
    name = str(owner.symbol.name if isinstance(owner, SymbolPart) else owner.name)
    return not name.startswith(("r_", "omega", "w")), name


def _entry_owner(element: MatrixElement) -> sp.MatrixExpr | None:
    """The vector or matrix an entry belongs to; None for scalars stored as 1 x 1."""
    parent = element.parent
    if not isinstance(parent, sp.MatrixSymbol):
        return None
    rows, columns = int(parent.rows), int(parent.cols)
    if columns == 1 and rows > 3 and rows % 3 == 0:
        return SymbolPart(parent, 3 * (int(element.i) // 3), 0, 3, 1)
    return parent if rows * columns > 1 else None


def _coefficient(matrix: Matrix, candidate: sp.MatrixExpr) -> sp.Expr:
    """Scalar c for which c candidate may be a part of the matrix, from one leading term."""
    explicit_entries = explicit(candidate).applyfunc(sp.expand)
    # Off the diagonal a~ b~ and b~ a~ have no term in common, so these entries come first.
    order = sorted(
        range(len(explicit_entries)),
        key=lambda k: explicit_entries.rows > 1 and k % (explicit_entries.cols + 1) == 0,
    )
    for position in order:
        entry = explicit_entries[position]
        if entry != 0:
            leading_term = sp.Add.make_args(entry)[0]
            number, symbols = leading_term.as_coeff_Mul()
            if symbols == 1:
                constant = [t for t in sp.Add.make_args(matrix[position]) if not _has_owner(t)]
                return sp.Add(*constant) / number
            factors = [t / symbols for t in sp.Add.make_args(matrix[position])]
            return sp.Add(*(factor for factor in factors if not _has_owner(factor))) / number
    return sp.Integer(0)


def _has_owner(term: sp.Expr) -> bool:
    return any(_entry_owner(e) is not None for e in term.atoms(MatrixElement))


def _column_candidates(term: tuple[sp.Basic, ...]) -> Iterator[sp.MatrixExpr]:
    """Candidates for a 3 x 1 column: a, a~ b, A b, A^T b, a~ a~ b, a~ A a."""
    vectors, matrices = _split_vectors_matrices(term)
    if len(vectors) == 1 and not matrices:
        yield vectors[0]
    elif len(vectors) == 2 and vectors[0] != vectors[1]:
        yield Tilde(vectors[0]) * vectors[1]
    elif len(vectors) == 1 and len(matrices) == 1:
        yield matrices[0] * vectors[0]
        yield matrices[0].T * vectors[0]
    elif len(vectors) == 3:  # one of them occurs twice
        for a in set(vectors):
            others = [v for v in vectors if v != a]
            if len(others) == 1:
                yield Tilde(a) * Tilde(a) * others[0]
    elif len(matrices) == 1 and len(vectors) == 2 and vectors[0] == vectors[1]:
        yield Tilde(vectors[0]) * matrices[0] * vectors[0]


def _square_candidates(term: tuple[sp.Basic, ...]) -> Iterator[sp.MatrixExpr]:
    """Candidates for a 3 x 3 block: I, a~, A, A^T, a~ b~, b~ a~."""
    vectors, matrices = _split_vectors_matrices(term)
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


def _planar_column_candidates(term: tuple[sp.Basic, ...]) -> Iterator[sp.MatrixExpr]:
    if len(term) == 1 and term[0].shape == (2, 1):
        yield term[0]
        yield Perp(term[0])


def _split_vectors_matrices(term: tuple[sp.Basic, ...]) -> tuple[list[sp.Basic], list[sp.Basic]]:
    vectors = [x for x in term if tuple(x.shape) == (3, 1)]
    matrices = [x for x in term if tuple(x.shape) == (3, 3)]
    is_complete = len(vectors) + len(matrices) == len(term)
    return (vectors, matrices) if is_complete else ([], [])


_CANDIDATES: dict[
    tuple[int, int], Callable[[tuple[sp.Basic, ...]], Iterator[sp.MatrixExpr]]
] = {
    (3, 1): _column_candidates,
    (3, 3): _square_candidates,
    (1, 3): lambda term: (candidate.T for candidate in _column_candidates(term)),
    (2, 1): _planar_column_candidates,
    (1, 2): lambda term: (candidate.T for candidate in _planar_column_candidates(term)),
    (2, 2): lambda term: iter(() if term else (sp.Identity(2),)),
}  # fmt: skip
