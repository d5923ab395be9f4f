"""Columns of numbers over time, as CSV and MATLAB files hold them: without the scene."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mstmm.arguments import number_in, path_of
from mstmm.arrays import Array, Integers
from mstmm.errors import SceneError
from mstmm.scene.rules.messages import near

from ...engine.shown import BODY, HINGE, WXYZ, XYZ
from ..names import Quantity
from ..owners.angles import EULER
from ..plotting.choice import looked_at
from ..plotting.shown import Candidate
from .tabled import TABLES, write

#: "shoulder.angle [rad]", "rod.qw".
_HEADING = re.compile(r"(.*?)(?: \[(.*)\])?")

#: No scene has so many events.
_EVENTS = 2**53
#: Columns whose time derivative is another one, by the ends of their names.
_RATES = {"x": "vx", "y": "vy", "z": "vz", "vx": "ax", "vy": "ay", "vz": "az"}


#: Vectors whose components have short names, such as rod1.tip.vx.
_VECTORS = {**BODY, **HINGE, "euler": EULER}


class _NotInColumnsError(SceneError, AttributeError):
    """Access to a quantity that needs the scene of the run."""


class Columns:
    """A result that was saved without its scene: every column by its name, and no more.

    `t` (n,) in s and `event` (n,) are as in `Result`, and so are `names`, `quantity`, `plot`,
    `table` and `save` (".csv", ".mat").  Whatever else a `Result` has raises SceneError, with the
    way out.
    """

    def __init__(
        self, path: Path, t: Array, event: Integers, columns: Mapping[str, tuple[str, Array]]
    ) -> None:
        self.path, self.t, self.event = path, t, event
        self._columns = dict(columns)
        #: What a `Result` has besides.
        self.lost: frozenset[str] = frozenset()

    def names(self) -> tuple[str, ...]:
        """Every name that `quantity` takes."""
        return tuple(self._columns)

    def quantity(self, name: str) -> Quantity:
        """Values (n,) with their unit; SceneError with the nearest name if there is no such one."""
        if name not in self._columns:
            return self._vector(name)
        unit, values = self._columns[name]
        rate = self._rate(name)
        rates = None if rate is None else partial(self._values, rate)
        return Quantity(name, values, unit, name, rates=rates)

    def _vector(self, name: str) -> Quantity:
        """Of the columns that are its components, as results name them."""
        owner, _, kind = name.rpartition(".")
        about = _VECTORS.get(kind)
        ways = [(x, tuple(f"{name}.{label}" for label in x)) for x in (XYZ, WXYZ, EULER.labels)]
        if about is not None:
            ways.append((about.labels, tuple(f"{owner}.{word}" for word in about.short)))
        for labels, columns in ways:
            if all(one in self._columns for one in columns):
                values = np.stack([self._values(one) for one in columns], axis=1)
                return Quantity(name, values, self._columns[columns[0]][0], name, labels)
        hint = near(name, self._columns)
        raise SceneError(f'"{name}": there is no such column in {self.path}{hint}')

    def candidates(self) -> list[Candidate]:
        """Coordinates, which have a rate beside them; without such all angles and lengths, or all
        columns."""
        found = [name for name in self._columns if f"{name}_rate" in self._columns]
        lengths = [name for name, (unit, _) in self._columns.items() if unit in ("rad", "m")]
        return list(looked_at(self, found or lengths or list(self._columns)))

    def scalars(self) -> list[Quantity]:
        """Every column."""
        return [self.quantity(name) for name in self._columns]

    def table(self, *names: str, rows: int = 12) -> str:
        """As `Result.table`."""
        from .table import table

        return table(self, names, rows, sorted({"energy"} & self._columns.keys()))

    def plot(self, *names: str, **options: Any) -> Any:
        """As `Result.plot`."""
        from ..plotting.figure import plot_of

        return plot_of(self, names, **options)

    def save(self, path: str | Path) -> Path:
        """As `Result.save`, to ".csv" or ".mat"."""
        path = path_of("result file", path)
        if path.suffix.lower() not in TABLES:
            raise SceneError(
                f'result file "{path}": columns without their scene go into .csv and .mat files'
            )
        return write(self.t, self.event, self.scalars(), path)

    def _values(self, name: str) -> Array:
        return self._columns[name][1]

    def _rate(self, name: str) -> str | None:
        stem, dot, last = name.rpartition(".")
        known = (f"{name}_rate", f"{stem}{dot}{_RATES.get(last, '')}")
        return next((one for one in known if one in self._columns), None)

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_") or name not in self.__dict__.get("lost", ()):
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        raise _NotInColumnsError(
            f'"{name}" needs the scene of the run, and {self.path} holds its columns alone; save '
            "the result as .nc, or run it again"
        )

    def __repr__(self) -> str:
        return f"<Columns of {self.path}: {len(self._columns)} names, {len(self.t)} samples>"


def read_csv(path: Path) -> Columns:
    """A table that `Result.save` wrote.  SceneError for any other, with the line at fault."""
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = list(csv.reader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise _refused(path, f"it cannot be read as a table ({error})") from None
    header = rows[0] if rows else []
    if header[:2] != ["time [s]", "event"]:
        raise _refused(path, "its first columns are not those of a result, time [s] and event")
    for line, row in enumerate(rows, 1):
        if len(row) != len(header):
            raise _refused(path, f"line {line} has {len(row)} entries, expected {len(header)}")
    numbers = np.empty((len(rows) - 1, len(header)))
    for k, row in enumerate(rows[1:]):
        try:
            numbers[k] = [number_in(entry) for entry in row]
        except ValueError as error:
            raise _refused(path, f"line {k + 2}: {error}; expected numbers") from None
    known = [_heading(text) for text in header]
    found = {name: (unit, numbers[:, k]) for k, (name, unit) in enumerate(known) if k > 1}
    return _read(path, numbers[:, 0], numbers[:, 1], found)


def _heading(text: str) -> tuple[str, str]:
    found = _HEADING.fullmatch(text)
    return (text, "") if found is None else (found[1], found[2] or "")


def read_mat(path: Path) -> Columns:
    """A file that `Result.save` wrote.  SceneError for any other."""
    from scipy.io import loadmat

    try:
        data = loadmat(str(path), chars_as_strings=True)
        names = [[str(np.ravel(cell)[0]) if np.size(cell) else "" for cell in row]
                 for row in data["names"]]  # fmt: skip
        t, event = np.ravel(data["t"]), np.ravel(data["event"])
        found = {name: (unit, np.ravel(data[key])) for key, name, unit in names}
    except Exception as error:  # whatever SciPy makes of files that are none
        raise _refused(path, f"not a result of mstmm ({type(error).__name__}: {error})") from None
    return _read(path, t, event, found)


def _read(path: Path, t: Array, event: Array, found: Mapping[str, tuple[str, Array]]) -> Columns:
    """What a file holds, where it can be that of a run."""
    columns = [t, event, *(values for _, values in found.values())]
    if any(len(one) != len(t) for one in columns):
        raise _refused(path, "its columns are not equally long")
    if any(one.dtype.kind not in "buif" for one in columns):
        raise _refused(path, "its columns are not all of real numbers")
    if not np.isfinite(t).all() or (np.diff(t) < 0).any():
        raise _refused(path, "its times are not finite numbers, none before another")
    if not (np.isfinite(event) & (np.abs(event) < _EVENTS) & (event == np.round(event))).all():
        raise _refused(path, "its events are not whole numbers")
    return Columns(path, t, event.astype(np.int64), found)


def _refused(path: Path, why: str) -> SceneError:
    return SceneError(f'result file "{path}": {why}; save the result again')


#: Readers by the endings of files.
READERS: dict[str, Callable[[Path], Columns]] = {".csv": read_csv, ".mat": read_mat}
