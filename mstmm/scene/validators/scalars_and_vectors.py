"""Validators of scene values: strict checks, with messages that state the expected value.

A `Rule` annotates a pydantic field: it checks and normalises the value from TOML, JSON or Python,
and publishes the accepted form in the JSON Schema.  Booleans are not accepted as numbers.  Text is
accepted where it is an expression of constants ("pi/6", "2*half").
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Self, get_args

from pydantic import (
    BaseModel,
    ConfigDict,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    model_validator,
)
from pydantic.json_schema import GenerateJsonSchema
from pydantic_core import CoreSchema, core_schema

from ...errors import ExpressionError
from ...numerics.rotations import Vector, norm
from . import constant_expressions
from .constant_expressions import unit_hint, unit_remedy

NAME_PATTERN = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}")
#: A body of the scene: its name, or a chain member, "rope[3]" or "rope[last]".
BODY_PATTERN = re.compile(rf"{NAME_PATTERN.pattern}(\[([0-9]{{1,8}}|last)\])?")
NAME_DESCRIPTION = "a letter, then letters, digits or _ (64 characters at most)"
GROUND = "ground"

Location = tuple[str | int, ...]
#: Location inside a value, and message.
Problem = tuple[Location, str]
Numbers = tuple[float, ...]


class ValidationProblems(ValueError):
    """Problems of a value, each as (location inside the value, message)."""

    def __init__(self, *problems: Problem) -> None:
        super().__init__("; ".join(message for _, message in problems))
        self.problems = problems


def problem(message: str, *place: str | int) -> ValidationProblems:
    """Exception with a single problem at `place` inside the value, for the caller to raise."""
    return ValidationProblems((place, message))


def unexpected(expected: str, value: object, *place: str | int) -> ValidationProblems:
    """Exception for a value that is not the expected one, for the caller to raise."""
    return problem(f"expected {expected}, found {describe_value(value)}", *place)


def describe_value(value: object, depth: int = 0) -> str:
    """Describe a value in a message: short, printable, in the terms of a scene file."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return ascii(value) if len(value) <= 40 else f"{ascii(value[:37])[:-1]}...'"
    if isinstance(value, int) and abs(value) >= 10**30:
        return "a whole number of more than 30 digits"
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, (list, tuple)):
        if depth == 2:
            return f"a list of {len(value)}"
        entries_text = ", ".join(describe_value(v, depth + 1) for v in value[:7])
        entries_text += ", ..." if len(value) > 7 else ""
        return f"[{entries_text}]" if len(entries_text) <= 60 else f"a list of {len(value)}"
    if isinstance(value, (int, float)):
        return f"{float(value):.6g}"
    return type(value).__name__


class _JsonSchemaGenerator(GenerateJsonSchema):
    """JSON Schema generator that writes defaults as their rule does, not by their type."""

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> dict[str, Any]:
        inner: dict[str, Any] = dict(schema["schema"])
        dump = inner.get("serialization", {}).get("function")
        if dump is not None and "default" in schema:
            schema = {**schema, "default": dump(schema["default"])}
        return super().default_schema(schema)


class Table(BaseModel):
    """Base of all tables of a scene: frozen; unknown keys are rejected.

    A table has rules for its keys among each other in `_check` and `_problems`.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)

    def _check(self) -> None:
        """Complete the values, and raise ValidationProblems where they contradict each other."""

    def _problems(self) -> Iterable[Problem]:
        """Problems of the values with each other, all of which are reported."""
        return ()

    @model_validator(mode="after")
    def _apply_rules(self) -> Self:
        self._check()
        if problems := tuple(self._problems()):
            raise ValidationProblems(*problems)
        return self

    @classmethod
    def model_json_schema(cls, *args: Any, **options: Any) -> dict[str, Any]:
        """JSON Schema of the table, with defaults as they are written in a file."""
        return super().model_json_schema(
            *args, **{"schema_generator": _JsonSchemaGenerator} | options
        )


def split_reference(reference: str) -> tuple[str, str]:
    """Split a reference into body and end: ("rod1", "tip") for "rod1.tip", "" for no end."""
    body, _, end = reference.partition(".")
    return body, end


@dataclass(frozen=True)
class Rule:
    """Field annotation whose `check` returns the normalised value or raises Refused."""

    expected: str
    check: Callable[[Any], Any]
    schema: dict[str, Any]
    dump: Callable[[Any], Any] | None = None

    def __get_pydantic_core_schema__(
        self, source: object, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        dump = self.dump
        serialization = (
            core_schema.plain_serializer_function_ser_schema(dump) if dump is not None else None
        )
        check = self.check
        if type(None) in get_args(source):
            return core_schema.no_info_plain_validator_function(
                lambda value: None if value is None else check(value), serialization=serialization
            )
        return core_schema.no_info_plain_validator_function(check, serialization=serialization)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return {"description": self.expected, **self.schema}


@dataclass(frozen=True)
class Shorthand:
    """Field annotation that converts a short form of a table before the table is validated."""

    expected: str
    widen: Callable[[Any], Any]
    schema: dict[str, Any]

    def __get_pydantic_core_schema__(
        self, source: object, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        return core_schema.no_info_before_validator_function(self.widen, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        inner = handler(schema["schema"])
        return {"description": self.expected, "anyOf": [inner, self.schema]}


def value_rule(
    expected: str,
    accepts: Callable[[Any], object],
    schema: dict[str, Any],
    convert: Callable[[Any], Any] = lambda value: value,
) -> Rule:
    """Rule for the values for which `accepts` is true; `convert` normalises them."""

    def check(value: Any) -> Any:
        value = to_python(value)
        if not accepts(value):
            raise unexpected(expected, value)
        return convert(value)

    return Rule(expected, check, schema)


# --- numbers ---------------------------------------------------------------------------------


def to_python(value: Any) -> Any:
    """Convert arrays and numbers of other libraries to Python lists and numbers."""
    return value.tolist() if hasattr(value, "tolist") else value


def require_finite(value: Any, expected: str, *place: str | int) -> float:
    """Require a finite number.  Raises Refused."""
    if isinstance(value, str):
        return _number_from_text(value, expected, *place)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise unexpected(expected, value, *place)
    if isinstance(value, constant_expressions.WrittenNumber):
        return value
    try:
        result = float(value)
    except OverflowError:
        result = math.inf
    if not math.isfinite(result):
        raise problem(
            f"expected {expected}, found {describe_value(value)}, which is not finite", *place
        )
    return result


def _number_from_text(text: str, expected: str, *place: str | int) -> float:
    """Value of a constant expression.  Raises Refused for other text."""
    hint, is_expression = unit_hint(text), bool(set(text) & _EXPRESSION_CHARACTERS)
    try:
        result = constant_expressions.constant_value(text)
    except ExpressionError as error:
        hint = unit_remedy(text) or (f"; {error}" if is_expression else hint)
    else:
        if result is not None:
            return result
        if is_expression or constant_expressions.current_constants():
            hint = constant_expressions.unknown_name_hint(text)
    raise problem(f"expected {expected}, found {describe_value(text)}{hint}", *place)


#: Characters that make a text an expression rather than a name.
_EXPRESSION_CHARACTERS = frozenset("+-*/^()")


def _unit_text(name: str) -> str:
    return f" in {name}" if name else ""


#: A number, or the text of a constant expression.
NUMBER_SCHEMA = {"type": ["number", "string"]}


def number_rule(of: str = "", minimum: float | None = None, above: float | None = None) -> Rule:
    """Rule for a finite number in the unit `of`, at least `minimum`, strictly above `above`."""
    bound = f", {minimum:g} or more" if minimum is not None else ""
    bound += f", more than {above:g}" if above is not None else ""
    expected = f"a number{_unit_text(of)}{bound}"
    schema: dict[str, Any] = dict(NUMBER_SCHEMA)
    schema |= {} if minimum is None else {"minimum": minimum}
    schema |= {} if above is None else {"exclusiveMinimum": above}

    def check(value: Any) -> float:
        result = require_finite(to_python(value), expected)
        _check_bounds(result, expected, minimum, above)
        return result

    return Rule(expected, check, schema)


def is_integer(value: Any) -> bool:
    """Whether a value is a whole number; true and false are none."""
    return isinstance(value, int) and not isinstance(value, bool)


def integer(minimum: int, maximum: int) -> Rule:
    """Rule for a whole number from `minimum` to `maximum`, both included."""
    return value_rule(
        f"a whole number from {minimum} to {maximum}",
        lambda value: is_integer(value) and minimum <= value <= maximum,
        {"type": "integer", "minimum": minimum, "maximum": maximum},
    )


def _check_bounds(
    value: float, expected: str, minimum: float | None, above: float | None, *place: str | int
) -> None:
    if (minimum is not None and value < minimum) or (above is not None and value <= above):
        raise unexpected(expected, value, *place)


def require_list(value: Any, expected: str) -> Sequence[Any]:
    """Require a list and return its entries.  Raises Refused."""
    value = to_python(value)
    if not isinstance(value, (list, tuple)):
        raise unexpected(expected, value)
    return value


def count_text(entries: int) -> str:
    """Number of entries as text: "1 entry" or "3 entries"."""
    return "1 entry" if entries == 1 else f"{entries} entries"


def check_entries(
    values: Sequence[Any], expected: str, check: Callable[[Any, int], Any]
) -> tuple[Any, ...]:
    """Check every entry of a list; raise Refused with the problems of all of them."""
    problems: list[tuple[Location, str]] = []
    results = []
    for i, value in enumerate(values):
        try:
            results.append(check(value, i))
        except ValidationProblems as refused:
            problems.extend(refused.problems)
    if problems:
        raise ValidationProblems(*problems)
    return tuple(results)


def numbers_rule(expected: str, *lengths: int, minimum: float | None = None, of: str = "") -> Rule:
    """Rule for a list of finite numbers of one of these lengths (none given: any length).

    Without lengths a single number is accepted as a list with one entry.  `of` is the unit.
    """
    entry = f"a number{_unit_text(of)}" + (f", {minimum:g} or more" if minimum is not None else "")

    def check_entry(value: Any, i: int) -> float:
        result = require_finite(to_python(value), entry, i)
        _check_bounds(result, entry, minimum, None, i)
        return result

    def check(value: Any) -> tuple[float, ...]:
        value = to_python(value)
        if not lengths and not isinstance(value, (list, tuple)):
            result = require_finite(value, expected)
            _check_bounds(result, expected, minimum, None)
            return (result,)
        entries = require_list(value, expected)
        if lengths and len(entries) not in lengths:
            raise problem(f"expected {expected}, found {count_text(len(entries))}")
        return check_entries(entries, expected, check_entry)

    item: dict[str, Any] = dict(NUMBER_SCHEMA) | ({} if minimum is None else {"minimum": minimum})
    array: dict[str, Any] = {"type": "array", "items": item}
    if not lengths:
        return Rule(expected, check, {"anyOf": [item, array]})
    forms = [array | {"minItems": n, "maxItems": n} for n in lengths]
    return Rule(expected, check, forms[0] if len(forms) == 1 else {"anyOf": forms})


#: Largest entry of vectors and moments of inertia, so that products of two do not overflow.
MAX_ENTRY = 1e150


def vector_rule(of: str) -> Rule:
    """Rule for three numbers in the unit `of`, at most LARGEST in size."""
    inner = numbers_rule(f"three numbers{_unit_text(of)}", 3, of=of.partition(",")[0])

    def check(value: Any) -> tuple[float, ...]:
        result: tuple[float, ...] = inner.check(value)
        for i, entry in enumerate(result):
            if abs(entry) > MAX_ENTRY:
                raise problem(
                    f"expected a number{_unit_text(of)} of absolute value {MAX_ENTRY:g} or less, "
                    f"found {describe_value(entry)}, whose square overflows",
                    i,
                )
        return result

    return Rule(inner.expected, check, inner.schema)


def direction_rule() -> Rule:
    """Rule for three numbers, not all zero: a direction; its length has no effect."""
    expected = "three numbers, not all zero (a direction)"
    inner = numbers_rule(expected, 3)

    def check(value: Any) -> tuple[float, ...]:
        result: tuple[float, ...] = inner.check(value)
        if norm(result) < 1e-12:
            raise problem(
                f"expected {expected}, found {describe_value(result)}; write for example [0, 0, 1]"
            )
        return result

    return Rule(expected, check, inner.schema)


#: Values of keys of several tables: a point (m) and a direction.
Position = Annotated[Vector, vector_rule("m")]
Direction = Annotated[Vector, direction_rule()]
