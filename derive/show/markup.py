"""Layout trees as LaTeX (amsmath) and as presentation MathML."""

from __future__ import annotations

import re
from html import escape

from .formula_layout import Fence, Fraction, Name, Node, Root, Row, Sign, Superscript, Table, Word
from .symbol_names import GREEK, SymbolName

# --- LaTeX ----------------------------------------------------------------------------------------

_SIGN_COMMANDS = {
    "−": "-", "≤": r"\le ", "≥": r"\ge ", "≠": r"\ne ", " ": r"\,", "·": r"\cdot ",
}  # fmt: skip
_WORD_COMMANDS = {
    "∼": r"\sim", "⊥": r"\perp", "π": r"\pi", "T": r"\mathsf{T}", "−1": "-1", "I": "I",
    "−T": r"-\mathsf{T}", "∫": r"\textstyle\int",
}  # fmt: skip
_FUNCTIONS = {"sin", "cos", "tan", "sinh", "cosh", "tanh", "exp", "log", "max", "min"}
_TEXT_ESCAPES = {
    "\\": r"\textbackslash{}", "{": r"\{", "}": r"\}", "_": r"\_", "%": r"\%", "&": r"\&",
    "#": r"\#", "$": r"\$", "^": r"\textasciicircum{}", "~": r"\textasciitilde{}",
    "<": r"\textless{}", ">": r"\textgreater{}", "–": "--", "·": r"$\cdot$", "…": r"\dots{}",
    "≤": r"$\le$", "≥": r"$\ge$", "²": r"$^2$", "³": r"$^3$", "−": r"$-$",
    "×": r"$\times$", "\u2003": r"\quad{}",
}  # fmt: skip
#: Matrices with more columns than this use narrower spacing.
_MAX_WIDE_COLUMNS = 5


def escape_latex(text: str) -> str:
    """Plain text safe in a LaTeX paragraph."""
    return "".join(_TEXT_ESCAPES.get(c, c) for c in text)


def latex_unit(unit: str) -> str:
    """kg*m2 as kg m^2, upright."""
    if not unit:
        return "--"
    text = escape_latex(unit).replace("*", r"\,")
    return re.sub(r"(?<=[A-Za-z])(?:\\textasciicircum\{\})?(-?\d+)", r"\\textsuperscript{\1}", text)


def latex_name(name: SymbolName, accent: str = "", index: str = "") -> str:
    """LaTeX of a name with its dots, accent, subscript and index."""
    core = _base_text(name)
    core = {0: core, 1: rf"\dot{{{core}}}", 2: rf"\ddot{{{core}}}"}[min(name.dots, 2)]
    if accent == "tilde":
        core = rf"\tilde{{{core}}}" if len(name.base) == 1 else rf"\widetilde{{{core}}}"
    upright = rf"\mathrm{{{name.subscript}}}".replace("_", r"\_")
    subscript = [upright if len(name.subscript) > 1 else name.subscript] if name.subscript else []
    for sign, command in (("…", r"\dots "), ("⟨", r"\langle "), ("⟩", r"\rangle ")):
        index = index.replace(sign, command)
    subscript += [index] if index else []
    tail = f"_{{{','.join(subscript)}}}" if subscript else ""
    return f"{core}{tail}" + (r"^{\perp}" if accent == "perp" else "")


def _base_text(name: SymbolName) -> str:
    if name.base in GREEK:
        return "\\" + name.base
    if name.upright or len(name.base) > 1:
        return rf"\mathrm{{{name.base}}}".replace("_", r"\_")
    return name.base


def latex_text(node: Node) -> str:
    """LaTeX of a node, for use inside a formula."""
    if isinstance(node, Name):
        return latex_name(node.name, node.accent, node.index)
    if isinstance(node, Word):
        return _word_text(node.text)
    if isinstance(node, Sign):
        sign = _SIGN_COMMANDS.get(node.text, node.text)
        return f" {sign} " if node.has_spaces else sign
    if isinstance(node, Row):
        return "".join(latex_text(item) for item in node.items)
    if isinstance(node, Fraction):
        return rf"\frac{{{latex_text(node.numerator)}}}{{{latex_text(node.denominator)}}}"
    if isinstance(node, Superscript):
        return rf"{{{latex_text(node.base)}}}^{{{latex_text(node.exponent)}}}"
    if isinstance(node, Fence):
        return rf"\left{node.left}{latex_text(node.body)}\right{node.right}"
    if isinstance(node, Root):
        return rf"\sqrt{{{latex_text(node.body)}}}"
    rows = r" \\ ".join(" & ".join(latex_text(cell) for cell in row) for row in node.rows)
    if node.cases:
        return rf"\begin{{cases}} {rows} \end{{cases}}"
    columns = len(node.rows[0])
    narrow = r"\arraycolsep3pt" if columns > _MAX_WIDE_COLUMNS else ""
    return rf"\left[{narrow}\begin{{array}}{{{'c' * columns}}} {rows} \end{{array}}\right]"


def _word_text(text: str) -> str:
    if text in _WORD_COMMANDS:
        return _WORD_COMMANDS[text]
    if text in _FUNCTIONS:
        return "\\" + text
    if re.fullmatch(r"−?[0-9.]+", text):
        return text.replace("−", "-")
    return rf"\text{{{escape_latex(text)}}}"


# --- MathML ---------------------------------------------------------------------------------------

#: Rules of formulas and tables of quantities, in addition to those of all pages.
STYLE = """
p.note, p.sources { color: var(--soft); font-size: .92rem; }
table.quantities { width: 100%; } table.quantities tr.inner td:first-child { padding-left: 1.2rem; }
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
@media (max-width: 40rem) { figure { padding: .4rem .6rem; } }
@media print { figure { padding: 0; break-inside: avoid; } math { font-size: 1rem; }
  figure .formula { overflow: visible; } }
"""


def mathml(node: Node, display: bool = True) -> str:
    """A <math> element; `display` for displayed formulas."""
    kind = ' displaystyle="true"' if display else ""
    return f'<math xmlns="http://www.w3.org/1998/Math/MathML"{kind}>{_node_markup(node)}</math>'


def name_markup(name: SymbolName, accent: str = "", index: str = "") -> str:
    """Markup of a name with its dots, accent, subscript and index."""
    base = GREEK.get(name.base, name.base)
    variant = ' mathvariant="normal"' if name.upright and len(base) == 1 else ""
    core = f"<mi{variant}>{escape(base)}</mi>"
    for mark in ("", "˙", "¨")[min(name.dots, 2)] + ("~" if accent == "tilde" else ""):
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


def _node_markup(node: Node) -> str:
    if isinstance(node, Name):
        return name_markup(node.name, node.accent, node.index)
    if isinstance(node, Word):
        number = re.fullmatch(r"−?[0-9.]+", node.text) is not None
        tag = "mn" if number else "mi" if len(node.text) == 1 else "mtext"
        shown = escape(node.text).replace(" ", "&#160;")  # MathML would drop outer blanks
        return f"<{tag}>{shown}</{tag}>"
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
