"""Numbers given as constant expressions in a scene: "pi/6", "30*deg", "2*half"."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

from ...expression.expression import Expression, parse

#: Named constants of the scene that is being validated.
_CONSTANTS: ContextVar[Mapping[str, float] | None] = ContextVar("constants", default=None)


#: Names of inputs and signals of the scene that is being validated.
_INPUTS: ContextVar[frozenset[str]] = ContextVar("inputs", default=frozenset())


@contextmanager
def constants_context(constants: Mapping[str, float], inputs: Iterable[str] = ()) -> Iterator[None]:
    """Within this context, expressions may name these constants and drives these inputs."""
    tokens = _CONSTANTS.set(constants), _INPUTS.set(frozenset(inputs))
    try:
        yield
    finally:
        _CONSTANTS.reset(tokens[0])
        _INPUTS.reset(tokens[1])


def current_constants() -> Mapping[str, float]:
    """Named constants of the scene that is being validated."""
    return _CONSTANTS.get() or {}


def current_inputs() -> frozenset[str]:
    """Names of the inputs and signals of the scene that is being validated."""
    return _INPUTS.get()


def parse_with_constants(text: str) -> Expression:
    """Parse an expression with the constants of the scene that is being validated.

    Raises ExpressionError.
    """
    return parse(text, constants=current_constants())


class WrittenNumber(float):
    """Number with the expression of named constants that gives it; arithmetic gives floats."""

    __slots__ = ("text",)
    text: str

    def __new__(cls, value: float, text: str) -> WrittenNumber:
        number = super().__new__(cls, value)
        number.text = text
        return number

    def __reduce__(self) -> tuple[Any, ...]:
        return WrittenNumber, (float(self), self.text)


def constant_value(text: str) -> float | None:
    """Value of a constant expression, `WrittenNumber` where it contains named constants.

    None where it contains other names.  Raises ExpressionError for text that is no expression or
    has no finite value.
    """
    expression = parse_with_constants(text)
    if expression.constant is None or expression.is_condition:
        return None
    return (
        WrittenNumber(expression.constant, expression.text)
        if expression.constants
        else expression.constant
    )


def unknown_name_hint(text: str, there: Collection[str] = ()) -> str:
    """Remedy '; ...' for the first name that is neither a constant nor in `there`, or ""."""
    names = [name.text for name in parse_with_constants(text).names if name.text not in there]
    if not names:
        return ""
    matches = difflib.get_close_matches(names[0], current_constants(), n=1, cutoff=0.6)
    remedy = f'did you mean "{matches[0]}"?' if matches else "define it in [constants]"
    return f"; {names[0]!r} is no constant of the scene: {remedy}"


def keep_written_form(values: tuple[float, ...], given: tuple[float, ...]) -> tuple[float, ...]:
    """Keep the written form of `given` in `values`, which were computed from all of them.

    Where one of `given` is `WrittenNumber`, each value keeps the text of its given number.
    """
    if not any(isinstance(x, WrittenNumber) for x in given):
        return values
    return tuple(
        WrittenNumber(value, x.text if isinstance(x, WrittenNumber) else repr(float(x)))
        for value, x in zip(values, given, strict=True)
    )
