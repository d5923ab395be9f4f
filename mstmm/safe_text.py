"""Text for display: short lists, and foreign text made safe to print."""

from __future__ import annotations

from collections.abc import Sequence


def abbreviate_names(names: Sequence[str], count: int = 4) -> str:
    """First `count` names on one line, and the number of the others."""
    rest_count = len(names) - count
    return ", ".join(names[:count]) + (f" and {rest_count} more" if rest_count > 0 else "")


def escape_control_characters(text: str) -> str:
    """Escape control characters of a text, which a terminal might execute."""
    return "".join(c if c.isprintable() or c == "\n" else ascii(c)[1:-1] for c in text)
