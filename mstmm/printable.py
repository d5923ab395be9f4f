"""Text for display: short lists, and foreign text made safe to print."""

from __future__ import annotations

from collections.abc import Sequence


def abbreviate(names: Sequence[str], count: int = 4) -> str:
    """First `count` names on one line, and the number of the others."""
    more = len(names) - count
    return ", ".join(names[:count]) + (f" and {more} more" if more > 0 else "")


def printable(text: str) -> str:
    """Escape control characters of a text, which a terminal might execute."""
    return "".join(c if c.isprintable() or c == "\n" else ascii(c)[1:-1] for c in text)
