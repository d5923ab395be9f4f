"""Validators of scene values: strict checks, with messages that state the expected value.

A `Rule` annotates a pydantic field: it checks and normalises the value from TOML, JSON or Python,
and publishes the accepted form in the JSON Schema.  Booleans are not accepted as numbers.  Text is
accepted where it is an expression of constants ("pi/6", "2*half").
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, get_args

from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import GenerateJsonSchema
from pydantic_core import CoreSchema, core_schema

from ...errors import ExpressionError
from ...numbers.rotations import norm
from . import written
from .units import instead, with_unit

NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}")
#: A body of the scene: its name, or a chain member, "rope[3]" or "rope[last]".
BODY = re.compile(rf"{NAME.pattern}(\[([0-9]{{1,8}}|last)\])?")
NAME_SHAPE = "a letter, then letters, digits or _ (64 characters at most)"
GROUND = "ground"

Location = tuple[str | int, ...]
Numbers = tuple[float, ...]
Orientation = tuple[float, ...]


class Refused(ValueError):
    """Problems of a value, each as (location inside the value, message)."""

    def __init__(self, *problems: tuple[Location, str]) -> None:
        super().__init__("; ".join(message for _, message in problems))
        self.problems = problems


def refuse(message: str, *place: str | int) -> Refused:
    """Exception with a single problem at `place` inside the value, for the caller to raise."""
    return Refused((place, message))


def found(value: object, depth: int = 0) -> str:
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
        inside = ", ".join(found(v, depth + 1) for v in value[:7])
        inside += ", ..." if len(value) > 7 else ""
        return f"[{inside}]" if len(inside) <= 60 else f"a list of {len(value)}"
    if isinstance(value, (int, float)):
        return f"{float(value):.6g}"
    return type(value).__name__


class _Published(GenerateJsonSchema):
    """JSON Schema generator that writes defaults as their rule does, not by their type."""

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> dict[str, Any]:
        inner: dict[str, Any] = dict(schema["schema"])
        dump = inner.get("serialization", {}).get("function")
        if dump is not None and "default" in schema:
            schema = {**schema, "default": dump(schema["default"])}
        return super().default_schema(schema)


class Table(BaseModel):
    """Base of all tables of a scene: frozen; unknown keys are rejected."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)

    @classmethod
    def model_json_schema(cls, *args: Any, **options: Any) -> dict[str, Any]:
        """JSON Schema of the table, with defaults as they are written in a file."""
        return super().model_json_schema(*args, **{"schema_generator": _Published} | options)


def split(reference: str) -> tuple[str, str]:
    """Split a reference into body and end: ("rod1", "tip") for "rod1.tip", "" for no end."""
    body, _, at = reference.partition(".")
    return body, at


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


# --- numbers ---------------------------------------------------------------------------------


def plain(value: Any) -> Any:
    """Convert arrays and numbers of other libraries to Python lists and numbers."""
    return value.tolist() if hasattr(value, "tolist") else value


def finite(value: Any, expected: str, *place: str | int) -> float:
    """Require a finite number.  Raises Refused."""
    if isinstance(value, str):
        return _of_text(value, expected, *place)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise refuse(f"expected {expected}, found {found(value)}", *place)
    if isinstance(value, written.Written):
        return value
    try:
        result = float(value)
    except OverflowError:
        result = math.inf
    if not math.isfinite(result):
        raise refuse(f"expected {expected}, found {found(value)}, which is not finite", *place)
    return result


def _of_text(text: str, expected: str, *place: str | int) -> float:
    """Value of a constant expression.  Raises Refused for other text."""
    hint, calculates = instead(text), bool(set(text) & _OPERATORS)
    try:
        result = written.as_number(text)
    except ExpressionError as error:
        hint = with_unit(text) or (f"; {error}" if calculates else hint)
    else:
        if result is not None:
            return result
        hint = written.unknown(text) if calculates or written.constants() else hint
    raise refuse(f"expected {expected}, found {found(text)}{hint}", *place)


#: Characters that make a text an expression rather than a name.
_OPERATORS = frozenset("+-*/^()")


def _unit(name: str) -> str:
    return f" in {name}" if name else ""


#: A number, or the text of a constant expression.
NUMBER = {"type": ["number", "string"]}


def number(of: str = "", minimum: float | None = None, above: float | None = None) -> Rule:
    """Rule for a finite number in the unit `of`, at least `minimum`, strictly above `above`."""
    bound = f", {minimum:g} or more" if minimum is not None else ""
    bound += f", more than {above:g}" if above is not None else ""
    expected = f"a number{_unit(of)}{bound}"
    schema: dict[str, Any] = dict(NUMBER)
    schema |= {} if minimum is None else {"minimum": minimum}
    schema |= {} if above is None else {"exclusiveMinimum": above}

    def check(value: Any) -> float:
        result = finite(plain(value), expected)
        _within(result, expected, minimum, above)
        return result

    return Rule(expected, check, schema)


def whole(minimum: int, maximum: int) -> Rule:
    """Rule for a whole number from `minimum` to `maximum`, both included."""
    expected = f"a whole number from {minimum} to {maximum}"

    def check(value: Any) -> int:
        value = plain(value)
        if isinstance(value, bool) or not isinstance(value, int):
            raise refuse(f"expected {expected}, found {found(value)}")
        if not minimum <= value <= maximum:
            raise refuse(f"expected {expected}, found {found(value)}")
        return value

    return Rule(expected, check, {"type": "integer", "minimum": minimum, "maximum": maximum})


def _within(
    value: float, expected: str, minimum: float | None, above: float | None, *place: str | int
) -> None:
    if (minimum is not None and value < minimum) or (above is not None and value <= above):
        raise refuse(f"expected {expected}, found {found(value)}", *place)


def entries_of(value: Any, expected: str) -> Sequence[Any]:
    """Require a list and return its entries.  Raises Refused."""
    value = plain(value)
    if not isinstance(value, (list, tuple)):
        raise refuse(f"expected {expected}, found {found(value)}")
    return value


def counted(entries: int) -> str:
    """Number of entries as text: "1 entry" or "3 entries"."""
    return "1 entry" if entries == 1 else f"{entries} entries"


def collect(
    values: Sequence[Any], expected: str, check: Callable[[Any, int], Any]
) -> tuple[Any, ...]:
    """Check every entry of a list; raise Refused with the problems of all of them."""
    problems: list[tuple[Location, str]] = []
    results = []
    for i, value in enumerate(values):
        try:
            results.append(check(value, i))
        except Refused as refused:
            problems.extend(refused.problems)
    if problems:
        raise Refused(*problems)
    return tuple(results)


def numbers(expected: str, *lengths: int, minimum: float | None = None, of: str = "") -> Rule:
    """Rule for a list of finite numbers of one of these lengths (none given: any length).

    Without lengths a single number is accepted as a list with one entry.  `of` is the unit.
    """
    entry = f"a number{_unit(of)}" + (f", {minimum:g} or more" if minimum is not None else "")

    def one(value: Any, i: int) -> float:
        result = finite(plain(value), entry, i)
        _within(result, entry, minimum, None, i)
        return result

    def check(value: Any) -> tuple[float, ...]:
        value = plain(value)
        if not lengths and not isinstance(value, (list, tuple)):
            result = finite(value, expected)
            _within(result, expected, minimum, None)
            return (result,)
        entries = entries_of(value, expected)
        if lengths and len(entries) not in lengths:
            raise refuse(f"expected {expected}, found {counted(len(entries))}")
        return collect(entries, expected, one)

    item: dict[str, Any] = dict(NUMBER) | ({} if minimum is None else {"minimum": minimum})
    array: dict[str, Any] = {"type": "array", "items": item}
    if not lengths:
        return Rule(expected, check, {"anyOf": [item, array]})
    forms = [array | {"minItems": n, "maxItems": n} for n in lengths]
    return Rule(expected, check, forms[0] if len(forms) == 1 else {"anyOf": forms})


#: Largest entry of vectors and moments of inertia, so that products of two do not overflow.
LARGEST = 1e150


def vector(of: str) -> Rule:
    """Rule for three numbers in the unit `of`, at most LARGEST in size."""
    inner = numbers(f"three numbers{_unit(of)}", 3, of=of.partition(",")[0])

    def check(value: Any) -> tuple[float, ...]:
        result: tuple[float, ...] = inner.check(value)
        for i, entry in enumerate(result):
            if abs(entry) > LARGEST:
                raise refuse(
                    f"expected a number{_unit(of)} of absolute value {LARGEST:g} or less, found "
                    f"{found(entry)}, whose square overflows",
                    i,
                )
        return result

    return Rule(inner.expected, check, inner.schema)


def direction() -> Rule:
    """Rule for three numbers, not all zero: a direction; its length has no effect."""
    expected = "three numbers, not all zero (a direction)"
    inner = numbers(expected, 3)

    def check(value: Any) -> tuple[float, ...]:
        result: tuple[float, ...] = inner.check(value)
        if norm(result) < 1e-12:
            raise refuse(f"expected {expected}, found {found(result)}; write for example [0, 0, 1]")
        return result

    return Rule(expected, check, inner.schema)
