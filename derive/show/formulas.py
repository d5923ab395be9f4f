"""Lines of one equation: whole, by blocks, or entry by entry if too wide."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace

import sympy as sp

from .formula_layout import Name, Node, Row, Table, Word, entry_index, equation, layout
from .line_breaking import TextWidth
from .plain_text import text_box
from .symbol_names import parse_name
from .vector_recognition import recognise_matrix

#: Block sizes of the matrices of the method: state vectors, wrenches and accelerations.
PARTITIONS: dict[int, tuple[int, ...]] = {
    13: (3, 3, 3, 3, 1), 7: (2, 1, 1, 2, 1), 12: (3, 3, 3, 3), 9: (3, 3, 3), 6: (3, 3),
    10: (2, 1, 1, 2, 3, 1), 15: (3, 3, 3, 3, 2, 1),
}  # fmt: skip
#: Matrices with more operations than this use named common sub-expressions.
MAX_UNSHARED_OPERATIONS = 150


def equation_lines(
    left: sp.Basic,
    right: sp.Basic,
    rows: tuple[str, ...] = (),
    measure: TextWidth = TextWidth(),  # noqa: B008 - stateless
) -> list[Node]:
    """Lines of left = right; matrices in blocks if their sizes are those of state vectors.

    `rows` are names of the entries of a column, which is then written entry by entry; `measure`
    decides what fits.
    """
    return _EquationWriter(measure).equation(layout(left), right, rows)


class _EquationWriter:
    """Formulas split according to their width."""

    def __init__(self, measure: TextWidth) -> None:
        self.measure = measure

    def equation(self, shown: Node, right: sp.Basic, rows: tuple[str, ...]) -> list[Node]:
        if isinstance(right, sp.MatrixBase):
            roots, right = self.name_long_roots(right)
            lines_ = self.row_lines(shown, right, rows) if rows else self.matrix(shown, right)
            return [*roots, *lines_]
        if not getattr(right, "is_Matrix", False):
            return self.scalar(shown, right)
        line = equation(shown, layout(right))
        if self.measure.line(line):
            return [line]
        lines = self.lines_with_named_matrices(shown, right) or [line]
        if isinstance(right, sp.BlockMatrix) and not self.measure.line(lines[0]):
            return self.block_lines(shown, right)
        return lines

    def name_long_roots(self, matrix: sp.MatrixBase) -> tuple[list[Node], sp.MatrixBase]:
        """Names of long roots that occur repeatedly, and the matrix that uses them."""
        counts = Counter(
            sp.sqrt(node.base)
            for entry in matrix
            for node in sp.preorder_traversal(entry)
            if isinstance(node, sp.Pow) and abs(node.exp) == sp.Rational(1, 2)
        )
        lines: list[Node] = []
        names: dict[sp.Basic, sp.Basic] = {}
        for root in sorted(counts, key=sp.default_sort_key):
            if counts[root] > 2 and not self.measure.fits_inside(layout(root)):
                symbol = sp.Symbol(f"l_{len(names) + 1}" if names else "l", positive=True)
                names |= {root: symbol, 1 / root: 1 / symbol}
                lines += self.scalar(layout(symbol), root)
        return lines, matrix.xreplace(names) if names else matrix

    def row_lines(self, shown: Node, column: sp.MatrixBase, rows: tuple[str, ...]) -> list[Node]:
        assert isinstance(shown, Name)
        lines = []
        for row, entry in zip(rows, column, strict=True):
            subscript = ",".join(filter(None, (shown.name.subscript, row)))
            lines += self.scalar(Name(replace(shown.name, subscript=subscript)), entry)
        return lines

    def matrix(self, shown: Node, matrix: sp.MatrixBase) -> list[Node]:
        is_small = max(matrix.shape) <= 6 and matrix.rows * matrix.cols <= 12
        is_partitioned = any(extent in PARTITIONS for extent in matrix.shape)
        if not is_partitioned or recognise_matrix(matrix) is not None:
            return self.matrix_lines(shown, matrix)
        if matrix.cols == 1:
            parts = list(_state_blocks(matrix))
            if all(len(part) == 1 or recognise_matrix(part) is not None for part in parts):
                line = equation(shown, Table(tuple((layout(part),) for part in parts)))
                if self.measure.line(line):
                    return [line]
        return self.matrix_lines(shown, matrix) if is_small else self.blocks(shown, matrix)

    def matrix_lines(self, shown: Node, matrix: sp.MatrixBase) -> list[Node]:
        """A matrix in one formula, or entry by entry if that is too wide."""
        if matrix.shape == (1, 1):
            return self.scalar(shown, matrix[0, 0])
        if recognise_matrix(matrix) is not None or sp.count_ops(matrix) <= MAX_UNSHARED_OPERATIONS:
            line = equation(shown, layout(matrix))
            if self.measure.line(line):
                return [line]
        return self.entries(shown, matrix)

    def blocks(self, shown: Node, matrix: sp.MatrixBase) -> list[Node]:
        """The matrix of blocks, then the blocks that were named."""
        rows = PARTITIONS.get(matrix.rows, (matrix.rows,))
        columns = PARTITIONS.get(matrix.cols, (matrix.cols,))
        table: list[tuple[Node, ...]] = []
        block_definitions: list[Node] = []
        for i, height in enumerate(rows):
            cells = []
            for j, width in enumerate(columns):
                row_start, column_start = sum(rows[:i]), sum(columns[:j])
                block = matrix[row_start : row_start + height, column_start : column_start + width]
                cell = layout(block) if sp.count_ops(block) <= MAX_UNSHARED_OPERATIONS else None
                if cell is None or not self.measure.cell(cell, len(columns)):
                    position = f"{i + 1}{j + 1}" if len(columns) > 1 else str(i + 1)
                    cell = _indexed_name(shown, f"⟨{position}⟩")
                    block_definitions += self.matrix_lines(cell, block)
                cells.append(cell)
            table.append(tuple(cells))
        return [equation(shown, Table(tuple(table))), *block_definitions]

    def block_lines(self, shown: Node, matrix: sp.BlockMatrix) -> list[Node]:
        """A matrix by its blocks; blocks that do not fit are named."""
        rows, columns = matrix.blocks.shape
        block_definitions: list[Node] = []
        table = []
        for i in range(rows):
            cells = [layout(matrix.blocks[i, j]) for j in range(columns)]
            for j, cell in enumerate(cells):
                if not self.measure.line(Row((shown, cell, Word("   ")))) or columns > 1:
                    if self.measure.cell(cell, columns):
                        continue
                    cells[j] = _indexed_name(
                        shown, f"⟨{i + 1}{j + 1}⟩" if columns > 1 else f"⟨{i + 1}⟩"
                    )
                    block_definitions += self.equation(cells[j], matrix.blocks[i, j], ())
            table.append(tuple(cells))
        return [equation(shown, Table(tuple(table))), *block_definitions]

    def entries(self, shown: Node, matrix: sp.MatrixBase) -> list[Node]:
        """One line for every non-zero entry."""
        lines: list[Node] = []
        reduced = sp.Matrix(matrix)
        if sp.count_ops(matrix) > MAX_UNSHARED_OPERATIONS:
            symbols = sp.numbered_symbols("c_", start=1)
            common_terms, (reduced,) = sp.cse([sp.Matrix(matrix)], symbols=symbols)
            for symbol, value in common_terms:
                lines += self.scalar(layout(symbol), value)
        for i in range(matrix.rows):
            for j in range(matrix.cols):
                if reduced[i, j] != 0:
                    lines += self.scalar(_entry_name(shown, matrix.shape, i, j), reduced[i, j])
        if any(entry == 0 for entry in reduced):
            lines.append(Word("all other entries are 0"))
        return lines

    def scalar(self, place: Node, value: sp.Basic) -> list[Node]:
        """place = value; a Piecewise that does not fit has one line per branch."""
        line = equation(place, layout(value))
        if self.measure.line(line) or (
            len(text_box(line).lines) == 1 and not value.has(sp.Piecewise)
        ):
            return [line]
        if isinstance(value, sp.Piecewise):
            rows: list[Node] = []
            for branch, condition in value.args:
                separator = Word("   " if condition in (True, sp.true) else "   if ")
                row = (*equation(place, layout(branch)).items, separator, layout(condition))
                rows.append(Row(row))
            return rows
        pieces = list(_outermost_choices(value))
        names = {piece: _indexed_name(place, f"⟨{k}⟩") for k, piece in enumerate(pieces, start=1)}
        lines: list[Node] = [equation(place, layout(value, names))]
        for piece, name in names.items():
            lines += self.scalar(name, piece)
        return lines

    def lines_with_named_matrices(self, shown: Node, right: sp.Basic) -> list[Node]:
        """A wide expression whose explicit matrices are named and defined below it."""
        names: dict[sp.Basic, Node] = {}
        for matrix in _inner_matrices(right):
            if matrix not in names and recognise_matrix(matrix) is None:
                is_wide = sp.count_ops(matrix) > MAX_UNSHARED_OPERATIONS
                if is_wide or not self.measure.fits_inside(layout(matrix)):
                    names[matrix] = _indexed_name(shown, f"⟨{len(names) + 1}⟩")
        if not names:
            return []
        lines: list[Node] = [equation(shown, layout(right, names))]
        return lines + [
            line for matrix, name in names.items() for line in self.matrix(name, matrix)
        ]


def _state_blocks(column: sp.MatrixBase) -> Iterator[sp.MatrixBase]:
    """Blocks of a column, with the sizes of state vectors."""
    start = 0
    for height in PARTITIONS[column.rows]:
        yield column[start : start + height, :]
        start += height


def _indexed_name(shown: Node, index: str) -> Name:
    """Name of the left side with an additional index."""
    if not isinstance(shown, Name):
        return Name(parse_name("B"), "", index)
    outer = shown.index
    if outer.endswith("⟩"):
        outer, index = outer[:-1], f".{index[1:]}"
    return Name(shown.name, shown.accent, outer + index)


def _entry_name(shown: Node, shape: tuple[int, int], i: int, j: int) -> Node:
    if isinstance(shown, Name):
        index = entry_index(shown.name.code_name(), shape, i, j)
        return Name(shown.name, shown.accent, shown.index + index)
    return Row((shown, Word(f"[{entry_index('', shape, i, j)}]")))


def _outermost_choices(value: sp.Basic) -> Iterator[sp.Piecewise]:
    """Outermost Piecewise expressions, without repetition, in a fixed order."""
    visited: set[sp.Basic] = set()
    stack = [value]
    while stack:
        current = stack.pop()
        if isinstance(current, sp.Piecewise):
            if current not in visited:
                visited.add(current)
                yield current
        else:
            stack.extend(sorted(current.args, key=sp.default_sort_key, reverse=True))


def _inner_matrices(expression: sp.Basic) -> Iterator[sp.MatrixBase]:
    if isinstance(expression, sp.BlockMatrix):
        for block in expression.blocks:
            yield from _inner_matrices(block)
    elif isinstance(expression, sp.MatrixBase):
        yield sp.ImmutableDenseMatrix(expression)
    else:
        for part in expression.args:
            yield from _inner_matrices(part)
