"""Table [[controller]]: linear discrete-time controllers from measurements to inputs."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Annotated, Any

from pydantic import model_validator

from ...validators import names_and_text as texts
from ...validators import scalars_and_vectors as rules
from ...validators.scalars_and_vectors import (
    Rule,
    Table,
    check_entries,
    count_text,
    describe_value,
    problem,
    require_finite,
    require_list,
    to_python,
)

Numbers = tuple[float, ...]
Matrix = tuple[Numbers, ...]


def _matrix_rule() -> Rule:
    """Rule for a matrix as rows of numbers; no rows for an empty matrix."""
    expected = "a matrix: a list of rows of numbers of equal length"

    def row(value: Any, i: int) -> Numbers:
        entries = require_list(to_python(value), "a row of numbers")
        return tuple(require_finite(to_python(x), "a number", i, k) for k, x in enumerate(entries))

    def check(value: Any) -> Matrix:
        rows = check_entries(require_list(to_python(value), expected), expected, row)
        if len({len(matrix_row) for matrix_row in rows}) > 1:
            raise problem(
                f"expected {expected}, found rows of {[len(matrix_row) for matrix_row in rows]} "
                f"numbers"
            )
        return rows

    item = {"type": "array", "items": {"type": ["number", "string"]}}
    return Rule(expected, check, {"type": "array", "items": item})


def _names_rule(expected: str) -> Rule:
    def check_name(value: Any, i: int) -> str:
        if not isinstance(value, str) or not value:
            raise problem(f"expected a name, found {describe_value(value)}", i)
        return value

    def check(value: Any) -> tuple[str, ...]:
        names = check_entries(require_list(to_python(value), expected), expected, check_name)
        if not names:
            raise problem(f"expected {expected}, found none")
        return names

    items = {"type": "string"}
    return Rule(expected, check, {"type": "array", "items": items, "minItems": 1})


class Controller(Table):
    """Linear discrete-time controller, evaluated at times k `sample_time`, k = 0, 1, 2, ...

    y are the values of `inputs`.  The `outputs` u = C x + D (y - reference) + offset are constant
    until the next sample.  Then x <- A x + B (y - reference); x starts with `initial`.
    """

    name: Annotated[str, texts.name_rule("the controller's name")]
    sample_time: Annotated[float, rules.number_rule("s", above=0.0)]
    inputs: Annotated[tuple[str, ...], _names_rule("names of outputs or of quantities of results")]
    outputs: Annotated[tuple[str, ...], _names_rule("names of inputs of the scene")]
    A: Annotated[Matrix, _matrix_rule()] = ()
    B: Annotated[Matrix, _matrix_rule()] = ()
    C: Annotated[Matrix, _matrix_rule()] = ()
    D: Annotated[Matrix, _matrix_rule()] = ()
    initial: Annotated[Numbers, rules.numbers_rule("a list of numbers")] = ()
    reference: Annotated[Numbers, rules.numbers_rule("a list of numbers")] = ()
    offset: Annotated[Numbers, rules.numbers_rule("a list of numbers")] = ()

    @model_validator(mode="after")
    def _check(self) -> Controller:
        n, n_y, n_u = len(self.A), len(self.inputs), len(self.outputs)
        for key, shape in (("A", (n, n)), ("B", (n, n_y)), ("C", (n_u, n)), ("D", (n_u, n_y))):
            rows = getattr(self, key)
            actual_shape = len(rows), len(rows[0]) if rows else 0
            if actual_shape != shape and rows and any(rows):
                raise problem(
                    f"expected {shape[0]} rows of {shape[1]} (A has {n} rows, and there are "
                    f"{n_y} inputs and {n_u} outputs), found {actual_shape[0]} of "
                    f"{actual_shape[1]}",
                    key,
                )
            if actual_shape != shape and not (key == "D" and n) and 0 not in shape:
                raise problem(f"missing; expected {shape[0]} rows of {shape[1]} numbers", key)
        for key, length in (("initial", n), ("reference", n_y), ("offset", n_u)):
            values = getattr(self, key)
            if values and len(values) != length:
                raise problem(f"expected {count_text(length)}, found {len(values)}", key)
        for name in self.outputs:
            if self.outputs.count(name) > 1:
                raise problem(f'"{name}" is listed twice; leave one out', "outputs")
        return self

    @cached_property
    def complete_matrices(self) -> dict[str, Numbers]:
        """Matrices, flat row by row, and vectors by key, with zeros where nothing is given."""
        n, n_y, n_u = len(self.A), len(self.inputs), len(self.outputs)
        sizes = {"A": n * n, "B": n * n_y, "C": n_u * n, "D": n_u * n_y,
                 "initial": n, "reference": n_y, "offset": n_u}  # fmt: skip
        return {key: tuple(_flatten(getattr(self, key))) or (0.0,) * sizes[key] for key in sizes}


def _flatten(given: Any) -> Iterator[float]:
    for row_or_number in given:
        if isinstance(row_or_number, tuple):
            yield from map(float, row_or_number)
        else:
            yield float(row_or_number)
