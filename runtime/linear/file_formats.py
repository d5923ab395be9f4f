"""Linear models as dictionaries, tables and NetCDF files (extra: io)."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.optional_packages import missing_package_error
from mstmm.risk import AssessedResult

from ..platform_support.safe_files import replace_atomically, require_path, seal

if TYPE_CHECKING:
    from .state_space import StateSpace

#: Saved matrices of a linear model: row dimension and column dimension by name in the file.
MATRICES = {
    **dict.fromkeys(
        ("M", "C", "K", "damping", "gyroscopic", "elastic", "geometric", "load"),
        ("coordinate", "coordinate"),
    ),
    "C_driven": ("coordinate", "drive"), "K_driven": ("coordinate", "drive"),
    "V": ("coordinate", "input"), "W": ("coordinate", "disturbance"),
    "A": ("state", "state"), "B": ("state", "input"), "B_disturbances": ("state", "disturbance"),
}  # fmt: skip

#: Attributes of `Linear` with another name than their matrix in the file.
_ATTRIBUTES = {
    "damping": "C_damping", "gyroscopic": "C_gyroscopic", "elastic": "K_elastic",
    "geometric": "K_geometric", "load": "K_load", "C_driven": "C_prescribed",
    "K_driven": "K_prescribed",
}  # fmt: skip


def names(linear: StateSpace) -> dict[str, tuple[str, ...]]:
    """Names along each dimension of the matrices."""
    return {
        "coordinate": linear.coordinate_names,
        "state": linear.state_names,
        "input": linear.input_names,
        "disturbance": linear.disturbance_names,
        "drive": linear.prescribed_coordinates,
    }


def _matrices(linear: StateSpace) -> Iterator[tuple[str, str, str, Array]]:
    """Yield name, row dimension, column dimension and values of the matrices of the model."""
    for key, (row, column) in MATRICES.items():
        if linear.has_stiffness or "state" in (row, column):
            yield key, row, column, getattr(linear, _ATTRIBUTES.get(key, key))


def dictionary(linear: StateSpace) -> dict[str, Any]:
    """Names, state and matrices of a linear model as a dictionary for JSON."""
    state = linear.state
    return {
        "t": state.t, "q": state.q.tolist(), "u": state.u.tolist(),
        "coordinates": list(linear.coordinate_names), "units": list(linear.coordinate_units),
        "inputs": list(linear.input_names), "disturbances": list(linear.disturbance_names),
        "driven": list(linear.prescribed_coordinates),
        **{key: values.tolist() for key, _, _, values in _matrices(linear)},
    }  # fmt: skip


def dataset(linear: StateSpace) -> Any:
    """`xarray.Dataset` of the matrices with row and column names."""
    along = names(linear)
    arrays = {
        key: ((row, f"{column}2" if column == row else column), values)
        for key, row, column, values in _matrices(linear)
    }
    coords = dict(along) | {f"{key}2": along[key] for key in ("coordinate", "state")}
    return xarray().Dataset(
        arrays, {key: list(value) for key, value in coords.items()}, {"t": linear.state.t}
    )


def entries(linear: StateSpace) -> Iterator[tuple[str, ...]]:
    """Yield a header, then each nonzero entry: matrix, row, column, value."""
    along = names(linear)
    yield "matrix", "row", "column", "value"
    for key, row, column, values in _matrices(linear):
        for i, j in zip(*np.nonzero(values), strict=True):
            yield key, along[row][i], along[column][j], repr(float(values[i, j]))


def save(given: str | Path, dataset: Callable[[], Any], rows: Iterator[tuple[str, ...]]) -> Path:
    """Write the data set of `dataset()` to .nc, or rows to .csv.

    Raises SceneError for another file extension, EnvironmentFailure without the extra.
    """
    path = require_path(given)
    ending = path.suffix.lower()
    if ending not in (".nc", ".csv"):
        raise SceneError(f'file "{path}": expected a name that ends in .nc or .csv')
    built_dataset = dataset() if ending == ".nc" else None
    with replace_atomically(path) as temporary:
        if built_dataset is not None:
            built_dataset.to_netcdf(temporary, engine="h5netcdf")
            seal(temporary)
        else:
            with temporary.open("w", newline="", encoding="utf-8") as file:
                csv.writer(file).writerows(rows)
    return path


class SavedResult(AssessedResult):
    """Base of results that are saved as a data set (`to_xarray`) or as a table (`_rows`)."""

    def to_xarray(self) -> Any:
        raise NotImplementedError

    def _rows(self) -> Iterator[tuple[str, ...]]:
        raise NotImplementedError

    def save(self, path: str | Path) -> Path:
        """Save the result: .nc (extra io), or .csv with one row per value, frequency or mode.

        Raises SceneError for another file extension, EnvironmentFailure without the extra.
        """
        return save(path, self.to_xarray, self._rows())


def xarray() -> Any:
    """The package xarray with a NetCDF writer; EnvironmentFailure without the extra."""
    try:
        import h5netcdf  # noqa: F401
        import xarray as found
    except ImportError as error:
        raise missing_package_error("io", "a NetCDF file", error) from None
    return found
