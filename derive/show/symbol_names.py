"""Parsing of names: rdd_IO is r with two dots and subscript IO, omegadot is ω̇."""

from __future__ import annotations

import re
from dataclasses import dataclass

#: Greek letters by name, capitals included.
GREEK = {
    "alpha": "α", "beta": "β", "gamma": "γ", "delta": "δ", "epsilon": "ε", "zeta": "ζ",
    "eta": "η", "theta": "θ", "kappa": "κ", "lambda": "λ", "mu": "μ", "nu": "ν", "xi": "ξ",
    "rho": "ρ", "sigma": "σ", "tau": "τ", "phi": "φ", "chi": "χ", "psi": "ψ", "omega": "ω",
    "Gamma": "Γ", "Delta": "Δ", "Theta": "Θ", "Lambda": "Λ", "Sigma": "Σ", "Phi": "Φ",
    "Psi": "Ψ", "Omega": "Ω", "pi": "π",
}  # fmt: skip

_DOTS = (("ddot", 2), ("dot", 1), ("dd", 2), ("d", 1))


@dataclass(frozen=True)
class SymbolName:
    """Base letter (or word, then `upright`), number of dots, subscript."""

    base: str
    dots: int = 0
    subscript: str = ""
    upright: bool = False

    def code_name(self) -> str:
        """Name as written in code, without dots."""
        return "_".join(filter(None, (self.base, self.subscript)))


def parse_name(name: str) -> SymbolName:
    """Split the name of a port or symbol into base, dots and subscript."""
    head, _, subscript = name.partition("_")
    base, dots = _split_dots(head)
    if is_letter(base):
        return SymbolName(base, dots, subscript)
    match = re.fullmatch(r"([A-Za-z]+?)(\d+)", head)
    if match and is_letter(match[1]):
        return SymbolName(match[1], 0, ",".join(filter(None, (match[2], subscript))))
    is_short = len(subscript) <= 2
    return SymbolName(head if is_short else name, 0, subscript if is_short else "", upright=True)


def parse_author_name(name: str) -> SymbolName:
    """Name chosen by an author: a letter with its subscript, or the word unchanged."""
    head, _, subscript = name.partition("_")
    match = re.fullmatch(r"([A-Za-z]+?)(\d*)", head)
    if match and is_letter(match[1]):
        return SymbolName(match[1], 0, ",".join(filter(None, (match[2], subscript))))
    return SymbolName(name, upright=True)


def _split_dots(head: str) -> tuple[str, int]:
    for suffix, dots in _DOTS:
        if head.endswith(suffix) and is_letter(head.removesuffix(suffix)):
            return head.removesuffix(suffix), dots
    return head, 0


def is_letter(text: str) -> bool:
    """Whether a text is one letter; Greek letters are given by name."""
    return len(text) == 1 or text in GREEK


_SUPERSCRIPT = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")


def unit_text(unit: str) -> str:
    """kg*m2 as kg·m²; a dash for a quantity without unit."""
    if not unit:
        return "–"
    text = re.sub(r"(?<=[A-Za-z])\^?(-?\d+)", lambda m: m[1].translate(_SUPERSCRIPT), unit)
    return text.replace("*", "·")
