"""Rules for text values: names, references, choices and expressions."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from ...errors import ExpressionError
from ...expression.expression import Expression, number
from . import constant_expressions
from .constant_expressions import unit_remedy
from .scalars_and_vectors import (
    BODY_PATTERN,
    GROUND,
    NAME_DESCRIPTION,
    NAME_PATTERN,
    Rule,
    check_entries,
    count_text,
    describe_value,
    problem,
    require_finite,
    require_list,
    to_python,
)


def name_rule(expected: str, missing: str = "") -> Rule:
    """Rule for a name: a letter, then letters, digits or _; "ground" is reserved.

    `missing` describes the expected value where the name is left out.
    """

    def check(value: Any) -> str:
        checked_text = require_text(value, f"{expected}: {NAME_DESCRIPTION}")
        if not NAME_PATTERN.fullmatch(checked_text):
            raise problem(
                f"expected {expected}: {NAME_DESCRIPTION}, found {describe_value(checked_text)}"
            )
        if checked_text == GROUND:
            raise problem('"ground" is reserved for the inertial frame; choose another name')
        return checked_text

    return Rule(
        f"{expected}: {missing or NAME_DESCRIPTION}",
        check,
        {"type": "string", "pattern": _pattern(NAME_PATTERN)},
    )


def _pattern(expression: re.Pattern[str]) -> str:
    return f"^{expression.pattern}$"


def require_text(value: Any, expected: str) -> str:
    """Require text.  Raises Refused."""
    if not isinstance(value, str):
        raise problem(f"expected {expected}, found {describe_value(value)}")
    return str(value)


def end_rule(ground: bool = True) -> Rule:
    """Rule for a reference to a body ("rod1": its origin), an end ("rod1.tip") or the ground."""
    expected = 'a body or an end of one ("rod1" or "rod1.tip")' + (' or "ground"' if ground else "")
    shape = re.compile(rf"{BODY_PATTERN.pattern}(\.{NAME_PATTERN.pattern})?")

    def check(value: Any) -> str:
        checked_text = require_text(value, expected)
        if not shape.fullmatch(checked_text):
            raise problem(f"expected {expected}, found {describe_value(checked_text)}")
        if checked_text.startswith(f"{GROUND}."):
            raise problem(
                f'expected "ground", which has no ends, found {describe_value(checked_text)}'
            )
        if checked_text == GROUND and not ground:
            raise problem(f"expected {expected}, found 'ground', which does not move")
        return checked_text

    return Rule(expected, check, {"type": "string", "pattern": _pattern(shape)})


def body_rule(expected: str) -> Rule:
    """Rule for the spelling of a body's name: "rod1", or "rope[3]" of a chain; not "ground"."""

    def check(value: Any) -> str:
        checked_text = require_text(value, expected)
        if not BODY_PATTERN.fullmatch(checked_text) or checked_text == GROUND:
            raise problem(f"expected {expected}, found {describe_value(checked_text)}")
        return checked_text

    return Rule(expected, check, {"type": "string", "pattern": _pattern(BODY_PATTERN)})


def label_rule(expected: str) -> Rule:
    """Rule for a name given by another program: 1 to 64 printable characters."""

    def check(value: Any) -> str:
        checked_text = require_text(value, expected)
        if not 0 < len(checked_text) <= 64 or not checked_text.isprintable():
            raise problem(f"expected {expected}, found {describe_value(checked_text)}")
        return checked_text

    return Rule(expected, check, {"type": "string", "minLength": 1, "maxLength": 64})


def choice_rule(*options: str) -> Rule:
    """Rule for one of several keywords."""
    expected = " or ".join(f'"{option}"' for option in options)

    def check(value: Any) -> str:
        if not isinstance(value, str) or value not in options:
            raise problem(f"expected {expected}, found {describe_value(value)}")
        return str(value)

    return Rule(expected, check, {"enum": list(options)})


def flag_rule() -> Rule:
    """Rule for true or false."""

    def check(value: Any) -> bool:
        value = to_python(value)
        if not isinstance(value, bool):
            raise problem(f"expected true or false, found {describe_value(value)}")
        return value

    return Rule("true or false", check, {"type": "boolean"})


def parameters_rule() -> Rule:
    """Rule for a table of named numbers: parameters of user-defined elements."""
    expected = "a table of named numbers"

    def check(value: Any) -> dict[str, float]:
        if not isinstance(value, dict):
            raise problem(f"expected {expected}, found {describe_value(value)}")
        for key in value:
            if not isinstance(key, str) or not NAME_PATTERN.fullmatch(key):
                raise problem(f"expected names ({NAME_DESCRIPTION}), found {describe_value(key)}")

        def check_value(key: Any, _: int) -> float:
            return require_finite(to_python(value[key]), "a number", key)

        keys = list(value)
        return dict(zip(keys, check_entries(keys, expected, check_value), strict=True))

    schema = {"type": "object", "additionalProperties": {"type": ["number", "string"]}}
    return Rule(expected, check, schema)


# --- expressions ----------------------------------------------------------------------------------


def to_expression(value: Any, expected: str, *place: str | int) -> Expression:
    """Convert a number or the text of an expression to an Expression.  Raises Refused."""
    value = to_python(value)
    if isinstance(value, Expression):
        return value
    if not isinstance(value, str):
        return number(require_finite(value, expected, *place))
    try:
        return constant_expressions.parse_with_constants(value)
    except ExpressionError as error:
        raise problem(f"{error}{unit_remedy(value)}", *place) from None


def to_quantity(value: Any, expected: str, *place: str | int) -> Expression:
    """Convert a value to an expression that is no comparison.  Raises Refused."""
    result = to_expression(value, expected, *place)
    if result.is_condition:
        raise problem(
            f"expected {expected}, found a comparison; write where({result.text}, 1, 0)"[:300],
            *place,
        )
    return result


def dump_expression(value: Expression | None) -> str | float:
    """Convert an expression to a number where it is one, else to text; None becomes "free"."""
    return "free" if value is None else _to_number_or_text(value.text)


def _to_number_or_text(written: str) -> str | float:
    try:
        result = float(written)
    except ValueError:
        return written
    return result if repr(result) == written else written


_EXPRESSION_SCHEMA: dict[str, Any] = {"type": ["number", "string"]}


def expressions_rule(expected: str, length: int | None = None, free: bool = False) -> Rule:
    """Rule for a list of numbers or expressions; without `length` a single entry needs no list.

    With `free` the keyword "free" is accepted for an entry and becomes None.
    """
    entry = "a number or an expression" + (' or "free"' if free else "")

    def check_entry(value: Any, *place: str | int) -> Expression | None:
        if free and (value is None or value == "free"):
            return None
        return to_quantity(value, entry, *place)

    def check(value: Any) -> tuple[Expression | None, ...]:
        value = to_python(value)
        if length is None and not isinstance(value, (list, tuple)):
            return (check_entry(value),)
        entries = require_list(value, expected)
        if length is not None and len(entries) != length:
            raise problem(f"expected {expected}, found {count_text(len(entries))}")
        return check_entries(entries, expected, check_entry)

    def dump(value: Sequence[Expression | None] | None) -> list[str | float] | None:
        return None if value is None else [dump_expression(v) for v in value]

    array: dict[str, Any] = {"type": "array", "items": _EXPRESSION_SCHEMA}
    array |= {} if length is None else {"minItems": length, "maxItems": length}
    schema = array if length is not None else {"anyOf": [_EXPRESSION_SCHEMA, array]}
    return Rule(expected, check, schema, dump)


def expression_rule(expected: str) -> Rule:
    """Rule for a number or an expression."""

    def check(value: Any) -> Expression:
        return to_quantity(value, expected)

    def dump(value: Expression | None) -> str | float | None:
        return None if value is None else dump_expression(value)

    return Rule(expected, check, _EXPRESSION_SCHEMA, dump)


def formula_rule(expected: str) -> Rule:
    """Rule for an expression that is not constant, such as "rod1.tip.x - 2*shoulder.angle"."""

    def check(value: Any) -> Expression:
        value = to_python(value)
        if not isinstance(value, (str, Expression)):
            raise problem(f"expected {expected}, found {describe_value(value)}")
        result = to_expression(value, expected)
        if result.is_constant:
            raise problem(
                f"expected {expected}, found {describe_value(result.text)}, which is constant"
            )
        return result

    return Rule(expected, check, {"type": "string"}, _expression_text)


def _expression_text(value: Expression | None) -> str | None:
    return None if value is None else value.text


def condition_rule(expected: str, time: bool = False) -> Rule:
    """Rule for a comparison such as "rod1.x < 0.1"; with `time` a number means t >= number."""

    def check(value: Any) -> Expression:
        value = to_python(value)
        if time and isinstance(value, (int, float)) and not isinstance(value, bool):
            return constant_expressions.parse_with_constants(
                f"t >= {require_finite(value, expected)!r}"
            )
        if not isinstance(value, (str, Expression)):
            raise problem(f"expected {expected}, found {describe_value(value)}")
        result = to_expression(value, expected)
        if not result.is_condition:
            raise problem(
                f"expected {expected}, found {describe_value(result.text)}, which is no comparison"
            )
        return result

    schema = {"type": ["string", "number"] if time else "string"}
    return Rule(expected, check, schema, _expression_text)
