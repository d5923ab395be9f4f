"""What notebooks show: tables and boxes of HTML, escaped, for reports too; bundles of formats."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence
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


class Displayed:
    """What a notebook shows by itself: in one bundle whatever formats its class has."""

    def _plain(self) -> str:
        """What is shown where nothing but text can be."""
        return repr(self)

    def _repr_mimebundle_(
        self, include: Collection[str] | None = None, exclude: Collection[str] | None = None
    ) -> dict[str, str]:
        """Formats by their MIME types; of these `include` alone, where it is given."""
        makers: dict[str, Callable[[], str] | None] = {
            "text/plain": self._plain,
            "text/html": getattr(self, "_repr_html_", None),
            "text/latex": getattr(self, "_repr_latex_", None),
        }
        wanted = set(include or makers) - set(exclude or ())
        return {kind: make() for kind, make in makers.items() if make and kind in wanted}
