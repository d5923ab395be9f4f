"""Width limits of formulas: columns in text, points on paper."""

from __future__ import annotations

from .formula_layout import Node
from .line_breaking import PAGE_WIDTH, node_width
from .plain_text import text_box

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
