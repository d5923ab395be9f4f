"""Rules for text values: names, references, choices and expressions."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from ...errors import ExpressionError
from ...expression.expression import Expression, number
from . import written
from .units import with_unit
from .values import (
    BODY,
    GROUND,
    NAME,
    NAME_SHAPE,
    Rule,
    collect,
    counted,
    entries_of,
    finite,
    found,
    plain,
    refuse,
)


def name(expected: str, missing: str = "") -> Rule:
    """Rule for a name: a letter, then letters, digits or _; "ground" is reserved.

    `missing` describes the expected value where the name is left out.
    """

    def check(value: Any) -> str:
        checked = text(value, f"{expected}: {NAME_SHAPE}")
        if not NAME.fullmatch(checked):
            raise refuse(f"expected {expected}: {NAME_SHAPE}, found {found(checked)}")
        if checked == GROUND:
            raise refuse('"ground" is reserved for the inertial frame; choose another name')
        return checked

    return Rule(
        f"{expected}: {missing or NAME_SHAPE}", check, {"type": "string", "pattern": _pattern(NAME)}
    )


def _pattern(expression: re.Pattern[str]) -> str:
    return f"^{expression.pattern}$"


def text(value: Any, expected: str) -> str:
    """Require text.  Raises Refused."""
    if not isinstance(value, str):
        raise refuse(f"expected {expected}, found {found(value)}")
    return str(value)


def end(ground: bool = True) -> Rule:
    """Rule for a reference to a body ("rod1": its origin), an end ("rod1.tip") or the ground."""
    expected = 'a body or an end of one ("rod1" or "rod1.tip")' + (' or "ground"' if ground else "")
    shape = re.compile(rf"{BODY.pattern}(\.{NAME.pattern})?")

    def check(value: Any) -> str:
        checked = text(value, expected)
        if not shape.fullmatch(checked):
            raise refuse(f"expected {expected}, found {found(checked)}")
        if checked.startswith(f"{GROUND}."):
            raise refuse(f'expected "ground", which has no ends, found {found(checked)}')
        if checked == GROUND and not ground:
            raise refuse(f"expected {expected}, found 'ground', which does not move")
        return checked

    return Rule(expected, check, {"type": "string", "pattern": _pattern(shape)})


def body(expected: str) -> Rule:
    """Rule for a reference to a body ("rod1", or "rope[3]" of a chain), or a keyword."""

    def check(value: Any) -> str:
        checked = text(value, expected)
        if not BODY.fullmatch(checked) or checked == GROUND:
            raise refuse(f"expected {expected}, found {found(checked)}")
        return checked

    return Rule(expected, check, {"type": "string", "pattern": _pattern(BODY)})


def label(expected: str) -> Rule:
    """Rule for a name given by another program: 1 to 64 printable characters."""

    def check(value: Any) -> str:
        checked = text(value, expected)
        if not 0 < len(checked) <= 64 or not checked.isprintable():
            raise refuse(f"expected {expected}, found {found(checked)}")
        return checked

    return Rule(expected, check, {"type": "string", "minLength": 1, "maxLength": 64})


def choice(*options: str) -> Rule:
    """Rule for one of several keywords."""
    expected = " or ".join(f'"{option}"' for option in options)

    def check(value: Any) -> str:
        if not isinstance(value, str) or value not in options:
            raise refuse(f"expected {expected}, found {found(value)}")
        return str(value)

    return Rule(expected, check, {"enum": list(options)})


def flag() -> Rule:
    """Rule for true or false."""

    def check(value: Any) -> bool:
        value = plain(value)
        if not isinstance(value, bool):
            raise refuse(f"expected true or false, found {found(value)}")
        return value

    return Rule("true or false", check, {"type": "boolean"})


def parameters() -> Rule:
    """Rule for a table of named numbers: parameters of user-defined elements."""
    expected = "a table of named numbers"

    def check(value: Any) -> dict[str, float]:
        if not isinstance(value, dict):
            raise refuse(f"expected {expected}, found {found(value)}")
        for key in value:
            if not isinstance(key, str) or not NAME.fullmatch(key):
                raise refuse(f"expected names ({NAME_SHAPE}), found {found(key)}")

        def one(key: Any, _: int) -> float:
            return finite(plain(value[key]), "a number", key)

        keys = list(value)
        return dict(zip(keys, collect(keys, expected, one), strict=True))

    schema = {"type": "object", "additionalProperties": {"type": ["number", "string"]}}
    return Rule(expected, check, schema)


# --- expressions ----------------------------------------------------------------------------------


def to_expression(value: Any, expected: str, *place: str | int) -> Expression:
    """Convert a number or the text of an expression to an Expression.  Raises Refused."""
    value = plain(value)
    if isinstance(value, Expression):
        return value
    if not isinstance(value, str):
        return number(finite(value, expected, *place))
    try:
        return written.expression_of(value)
    except ExpressionError as error:
        raise refuse(f"{error}{with_unit(value)}", *place) from None


def quantity(value: Any, expected: str, *place: str | int) -> Expression:
    """Convert a value to an expression that is no comparison.  Raises Refused."""
    result = to_expression(value, expected, *place)
    if result.is_condition:
        raise refuse(
            f"expected {expected}, found a comparison; write where({result.text}, 1, 0)"[:300],
            *place,
        )
    return result


def dump_expression(value: Expression | None) -> str | float:
    """Convert an expression to a number where it is one, else to text; None becomes "free"."""
    return "free" if value is None else _as_number(value.text)


def _as_number(written: str) -> str | float:
    try:
        result = float(written)
    except ValueError:
        return written
    return result if repr(result) == written else written


_EXPRESSION_SCHEMA: dict[str, Any] = {"type": ["number", "string"]}


def expressions(expected: str, length: int | None = None, free: bool = False) -> Rule:
    """Rule for a list of numbers or expressions; without `length` a single entry needs no list.

    With `free` the keyword "free" is accepted for an entry and becomes None.
    """
    entry = "a number or an expression" + (' or "free"' if free else "")

    def one(value: Any, *place: str | int) -> Expression | None:
        if free and (value is None or value == "free"):
            return None
        return quantity(value, entry, *place)

    def check(value: Any) -> tuple[Expression | None, ...]:
        value = plain(value)
        if length is None and not isinstance(value, (list, tuple)):
            return (one(value),)
        entries = entries_of(value, expected)
        if length is not None and len(entries) != length:
            raise refuse(f"expected {expected}, found {counted(len(entries))}")
        return collect(entries, expected, one)

    def dump(value: Sequence[Expression | None] | None) -> list[str | float] | None:
        return None if value is None else [dump_expression(v) for v in value]

    array: dict[str, Any] = {"type": "array", "items": _EXPRESSION_SCHEMA}
    array |= {} if length is None else {"minItems": length, "maxItems": length}
    schema = array if length is not None else {"anyOf": [_EXPRESSION_SCHEMA, array]}
    return Rule(expected, check, schema, dump)


def one_expression(expected: str) -> Rule:
    """Rule for a number or an expression."""

    def check(value: Any) -> Expression:
        return quantity(value, expected)

    def dump(value: Expression | None) -> str | float | None:
        return None if value is None else dump_expression(value)

    return Rule(expected, check, _EXPRESSION_SCHEMA, dump)


def formula(expected: str) -> Rule:
    """Rule for an expression that is not constant, such as "rod1.tip.x - 2*shoulder.angle"."""

    def check(value: Any) -> Expression:
        value = plain(value)
        if not isinstance(value, (str, Expression)):
            raise refuse(f"expected {expected}, found {found(value)}")
        result = to_expression(value, expected)
        if result.is_constant:
            raise refuse(f"expected {expected}, found {found(result.text)}, which is constant")
        return result

    return Rule(expected, check, {"type": "string"}, _text_of)


def _text_of(value: Expression | None) -> str | None:
    return None if value is None else value.text


def condition(expected: str, time: bool = False) -> Rule:
    """Rule for a comparison such as "rod1.x < 0.1"; with `time` a number means t >= number."""

    def check(value: Any) -> Expression:
        value = plain(value)
        if time and isinstance(value, (int, float)) and not isinstance(value, bool):
            return written.expression_of(f"t >= {finite(value, expected)!r}")
        if not isinstance(value, (str, Expression)):
            raise refuse(f"expected {expected}, found {found(value)}")
        result = to_expression(value, expected)
        if not result.is_condition:
            raise refuse(f"expected {expected}, found {found(result.text)}, which is no comparison")
        return result

    schema = {"type": ["string", "number"] if time else "string"}
    return Rule(expected, check, schema, _text_of)
