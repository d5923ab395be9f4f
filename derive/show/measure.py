"""Limits of formula widths: columns in text, points on paper."""

from __future__ import annotations

from .breaking import PAGE, width
from .layout import Node
from .text import box

#: A block wider than this in text gets a name and is spelled out below the matrix.
CELL_WIDTH = 20
#: A formula wider than this in text is stated entry by entry.
FORMULA_WIDTH = 96
#: Explicit matrices wider than this inside a formula that does not fit get a name.
INNER_WIDTH = 16


class Columns:
    """Width limits of text pages, in columns."""

    def line(self, node: Node) -> bool:
        """Whether a formula fits in a line."""
        return box(node).width <= FORMULA_WIDTH

    def cell(self, node: Node, columns: int) -> bool:
        """Whether a block fits in a matrix of so many columns."""
        return len(box(node).lines) == 1 and box(node).width <= CELL_WIDTH

    def inner(self, node: Node) -> bool:
        """Whether a matrix may stay inside a formula that does not fit."""
        return box(node).width <= INNER_WIDTH


class Paper(Columns):
    """Width limits of paper pages, in points."""

    def line(self, node: Node) -> bool:
        return width(node) <= PAGE

    def cell(self, node: Node, columns: int) -> bool:
        return super().cell(node, columns) and (columns + 1) * (width(node) + 10) <= PAGE
