"""CSV and MATLAB files of columns over time, without the scene, and text tables."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.argument_validation import parse_number, require_path
from mstmm.array_validation import Array, Integers, integer
from mstmm.errors import SceneError
from mstmm.scene.validators.validation_messages import did_you_mean

from ...engine.quantity_registry import BODY_QUANTITIES, EULER_KIND, HINGE_QUANTITIES, WXYZ, XYZ
from ...platform_support.safe_files import replace_atomically
from ..plotting.default_quantities import Candidate, choose_panels, rate_candidates
from ..quantity_names import Quantity

if TYPE_CHECKING:
    from ..plotting.default_quantities import PlotSource
    from ..quantity_names import Quantity


def write_table(
    t: Array, event: Integers, quantities: Sequence[Quantity], path: Path, scene: str = ""
) -> Path:
    """Write scalar quantities and events (n,) at the times t (n,) s; the suffix is in `TABLES`."""
    with replace_atomically(path) as temporary:
        TABLES[path.suffix.lower()](t, event, quantities, temporary, scene)
    return path


def column_heading(quantity: Quantity) -> str:
    """Heading of a column: name and unit."""
    return f"{quantity.name} [{quantity.unit}]" if quantity.unit else quantity.name


def matlab_names(names: Sequence[str]) -> list[str]:
    """Unique names valid in MATLAB: letters, digits and _, at most 63 characters."""
    taken, result = {"t", "event", "names", "scene"}, []
    for name in names:
        text = re.sub(r"\W", "_", name)
        text = (text if text[:1].isalpha() else f"x{text}")[:63]
        number = 1
        while text in taken:
            number += 1
            end = f"_{number}"
            text = text[: 63 - len(end)] + end
        taken.add(text)
        result.append(text)
    return result


def _write_csv(
    t: Array, event: Integers, quantities: Sequence[Quantity], path: Path, _: str
) -> None:
    """One row per sample, one column per scalar; the header holds names and units."""
    header = ["time [s]", "event", *map(column_heading, quantities)]
    columns = [t.tolist(), event.tolist(), *(q.values.tolist() for q in quantities)]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(header)
        writer.writerows(zip(*columns, strict=True))


def _write_mat(
    t: Array, event: Integers, quantities: Sequence[Quantity], path: Path, scene: str
) -> None:
    """One variable per scalar; `names` has a row for each: MATLAB's name, original name, unit."""
    from scipy.io import savemat

    keys = matlab_names([quantity.name for quantity in quantities])
    rows = [
        (key, quantity.name, quantity.unit) for key, quantity in zip(keys, quantities, strict=True)
    ]
    names = np.array(rows, dtype=object).reshape(-1, 3)
    data: dict[str, Any] = {
        key: quantity.values[:, None] for key, quantity in zip(keys, quantities, strict=True)
    }
    data |= {"t": t[:, None], "event": event[:, None], "names": names, "scene": scene}
    with path.open("wb") as file:
        savemat(file, data, long_field_names=True, do_compression=True)


#: Writers by file suffix.
TABLES: dict[str, Callable[[Array, Integers, Sequence[Quantity], Path, str], None]] = {
    ".csv": _write_csv, ".mat": _write_mat,
}  # fmt: skip


#: Default number of columns of a table.
_DEFAULT_COLUMNS = 6


def default_names(result: PlotSource, most: int = _DEFAULT_COLUMNS) -> list[str]:
    """Names of the default quantities of `plot`, one for each column."""
    return [name for chosen in choose_panels(result, most) for name in chosen.names][:most]


def flat_columns(quantities: Sequence[Quantity]) -> list[tuple[str, str, np.ndarray]]:
    """Name, unit and values (n,) of every column."""
    columns = []
    for quantity in quantities:
        if quantity.values.ndim == 1:
            columns.append((quantity.name, quantity.unit, quantity.values))
            continue
        for k, label in enumerate(quantity.labels):
            columns.append((f"{quantity.name}.{label}", quantity.unit, quantity.values[:, k]))
    return columns


def text_table(
    result: PlotSource, names: Sequence[str], rows: int, beside: Sequence[str] = ("energy",)
) -> str:
    """Aligned columns with a line of units; `rows` samples spread evenly over time.

    Without names, default quantities are chosen, followed by the names in `beside`.
    """
    selected = list(names) or [*default_names(result), *beside]
    columns = [("t", "s", result.t), *flat_columns([result.quantity(name) for name in selected])]
    samples = _evenly_spaced_samples(
        result.t, integer("rows", rows, 2, "a whole number of rows, 2 or more")
    )
    texts = [
        [name, f"[{unit}]" if unit else "", *(f"{value:.6g}" for value in values[samples])]
        for name, unit, values in columns
    ]
    widths = [max(map(len, column)) for column in texts]
    lines = [
        "  ".join(entry.rjust(width) for entry, width in zip(row, widths, strict=True)).rstrip()
        for row in zip(*texts, strict=True)
    ]
    rule = "  ".join("-" * width for width in widths)
    return "\n".join([*lines[:2], rule, *lines[2:]])


def _evenly_spaced_samples(t: np.ndarray, rows: int) -> list[int]:
    """Samples next to `rows` evenly spaced times, including the first and last."""
    if len(t) <= rows:
        return list(range(len(t)))
    targets = np.linspace(t[0], t[-1], max(2, rows))
    right = np.clip(np.searchsorted(t, targets), 1, len(t) - 1)
    nearest = np.where(targets - t[right - 1] < t[right] - targets, right - 1, right)
    return sorted({*nearest.tolist(), len(t) - 1})


#: "shoulder.angle [rad]", "rod.qw".
_HEADING_PATTERN = re.compile(r"(.*?)(?: \[(.*)\])?")

#: Upper bound of the number of events of a scene.
_MAX_EVENT = 2**53
#: Columns whose time derivative is another column, by the ends of their names.
_RATE_SUFFIXES = {"x": "vx", "y": "vy", "z": "vz", "vx": "ax", "vy": "ay", "vz": "az"}


#: Vectors whose components have short names, such as rod1.tip.vx.
_VECTOR_KINDS = {**BODY_QUANTITIES, **HINGE_QUANTITIES}


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
        if kind_description is not None and kind_description.short:
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
