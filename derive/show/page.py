"""`mstmm show`: stop the line at any stage and print it, as text, LaTeX or one HTML page.

Stages: equations (quantities, premises), matrix (what follows from them, block by block), ir (the
kernels' statements), c (the generated source).  Every page carries units and sources.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from html import escape

from mstmm.errors import ElementError

from .document import (
    STAGES,
    Code,
    ElementView,
    Formula,
    Heading,
    Item,
    Paragraph,
    Quantities,
    QuantityRow,
    document,
)
from .html import mathml, page
from .latex import escaped, latex, latex_unit
from .layout import Node, Word
from .names import shown_unit
from .text import WIDTH, box, columns, pad, wrapped

__all__ = ["FORMATS", "STAGES", "ElementView", "show", "show_view"]


def show(element: str, at: str, format: str, registry: Callable[[str], ElementView]) -> str:
    """The page of an element.

    `registry` gives the view of a name (and raises ElementError for an unknown one).  Raises
    ElementError for an unknown stage or format.
    """
    return show_view(registry(element), at, format)


def show_view(view: ElementView, at: str = "equations", format: str = "text") -> str:
    """The page of a view: complete HTML, a LaTeX fragment (amsmath), or text of 100 columns."""
    if format not in FORMATS:
        raise ElementError(f"no format {format!r}; there are {', '.join(FORMATS)}")
    return FORMATS[format](view.title, document(view, at))


# --- text -------------------------------------------------------------------------------------


def _text_page(_: str, items: list[Item]) -> str:
    lines: list[str] = []
    for item in items:
        lines += _text_item(item)
    return re.sub(r"\n{3,}", "\n\n", "\n".join(lines)).strip("\n") + "\n"


def _text_item(item: Item) -> list[str]:
    if isinstance(item, Heading):
        if item.level == 3:
            return ["", item.text]
        return ["", item.text, ("=" if item.level == 1 else "-") * min(columns(item.text), WIDTH)]
    if isinstance(item, Paragraph):
        label = {"sources": "source: ", "note": "note: "}.get(item.kind, "")
        before = [""] if item.kind == "note" else []
        return [*before, *_folded(label + item.text)]
    if isinstance(item, Quantities):
        return _text_table(item.rows)
    if isinstance(item, Formula):
        return _text_formula(item)
    return ["", *item.text.split("\n")]


def _text_formula(item: Formula) -> list[str]:
    head = " · ".join(filter(None, (item.name, item.source, item.remark)))
    lines = ["", *_folded("  " + head)]
    tall = any(len(box(line).lines) > 1 for line in item.lines)
    for line in item.lines:
        lines += wrapped(line) + ([""] if tall else [])
    return lines


def _folded(text: str, width: int = WIDTH) -> list[str]:
    indent = " " * (len(text) - len(text.lstrip()))
    lines, line = [], indent
    for word in text.split():
        if columns(line) + 1 + columns(word) > width and line.strip():
            lines.append(line)
            line = indent + "  "
        line += word if not line.strip() else " " + word
    return [*lines, line]


def _text_table(rows: tuple[QuantityRow, ...]) -> list[str]:
    cells = [(box(r.symbol).lines[0], r.port, r.shape, shown_unit(r.unit), r.meaning) for r in rows]
    if not cells:
        return ["  none"]
    widths = [max(columns(row[k]) for row in cells) for k in range(4)]
    start = sum(widths) + 10
    lines = []
    for row in cells:
        head = "  " + "  ".join(pad(c, w) for c, w in zip(row[:4], widths, strict=True)) + "  "
        meaning = _folded(row[4], max(WIDTH - start, 24))
        lines.append((head + meaning[0]).rstrip())
        lines += [" " * start + part.strip() for part in meaning[1:]]
    return lines


# --- LaTeX ------------------------------------------------------------------------------------


def _latex_page(title: str, items: list[Item]) -> str:
    body = "\n".join(_latex_item(item) for item in items)
    return f"% {title}; needs amsmath\n{body}\n"


def _latex_item(item: Item) -> str:
    if isinstance(item, Heading):
        command = ("section", "subsection", "paragraph")[item.level - 1]
        return rf"\{command}*{{{escaped(item.text)}}}"
    if isinstance(item, Paragraph):
        text = escaped(item.text)
        return rf"\emph{{{text}}}\par" if item.kind == "sources" else rf"{text}\par"
    if isinstance(item, Quantities):
        rows = "\n".join(_latex_row(row) for row in item.rows)
        return "\\begin{tabular}{llllp{7cm}}\n" + rows + "\n\\end{tabular}\\par"
    if isinstance(item, Formula):
        return _latex_formula(item)
    return "\\begin{verbatim}\n" + item.text + "\n\\end{verbatim}"


def _latex_row(row: QuantityRow) -> str:
    cells = (
        f"${latex(row.symbol)}$",
        rf"\texttt{{{escaped(row.port)}}}",
        "$" + row.shape.replace("×", r"\times") + "$",
        latex_unit(row.unit),
        escaped(row.meaning),
    )
    return " & ".join(cells) + r" \\"


def _latex_formula(item: Formula) -> str:
    head = escaped(item.name) + (f" {escaped(item.source)}" if item.source else "")
    tail = f" --- {escaped(item.remark)}" if item.remark else ""
    rows = " \\\\\n".join(_aligned(line) for line in item.lines)
    return f"\\noindent {head}{tail}\n\\begin{{align*}}\n{rows}\n\\end{{align*}}"


def _aligned(line: Node) -> str:
    if isinstance(line, Word):
        return rf"&\text{{{escaped(line.text)}}}"
    return latex(line).replace(" = ", " &= ", 1)


# --- HTML -------------------------------------------------------------------------------------


def _html_page(title: str, items: list[Item]) -> str:
    return page(title, "\n".join(_html_item(item) for item in items))


def _html_item(item: Item) -> str:
    if isinstance(item, Heading):
        return f"<h{item.level}>{escape(item.text)}</h{item.level}>"
    if isinstance(item, Paragraph):
        label = "Source: " if item.kind == "sources" else ""
        return f'<p class="{item.kind}">{label}{escape(item.text)}</p>'
    if isinstance(item, Quantities):
        head = "".join(f"<th>{t}</th>" for t in ("symbol", "name", "size", "unit", "meaning"))
        rows = "\n".join(_html_row(row) for row in item.rows)
        return f'<table class="quantities">\n<tr>{head}</tr>\n{rows}\n</table>'
    if isinstance(item, Code):
        return f"<pre><code>{escape(item.text)}</code></pre>"
    lines = "\n".join(f'<div class="formula">{mathml(line)}</div>' for line in item.lines)
    remark = f" — {escape(item.remark)}" if item.remark else ""
    source = f'<span class="source">{escape(item.source)}</span>' if item.source else ""
    caption = f"<figcaption><span>{escape(item.name)}{remark}</span>{source}</figcaption>"
    return f"<figure>{caption}\n{lines}</figure>"


def _html_row(row: QuantityRow) -> str:
    cells = (
        mathml(row.symbol, display=False),
        f"<code>{escape(row.port)}</code>",
        escape(row.shape),
        escape(shown_unit(row.unit)),
        escape(row.meaning),
    )
    return "<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>"


#: Format name -> printer of (title, items).
FORMATS: dict[str, Callable[[str, list[Item]], str]] = {
    "text": _text_page,
    "latex": _latex_page,
    "html": _html_page,
}
