"""Typeset plain formulas inside sentences of derivations (`S_Q = S - U G`).

A formula consists of names (a Latin or Greek letter with dots, subscripts and superscripts) and the
signs between them.  Everything else stays text.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from .formula_layout import Name, Node, Row, Sign, Superscript, Word
from .plain_text import text_box
from .symbol_names import is_letter, parse_name

_TOKEN_PATTERN = re.compile(
    r"(?P<blank>\s+)"
    r"|(?P<name>(?<![\w'])[A-Za-z]+\d*(?:_[A-Za-z0-9]+)?)(?P<tilde>~?)(?P<power>\^[-+]?\w*)?(?![\w'])"
    r"|(?P<raised>(?<=[)\]])\^[-+]?\w+)"
    r"|(?P<sign>[-+]?=|[-+/*<])"
    r"|(?P<other>[\w']+|.)"
)
#: Words that look like a letter with dots, and articles that look like names.
_WORDS, _ARTICLES = {"add", "odd", "id", "ad"}, {"a", "A"}
#: Longest subscript of a name; longer ones are words joined by underscores.
_MAX_SUBSCRIPT_LENGTH = 4
_SIGNS = {"-": "−", "*": "·"}

Token = tuple[str, str, Node | None]
_NO_NEIGHBOUR = ("", "")


def split_caption(text: str) -> Iterator[str | Node]:
    """Text and formulas of a sentence, in order."""
    tokens = _resolve_tokens([_classify_token(match) for match in _TOKEN_PATTERN.finditer(text)])
    formula: list[Node] = []
    blank = ""
    for kind, token_text, node in tokens:
        if kind == "blank":
            blank = token_text
        elif node is not None:
            signs = _is_sign(node) or (bool(formula) and _is_sign(formula[-1]))
            if blank and formula and not signs:
                formula.append(Sign(" "))
            elif blank and not signs:
                yield blank
            formula.append(node)
            blank = ""
        else:
            if formula:
                yield Row(tuple(formula))
            yield token_text if formula and _is_sign(formula[-1]) else blank + token_text
            formula, blank = [], ""
    if formula:
        yield Row(tuple(formula))


def caption_text(text: str) -> str:
    """Sentence with its formulas as plain text."""
    return "".join(p if isinstance(p, str) else text_box(p).lines[0] for p in split_caption(text))


def _is_sign(node: Node) -> bool:
    return isinstance(node, Sign)


def _classify_token(match: re.Match[str]) -> Token:
    """Kind, text, and the node if the token is certainly part of a formula."""
    kind, text = match.lastgroup or "", match.group()
    if match["name"] is None:
        return (kind, text, _with_exponent(Word(""), text[1:]) if kind == "raised" else None)
    name, tilde, power = match["name"], match["tilde"], match["power"]
    head, _, subscript = name.partition("_")
    name_parts = parse_name(name)
    is_symbol = (
        not name_parts.upright and head not in _WORDS and len(subscript) <= _MAX_SUBSCRIPT_LENGTH
    )
    if not is_symbol or not is_letter(name_parts.base):
        return ("word", text, None)
    node: Node = Name(name_parts, "tilde" if tilde else "")
    is_certain = name not in _ARTICLES or tilde or power
    return ("name" if is_certain else "article", text, _with_exponent(node, (power or "^")[1:]))


def _with_exponent(base: Node, exponent: str) -> Node:
    return Superscript(base, Word(exponent.replace("-", "−"))) if exponent else base


def _resolve_tokens(tokens: list[Token]) -> Iterator[Token]:
    """Classify signs and articles as formula parts if their neighbours are."""
    solid = [token for token in tokens if token[0] != "blank"]
    solid_index = 0
    for kind, text, node in tokens:
        if kind == "blank":
            yield (kind, text, node)
            continue
        previous = solid[solid_index - 1][:2] if solid_index else _NO_NEIGHBOUR
        solid_index += 1
        following = solid[solid_index][:2] if solid_index < len(solid) else _NO_NEIGHBOUR
        if kind == "article":
            name = text == "A" and solid_index > 1
            yield (
                kind,
                text,
                node if name or _makes_name(previous) or _makes_name(following) else None,
            )
        elif text == "int" and _begins_operand(following):
            yield (kind, text, Word("∫"))
        elif kind == "sign" and _ends_operand(previous) and _begins_operand(following):
            yield (kind, text, Sign(_SIGNS.get(text, text), True))
        elif (
            kind == "name"
            and text == "x"
            and _ends_operand(previous)
            and _begins_operand(following)
        ):
            yield (kind, text, Sign("×", True))
        else:
            yield (kind, text, node)


def _makes_name(neighbour: tuple[str, str]) -> bool:
    """Whether an article next to this token is a symbol."""
    kind, text = neighbour
    return kind in ("name", "raised") or (kind == "sign" and text != "-")


def _ends_operand(neighbour: tuple[str, str]) -> bool:
    kind, text = neighbour
    return kind in ("name", "raised", "article") or (
        kind == "other" and (text in (")", "]") or text.isdigit())
    )


def _begins_operand(neighbour: tuple[str, str]) -> bool:
    kind, text = neighbour
    return kind in ("name", "article") or (
        kind == "other" and (text in ("(", "[") or text.isdigit())
    )
