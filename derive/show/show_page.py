"""Pages of `mstmm show`: an element at any stage as text, LaTeX or HTML.

Stages: equations (quantities, premises), matrix (what follows from them, block by block), ir (the
kernels' statements), c (the generated source).  Every page carries units and sources.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable
from html import escape

from mstmm.errors import ElementError
from mstmm.html_page import html_page

from .captions import caption_text, split_caption
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
from .formula_layout import Name, Node, Row, Word, equation
from .line_breaking import PaperLine, PaperWidth, TextWidth, paper_lines
from .markup import STYLE, escape_latex, latex_text, latex_unit, mathml
from .plain_text import WIDTH, column_count, pad_columns, text_box, wrap_formula
from .symbol_names import unit_text

#: Labels of source paragraphs, by their kind.
_SOURCE_LABELS = {"sources": "Source: ", "sweep": "Source of the sweep: "}

__all__ = ["FORMATS", "STAGES", "STYLE", "ElementView", "html_body", "show_view"]


def show_view(view: ElementView, at: str = "equations", format: str = "text") -> str:
    """Page of a view: complete HTML, a LaTeX fragment (amsmath), or text of 100 columns.

    Raises ElementError for an unknown stage or format.
    """
    return render_page(view.title, lambda measure: document(view, at, measure), format)


def render_page(title: str, items: Callable[[TextWidth], list[Item]], format: str) -> str:
    """Page of `items` in a format, as printed by `show_view`."""
    if format not in FORMATS:
        raise ElementError(f"unknown format {format!r}; expected one of {', '.join(FORMATS)}")
    return FORMATS[format](title, items(TextWidth() if format == "text" else PaperWidth()))


# --- text -------------------------------------------------------------------------------------


def _text_page(_: str, items: list[Item]) -> str:
    lines = [line for item in items for line in _text_item(item)]
    return re.sub(r"\n{3,}", "\n\n", "\n".join(lines)).strip("\n") + "\n"


def _text_item(item: Item) -> list[str]:
    if isinstance(item, Heading):
        if item.level == 3:
            return ["", item.text]
        text = caption_text(item.text)
        return ["", text, ("=" if item.level == 1 else "-") * min(column_count(text), WIDTH)]
    if isinstance(item, Paragraph):
        label = {**_SOURCE_LABELS, "note": "note: "}.get(item.kind, "")
        label = label[:1].lower() + label[1:]
        blank_lines = [""] if item.kind == "note" else []
        text = item.text if item.kind in _SOURCE_LABELS else caption_text(item.text)
        return [*blank_lines, *_fold_text(label + text)]
    if isinstance(item, Quantities):
        return _text_table(item.rows)
    if isinstance(item, Formula):
        return _text_formula(item)
    return ["", *item.text.split("\n"), ""]


def _text_formula(item: Formula) -> list[str]:
    head = " · ".join(
        filter(None, (caption_text(item.name), item.source, caption_text(item.remark)))
    )
    lines = ["", *(_fold_text("  " + head) if head else [])]
    is_tall = any(len(text_box(line).lines) > 1 for line in item.lines)
    for line in item.lines:
        lines += wrap_formula(line) + ([""] if is_tall else [])
    return lines


def _fold_text(text: str, width: int = WIDTH) -> list[str]:
    indent = " " * (len(text) - len(text.lstrip()))
    lines, line = [], indent
    for word in text.split():
        if column_count(line) + 1 + column_count(word) > width and line.strip():
            lines.append(line)
            line = indent + "  "
        line += word if not line.strip() else " " + word
    return [*lines, line]


def _text_table(rows: tuple[QuantityRow, ...]) -> list[str]:
    cells = [
        (
            "  " * r.inner + text_box(r.symbol).lines[0], r.port, r.shape, unit_text(r.unit),
            caption_text(r.meaning),
        )
        for r in rows
    ]  # fmt: skip
    if not cells:
        return ["  none"]
    widths = [max(column_count(row[k]) for row in cells) for k in range(4)]
    start = sum(widths) + 10
    lines = []
    for row in cells:
        head = (
            "  " + "  ".join(pad_columns(c, w) for c, w in zip(row[:4], widths, strict=True)) + "  "
        )
        meaning = _fold_text(row[4], max(WIDTH - start, 24))
        lines.append((head + meaning[0]).rstrip())
        lines += [" " * start + part.strip() for part in meaning[1:]]
    return lines


# --- LaTeX ------------------------------------------------------------------------------------


def _latex_page(title: str, items: list[Item]) -> str:
    body = "\n".join(_latex_item(item) for item in items)
    return f"% {title}; needs amsmath\n{{\\allowdisplaybreaks\n{body}\n}}\n"


def _latex_item(item: Item) -> str:
    if isinstance(item, Heading):
        command = ("section", "subsection", "subsubsection")[item.level - 1]
        return rf"\{command}*{{{_latex_caption(item.text)}}}"
    if isinstance(item, Paragraph):
        if item.kind in _SOURCE_LABELS:
            label = "" if item.kind == "sources" else _SOURCE_LABELS[item.kind]
            return rf"{{\raggedright {label}\emph{{{escape_latex(item.text)}}}\par}}"
        return rf"{{\raggedright {_latex_caption(item.text)}\par}}"
    if isinstance(item, Quantities):
        tables = range(0, len(item.rows), _ROWS_PER_TABLE)
        return "\n".join(_latex_table(item.rows[k : k + _ROWS_PER_TABLE]) for k in tables)
    if isinstance(item, Formula):
        return _latex_formula(item)
    return _VERBATIM.format("\n".join(map(_code_line, item.text.split("\n"))))


#: Replacements of box-drawing characters by characters that every font has.
_ASCII_LINES = str.maketrans({"└": "+", "├": "+", "│": "|", "─": "-", "→": "->"})


def _code_line(line: str) -> str:
    """A line of code, broken if it is wider than the page."""
    line = line.translate(_ASCII_LINES)
    if len(line) <= WIDTH:
        return line
    options = {"subsequent_indent": " " * 8, "drop_whitespace": True, "break_on_hyphens": False}
    return textwrap.fill(line, WIDTH, **options)  # type: ignore[arg-type]


#: Number of table rows that fit on a page.
_ROWS_PER_TABLE = 24
#: A line of 100 columns must fit the text width.
_VERBATIM = "{{\\fontsize{{6}}{{7.2}}\\selectfont\n\\begin{{verbatim}}\n{}\n\\end{{verbatim}}}}"
_COLUMN_FORMAT = "".join(rf"p{{{w}\textwidth}}" for w in (0.22, 0.19, 0.07, 0.13, 0.31))


def _latex_table(rows: tuple[QuantityRow, ...]) -> str:
    return (
        "{\\footnotesize\\tabcolsep3pt\\noindent\n"
        rf"\begin{{tabular}}{{@{{}}{_COLUMN_FORMAT}@{{}}}}" + "\n"
        + "\n".join(map(_latex_row, rows))
        + "\n\\end{tabular}\\par}"
    )  # fmt: skip


def _latex_caption(text: str) -> str:
    parts = (
        escape_latex(p) if isinstance(p, str) else f"${{}}{latex_text(p)}$"
        for p in split_caption(text)
    )
    return "".join(parts)


def _latex_row(row: QuantityRow) -> str:
    symbol = f"${latex_text(row.symbol)}$"
    if isinstance(row.symbol, Name) and row.symbol.name.upright and not row.symbol.index:
        symbol = _breakable_name(row.symbol.name.code_name())
    cells = (
        (r"\quad " if row.inner else "") + symbol,
        rf"\texttt{{{_breakable_name(row.port)}}}",
        "$" + row.shape.replace("×", r"\times") + "$",
        latex_unit(row.unit),
        _latex_caption(row.meaning),
    )
    return " & ".join(rf"\raggedright {cell}" for cell in cells) + r"\tabularnewline"


def _breakable_name(word: str) -> str:
    return escape_latex(word).replace(r"\_", r"\_\allowbreak{}").replace(".", r".\allowbreak{}")


def _latex_formula(item: Formula) -> str:
    head = _latex_caption(item.name) + (f" {escape_latex(item.source)}" if item.source else "")
    tail = f" --- {_latex_caption(item.remark)}" if item.remark else ""
    rows = " \\\\\n".join(map(_aligned_line, paper_lines(item.lines)))
    heading = f"{{\\raggedright\\noindent {head}{tail}\\par}}\n" if head + tail else ""
    return f"{heading}\\begin{{align*}}\n{rows}\n\\end{{align*}}"


def _aligned_line(part: PaperLine) -> str:
    if part.left is not None:
        return f"{latex_text(part.left)} &= {latex_text(part.right)}"
    if isinstance(part.right, Word):
        return rf"&\text{{{escape_latex(part.right.text)}}}"
    return rf"&\quad{{}} {latex_text(part.right)}"


# --- HTML -------------------------------------------------------------------------------------


def _html_page(title: str, items: list[Item]) -> str:
    return html_page(title, _html_body(items), STYLE, dark=True)


def html_body(view: ElementView) -> str:
    """Equations of a view as HTML without the page around them; their rules are `STYLE`."""
    return _html_body(document(view, "equations", PaperWidth()))


def _html_body(items: list[Item]) -> str:
    return "\n".join(_html_item(item) for item in items)


def _html_item(item: Item) -> str:
    if isinstance(item, Heading):
        return f"<h{item.level}>{_html_caption(item.text)}</h{item.level}>"
    if isinstance(item, Paragraph):
        label = _SOURCE_LABELS.get(item.kind, "")
        text = escape(item.text) if label else _html_caption(item.text)
        return f'<p class="{"sources" if label else item.kind}">{label}{text}</p>'
    if isinstance(item, Quantities):
        head = "".join(f"<th>{t}</th>" for t in ("symbol", "name", "size", "unit", "meaning"))
        rows = "\n".join(_html_row(row) for row in item.rows)
        table = f'<table class="quantities">\n<tr>{head}</tr>\n{rows}\n</table>'
        return f'<div class="wide">{table}</div>'
    if isinstance(item, Code):
        return f"<pre><code>{escape(item.text)}</code></pre>"
    lines = "\n".join(
        f'<div class="formula">{mathml(_html_line(part))}</div>' for part in paper_lines(item.lines)
    )
    remark = f" — {_html_caption(item.remark)}" if item.remark else ""
    source = f'<span class="source">{escape(item.source)}</span>' if item.source else ""
    caption = f"<figcaption><span>{_html_caption(item.name)}{remark}</span>{source}</figcaption>"
    caption = caption if item.name or remark or source else ""
    return f"<figure>{caption}\n{lines}</figure>"


def _html_caption(text: str) -> str:
    parts = (
        escape(p) if isinstance(p, str) else mathml(p, display=False) for p in split_caption(text)
    )
    return "".join(parts)


def _html_line(part: PaperLine) -> Node:
    if part.left is None:
        return part.right if isinstance(part.right, Word) else Row((Word("\u2003"), part.right))
    return equation(part.left, part.right)


def _html_row(row: QuantityRow) -> str:
    kind = ' class="inner"' if row.inner else ""
    cells = (
        mathml(row.symbol, display=False),
        f"<code>{escape(row.port)}</code>",
        escape(row.shape),
        escape(unit_text(row.unit)),
        _html_caption(row.meaning),
    )
    return f"<tr{kind}>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>"


#: Format name -> printer of (title, items).
FORMATS: dict[str, Callable[[str, list[Item]], str]] = {
    "text": _text_page,
    "latex": _latex_page,
    "html": _html_page,
}
