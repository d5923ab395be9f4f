"""Layout trees as presentation MathML, and the HTML page: one file, no script."""

from __future__ import annotations

import re
from html import escape

from .formula_layout import Fence, Fraction, Name, Node, Root, Row, Sign, Superscript, Table, Word
from .symbol_names import GREEK, SymbolName

STYLE = """
html { color-scheme: light; --ink: #1b1f24; --soft: #57606a; --line: #d5dae0; --page: #fdfdfc;
  --block: #f4f6f8; --accent: #0a5a8a; }
@media print { html { color-scheme: light; --ink: #000; --soft: #444; --line: #bbb; --page: #fff;
  --block: #fff; --accent: #000; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--page); color: var(--ink);
  font: 16px/1.55 "Source Serif 4", Charter, Georgia, "Times New Roman", serif; }
main { max-width: 62rem; margin: 0 auto; padding: 2.5rem 1.5rem 4rem; }
h1 { font-size: 1.7rem; line-height: 1.25; margin: 0 0 .3rem; }
h2 { font-size: 1.25rem; margin: 2.4rem 0 .8rem; padding-top: .8rem;
  border-top: 1px solid var(--line); }
h3 { font-size: 1rem; margin: 1.6rem 0 .5rem; color: var(--accent); }
p { margin: .4rem 0; } p.note, p.sources { color: var(--soft); font-size: .92rem; }
.wide { overflow-x: auto; }
table.quantities tr.inner td:first-child { padding-left: 1.2rem; }
table.quantities { border-collapse: collapse; width: 100%; font-size: .93rem; }
table.quantities th { text-align: left; font-weight: 600; color: var(--soft); }
table.quantities th, table.quantities td { padding: .28rem .8rem .28rem 0;
  border-bottom: 1px solid var(--line); vertical-align: baseline; }
table.quantities td:nth-child(3) { white-space: nowrap; }
table.quantities code { font-size: .88em; color: var(--soft); }
figure { margin: .7rem 0; padding: .55rem .9rem; background: var(--block); border-radius: 6px; }
figure .formula { overflow-x: auto; padding: .35rem 0; }
figcaption { display: flex; flex-wrap: wrap; gap: 0 1rem; font-size: .87rem;
  justify-content: space-between;
  color: var(--soft); }
figcaption .source { white-space: nowrap; font-style: italic; }
math { font-size: 1.12rem; font-family: "STIX Two Math", "Latin Modern Math", "Cambria Math",
  "Libertinus Math", "DejaVu Math TeX Gyre", math; }
figure .formula math { margin: 0 0 0 1.2rem; }
mover > mo { padding-bottom: .1em; }
/* Brackets and braces are drawn, so that they stretch with any font. */
mtable.matrix, mtable.cases { padding: .1em .25em; margin: 0 .12em; }
mtable.matrix { border-left: 1.3px solid; border-right: 1.3px solid;
  background: linear-gradient(currentColor, currentColor) 0 0 / .4em 1.3px no-repeat,
    linear-gradient(currentColor, currentColor) 100% 0 / .4em 1.3px no-repeat,
    linear-gradient(currentColor, currentColor) 0 100% / .4em 1.3px no-repeat,
    linear-gradient(currentColor, currentColor) 100% 100% / .4em 1.3px no-repeat; }
mtable.cases { border-left: 1.3px solid; }
mtable.matrix mtd { padding: .26em .55em; }
mtable.cases mtd { padding: .26em .7em; text-align: left; }
pre { background: var(--block); border-radius: 6px; padding: .9rem 1rem; overflow-x: auto;
  font: 13px/1.5 "JetBrains Mono", "DejaVu Sans Mono", Menlo, Consolas, monospace; }
@media (max-width: 40rem) { main { padding: 1rem .8rem 2rem; } figure { padding: .4rem .6rem; }
  table.quantities { font-size: .85rem; } }
@media print { body { font-size: 11pt; } main { max-width: none; padding: 0; }
  figure { padding: 0; break-inside: avoid; } pre { white-space: pre-wrap; font-size: 7pt; }
  math { font-size: 1rem; } h2, h3 { break-after: avoid; }
  .wide, figure .formula { overflow: visible; } }
"""

#: Pages with formulas only support dark mode; plots of reports need a white background.
DARK_STYLE = """
@media (prefers-color-scheme: dark) { :root { color-scheme: dark; --ink: #e3e6ea; --soft: #9aa4af;
  --line: #363c44; --page: #15181c; --block: #1e2227; --accent: #6fb5e0; } }
"""


def mathml(node: Node, display: bool = True) -> str:
    """A <math> element; `display` for displayed formulas."""
    kind = ' displaystyle="true"' if display else ""
    return f'<math xmlns="http://www.w3.org/1998/Math/MathML"{kind}>{_node_markup(node)}</math>'


def name_markup(name: SymbolName, accent: str = "", index: str = "") -> str:
    """Markup of a name with its dots, accent, subscript and index."""
    base = GREEK.get(name.base, name.base)
    core = f"<mi{_variant_attribute(name, base)}>{escape(base)}</mi>"
    for mark in _accent_marks(name.dots, accent):
        core = f'<mover accent="true">{core}<mo stretchy="false">{mark}</mo></mover>'
    parts = [f"<mtext>{escape(name.subscript)}</mtext>"] if name.subscript else []
    parts += [f"<mtext>{escape(index)}</mtext>"] if index else []
    below = "<mo>,</mo>".join(parts)
    below = f"<mrow>{below}</mrow>" if len(parts) > 1 else below
    if accent == "perp":
        above = "<mo>⊥</mo>"
        return (
            f"<msubsup>{core}{below}{above}</msubsup>" if below else f"<msup>{core}{above}</msup>"
        )
    return f"<msub>{core}{below}</msub>" if below else core


def _variant_attribute(name: SymbolName, base: str) -> str:
    return ' mathvariant="normal"' if name.upright and len(base) == 1 else ""


def _accent_marks(dots: int, accent: str) -> list[str]:
    marks = {0: [], 1: ["˙"], 2: ["¨"]}[min(dots, 2)]
    return [*marks, "~"] if accent == "tilde" else marks


def _node_markup(node: Node) -> str:
    if isinstance(node, Name):
        return name_markup(node.name, node.accent, node.index)
    if isinstance(node, Word):
        number = re.fullmatch(r"−?[0-9.]+", node.text) is not None
        tag = "mn" if number else "mi" if len(node.text) == 1 else "mtext"
        return f"<{tag}>{_escape_blanks(node.text)}</{tag}>"
    if isinstance(node, Sign):
        return _sign_markup(node)
    if isinstance(node, Row):
        return f"<mrow>{''.join(_node_markup(item) for item in node.items)}</mrow>"
    if isinstance(node, Fraction):
        return f"<mfrac>{_node_markup(node.numerator)}{_node_markup(node.denominator)}</mfrac>"
    if isinstance(node, Superscript):
        return f"<msup>{_node_markup(node.base)}{_node_markup(node.exponent)}</msup>"
    if isinstance(node, Fence):
        left, right = escape(node.left), escape(node.right)
        return (
            f'<mrow><mo fence="true" stretchy="true">{left}</mo>{_node_markup(node.body)}'
            f'<mo fence="true" stretchy="true">{right}</mo></mrow>'
        )
    if isinstance(node, Root):
        return f"<msqrt>{_node_markup(node.body)}</msqrt>"
    return _table_markup(node)


def _escape_blanks(text: str) -> str:
    """Escaped text that keeps outer blanks, which MathML would drop."""
    return escape(text).replace(" ", "&#160;")


def _sign_markup(sign: Sign) -> str:
    if sign.text == " ":
        return '<mspace width="0.17em"/>'
    form = ' form="infix"' if sign.has_spaces else ' form="prefix"'
    return f"<mo{form}>{escape(sign.text)}</mo>"


def _table_markup(table: Table) -> str:
    kind = "cases" if table.cases else "matrix"
    rows = "".join(
        f"<mtr>{''.join(f'<mtd>{_node_markup(cell)}</mtd>' for cell in row)}</mtr>"
        for row in table.rows
    )
    return f'<mtable class="{kind}">{rows}</mtable>'


def html_page(title: str, body: str) -> str:
    """A complete HTML page."""
    return (
        "<!DOCTYPE html>\n"
        '<html lang="en">\n<head>\n<meta charset="utf-8"/>\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1"/>\n'
        f"<title>{escape(title)}</title>\n<style>{DARK_STYLE}{STYLE}</style>\n</head>\n"
        f"<body>\n<main>\n{body}\n</main>\n</body>\n</html>\n"
    )
