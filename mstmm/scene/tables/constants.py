"""Named constants of a scene, usable in every number and expression of it."""

from __future__ import annotations

from typing import Any

from ...expression.expression import FUNCTIONS
from ..validators import constant_expressions
from ..validators.scalars_and_vectors import (
    NAME_DESCRIPTION,
    NAME_PATTERN,
    Location,
    Rule,
    ValidationProblems,
    describe_value,
    problem,
    require_finite,
    to_python,
)

#: Names with a meaning in expressions, or in the shape functions of beams (x, L).
RESERVED_NAMES = ("t", "q", "u", "x", "L", "pi", "deg", "free", *FUNCTIONS)


def name_problem(name: object) -> str:
    """Message about a name that users cannot define in expressions, or ""."""
    if not isinstance(name, str) or not NAME_PATTERN.fullmatch(name):
        return f"expected a name ({NAME_DESCRIPTION}), found {describe_value(name)}"
    if name in RESERVED_NAMES:
        return f'"{name}" already has a meaning in expressions; choose another name'
    return ""


def evaluate_constants(value: Any) -> dict[str, float]:
    """Evaluate a table of constants: numbers, or expressions of constants above them.

    Raises Refused.
    """
    expected = "a table of named numbers"
    if not isinstance(value, dict):
        raise problem(f"expected {expected}, found {describe_value(value)}")
    constants_by_name: dict[str, float] = {}
    problems: list[tuple[Location, str]] = []
    for name, given_value in value.items():
        if problem_ := name_problem(name):
            problems.append(((str(name),), problem_))
            continue
        try:
            with constant_expressions.constants_context(constants_by_name):
                constants_by_name[name] = require_finite(
                    to_python(given_value), "a number, or an expression of constants above", name
                )
        except ValidationProblems as refused:
            problems += refused.problems
    if problems:
        raise ValidationProblems(*problems)
    return constants_by_name


def constants_rule() -> Rule:
    """Rule for the table [constants]."""
    item = {"type": ["number", "string"]}
    return Rule(
        "a table of named numbers",
        evaluate_constants,
        {"type": "object", "additionalProperties": item},
    )
