"""The small grammar of scene files: text, its parsed form, and drives made of it."""

from __future__ import annotations

from .expression import FUNCTIONS, SWITCHES, Expression, Name, number, parse

__all__ = ["FUNCTIONS", "SWITCHES", "Expression", "Name", "number", "parse"]
