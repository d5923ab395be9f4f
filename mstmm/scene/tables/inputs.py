"""Tables [[input]], [[signal]], [[output]] and [[controller]]: outside values, observations."""

from __future__ import annotations

import math
import os
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from ...argument_validation import parse_number
from ...expression.expression import Expression
from ...numerics.piecewise_polynomial import INTERPOLATIONS, PiecewisePolynomial, interpolate
from ..validators import constant_expressions
from ..validators import names_and_text as texts
from ..validators import scalars_and_vectors as rules
from ..validators.names_and_text import SCENE_FOLDER
from ..validators.scalars_and_vectors import (
    NAME_PATTERN,
    Numbers,
    Rule,
    Table,
    ValidationProblems,
    check_entries,
    count_text,
    describe_value,
    problem,
    require_finite,
    require_list,
    to_python,
    unexpected,
)

#: A unit shown in tables and plots; nothing is converted.
_Unit = Annotated[str, texts.label_rule('a unit such as "N m"', minimum=0)]


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
    unit: _Unit = ""
    value: Annotated[float | str, _value_rule()] = 0.0
    rates: Annotated[Numbers | None, rules.numbers_rule("two numbers: rate, second rate", 2)] = None

    def _check(self) -> None:
        if self.rates is not None and isinstance(self.value, str):
            raise problem(f'the signal "{self.value}" has its own rates; leave them out', "rates")


class Output(Table):
    """Named quantity of results, or an expression of quantities, t, inputs and signals.

    Without a `unit` it has the unit of its quantity.
    """

    name: Annotated[str, texts.name_rule("the output's name")]
    of: Annotated[Expression, texts.formula_rule("a quantity of results or an expression of some")]
    unit: _Unit = ""


_COLUMN = rules.value_rule(
    "the name or the number of a column, 2 or more",
    lambda value: value if isinstance(value, str) else rules.is_integer(value) and value >= 2,
    {"type": ["integer", "string"], "minimum": 2},
)


class Signal(Table):
    """Signal tabulated over time: values at ascending times (s), or columns of a CSV file.

    The file is in the folder of the scene and is read with it.  `interpolation` is by steps, lines
    or a cubic spline; before the first and after the last time the signal is constant.
    """

    name: Annotated[str, texts.name_rule("the signal's name")]
    unit: _Unit = ""
    interpolation: Annotated[str, texts.choice_rule(*INTERPOLATIONS)] = "line"
    times: Annotated[Numbers, rules.numbers_rule("a list of times", of="s")] = ()
    values: Annotated[Numbers, rules.numbers_rule("a list of numbers")] = ()
    file: Annotated[str | None, texts.label_rule("a CSV file in the folder of the scene")] = None
    column: Annotated[str | int | None, _COLUMN] = None

    def _check(self) -> None:
        if self.file is not None:
            self._read()
        elif self.column is not None:
            raise problem("only a signal from a file has a column; leave it out", "column")
        else:
            self._check_order([f"times[{k}]" for k in range(len(self.times))], "times")

    def _read(self) -> None:
        """Replace the file name by the numbers of the file."""
        if self.times or self.values:
            raise problem("expected a file, or times and values, found both; leave one out", "file")
        try:
            columns = read_columns(str(self.file), SCENE_FOLDER.get(), self.column or 2)
        except ValidationProblems as refused:
            raise problem(str(refused), "file") from None
        vars(self).update(times=columns.first, values=columns.other)
        self._check_order(
            [f"{describe_value(self.file)} row {line}" for line in columns.lines], "file"
        )
        vars(self).update(file=None, column=None)

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


# --- controllers ----------------------------------------------------------------------------------


Matrix = tuple[Numbers, ...]


def _matrix_rule() -> Rule:
    """Rule for a matrix as rows of numbers; no rows for an empty matrix."""
    expected = "a matrix: a list of rows of numbers of equal length"

    def row(value: Any, i: int) -> Numbers:
        entries = require_list(value, "a row of numbers")
        return tuple(require_finite(to_python(x), "a number", i, k) for k, x in enumerate(entries))

    def check(value: Any) -> Matrix:
        rows = check_entries(require_list(value, expected), expected, row)
        if len({len(numbers) for numbers in rows}) > 1:
            widths = [len(numbers) for numbers in rows]
            raise problem(f"expected {expected}, found rows of {widths} numbers")
        return rows

    item = {"type": "array", "items": {"type": ["number", "string"]}}
    return Rule(expected, check, {"type": "array", "items": item})


def _names_rule(expected: str) -> Rule:
    def check_name(value: Any, i: int) -> str:
        if not isinstance(value, str) or not value:
            raise unexpected("a name", value, i)
        return value

    def check(value: Any) -> tuple[str, ...]:
        names = check_entries(require_list(value, expected), expected, check_name)
        if not names:
            raise problem(f"expected {expected}, found none")
        return names

    return Rule(expected, check, {"type": "array", "items": {"type": "string"}, "minItems": 1})


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

    def _check(self) -> None:
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

    @cached_property
    def complete_matrices(self) -> dict[str, Numbers]:
        """Matrices, flat row by row, and vectors by key, with zeros where nothing is given."""
        n, n_y, n_u = len(self.A), len(self.inputs), len(self.outputs)
        sizes = {"A": n * n, "B": n * n_y, "C": n_u * n, "D": n_u * n_y,
                 "initial": n, "reference": n_y, "offset": n_u}  # fmt: skip
        rows = {key: getattr(self, key) for key in ("A", "B", "C", "D")}
        given = {key: tuple(float(x) for row in rows[key] for x in row) for key in rows}
        given |= {key: tuple(map(float, getattr(self, key))) for key in sizes if key not in rows}
        return {key: given[key] or (0.0,) * size for key, size in sizes.items()}


# --- CSV files in the folder of a scene -----------------------------------------------------------


#: Largest file in MB.
MAX_FILE_SIZE_MB = 64


class Columns(NamedTuple):
    """Two columns of a file: the first and another; `lines` are their line numbers."""

    first: Numbers
    other: Numbers
    lines: tuple[int, ...]


def read_columns(path: str, folder: str, column: str | int) -> Columns:
    """Read the first column of a CSV file and the one with the given name or number.

    The file is in or below `folder` (empty: the current one).  Columns are separated by commas,
    semicolons or tabs.  The first line may contain their names; empty lines and those that begin
    with # are skipped.  Raises Refused.
    """
    where = describe_value(path)
    rows = [
        (number, [cell.strip() for cell in line.split(_separator_of(line))])
        for number, line in enumerate(_read_text(path, folder).splitlines(), 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    names = rows.pop(0)[1] if rows and _parse_number(rows[0][1][0]) is None else []
    index = _column_index(where, column, names, len(rows[0][1]) if rows else 0)
    if not rows:
        raise problem(f"{where}: expected rows of numbers, times in s first, found none")
    numbers = []
    for line, cells in rows:
        if len(cells) <= index:
            raise problem(
                f"{where}: row {line}: expected {index + 1} columns or more, found {len(cells)}"
            )
        for cell in (cells[0], cells[index]):
            value = _parse_number(cell)
            if value is None or not math.isfinite(value):
                found = describe_value(cell)
                raise problem(f"{where}: row {line}: expected a number, found {found}")
            numbers.append(value)
    return Columns(tuple(numbers[::2]), tuple(numbers[1::2]), tuple(line for line, _ in rows))


def _separator_of(line: str) -> str:
    return next((mark for mark in ";\t" if mark in line), ",")


def _parse_number(cell: str) -> float | None:
    try:
        return parse_number(cell)
    except ValueError:
        return None


def _column_index(where: str, column: str | int, names: list[str], width: int) -> int:
    if isinstance(column, str):
        if column not in names:
            available_names = ", ".join(names) or "none; give the column number instead"
            found = describe_value(column)
            raise problem(f"{where}: no column {found}; its columns: {available_names}")
        return names.index(column)
    if width and column > width:
        raise problem(f"{where}: no column {column}; it has {width} columns")
    return column - 1


def _read_text(path: str, folder: str) -> str:
    """Text of a file in or below the folder."""
    where = describe_value(path)
    folder_path = Path(folder or os.curdir).resolve()
    file_path = (folder_path / path).resolve()
    if Path(path).is_absolute() or not file_path.is_relative_to(folder_path):
        raise problem(
            f"expected a file in the folder of the scene, found {where}; copy it "
            "there, or give its numbers as times and values"
        )
    try:
        if not file_path.is_file():
            raise problem(f"{where}: there is no such file in the folder of the scene")
        if file_path.stat().st_size > MAX_FILE_SIZE_MB * 2**20:
            raise problem(
                f"{where}: the file is larger than {MAX_FILE_SIZE_MB} MB; reduce its number of rows"
            )
        return file_path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise problem(f"{where}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise problem(f"{where}: not UTF-8 text; save it as CSV in UTF-8") from None
