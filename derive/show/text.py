"""Layout trees as plain text: boxes of lines joined at their baselines, 100 columns wide."""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass

from .layout import Fence, Fraction, Name, Node, Raised, Root, Row, Sign, Table, Word
from .names import GREEK, ShownName

WIDTH = 100

_DOTS = ("", "\u0307", "\u0308")
_ACCENTS = {"": "", "tilde": "\u0303", "perp": "\u22a5"}
_RAISED = {"T": "ᵀ", "∼": "~", "⊥": "⊥", "+": "⁺", "−T": "⁻ᵀ"}
_DIGITS = str.maketrans("0123456789−", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")


@dataclass(frozen=True)
class Box:
    """Lines of equal width and the line that carries the baseline."""

    lines: tuple[str, ...]
    baseline: int = 0

    @property
    def width(self) -> int:
        return max(columns(line) for line in self.lines)


def columns(text: str) -> int:
    """Columns a terminal needs: combining marks need none."""
    return sum(1 for c in text if not unicodedata.combining(c))


def pad(text: str, width: int) -> str:
    """Text filled with blanks to a width in columns."""
    return text + " " * (width - columns(text))


def text_name(name: ShownName, accent: str = "") -> str:
    """A name in one line: r̈_IO, ω̇_I, r̃_IC, mass matrix."""
    base = GREEK.get(name.base, name.base)
    marks = _DOTS[min(name.dots, 2)]
    core = f"({base})" if accent and len(base) > 1 else base
    mark = _ACCENTS[accent]
    subscript = f"_{name.subscript}" if name.subscript else ""
    if mark and not unicodedata.combining(mark[0]):
        return unicodedata.normalize("NFC", core + marks) + subscript + mark
    return unicodedata.normalize("NFC", core + marks + mark) + subscript


def box(node: Node) -> Box:
    """The node as a box; matrices and choices need several lines."""
    if isinstance(node, Name):
        return Box((text_name(node.name, node.accent) + _index(node.index),))
    if isinstance(node, Word):
        return Box((node.text,))
    if isinstance(node, Sign):
        return Box((f" {node.text} " if node.spaced and node.text != "," else _tight(node.text),))
    if isinstance(node, Row):
        return _join([box(item) for item in node.items])
    if isinstance(node, Fraction):
        return _join([_grouped(node.above), Box((" / ",)), _grouped(node.below)])
    if isinstance(node, Raised):
        return _join([box(node.base), Box((_exponent(node.exponent),))])
    if isinstance(node, Fence):
        inner = box(node.body)
        return _join([_bar(node.left, inner), inner, _bar(node.right, inner)])
    if isinstance(node, Root):
        inner = box(node.body)
        return _join([Box(("√(",)), inner, Box((")",))])
    return _choice(node) if node.cases else _matrix(node)


def _index(index: str) -> str:
    """.x, [2,3], or the name of a block as it is."""
    block, closed, own = index.rpartition("⟩")
    if closed:
        return block + closed + _index(own)
    if not index:
        return ""
    return f".{index}" if index in ("x", "y", "z") else f"[{index}]"


def _tight(text: str) -> str:
    return ", " if text == "," else text


def _grouped(node: Node) -> Box:
    """Parts of a quotient in one line: sums and products in parentheses."""
    return box(node if _plain(node) else Fence("(", node, ")"))


def _plain(node: Node) -> bool:
    if isinstance(node, Row) and len(node.items) == 2:  # a function of something
        return isinstance(node.items[0], Word) and isinstance(node.items[1], Fence)
    return isinstance(node, (Name, Word, Fence, Raised, Root))


def _exponent(node: Node) -> str:
    inner = box(node)
    text = inner.lines[inner.baseline]
    if re.fullmatch(r"−?\d+", text):
        return text.translate(_DIGITS)
    return _RAISED.get(text, f"^{text}" if len(text) == 1 else f"^({text})")


def _bar(mark: str, beside: Box) -> Box:
    if len(beside.lines) == 1:
        return Box((mark,))
    parts = {"(": "⎛⎜⎝", ")": "⎞⎟⎠", "|": "│││"}.get(mark, mark * 3)
    count = len(beside.lines) - 2
    return Box((parts[0], *[parts[1]] * count, parts[2]), beside.baseline)


def _join(boxes: list[Box]) -> Box:
    if not boxes:
        return Box(("",))
    above = max(b.baseline for b in boxes)
    below = max(len(b.lines) - b.baseline for b in boxes)
    lines = []
    for i in range(above + below):
        pieces = []
        for b in boxes:
            k = i - above + b.baseline
            pieces.append(pad(b.lines[k] if 0 <= k < len(b.lines) else "", b.width))
        lines.append("".join(pieces).rstrip() if len(boxes) == 1 else "".join(pieces))
    return Box(tuple(lines), above)


def _grid(table: Table) -> list[str]:
    """Cells in columns, two blanks apart; a tall cell makes its row tall."""
    cells = [[box(node) for node in row] for row in table.rows]
    widths = [max(row[j].width for row in cells) for j in range(len(cells[0]))]
    lines: list[str] = []
    for row in cells:
        padded = [
            Box(tuple(pad(line, w) for line in b.lines), b.baseline)
            for b, w in zip(row, widths, strict=True)
        ]
        spaced = [b for cell in padded for b in (cell, Box(("  ",)))][:-1]
        lines += _join(spaced).lines
    return lines


def _matrix(table: Table) -> Box:
    lines = _grid(table)
    width = max(columns(line) for line in lines)
    if len(lines) == 1:
        return Box((f"[{lines[0]}]",))
    marks = [("⎡", "⎤"), *[("⎢", "⎥")] * (len(lines) - 2), ("⎣", "⎦")]
    body = tuple(
        f"{left} {pad(line, width)} {right}"
        for line, (left, right) in zip(lines, marks, strict=True)
    )
    return Box(body, (len(lines) - 1) // 2)


def _choice(table: Table) -> Box:
    lines = _grid(table)
    marks = ["⎧", *["⎨"] * (len(lines) - 2), "⎩"] if len(lines) > 1 else ["{"]
    body = tuple(f"{mark} {line}" for mark, line in zip(marks, lines, strict=True))
    return Box(body, (len(lines) - 1) // 2)


def wrapped(node: Node, indent: int = 4, width: int = WIDTH) -> list[str]:
    """Lines of a node; a one-line row too wide for the page breaks before its spaced signs."""
    whole = box(node)
    if whole.width + indent <= width or not isinstance(node, Row) or len(whole.lines) > 1:
        return [" " * indent + line.rstrip() for line in whole.lines]
    pieces = [""]
    for text in _flattened(node):
        room = width - indent - (4 if len(pieces) > 1 else 0)
        if pieces[-1] and columns(pieces[-1]) + columns(text.rstrip()) > room:
            pieces.append("")
            text = text.lstrip()
        pieces[-1] += text
    hanging = " " * (indent + 4)
    first, *rest = pieces
    return [(" " * indent + first).rstrip(), *((hanging + piece).rstrip() for piece in rest)]


def _flattened(node: Node) -> list[str]:
    """Pieces of a one-line node that may be parted: text that begins a new piece is a sign."""
    if isinstance(node, Row):
        return _glued([_flattened(item) for item in node.items])
    if isinstance(node, Fence):
        return _glued([[node.left], _flattened(node.body), [node.right]])
    if isinstance(node, Root):
        return _glued([["√("], _flattened(node.body), [")"]])
    if isinstance(node, Fraction):
        parts = (node.above, node.below)
        above, below = ([p] if _plain(p) else ["(", p, ")"] for p in parts)
        opened = [[x] if isinstance(x, str) else _flattened(x) for x in (*above, " / ", *below)]
        return _glued(opened)
    text = box(node).lines[0]
    breakable = isinstance(node, Sign) and node.spaced and node.text not in "=,"
    return ["", text] if breakable else [text]


def _glued(groups: list[list[str]]) -> list[str]:
    """Groups joined end to start: only breaks inside a group stay breaks."""
    pieces = [""]
    for group in groups:
        pieces[-1] += group[0]
        pieces += group[1:]
    return pieces
