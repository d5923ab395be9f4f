"""One equation as displayed lines: whole, block by block, or entry by entry where too wide."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import sympy as sp

from .layout import Name, Node, Row, Sign, Table, Word, entry_index, equation, layout
from .names import shown_name
from .recognise import recognise
from .text import box

#: Blocks of the matrices of the method: state vectors, wrenches and accelerations.
PARTITIONS: dict[int, tuple[int, ...]] = {
    13: (3, 3, 3, 3, 1), 7: (2, 1, 1, 2, 1), 12: (3, 3, 3, 3), 9: (3, 3, 3), 6: (3, 3),
    10: (2, 1, 1, 2, 3, 1), 15: (3, 3, 3, 3, 2, 1),
}  # fmt: skip

#: A block wider than this in text gets a name and is spelled out below the matrix.
CELL_WIDTH = 20
#: A formula wider than this in text is stated entry by entry.
FORMULA_WIDTH = 96
#: Matrices with more operations than this are stated with named common sub-expressions.
SHARED_ABOVE = 150
#: Explicit matrices wider than this inside a formula that does not fit get a name.
INNER_WIDTH = 16


def stated(left: sp.Basic, right: sp.Basic) -> list[Node]:
    """Lines of left = right; matrices in blocks where their extents are those of state vectors."""
    shown = layout(left)
    if isinstance(right, sp.MatrixBase):
        return _stated_matrix(shown, right)
    if not getattr(right, "is_Matrix", False):
        return _scalar(shown, right)
    line = equation(shown, layout(right))
    return [line] if _fits(line) else _hoisted(shown, right) or [line]


def _fits(line: Node) -> bool:
    return box(line).width <= FORMULA_WIDTH


def _stated_matrix(shown: Node, matrix: sp.MatrixBase) -> list[Node]:
    small = max(matrix.shape) <= 6 and matrix.rows * matrix.cols <= 12
    partitioned = any(extent in PARTITIONS for extent in matrix.shape)
    if partitioned and not small and recognise(matrix) is None:
        return _blocks(shown, matrix)
    return _spelled(shown, matrix)


def _spelled(shown: Node, matrix: sp.MatrixBase) -> list[Node]:
    """A matrix in one formula, or entry by entry where that is too wide."""
    if matrix.shape == (1, 1):
        return _scalar(shown, matrix[0, 0])
    if recognise(matrix) is not None or sp.count_ops(matrix) <= SHARED_ABOVE:
        line = equation(shown, layout(matrix))
        if _fits(line):
            return [line]
    return _entries(shown, matrix)


def _blocks(shown: Node, matrix: sp.MatrixBase) -> list[Node]:
    """The matrix of its blocks, then the blocks that needed a name."""
    rows = PARTITIONS.get(matrix.rows, (matrix.rows,))
    columns = PARTITIONS.get(matrix.cols, (matrix.cols,))
    table: list[tuple[Node, ...]] = []
    below: list[Node] = []
    for i, height in enumerate(rows):
        cells = []
        for j, width in enumerate(columns):
            first, start = sum(rows[:i]), sum(columns[:j])
            block = matrix[first : first + height, start : start + width]
            cell = layout(block) if sp.count_ops(block) <= SHARED_ABOVE else None
            if cell is None or len(box(cell).lines) > 1 or box(cell).width > CELL_WIDTH:
                position = f"{i + 1}{j + 1}" if len(columns) > 1 else str(i + 1)
                cell = _named(shown, f"⟨{position}⟩")
                below += _spelled(cell, block)
            cells.append(cell)
        table.append(tuple(cells))
    return [equation(shown, Table(tuple(table))), *below]


def _named(shown: Node, index: str) -> Name:
    """A name made from the left side's by an index."""
    if isinstance(shown, Name):
        return Name(shown.name, shown.accent, shown.index + index)
    return Name(shown_name("B"), "", index)


def _entries(shown: Node, matrix: sp.MatrixBase) -> list[Node]:
    """One line for every entry that does not vanish."""
    lines: list[Node] = []
    reduced = sp.Matrix(matrix)
    if sp.count_ops(matrix) > SHARED_ABOVE:
        shared, (reduced,) = sp.cse([sp.Matrix(matrix)], symbols=sp.numbered_symbols("c_", start=1))
        for symbol, value in shared:
            lines += _scalar(layout(symbol), value)
    for i in range(matrix.rows):
        for j in range(matrix.cols):
            if reduced[i, j] != 0:
                lines += _scalar(_entry(shown, matrix.shape, i, j), reduced[i, j])
    if any(entry == 0 for entry in reduced):
        lines.append(Word("all other entries are 0"))
    return lines


def _entry(shown: Node, shape: tuple[int, int], i: int, j: int) -> Node:
    if isinstance(shown, Name):
        index = entry_index(shown.name.written(), shape, i, j)
        return Name(shown.name, shown.accent, shown.index + index)
    return Row((shown, Word(f"[{entry_index('', shape, i, j)}]")))


def _scalar(place: Node, value: sp.Basic) -> list[Node]:
    """place = value; a choice that does not fit becomes one line for each branch."""
    line = equation(place, layout(value))
    if len(box(line).lines) == 1 or _fits(line):
        return [line]
    if isinstance(value, sp.Piecewise):
        return [_branch(place, *pair) for pair in value.args]
    pieces = list(_choices(value))
    names = {piece: _named(place, f"⟨{k}⟩") for k, piece in enumerate(pieces, start=1)}
    lines: list[Node] = [equation(place, layout(value, names))]
    for piece, name in names.items():
        lines += _scalar(name, piece)
    return lines


def _branch(place: Node, value: sp.Basic, condition: sp.Basic) -> Node:
    word = "   " if condition in (True, sp.true) else "   if "
    items = (place, Sign("=", True), layout(value), Word(word), layout(condition))
    return Row(items)


def _choices(value: sp.Basic) -> Iterator[sp.Piecewise]:
    """Outermost choices of an expression, each once, in a fixed order."""
    seen: set[sp.Basic] = set()
    stack = [value]
    while stack:
        current = stack.pop()
        if isinstance(current, sp.Piecewise):
            if current not in seen:
                seen.add(current)
                yield current
        else:
            stack.extend(sorted(current.args, key=sp.default_sort_key, reverse=True))


def _hoisted(shown: Node, right: sp.Basic) -> list[Node]:
    """Explicit matrices inside a wide expression get names and are stated below it."""
    names: dict[sp.Basic, Node] = {}
    for matrix in _inner_matrices(right):
        if matrix not in names and recognise(matrix) is None:
            wide = sp.count_ops(matrix) > SHARED_ABOVE or box(layout(matrix)).width > INNER_WIDTH
            if wide:
                names[matrix] = _named(shown, f"⟨{len(names) + 1}⟩")
    return [equation(shown, layout(right, names)), *_stated_all(names)] if names else []


def _stated_all(names: Mapping[sp.Basic, Node]) -> Iterator[Node]:
    for matrix, name in names.items():
        yield from _stated_matrix(name, matrix)


def _inner_matrices(expression: sp.Basic) -> Iterator[sp.MatrixBase]:
    if isinstance(expression, sp.BlockMatrix):
        for block in expression.blocks:
            yield from _inner_matrices(block)
    elif isinstance(expression, sp.MatrixBase):
        yield sp.ImmutableDenseMatrix(expression)
    else:
        for part in expression.args:
            yield from _inner_matrices(part)
