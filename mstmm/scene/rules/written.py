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
def known(constants: Mapping[str, float], inputs: Iterable[str] = ()) -> Iterator[None]:
    """Within this context, expressions may name these constants and drives these inputs."""
    tokens = _CONSTANTS.set(constants), _INPUTS.set(frozenset(inputs))
    try:
        yield
    finally:
        _CONSTANTS.reset(tokens[0])
        _INPUTS.reset(tokens[1])


def constants() -> Mapping[str, float]:
    """Named constants of the scene that is being validated."""
    return _CONSTANTS.get() or {}


def inputs() -> frozenset[str]:
    """Names of the inputs and signals of the scene that is being validated."""
    return _INPUTS.get()


def expression_of(text: str) -> Expression:
    """Parse an expression with the named constants of the scene.  Raises ExpressionError."""
    return parse(text, constants=constants())


class Written(float):
    """Number with the expression of named constants that gives it; arithmetic gives floats."""

    __slots__ = ("text",)
    text: str

    def __new__(cls, value: float, text: str) -> Written:
        found = super().__new__(cls, value)
        found.text = text
        return found

    def __reduce__(self) -> tuple[Any, ...]:
        return Written, (float(self), self.text)


def as_number(text: str) -> float | None:
    """Value of a constant expression, `Written` where it contains named constants.

    None where it contains other names.  Raises ExpressionError for text that is no expression or
    has no finite value.
    """
    found = expression_of(text)
    if found.constant is None or found.is_condition:
        return None
    return Written(found.constant, found.text) if found.constants else found.constant


def unknown(text: str, there: Collection[str] = ()) -> str:
    """Remedy '; ...' for the first name that is neither a constant nor in `there`, or ""."""
    names = [name.text for name in expression_of(text).names if name.text not in there]
    if not names:
        return ""
    close = difflib.get_close_matches(names[0], constants(), n=1, cutoff=0.6)
    way_out = f'did you mean "{close[0]}"?' if close else "define it in [constants]"
    return f"; {names[0]!r} is no constant of the scene: {way_out}"


def alike(values: tuple[float, ...], given: tuple[float, ...]) -> tuple[float, ...]:
    """Keep the written form of `given` in `values`, which were computed from all of them.

    Where one of `given` is `Written`, each value keeps the text of its given number.
    """
    if not any(isinstance(x, Written) for x in given):
        return values
    return tuple(
        Written(value, x.text if isinstance(x, Written) else repr(float(x)))
        for value, x in zip(values, given, strict=True)
    )
