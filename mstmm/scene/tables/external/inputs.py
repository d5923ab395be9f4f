"""Tables [[input]], [[signal]], [[output]]: external values, tabulated values, observations."""

from __future__ import annotations

import math
from functools import cached_property
from itertools import pairwise
from typing import Annotated, Any

from pydantic import model_validator

from ....expression.expression import Expression
from ....numerics.piecewise_polynomial import INTERPOLATIONS, PiecewisePolynomial, interpolate
from ...validators import constant_expressions
from ...validators import names_and_text as texts
from ...validators import scalars_and_vectors as rules
from ...validators.csv_columns import read_columns
from ...validators.scalars_and_vectors import (
    NAME_PATTERN,
    Rule,
    Table,
    ValidationProblems,
    describe_value,
    problem,
    require_finite,
    to_python,
)
from ..elastic_keys import SCENE_FOLDER

Numbers = tuple[float, ...]


def _unit_rule() -> Rule:
    """Rule for a unit shown in tables and plots; nothing is converted."""
    expected = 'a unit such as "N m"'

    def check(value: Any) -> str:
        checked_text = texts.require_text(value, expected)
        if len(checked_text) > 64 or not checked_text.isprintable():
            raise problem(f"expected {expected}, found {describe_value(checked_text)}")
        return checked_text

    return Rule(expected, check, {"type": "string", "maxLength": 64})


def _value_rule() -> Rule:
    """Rule for a number, or the name of a signal."""
    expected = "a number or the name of a signal"

    def check(value: Any) -> float | str:
        value = to_python(value)
        if isinstance(value, str) and NAME_PATTERN.fullmatch(value):
            is_number = value in ("pi", "deg") or value in constant_expressions.current_constants()
            return require_finite(value, expected) if is_number else value
        return require_finite(value, expected)

    return Rule(expected, check, {"type": ["number", "string"]})


class Input(Table):
    """Input set from outside by `simulate(inputs=...)`; by default it is `value`.

    `value` is a number or the name of a signal.  `rates` are its first and second rate (per s, per
    s^2) at t = 0, so that the input is value + rate t + second rate t^2 / 2.
    """

    name: Annotated[str, texts.name_rule("the input's name")]
    unit: Annotated[str, _unit_rule()] = ""
    value: Annotated[float | str, _value_rule()] = 0.0
    rates: Annotated[Numbers | None, rules.numbers_rule("two numbers: rate, second rate", 2)] = None

    @model_validator(mode="after")
    def _check(self) -> Input:
        if self.rates is not None and isinstance(self.value, str):
            raise problem(f'the signal "{self.value}" has its own rates; leave them out', "rates")
        return self


class Output(Table):
    """Named quantity of results, or an expression of quantities, t, inputs and signals.

    Without a `unit` it has the unit of its quantity.
    """

    name: Annotated[str, texts.name_rule("the output's name")]
    of: Annotated[Expression, texts.formula_rule("a quantity of results or an expression of some")]
    unit: Annotated[str, _unit_rule()] = ""


def _column_rule() -> Rule:
    expected = "the name or the number of a column, 2 or more"

    def check(value: Any) -> str | int:
        if isinstance(value, str) and value:
            return value
        if isinstance(value, bool) or not isinstance(value, int) or value < 2:
            raise problem(f"expected {expected}, found {describe_value(value)}")
        return value

    return Rule(expected, check, {"type": ["integer", "string"], "minimum": 2})


class Signal(Table):
    """Signal tabulated over time: values at ascending times (s), or columns of a CSV file.

    The file is in the folder of the scene and is read with it.  `interpolation` is by steps, lines
    or a cubic spline; before the first and after the last time the signal is constant.
    """

    name: Annotated[str, texts.name_rule("the signal's name")]
    unit: Annotated[str, _unit_rule()] = ""
    interpolation: Annotated[str, texts.choice_rule(*INTERPOLATIONS)] = "line"
    times: Annotated[Numbers, rules.numbers_rule("a list of times", of="s")] = ()
    values: Annotated[Numbers, rules.numbers_rule("a list of numbers")] = ()
    file: Annotated[str | None, texts.label_rule("a CSV file in the folder of the scene")] = None
    column: Annotated[str | int | None, _column_rule()] = None

    @model_validator(mode="after")
    def _load_samples(self) -> Signal:
        if self.file is not None:
            self._read()
        elif self.column is not None:
            raise problem("only a signal from a file has a column; leave it out", "column")
        else:
            self._check_order([f"times[{k}]" for k in range(len(self.times))], "times")
        return self

    def _read(self) -> None:
        """Replace the file name by the numbers of the file."""
        if self.times or self.values:
            raise problem("expected a file, or times and values, found both; leave one out", "file")
        try:
            columns = read_columns(str(self.file), SCENE_FOLDER.get(), self.column or 2)
        except ValidationProblems as refused:
            raise problem(str(refused), "file") from None
        object.__setattr__(self, "times", columns.first)
        object.__setattr__(self, "values", columns.other)
        self._check_order(
            [f"{describe_value(self.file)} row {line}" for line in columns.lines], "file"
        )
        object.__setattr__(self, "file", None)
        object.__setattr__(self, "column", None)

    def _check_order(self, rows: list[str], place: str) -> None:
        """Check that times ascend and rates are finite.  Raises Refused with the rows."""
        if not self.times:
            raise problem("missing; expected times in s and values, or a file with them", place)
        if len(self.values) != len(self.times):
            raise problem(
                f"expected {rules.count_text(len(self.times))}, one for each of the times, found "
                f"{len(self.values)}", "values",
            )  # fmt: skip
        for k, (a, b) in enumerate(pairwise(self.times)):
            if a == b:
                raise problem(
                    f"{rows[k]} and {rows[k + 1]} are both at {a:g} s; keep one of them", place
                )
            if a > b:
                raise problem(
                    f"{rows[k + 1]}, {b:g} s, comes after {rows[k]}, {a:g} s; sort them by time",
                    place,
                )
        for k, piece in enumerate(self.pieces.pieces):
            if not all(map(math.isfinite, piece)):
                raise problem(
                    f"from {rows[max(0, k - 1)]} on its rate overflows; use fewer rows, or "
                    "scale it", place,
                )  # fmt: skip

    @cached_property
    def pieces(self) -> PiecewisePolynomial:
        """Signal as a piecewise polynomial of time."""
        return interpolate(self.times, self.values, self.interpolation)
