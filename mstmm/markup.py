"""Tables and boxes of HTML, with everything in them escaped: for notebooks and for reports."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from .printable import printable


def text(words: object) -> str:
    """Anything as text that a page can hold."""
    return escape(printable(str(words)))


def table(rows: Iterable[Sequence[object]], head: Sequence[str] = ()) -> str:
    """Rows of text; without a head the first of each row names it."""
    first = "".join(f"<th>{text(one)}</th>" for one in head)
    lines = [f"<tr>{first}</tr>"] if head else []
    for row in rows:
        cells = [f"<td>{text(one)}</td>" for one in row]
        if not head:
            cells[0] = f"<th>{text(row[0])}</th>"
        lines.append(f"<tr>{''.join(cells)}</tr>")
    return f'<div class="wide"><table class="rows">{"".join(lines)}</table></div>'


def bullets(sentences: Iterable[object]) -> str:
    """A list of sentences."""
    return f"<ul>{''.join(f'<li>{text(one)}</li>' for one in sentences)}</ul>"


def folded(summary: str, body: str) -> str:
    """What is read by those who ask for it."""
    return f"<details><summary>{text(summary)}</summary>{body}</details>"
