"""Text to show: short lists, and text from outside made safe."""

from __future__ import annotations

from collections.abc import Sequence


def abbreviate(names: Sequence[str], count: int = 4) -> str:
    """The first `count` names in one line, and how many more there are."""
    more = len(names) - count
    return ", ".join(names[:count]) + (f" and {more} more" if more > 0 else "")


def printable(text: str) -> str:
    """The text with control characters, of which a terminal would obey some, written out."""
    return "".join(c if c.isprintable() or c == "\n" else ascii(c)[1:-1] for c in text)
