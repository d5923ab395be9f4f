"""Linear models as dictionaries, tables and NetCDF files (extra: io)."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.errors import SceneError
from mstmm.optional_packages import missing_package_error

from ..platform_support.safe_files import replace_atomically, require_path, seal

if TYPE_CHECKING:
    from .state_space import StateSpace

#: Saved matrices of a linear model: name, row dimension and column dimension.
MATRICES = (
    ("M", "coordinate", "coordinate"), ("C", "coordinate", "coordinate"),
    ("K", "coordinate", "coordinate"), ("damping", "coordinate", "coordinate"),
    ("gyroscopic", "coordinate", "coordinate"), ("elastic", "coordinate", "coordinate"),
    ("geometric", "coordinate", "coordinate"), ("load", "coordinate", "coordinate"),
    ("C_driven", "coordinate", "drive"), ("K_driven", "coordinate", "drive"),
    ("V", "coordinate", "input"), ("W", "coordinate", "disturbance"), ("A", "state", "state"),
    ("B", "state", "input"), ("B_disturbances", "state", "disturbance"),
)  # fmt: skip


def names(linear: StateSpace) -> dict[str, tuple[str, ...]]:
    """Names along each dimension of the matrices."""
    return {
        "coordinate": linear.coordinates, "state": linear.states, "input": linear.inputs,
        "disturbance": linear.disturbances, "drive": linear.driven,
    }  # fmt: skip


def _there(linear: StateSpace) -> list[tuple[str, str, str]]:
    """Entries of `MATRICES` that the model has."""
    return [one for one in MATRICES if linear.has_stiffness or "state" in one[1:]]


def dictionary(linear: StateSpace) -> dict[str, Any]:
    """Names, state and matrices of a linear model as a dictionary for JSON."""
    state = linear.state
    return {
        "t": state.t, "q": state.q.tolist(), "u": state.u.tolist(),
        "coordinates": list(linear.coordinates), "units": list(linear.units),
        "inputs": list(linear.inputs), "disturbances": list(linear.disturbances),
        "driven": list(linear.driven),
        **{key: getattr(linear, key).tolist() for key, _, _ in _there(linear)},
    }  # fmt: skip


def dataset(linear: StateSpace) -> Any:
    """`xarray.Dataset` of the matrices with row and column names."""
    along = names(linear)
    arrays = {
        key: ((row, f"{column}2" if column == row else column), getattr(linear, key))
        for key, row, column in _there(linear)
    }
    coords = dict(along) | {f"{key}2": along[key] for key in ("coordinate", "state")}
    return xarray().Dataset(
        arrays, {key: list(value) for key, value in coords.items()}, {"t": linear.state.t}
    )


def entries(linear: StateSpace) -> Iterator[tuple[str, ...]]:
    """Yield a header, then each nonzero entry: matrix, row, column, value."""
    along = names(linear)
    yield "matrix", "row", "column", "value"
    for key, row, column in _there(linear):
        values = getattr(linear, key)
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
    made = dataset() if ending == ".nc" else None
    with replace_atomically(path) as temporary:
        if made is not None:
            made.to_netcdf(temporary, engine="h5netcdf")
            seal(temporary)
        else:
            with temporary.open("w", newline="", encoding="utf-8") as file:
                csv.writer(file).writerows(rows)
    return path


def xarray() -> Any:
    """The package xarray with a NetCDF writer; EnvironmentFailure without the extra."""
    try:
        import h5netcdf  # noqa: F401
        import xarray as found
    except ImportError as error:
        raise missing_package_error("io", "a NetCDF file", error) from None
    return found
