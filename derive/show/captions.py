"""Typeset plain formulas inside sentences of derivations (`S_Q = S - U G`).

What counts as a formula: names of a letter or a Greek letter, with their dots, subscripts and
superscripts, and the signs between them.  Everything else stays text.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from .layout import Name, Node, Raised, Row, Sign, Word
from .names import is_letter, shown_name
from .text import box

_TOKEN = re.compile(
    r"(?P<blank>\s+)"
    r"|(?P<name>(?<![\w'])[A-Za-z]+\d*(?:_[A-Za-z0-9]+)?)(?P<tilde>~?)(?P<power>\^[-+]?\w*)?(?![\w'])"
    r"|(?P<raised>(?<=[)\]])\^[-+]?\w+)"
    r"|(?P<sign>[-+]?=|[-+/*<])"
    r"|(?P<other>[\w']+|.)"
)
#: Words that look like a letter with dots, and the articles that look like names.
_WORDS, _ARTICLES = {"add", "odd", "id", "ad"}, {"a", "A"}
#: Longest subscript of a name; longer ones are words joined by underscores.
_SUBSCRIPT = 4
_SIGNS = {"-": "−", "*": "·"}

Token = tuple[str, str, Node | None]
_NOTHING = ("", "")


def caption(text: str) -> Iterator[str | Node]:
    """Text and formulas, in order."""
    tokens = _judged([_token(match) for match in _TOKEN.finditer(text)])
    formula: list[Node] = []
    blank = ""
    for kind, written, node in tokens:
        if kind == "blank":
            blank = written
        elif node is not None:
            signs = _signed(node) or (bool(formula) and _signed(formula[-1]))
            if blank and formula and not signs:
                formula.append(Sign(" "))
            elif blank and not signs:
                yield blank
            formula.append(node)
            blank = ""
        else:
            if formula:
                yield Row(tuple(formula))
            yield written if formula and _signed(formula[-1]) else blank + written
            formula, blank = [], ""
    if formula:
        yield Row(tuple(formula))


def as_text(text: str) -> str:
    """Sentence with its formulas as plain text."""
    return "".join(p if isinstance(p, str) else box(p).lines[0] for p in caption(text))


def _signed(node: Node) -> bool:
    return isinstance(node, Sign)


def _token(match: re.Match[str]) -> Token:
    """Kind, text, and the node if the token is certainly part of a formula."""
    kind, text = match.lastgroup or "", match.group()
    if match["name"] is None:
        return (kind, text, _power(Word(""), text[1:]) if kind == "raised" else None)
    name, tilde, power = match["name"], match["tilde"], match["power"]
    head, _, subscript = name.partition("_")
    shown = shown_name(name)
    letters = not shown.upright and head not in _WORDS and len(subscript) <= _SUBSCRIPT
    if not letters or not is_letter(shown.base):
        return ("word", text, None)
    node: Node = Name(shown, "tilde" if tilde else "")
    certain = name not in _ARTICLES or tilde or power
    return ("name" if certain else "article", text, _power(node, (power or "^")[1:]))


def _power(base: Node, exponent: str) -> Node:
    return Raised(base, Word(exponent.replace("-", "−"))) if exponent else base


def _judged(tokens: list[Token]) -> Iterator[Token]:
    """Signs and articles are parts of a formula where their neighbours are."""
    solid = [token for token in tokens if token[0] != "blank"]
    met = 0
    for kind, text, node in tokens:
        if kind == "blank":
            yield (kind, text, node)
            continue
        before = solid[met - 1][:2] if met else _NOTHING
        met += 1
        after = solid[met][:2] if met < len(solid) else _NOTHING
        if kind == "article":
            name = text == "A" and met > 1
            yield (kind, text, node if name or _joined(before) or _joined(after) else None)
        elif text == "int" and _begins(after):
            yield (kind, text, Word("∫"))
        elif kind == "sign" and _ends(before) and _begins(after):
            yield (kind, text, Sign(_SIGNS.get(text, text), True))
        elif kind == "name" and text == "x" and _ends(before) and _begins(after):
            yield (kind, text, Sign("×", True))
        else:
            yield (kind, text, node)


def _joined(neighbour: tuple[str, str]) -> bool:
    """Whether an article next to this token is a name."""
    kind, text = neighbour
    return kind in ("name", "raised") or (kind == "sign" and text != "-")


def _ends(neighbour: tuple[str, str]) -> bool:
    kind, text = neighbour
    return kind in ("name", "raised", "article") or (kind == "other" and _closing(text))


def _begins(neighbour: tuple[str, str]) -> bool:
    kind, text = neighbour
    return kind in ("name", "article") or (kind == "other" and _opening(text))


def _closing(text: str) -> bool:
    return text in (")", "]") or text.isdigit()


def _opening(text: str) -> bool:
    return text in ("(", "[") or text.isdigit()
