"""Width limits of formulas, and line breaks of formulas wider than the page."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from .formula_layout import Fence, Fraction, Name, Node, Root, Row, Sign, Superscript, Word
from .plain_text import text_box

#: Text width in points at a font size of 10 points (LaTeX's article).
PAGE_WIDTH = 338.0
#: Widths in points, rounded up: letters, subscripts, and the space around them.
_LETTER, _SMALL, _SPACED, _THIN, _BRACKET, _GAP = 6.2, 4.2, 13.5, 1.7, 4.5, 10.0
#: Additional indentation of continuation lines.
HANGING_INDENT = 20.0


def node_width(node: Node) -> float:
    """Width on paper (points), slightly overestimated."""
    if isinstance(node, Name):
        letters = _LETTER * (len(node.name.base) if node.name.upright else 1.2)
        return letters + _SMALL * len(node.name.subscript + node.index)
    if isinstance(node, Word):
        return 5.6 * len(node.text)
    if isinstance(node, Sign):
        return _SPACED if node.has_spaces else _THIN if node.text == " " else 8.0
    if isinstance(node, Row):
        return sum(map(node_width, node.items))
    if isinstance(node, Fraction):
        return max(node_width(node.numerator), node_width(node.denominator)) + 4.0
    if isinstance(node, Superscript):
        return node_width(node.base) + 0.75 * node_width(node.exponent)
    if isinstance(node, Fence):
        return node_width(node.body) + 2 * (_BRACKET + 3.0)
    if isinstance(node, Root):
        return node_width(node.body) + 9.0
    columns = [max(map(node_width, column)) for column in zip(*node.rows, strict=True)]
    return sum(columns) + _GAP * len(columns) + 2 * _BRACKET


@dataclass(frozen=True)
class PaperLine:
    """A line of a formula: the left side of = on the first line, None on continuation lines."""

    left: Node | None
    right: Node


def paper_lines(lines: Sequence[Node]) -> Iterator[PaperLine]:
    """Break equations, and words between them, into lines that fit the page.

    All lines start after the widest left side.
    """
    sides = [_split_sides(line) for line in lines]
    room = PAGE_WIDTH - max((node_width(left) + _SPACED for left, _ in sides if left), default=0.0)
    for left, right in sides:
        if left is None:
            yield PaperLine(None, right)
            continue
        first_line, *further_lines = break_lines(right, room)
        yield PaperLine(left, first_line)
        yield from (PaperLine(None, part) for part in further_lines)


def _split_sides(line: Node) -> tuple[Node | None, Node]:
    """Left and right of =; no left side if the line is no equation."""
    if not isinstance(line, Row) or len(line.items) < 3 or line.items[1] != Sign("=", True):
        return None, line
    return line.items[0], Row(line.items[2:])


def break_lines(node: Node, room: float) -> list[Node]:
    """Break a node before signs into lines that fit the available width if possible.

    Parentheses that a line leaves open are separate signs.
    """
    if node_width(node) <= room or not isinstance(node, Row):
        return [node]
    lines: list[list[Node]] = [[]]
    used_width = 0.0
    for piece in _breakable_pieces(node, room - HANGING_INDENT):
        piece_width = sum(map(node_width, piece))
        if lines[-1] and used_width + piece_width > room - (
            HANGING_INDENT if len(lines) > 1 else 0
        ):
            lines.append([])
            used_width = 0.0
        lines[-1] += piece
        used_width += piece_width
    return [Row(tuple(line)) for line in lines]


def _breakable_pieces(node: Row, room: float) -> Iterator[list[Node]]:
    """Unbreakable parts of a row: terms between signs, or factors of terms that are too wide."""
    for piece in _split_at_signs(node, room):
        if sum(map(node_width, piece)) <= room:
            yield piece
            continue
        factor: list[Node] = []
        for atom in piece:
            if isinstance(atom, Sign) and atom.text == " " and factor:
                yield factor
                factor = []
            factor.append(atom)
        yield factor


def _split_at_signs(node: Row, room: float) -> Iterator[list[Node]]:
    """Parts of a row; each but the first begins with a sign."""
    piece: list[Node] = []
    for atom in _flatten_atoms(node, room):
        if isinstance(atom, Sign) and (
            atom.text == "/" or (atom.has_spaces and atom.text not in "=,")
        ):
            yield piece
            piece = []
        piece.append(atom)
    yield piece


def _flatten_atoms(node: Node, room: float) -> Iterator[Node]:
    """Nodes of a row; nodes that are too wide for a line are split."""
    if isinstance(node, Row):
        for item in node.items:
            yield from _flatten_atoms(item, room)
    elif node_width(node) <= room / 2:
        yield node
    elif isinstance(node, Fence):
        yield Sign(node.left)
        yield from _flatten_atoms(node.body, room)
        yield Sign(node.right)
    elif isinstance(node, Fraction) and node_width(node) > room:
        yield from _flatten_atoms(_parenthesise(node.numerator), room)
        yield Sign("/")
        yield from _flatten_atoms(_parenthesise(node.denominator), room)
    elif isinstance(node, Root) and node_width(node) > room:
        yield from _flatten_atoms(Fence("(", node.body, ")"), room)
        yield Superscript(Word(""), Fraction(Word("1"), Word("2")))
    elif isinstance(node, Superscript) and isinstance(node.base, Fence):
        yield from _flatten_atoms(node.base, room)
        yield Superscript(Word(""), node.exponent)
    else:
        yield node


def _parenthesise(node: Node) -> Node:
    return Fence("(", node, ")") if isinstance(node, Row) and len(node.items) > 1 else node


# --- width limits: columns in text, points on paper -----------------------------------------------

#: A block wider than this in text is named and defined below the matrix.
CELL_WIDTH = 20
#: A formula wider than this in text is written entry by entry.
FORMULA_WIDTH = 96
#: Explicit matrices wider than this inside a formula that does not fit are named.
INNER_WIDTH = 16


class TextWidth:
    """Width limits of text pages, in columns."""

    def line(self, node: Node) -> bool:
        """Whether a formula fits on one line."""
        return text_box(node).width <= FORMULA_WIDTH

    def cell(self, node: Node, columns: int) -> bool:
        """Whether a block fits in a matrix with this number of columns."""
        return len(text_box(node).lines) == 1 and text_box(node).width <= CELL_WIDTH

    def fits_inside(self, node: Node) -> bool:
        """Whether a matrix may stay inside a formula that does not fit."""
        return text_box(node).width <= INNER_WIDTH


class PaperWidth(TextWidth):
    """Width limits of paper pages, in points."""

    def line(self, node: Node) -> bool:
        return node_width(node) <= PAGE_WIDTH

    def cell(self, node: Node, columns: int) -> bool:
        return super().cell(node, columns) and (columns + 1) * (node_width(node) + 10) <= PAGE_WIDTH
