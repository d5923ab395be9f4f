"""Expressions of scene files: text, parsed form, and prescribed motion built from them."""

from __future__ import annotations

from .expression import FUNCTIONS, SWITCHES, Expression, Name, number, parse

__all__ = ["FUNCTIONS", "SWITCHES", "Expression", "Name", "number", "parse"]
