"""Text from outside, safe to show: a file's name may hold what moves a terminal's cursor."""

from __future__ import annotations


def printable(text: str) -> str:
    """The text with control characters, of which a terminal would obey some, written out."""
    return "".join(c if c.isprintable() or c == "\n" else ascii(c)[1:-1] for c in text)
