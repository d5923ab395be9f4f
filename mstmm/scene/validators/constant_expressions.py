"""Numbers given as text: constant expressions ("pi/6"), and remedies for units ("30 deg")."""

from __future__ import annotations

import difflib
import math
import re
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
    value = expression.constant
    return WrittenNumber(value, expression.text) if expression.constants else value


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


# --- unit suffixes --------------------------------------------------------------------------------


#: Unit suffix -> its factor to SI units and rad.
_UNIT_FACTORS = {
    "deg": math.pi / 180, "degree": math.pi / 180, "degrees": math.pi / 180, "°": math.pi / 180,
    "deg/s": math.pi / 180, "°/s": math.pi / 180, "rad": 1.0, "rad/s": 1.0,
    "rev": 2 * math.pi, "turn": 2 * math.pi, "turns": 2 * math.pi, "rpm": math.pi / 30,
    "um": 1e-6, "mm": 1e-3, "cm": 1e-2, "dm": 0.1, "m": 1.0, "km": 1e3, "in": 0.0254, "ft": 0.3048,
    "m/s": 1.0, "mm/s": 1e-3, "km/h": 1 / 3.6, "ms": 1e-3, "s": 1.0, "min": 60.0,
    "g": 1e-3, "kg": 1.0, "t": 1e3, "N": 1.0, "mN": 1e-3, "kN": 1e3, "MN": 1e6, "Nm": 1.0,
    "N*m": 1.0, "Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "kg*m2": 1.0, "kg*m^2": 1.0,
    "N/m": 1.0, "N/mm": 1e3, "kN/m": 1e3, "%": 0.01,
}  # fmt: skip
_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\D.*?)?\s*")


def unit_hint(text: str) -> str:
    """Remedy '; write ...' for text given in place of a number, or ""."""
    match = _QUANTITY.fullmatch(text)
    if match is None:
        return ""
    if not match[2]:
        return "; write the number without quotes"
    return unit_remedy(text) or "; write only the number, without quotes, in SI units and rad"


def unit_remedy(text: str) -> str:
    """Remedy for a number with a known unit suffix, or ""."""
    match = _QUANTITY.fullmatch(text)
    if match is None or match[2] not in _UNIT_FACTORS:
        return ""
    value = float(match[1]) * _UNIT_FACTORS[match[2]]
    return f"; leave out the unit, all numbers are in SI units and rad: write {value:.12g}"


def is_number(text: str) -> bool:
    """Whether the text is a plain number, which needs no quotes."""
    match = _QUANTITY.fullmatch(text)
    return match is not None and not match[2]
