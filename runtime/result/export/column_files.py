"""CSV and MATLAB files of columns over time, without the scene."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mstmm.argument_validation import parse_number, require_path
from mstmm.array_validation import Array, Integers
from mstmm.errors import SceneError
from mstmm.scene.validators.validation_messages import did_you_mean

from ...engine.quantity_registry import BODY_QUANTITIES, HINGE_QUANTITIES, WXYZ, XYZ
from ..plotting.default_quantities import Candidate, rate_candidates
from ..quantity_names import Quantity
from ..sources.euler_angles import EULER_KIND
from .csv_and_mat import TABLES, write_table

#: "shoulder.angle [rad]", "rod.qw".
_HEADING_PATTERN = re.compile(r"(.*?)(?: \[(.*)\])?")

#: Upper bound of the number of events of a scene.
_MAX_EVENT = 2**53
#: Columns whose time derivative is another column, by the ends of their names.
_RATE_SUFFIXES = {"x": "vx", "y": "vy", "z": "vz", "vx": "ax", "vy": "ay", "vz": "az"}


#: Vectors whose components have short names, such as rod1.tip.vx.
_VECTOR_KINDS = {**BODY_QUANTITIES, **HINGE_QUANTITIES, "euler": EULER_KIND}


class _NotInColumnsError(SceneError, AttributeError):
    """Access to a quantity that needs the scene of the run."""


class ColumnFile:
    """Result that was saved without its scene: columns by name.

    `t` (n,) in s and `event` (n,) are as in `Result`, and so are `quantity_names`, `quantity`,
    `plot`, `table` and `save` (".csv", ".mat"). All other attributes of a `Result` raise
    SceneError, with a remedy.
    """

    def __init__(
        self, path: Path, t: Array, event: Integers, columns: Mapping[str, tuple[str, Array]]
    ) -> None:
        self.path, self.t, self.event = path, t, event
        self._columns = dict(columns)
        #: Further attributes of a `Result`, not available here.
        self.lost: frozenset[str] = frozenset()

    def quantity_names(self) -> tuple[str, ...]:
        """All names that `quantity` accepts."""
        return tuple(self._columns)

    def quantity(self, name: str) -> Quantity:
        """Values (n,) with their unit; SceneError with the nearest name for an unknown name."""
        if name not in self._columns:
            return self._vector(name)
        unit, values = self._columns[name]
        rate = self._rate(name)
        rates = None if rate is None else partial(self._values, rate)
        return Quantity(name, values, unit, name, rates=rates)

    def _vector(self, name: str) -> Quantity:
        """Vector of the columns that are its components, with the names used by results."""
        owner, _, kind = name.rpartition(".")
        kind_description = _VECTOR_KINDS.get(kind)
        candidates = [
            (x, tuple(f"{name}.{label}" for label in x)) for x in (XYZ, WXYZ, EULER_KIND.labels)
        ]
        if kind_description is not None:
            candidates.append(
                (
                    kind_description.labels,
                    tuple(f"{owner}.{word}" for word in kind_description.short),
                )
            )
        for labels, columns in candidates:
            if all(column in self._columns for column in columns):
                values = np.stack([self._values(column) for column in columns], axis=1)
                return Quantity(name, values, self._columns[columns[0]][0], name, labels)
        hint = did_you_mean(name, self._columns)
        raise SceneError(f'"{name}": there is no such column in {self.path}{hint}')

    def default_quantities(self) -> list[Candidate]:
        """Columns with a rate; without any, all angles and lengths, or all columns."""
        coordinates = [name for name in self._columns if f"{name}_rate" in self._columns]
        lengths = [name for name, (unit, _) in self._columns.items() if unit in ("rad", "m")]
        return list(rate_candidates(self, coordinates or lengths or list(self._columns)))

    def scalars(self) -> list[Quantity]:
        """All columns."""
        return [self.quantity(name) for name in self._columns]

    def table(self, *names: str, rows: int = 12) -> str:
        """Text table of some samples, as `Result.table`."""
        from .text_table import text_table

        return text_table(self, names, rows, sorted({"energy"} & self._columns.keys()))

    def plot(self, *names: str, **options: Any) -> Any:
        """Figure of columns by name, as `Result.plot`."""
        from ..plotting.figure import plot_of

        return plot_of(self, names, **options)

    def save(self, path: str | Path) -> Path:
        """Write ".csv" or ".mat", as `Result.save`."""
        path = require_path("result file", path)
        if path.suffix.lower() not in TABLES:
            raise SceneError(
                f'result file "{path}": columns without their scene can be saved as .csv or .mat '
                "only"
            )
        return write_table(self.t, self.event, self.scalars(), path)

    def _values(self, name: str) -> Array:
        return self._columns[name][1]

    def _rate(self, name: str) -> str | None:
        stem, dot, suffix = name.rpartition(".")
        rate_names = (f"{name}_rate", f"{stem}{dot}{_RATE_SUFFIXES.get(suffix, '')}")
        return next((rate_name for rate_name in rate_names if rate_name in self._columns), None)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name not in self.__dict__.get("lost", ()):
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        raise _NotInColumnsError(
            f'"{name}" needs the scene of the run, but {self.path} contains columns only; save '
            "the result as .nc, or run it again"
        )

    def __repr__(self) -> str:
        return f"<Columns of {self.path}: {len(self._columns)} names, {len(self.t)} samples>"


def read_csv(path: Path) -> ColumnFile:
    """Read a table that `Result.save` wrote. SceneError for any other, with the invalid line."""
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = list(csv.reader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise _file_error(path, f"it cannot be read as a table ({error})") from None
    header = rows[0] if rows else []
    if header[:2] != ["time [s]", "event"]:
        raise _file_error(path, "its first columns are not those of a result, time [s] and event")
    for line, row in enumerate(rows, 1):
        if len(row) != len(header):
            raise _file_error(path, f"line {line} has {len(row)} entries, expected {len(header)}")
    numbers = np.empty((len(rows) - 1, len(header)))
    for k, row in enumerate(rows[1:]):
        try:
            numbers[k] = [parse_number(entry) for entry in row]
        except ValueError as error:
            raise _file_error(path, f"line {k + 2}: {error}; expected numbers") from None
    headings = [_parse_heading(text) for text in header]
    columns_by_name = {
        name: (unit, numbers[:, k]) for k, (name, unit) in enumerate(headings) if k > 1
    }
    return _build_columns(path, numbers[:, 0], numbers[:, 1], columns_by_name)


def _parse_heading(text: str) -> tuple[str, str]:
    match = _HEADING_PATTERN.fullmatch(text)
    return (text, "") if match is None else (match[1], match[2] or "")


def read_mat(path: Path) -> ColumnFile:
    """Read a file that `Result.save` wrote. SceneError for any other."""
    from scipy.io import loadmat

    try:
        data = loadmat(str(path), chars_as_strings=True)
        names = [[str(np.ravel(cell)[0]) if np.size(cell) else "" for cell in row]
                 for row in data["names"]]  # fmt: skip
        t, event = np.ravel(data["t"]), np.ravel(data["event"])
        columns_by_name = {name: (unit, np.ravel(data[key])) for key, name, unit in names}
    except Exception as error:  # SciPy raises many types for invalid files
        raise _file_error(
            path, f"not a result of mstmm ({type(error).__name__}: {error})"
        ) from None
    return _build_columns(path, t, event, columns_by_name)


def _build_columns(
    path: Path, t: Array, event: Array, columns_found: Mapping[str, tuple[str, Array]]
) -> ColumnFile:
    """Columns of a file, if it can be that of a run."""
    columns = [t, event, *(values for _, values in columns_found.values())]
    if any(len(column) != len(t) for column in columns):
        raise _file_error(path, "its columns are not equally long")
    if any(column.dtype.kind not in "buif" for column in columns):
        raise _file_error(path, "its columns are not all of real numbers")
    if not np.isfinite(t).all() or (np.diff(t) < 0).any():
        raise _file_error(path, "its times are not finite numbers, none before another")
    if not (np.isfinite(event) & (np.abs(event) < _MAX_EVENT) & (event == np.round(event))).all():
        raise _file_error(path, "its events are not whole numbers")
    return ColumnFile(path, t, event.astype(np.int64), columns_found)


def _file_error(path: Path, why: str) -> SceneError:
    return SceneError(f'result file "{path}": {why}; save the result again')


#: Readers by file suffix.
READERS: dict[str, Callable[[Path], ColumnFile]] = {".csv": read_csv, ".mat": read_mat}
