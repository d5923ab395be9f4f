"""Layout trees as plain text: boxes of lines joined at their baselines, 100 columns wide."""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass

from .formula_layout import Fence, Fraction, Name, Node, Root, Row, Sign, Superscript, Table, Word
from .symbol_names import GREEK, SymbolName

WIDTH = 100

_DOTS = ("", "\u0307", "\u0308")
_ACCENTS = {"": "", "tilde": "\u0303", "perp": "\u22a5"}
_RAISED = {"T": "ᵀ", "∼": "~", "⊥": "⊥", "+": "⁺", "−T": "⁻ᵀ"}
_DIGITS = str.maketrans("0123456789−", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")


@dataclass(frozen=True)
class Box:
    """Lines of equal width and the index of the baseline."""

    lines: tuple[str, ...]
    baseline: int = 0

    @property
    def width(self) -> int:
        return max(column_count(line) for line in self.lines)


def column_count(text: str) -> int:
    """Number of terminal columns; combining marks count as zero."""
    return sum(1 for c in text if not unicodedata.combining(c))


def pad_columns(text: str, width: int) -> str:
    """Text padded with blanks to a width in columns."""
    return text + " " * (width - column_count(text))


def text_name(name: SymbolName, accent: str = "") -> str:
    """A name on one line: r̈_IO, ω̇_I, r̃_IC, mass matrix."""
    base = GREEK.get(name.base, name.base)
    marks = _DOTS[min(name.dots, 2)]
    core = f"({base})" if accent and len(base) > 1 else base
    mark = _ACCENTS[accent]
    subscript = f"_{name.subscript}" if name.subscript else ""
    if mark and not unicodedata.combining(mark[0]):
        return unicodedata.normalize("NFC", core + marks) + subscript + mark
    return unicodedata.normalize("NFC", core + marks + mark) + subscript


def text_box(node: Node) -> Box:
    """Box of a node; matrices and cases need several lines."""
    if isinstance(node, Name):
        return Box((text_name(node.name, node.accent) + _index_text(node.index),))
    if isinstance(node, Word):
        return Box((node.text,))
    if isinstance(node, Sign):
        if node.text == ",":
            return Box((", ",))
        return Box((f" {node.text} " if node.has_spaces else node.text,))
    if isinstance(node, Row):
        return _join_boxes([text_box(item) for item in node.items])
    if isinstance(node, Fraction):
        above, below = map(_group_quotient_part, (node.numerator, node.denominator))
        return _join_boxes([above, Box((" / ",)), below])
    if isinstance(node, Superscript):
        return _join_boxes([text_box(node.base), Box((_exponent_text(node.exponent),))])
    if isinstance(node, Fence):
        inner = text_box(node.body)
        return _join_boxes([_fence_box(node.left, inner), inner, _fence_box(node.right, inner)])
    if isinstance(node, Root):
        inner = text_box(node.body)
        return _join_boxes([Box(("√(",)), inner, Box((")",))])
    return _choice_box(node) if node.cases else _matrix_box(node)


def _index_text(index: str) -> str:
    """Text of an index: .x, [2,3], or the name of a block."""
    block, closing, rest_index = index.rpartition("⟩")
    if closing:
        return block + closing + _index_text(rest_index)
    if not index:
        return ""
    return f".{index}" if index in ("x", "y", "z") else f"[{index}]"


def _group_quotient_part(node: Node) -> Box:
    """Box of a numerator or denominator; sums and products in parentheses."""
    return text_box(node if _is_simple(node) else Fence("(", node, ")"))


def _is_simple(node: Node) -> bool:
    if isinstance(node, Row) and len(node.items) == 2:  # function call
        return isinstance(node.items[0], Word) and isinstance(node.items[1], Fence)
    return isinstance(node, (Name, Word, Fence, Superscript, Root))


def _exponent_text(node: Node) -> str:
    inner = text_box(node)
    text = inner.lines[inner.baseline]
    if re.fullmatch(r"−?\d+", text):
        return text.translate(_DIGITS)
    return _RAISED.get(text, f"^{text}" if len(text) == 1 else f"^({text})")


def _fence_box(mark: str, content: Box) -> Box:
    if len(content.lines) == 1:
        return Box((mark,))
    parts = {"(": "⎛⎜⎝", ")": "⎞⎟⎠", "|": "│││"}.get(mark, mark * 3)
    count = len(content.lines) - 2
    return Box((parts[0], *[parts[1]] * count, parts[2]), content.baseline)


def _join_boxes(boxes: list[Box]) -> Box:
    if not boxes:
        return Box(("",))
    above = max(b.baseline for b in boxes)
    below = max(len(b.lines) - b.baseline for b in boxes)
    lines = []
    for i in range(above + below):
        pieces = []
        for b in boxes:
            k = i - above + b.baseline
            pieces.append(pad_columns(b.lines[k] if 0 <= k < len(b.lines) else "", b.width))
        lines.append("".join(pieces).rstrip() if len(boxes) == 1 else "".join(pieces))
    return Box(tuple(lines), above)


def _table_lines(table: Table) -> list[str]:
    """Cells in columns separated by two blanks; a row is as high as its highest cell."""
    cells = [[text_box(node) for node in row] for row in table.rows]
    widths = [max(row[j].width for row in cells) for j in range(len(cells[0]))]
    lines: list[str] = []
    for row in cells:
        padded_cells = [
            Box(tuple(pad_columns(line, w) for line in b.lines), b.baseline)
            for b, w in zip(row, widths, strict=True)
        ]
        separated_cells = [b for cell in padded_cells for b in (cell, Box(("  ",)))][:-1]
        lines += _join_boxes(separated_cells).lines
    return lines


def _matrix_box(table: Table) -> Box:
    lines = _table_lines(table)
    width = max(column_count(line) for line in lines)
    if len(lines) == 1:
        return Box((f"[{lines[0]}]",))
    marks = [("⎡", "⎤"), *[("⎢", "⎥")] * (len(lines) - 2), ("⎣", "⎦")]
    body = tuple(
        f"{left} {pad_columns(line, width)} {right}"
        for line, (left, right) in zip(lines, marks, strict=True)
    )
    return Box(body, (len(lines) - 1) // 2)


def _choice_box(table: Table) -> Box:
    lines = _table_lines(table)
    marks = ["⎧", *["⎨"] * (len(lines) - 2), "⎩"] if len(lines) > 1 else ["{"]
    body = tuple(f"{mark} {line}" for mark, line in zip(marks, lines, strict=True))
    return Box(body, (len(lines) - 1) // 2)


def wrap_formula(node: Node, indent: int = 4, width: int = WIDTH) -> list[str]:
    """Lines of a node; a one-line row too wide for the page breaks before its spaced signs."""
    full_box = text_box(node)
    if full_box.width + indent <= width or not isinstance(node, Row) or len(full_box.lines) > 1:
        return [" " * indent + line.rstrip() for line in full_box.lines]
    pieces = [""]
    for text in _breakable_texts(node):
        room = width - indent - (4 if len(pieces) > 1 else 0)
        if pieces[-1] and column_count(pieces[-1]) + column_count(text.rstrip()) > room:
            pieces.append("")
            text = text.lstrip()
        pieces[-1] += text
    hanging_indent = " " * (indent + 4)
    first_line, *further_lines = pieces
    return [
        (" " * indent + first_line).rstrip(),
        *((hanging_indent + piece).rstrip() for piece in further_lines),
    ]


def _breakable_texts(node: Node) -> list[str]:
    """Pieces of a one-line node between which a line may break, before a sign."""
    if isinstance(node, Row):
        return _join_groups([_breakable_texts(item) for item in node.items])
    if isinstance(node, Fence):
        return _join_groups([[node.left], _breakable_texts(node.body), [node.right]])
    if isinstance(node, Root):
        return _join_groups([["√("], _breakable_texts(node.body), [")"]])
    if isinstance(node, Fraction):
        parts = (node.numerator, node.denominator)
        above, below = ([p] if _is_simple(p) else ["(", p, ")"] for p in parts)
        groups = [
            [x] if isinstance(x, str) else _breakable_texts(x) for x in (*above, " / ", *below)
        ]
        return _join_groups(groups)
    text = text_box(node).lines[0]
    breakable = isinstance(node, Sign) and node.has_spaces and node.text not in "=,"
    return ["", text] if breakable else [text]


def _join_groups(groups: list[list[str]]) -> list[str]:
    """Joined groups; only breaks inside a group remain breaks."""
    pieces = [""]
    for group in groups:
        pieces[-1] += group[0]
        pieces += group[1:]
    return pieces
