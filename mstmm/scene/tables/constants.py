"""Named constants of a scene: numbers by their names, for every number and expression in it."""

from __future__ import annotations

from typing import Any

from ...expression.expression import FUNCTIONS
from ..rules import written
from ..rules.values import NAME, NAME_SHAPE, Location, Refused, Rule, finite, found, plain, refuse

#: Words of expressions, and of the shapes of beams (x, L), that mean something already.
TAKEN = ("t", "q", "u", "x", "L", "pi", "deg", "free", *FUNCTIONS)


def problem_with_name(name: object) -> str:
    """Why an expression cannot have such a name of its own; empty if it can."""
    if not isinstance(name, str) or not NAME.fullmatch(name):
        return f"expected a name ({NAME_SHAPE}), found {found(name)}"
    if name in TAKEN:
        return f'"{name}" has a meaning in expressions already; choose another name'
    return ""


def evaluated(value: Any) -> dict[str, float]:
    """The constants of a table of numbers and of expressions of those above them.

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
                made[name] = finite(plain(given), "a number, or an expression of those above", name)
        except Refused as refused:
            problems += refused.problems
    if problems:
        raise Refused(*problems)
    return made


def constants() -> Rule:
    """The table `[constants]`."""
    item = {"type": ["number", "string"]}
    return Rule(
        "a table of named numbers", evaluated, {"type": "object", "additionalProperties": item}
    )
