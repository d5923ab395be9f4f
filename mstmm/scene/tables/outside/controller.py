"""Table [[controller]]: linear discrete-time controllers from measurements to inputs."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Annotated, Any

from pydantic import model_validator

from ...rules import text as texts
from ...rules import values as rules
from ...rules.values import Rule, Table, collect, counted, entries_of, finite, found, plain, refuse

Numbers = tuple[float, ...]
Matrix = tuple[Numbers, ...]


def _matrix() -> Rule:
    """Rule for a matrix as rows of numbers; no rows for an empty matrix."""
    expected = "a matrix: a list of rows of numbers of equal length"

    def row(value: Any, i: int) -> Numbers:
        entries = entries_of(plain(value), "a row of numbers")
        return tuple(finite(plain(x), "a number", i, k) for k, x in enumerate(entries))

    def check(value: Any) -> Matrix:
        rows = collect(entries_of(plain(value), expected), expected, row)
        if len({len(one) for one in rows}) > 1:
            raise refuse(f"expected {expected}, found rows of {[len(one) for one in rows]} numbers")
        return rows

    item = {"type": "array", "items": {"type": ["number", "string"]}}
    return Rule(expected, check, {"type": "array", "items": item})


def _names(expected: str) -> Rule:
    def one(value: Any, i: int) -> str:
        if not isinstance(value, str) or not value:
            raise refuse(f"expected a name, found {found(value)}", i)
        return value

    def check(value: Any) -> tuple[str, ...]:
        names = collect(entries_of(plain(value), expected), expected, one)
        if not names:
            raise refuse(f"expected {expected}, found none")
        return names

    items = {"type": "string"}
    return Rule(expected, check, {"type": "array", "items": items, "minItems": 1})


class Controller(Table):
    """Linear discrete-time controller, evaluated at times k `sample_time`, k = 0, 1, 2, ...

    y are the values of `inputs`.  The `outputs` u = C x + D (y - reference) + offset are constant
    until the next sample.  Then x <- A x + B (y - reference); x starts with `initial`.
    """

    name: Annotated[str, texts.name("the controller's name")]
    sample_time: Annotated[float, rules.number("s", above=0.0)]
    inputs: Annotated[tuple[str, ...], _names("names of outputs or of quantities of results")]
    outputs: Annotated[tuple[str, ...], _names("names of inputs of the scene")]
    A: Annotated[Matrix, _matrix()] = ()
    B: Annotated[Matrix, _matrix()] = ()
    C: Annotated[Matrix, _matrix()] = ()
    D: Annotated[Matrix, _matrix()] = ()
    initial: Annotated[Numbers, rules.numbers("a list of numbers")] = ()
    reference: Annotated[Numbers, rules.numbers("a list of numbers")] = ()
    offset: Annotated[Numbers, rules.numbers("a list of numbers")] = ()

    @model_validator(mode="after")
    def _check(self) -> Controller:
        n, n_y, n_u = len(self.A), len(self.inputs), len(self.outputs)
        for key, shape in (("A", (n, n)), ("B", (n, n_y)), ("C", (n_u, n)), ("D", (n_u, n_y))):
            rows = getattr(self, key)
            there = len(rows), len(rows[0]) if rows else 0
            if there != shape and rows and any(rows):
                raise refuse(
                    f"expected {shape[0]} rows of {shape[1]} (A has {n} rows, and there are "
                    f"{n_y} inputs and {n_u} outputs), found {there[0]} of {there[1]}", key,
                )  # fmt: skip
            if there != shape and not (key == "D" and n) and 0 not in shape:
                raise refuse(f"missing; expected {shape[0]} rows of {shape[1]} numbers", key)
        for key, length in (("initial", n), ("reference", n_y), ("offset", n_u)):
            given = getattr(self, key)
            if given and len(given) != length:
                raise refuse(f"expected {counted(length)}, found {len(given)}", key)
        for name in self.outputs:
            if self.outputs.count(name) > 1:
                raise refuse(f'"{name}" is listed twice; leave one out', "outputs")
        return self

    @cached_property
    def filled(self) -> dict[str, Numbers]:
        """Matrices, flat row by row, and vectors by key, with zeros where nothing is given."""
        n, n_y, n_u = len(self.A), len(self.inputs), len(self.outputs)
        sizes = {"A": n * n, "B": n * n_y, "C": n_u * n, "D": n_u * n_y,
                 "initial": n, "reference": n_y, "offset": n_u}  # fmt: skip
        return {key: tuple(_flat(getattr(self, key))) or (0.0,) * sizes[key] for key in sizes}


def _flat(given: Any) -> Iterator[float]:
    for one in given:
        if isinstance(one, tuple):
            yield from map(float, one)
        else:
            yield float(one)
