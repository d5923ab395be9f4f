"""Named constants of a scene, usable in every number and expression of it."""

from __future__ import annotations

from typing import Any

from ...expression.expression import FUNCTIONS
from ..rules import written
from ..rules.values import NAME, NAME_SHAPE, Location, Refused, Rule, finite, found, plain, refuse

#: Names with a meaning in expressions, or in the shape functions of beams (x, L).
TAKEN = ("t", "q", "u", "x", "L", "pi", "deg", "free", *FUNCTIONS)


def problem_with_name(name: object) -> str:
    """Message about a name that users cannot define in expressions, or ""."""
    if not isinstance(name, str) or not NAME.fullmatch(name):
        return f"expected a name ({NAME_SHAPE}), found {found(name)}"
    if name in TAKEN:
        return f'"{name}" already has a meaning in expressions; choose another name'
    return ""


def evaluated(value: Any) -> dict[str, float]:
    """Evaluate a table of constants: numbers, or expressions of constants above them.

    Raises Refused.
    """
    expected = "a table of named numbers"
    if not isinstance(value, dict):
        raise refuse(f"expected {expected}, found {found(value)}")
    made: dict[str, float] = {}
    problems: list[tuple[Location, str]] = []
    for name, given in value.items():
        if problem := problem_with_name(name):
            problems.append(((str(name),), problem))
            continue
        try:
            with written.known(made):
                made[name] = finite(
                    plain(given), "a number, or an expression of constants above", name
                )
        except Refused as refused:
            problems += refused.problems
    if problems:
        raise Refused(*problems)
    return made


def constants() -> Rule:
    """Rule for the table [constants]."""
    item = {"type": ["number", "string"]}
    return Rule(
        "a table of named numbers", evaluated, {"type": "object", "additionalProperties": item}
    )
