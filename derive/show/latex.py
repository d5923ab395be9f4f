"""Layout trees as LaTeX (amsmath)."""

from __future__ import annotations

import re

from .formula_layout import Fence, Fraction, Name, Node, Root, Row, Sign, Superscript, Word
from .symbol_names import GREEK, SymbolName

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
    subscript = [_subscript_text(name.subscript)] if name.subscript else []
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


def _subscript_text(text: str) -> str:
    return rf"\mathrm{{{text}}}".replace("_", r"\_") if len(text) > 1 else text


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
