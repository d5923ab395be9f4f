"""Rules for text values: names, references, choices, paths and expressions."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Sequence
from contextvars import ContextVar
from pathlib import Path
from typing import Annotated, Any

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
    Shorthand,
    check_entries,
    count_text,
    describe_value,
    problem,
    require_finite,
    require_list,
    split_reference,
    to_python,
    unexpected,
    value_rule,
)

#: Folder from which relative paths start while a scene file is read; "" leaves paths unchanged.
SCENE_FOLDER: ContextVar[str] = ContextVar("folder", default="")


def text_rule(
    expected: str,
    accepts: Callable[[str], object],
    schema: dict[str, Any],
    convert: Callable[[str], str] = str,
) -> Rule:
    """Rule for the texts for which `accepts` is true."""
    return value_rule(
        expected,
        lambda value: isinstance(value, str) and accepts(value),
        {"type": "string", **schema},
        convert,
    )


def pattern_rule(
    expected: str, pattern: re.Pattern[str], convert: Callable[[str], str] = str
) -> Rule:
    """Rule for the texts of a pattern."""
    return text_rule(expected, pattern.fullmatch, {"pattern": f"^{pattern.pattern}$"}, convert)


def name_rule(expected: str, missing: str = "") -> Rule:
    """Rule for a name: a letter, then letters, digits or _; "ground" is reserved.

    `missing` describes the expected value where the name is left out.
    """

    def convert(text: str) -> str:
        if text == GROUND:
            raise problem('"ground" is reserved for the inertial frame; choose another name')
        return str(text)

    rule = pattern_rule(f"{expected}: {NAME_DESCRIPTION}", NAME_PATTERN, convert)
    return Rule(f"{expected}: {missing or NAME_DESCRIPTION}", rule.check, rule.schema)


def end_rule(ground: bool = True) -> Rule:
    """Rule for a reference to a body ("rod1": its origin), an end ("rod1.tip") or the ground."""
    expected = 'a body or an end of one ("rod1" or "rod1.tip")' + (' or "ground"' if ground else "")

    def convert(text: str) -> str:
        if text.startswith(f"{GROUND}."):
            raise unexpected('"ground", which has no ends', text)
        if text == GROUND and not ground:
            raise problem(f"expected {expected}, found 'ground', which does not move")
        return str(text)

    pattern = re.compile(rf"{BODY_PATTERN.pattern}(\.{NAME_PATTERN.pattern})?")
    return pattern_rule(expected, pattern, convert)


def body_rule(expected: str) -> Rule:
    """Rule for the spelling of a body's name: "rod1", or "rope[3]" of a chain; not "ground"."""
    return text_rule(
        expected,
        lambda text: BODY_PATTERN.fullmatch(text) and text != GROUND,
        {"pattern": f"^{BODY_PATTERN.pattern}$"},
    )


def label_rule(expected: str, minimum: int = 1) -> Rule:
    """Rule for text that another program reads or writes: `minimum` to 64 printable characters."""
    return text_rule(
        expected,
        lambda text: minimum <= len(text) <= 64 and text.isprintable(),
        ({"minLength": minimum} if minimum else {}) | {"maxLength": 64},
    )


def choice_rule(*options: str) -> Rule:
    """Rule for one of several keywords."""
    expected = " or ".join(f'"{option}"' for option in options)
    rule = text_rule(expected, options.__contains__, {})
    return Rule(expected, rule.check, {"enum": list(options)})


def flag_rule() -> Rule:
    """Rule for true or false."""
    return value_rule("true or false", lambda value: isinstance(value, bool), {"type": "boolean"})


def path_rule(*suffixes: str) -> Rule:
    """Rule for the path of a file, relative to the folder of the scene file."""
    suffix_text = " or ".join(suffixes)
    expected = "the path of a file" + (f" ending in {suffix_text}" if suffixes else "")
    rule = text_rule(
        expected,
        lambda text: text and text.isprintable() and text.lower().endswith(suffixes or ""),
        {},
        lambda text: str(Path(SCENE_FOLDER.get()) / text) if SCENE_FOLDER.get() else text,
    )

    def check(value: Any) -> Any:
        return rule.check(os.fspath(value) if isinstance(value, os.PathLike) else value)

    return Rule(expected, check, rule.schema)


def path_inside_rule(*suffixes: str) -> Rule:
    """Rule for the path of a regular file in the folder of the scene file, or below.

    For a scene that was not read from a file, any path is accepted.
    """
    any_path_rule = path_rule(*suffixes)

    def check(value: Any) -> str:
        name: str = any_path_rule.check(value)
        if not SCENE_FOLDER.get():
            return name
        scene_folder, location = Path(SCENE_FOLDER.get()).resolve(), Path(name).resolve()
        if not location.is_relative_to(scene_folder):
            raise problem(
                f"expected a file in the folder of the scene, found {describe_value(value)}; copy "
                f"it there"
            )
        if not location.is_file():
            raise problem(
                f"{describe_value(value)}: there is no such file in the folder of the scene"
            )
        return name

    return Rule(any_path_rule.expected, check, any_path_rule.schema)


def ends_rule(
    expected: str, table: str, schema: dict[str, Any], widen: Callable[[Any], Any]
) -> Shorthand:
    """Rule for ends by name, each converted by `widen`; `table` is what the whole has to be."""

    def widen_all(value: Any) -> Any:
        if not isinstance(value, dict):
            raise unexpected(table, value)
        for key in value:
            if not isinstance(key, str) or not NAME_PATTERN.fullmatch(key):
                raise unexpected("the name of an end", key)
        return {key: widen(end) for key, end in value.items()}

    return Shorthand(expected, widen_all, {"type": "object", **schema})


def check_two_ends(element: Any, what: str, effect: str = "") -> None:
    """Reject ends `from` and `to` on one body, and a position where none is on the ground.

    Raises ValidationProblems.
    """
    bodies = (split_reference(element.from_)[0], split_reference(element.to)[0])
    if bodies[0] == bodies[1]:
        raise problem(f'both ends are on "{bodies[0]}"{effect}; connect two bodies', "to")
    if GROUND not in bodies and element.position != (0.0, 0.0, 0.0):
        raise problem(
            f"only {what} on the ground has a position; define an end of the body there", "position"
        )


def parameters_rule() -> Rule:
    """Rule for a table of named numbers: parameters of user-defined elements."""
    expected = "a table of named numbers"

    def check(value: Any) -> dict[str, float]:
        if not isinstance(value, dict):
            raise unexpected(expected, value)
        for key in value:
            if not isinstance(key, str) or not NAME_PATTERN.fullmatch(key):
                raise unexpected(f"names ({NAME_DESCRIPTION})", key)

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
            raise unexpected(expected, value)
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
            raise unexpected(expected, value)
        result = to_expression(value, expected)
        if not result.is_condition:
            raise problem(
                f"expected {expected}, found {describe_value(result.text)}, which is no comparison"
            )
        return result

    schema = {"type": ["string", "number"] if time else "string"}
    return Rule(expected, check, schema, _expression_text)


#: Values of keys of several tables: true or false, a body or end, parameters of user-defined types.
Flag = Annotated[bool, flag_rule()]
Reference = Annotated[str, end_rule()]
Parameters = Annotated[dict[str, float], parameters_rule()]
