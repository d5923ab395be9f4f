"""What public objects show: printable text, HTML for notebooks and reports, members by group."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from html import escape
from typing import ClassVar


def abbreviate_names(names: Sequence[str], count: int = 4) -> str:
    """First `count` names on one line, and the number of the others."""
    rest_count = len(names) - count
    return ", ".join(names[:count]) + (f" and {rest_count} more" if rest_count > 0 else "")


def escape_control_characters(text: str) -> str:
    """Escape control characters of a text, which a terminal might execute."""
    return "".join(c if c.isprintable() or c == "\n" else ascii(c)[1:-1] for c in text)


# --- HTML for notebooks and reports ---------------------------------------------------------------


def text(words: object) -> str:
    """Convert anything to printable text, escaped for HTML."""
    return escape(escape_control_characters(str(words)))


def table(
    rows: Iterable[Sequence[object]], head: Sequence[str] = (), numbers: Collection[int] = ()
) -> str:
    """HTML table of rows; without a head the first cell of each row is its header.

    The columns of the indices `numbers` are aligned to the right.
    """

    def line(row: Sequence[object], first: str, others: str) -> str:
        tags = [first, *[others] * (len(row) - 1)]
        classes = [' class="n"' if k in numbers else "" for k in range(len(row))]
        cells = zip(tags, classes, row, strict=True)
        return (
            f"<tr>{''.join(f'<{tag}{kind}>{text(cell)}</{tag}>' for tag, kind, cell in cells)}</tr>"
        )

    lines = [line(head, "th", "th")] if head else []
    lines += [line(row, "td" if head else "th", "td") for row in rows]
    return f'<div class="wide"><table class="rows">{"".join(lines)}</table></div>'


def bullets(sentences: Iterable[object]) -> str:
    """HTML list of sentences."""
    return f"<ul>{''.join(f'<li>{text(sentence)}</li>' for sentence in sentences)}</ul>"


def collapsible(summary: str, body: str) -> str:
    """HTML section that is collapsed until the reader opens it."""
    return f"<details><summary>{text(summary)}</summary>{body}</details>"


class NotebookDisplay:
    """Base class of objects that notebooks display, in all formats that the class provides."""

    def _plain_text(self) -> str:
        """Plain text, for displays without other formats."""
        return repr(self)

    def _repr_mimebundle_(
        self, include: Collection[str] | None = None, exclude: Collection[str] | None = None
    ) -> dict[str, str]:
        """Representations by MIME type: those of `include` if given, without `exclude`."""
        builders: dict[str, Callable[[], str] | None] = {
            "text/plain": self._plain_text,
            "text/html": getattr(self, "_repr_html_", None),
            "text/latex": getattr(self, "_repr_latex_", None),
        }
        kinds = set(include or builders) - set(exclude or ())
        return {kind: build() for kind, build in builders.items() if build and kind in kinds}


# --- members of public objects --------------------------------------------------------------------


class PublicMembers:
    """Base of classes whose `dir` lists only the members that users call.

    A subclass names them by group in `member_groups`; all others are for other packages of mstmm
    and may change.
    """

    member_groups: ClassVar[Mapping[str, str]]

    @classmethod
    def public_members(cls) -> dict[str, tuple[str, ...]]:
        """Names of the public members by group."""
        return {group: tuple(names.split()) for group, names in cls.member_groups.items()}

    def __dir__(self) -> list[str]:
        public = (name for names in self.public_members().values() for name in names)
        return sorted({*public, *(name for name in super().__dir__() if name.startswith("_"))})
