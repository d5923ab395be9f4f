"""Width of formulas on paper, and line breaks of formulas wider than the page."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from .layout import Fence, Fraction, Name, Node, Raised, Root, Row, Sign, Word

#: Width of a line of text in points where letters are 10 points high (LaTeX's article).
PAGE = 338.0
#: Widths in the same points, rounded up: letters, their subscripts, and the space around them.
_LETTER, _SMALL, _SPACED, _THIN, _BRACKET, _GAP = 6.2, 4.2, 13.5, 1.7, 4.5, 10.0
#: Lines after the first begin this much further right.
HANG = 20.0


def width(node: Node) -> float:
    """Width on paper (points), slightly overestimated."""
    if isinstance(node, Name):
        letters = _LETTER * (len(node.name.base) if node.name.upright else 1.2)
        return letters + _SMALL * len(node.name.subscript + node.index)
    if isinstance(node, Word):
        return 5.6 * len(node.text)
    if isinstance(node, Sign):
        return _SPACED if node.spaced else _THIN if node.text == " " else 8.0
    if isinstance(node, Row):
        return sum(map(width, node.items))
    if isinstance(node, Fraction):
        return max(width(node.above), width(node.below)) + 4.0
    if isinstance(node, Raised):
        return width(node.base) + 0.75 * width(node.exponent)
    if isinstance(node, Fence):
        return width(node.body) + 2 * (_BRACKET + 3.0)
    if isinstance(node, Root):
        return width(node.body) + 9.0
    columns = [max(map(width, column)) for column in zip(*node.rows, strict=True)]
    return sum(columns) + _GAP * len(columns) + 2 * _BRACKET


@dataclass(frozen=True)
class PaperLine:
    """A line of a formula: the left side of = on the first line, None on continuation lines."""

    left: Node | None
    right: Node


def paper_lines(lines: Sequence[Node]) -> Iterator[PaperLine]:
    """Break equations, and words between them, into lines that fit the page.

    All lines begin after the widest left side."""
    sides = [_sides(line) for line in lines]
    room = PAGE - max((width(left) + _SPACED for left, _ in sides if left), default=0.0)
    for left, right in sides:
        if left is None:
            yield PaperLine(None, right)
            continue
        first, *more = broken(right, room)
        yield PaperLine(left, first)
        yield from (PaperLine(None, part) for part in more)


def _sides(line: Node) -> tuple[Node | None, Node]:
    """Left and right of =; no left side if the line is no equation."""
    if not isinstance(line, Row) or len(line.items) < 3 or line.items[1] != Sign("=", True):
        return None, line
    return line.items[0], Row(line.items[2:])


def broken(node: Node, room: float) -> list[Node]:
    """Break a node before signs into lines that fit the available width where possible.

    Parentheses that a line leaves open come as signs of their own.
    """
    if width(node) <= room or not isinstance(node, Row):
        return [node]
    lines: list[list[Node]] = [[]]
    used = 0.0
    for piece in _pieces(node, room - HANG):
        wide = sum(map(width, piece))
        if lines[-1] and used + wide > room - (HANG if len(lines) > 1 else 0):
            lines.append([])
            used = 0.0
        lines[-1] += piece
        used += wide
    return [Row(tuple(line)) for line in lines]


def _pieces(node: Row, room: float) -> Iterator[list[Node]]:
    """Unbreakable parts of a row: terms between signs, or factors of terms that are too wide."""
    for piece in _between_signs(node, room):
        if sum(map(width, piece)) <= room:
            yield piece
            continue
        factor: list[Node] = []
        for atom in piece:
            if isinstance(atom, Sign) and atom.text == " " and factor:
                yield factor
                factor = []
            factor.append(atom)
        yield factor


def _between_signs(node: Row, room: float) -> Iterator[list[Node]]:
    """Parts of a row; each but the first begins with a sign."""
    piece: list[Node] = []
    for atom in _atoms(node, room):
        if isinstance(atom, Sign) and (atom.text == "/" or (atom.spaced and atom.text not in "=,")):
            yield piece
            piece = []
        piece.append(atom)
    yield piece


def _atoms(node: Node, room: float) -> Iterator[Node]:
    """Nodes of a row, with nodes that are too wide for a line split up."""
    if isinstance(node, Row):
        for item in node.items:
            yield from _atoms(item, room)
    elif width(node) <= room / 2:
        yield node
    elif isinstance(node, Fence):
        yield Sign(node.left)
        yield from _atoms(node.body, room)
        yield Sign(node.right)
    elif isinstance(node, Fraction) and width(node) > room:
        yield from _atoms(_fenced(node.above), room)
        yield Sign("/")
        yield from _atoms(_fenced(node.below), room)
    elif isinstance(node, Root) and width(node) > room:
        yield from _atoms(Fence("(", node.body, ")"), room)
        yield Raised(Word(""), Fraction(Word("1"), Word("2")))
    elif isinstance(node, Raised) and isinstance(node.base, Fence):
        yield from _atoms(node.base, room)
        yield Raised(Word(""), node.exponent)
    else:
        yield node


def _fenced(node: Node) -> Node:
    return Fence("(", node, ")") if isinstance(node, Row) and len(node.items) > 1 else node
