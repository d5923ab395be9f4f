"""Result files: NetCDF through xarray and h5netcdf (extra: io), CSV and MATLAB."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from mstmm.errors import EnvironmentFailure, SceneError
from mstmm.optional_packages import missing_package_error

from ...platform_support.safe_files import replace_atomically, seal
from ..result_record import Record
from .csv_and_mat import TABLES, write_table
from .xarray_dataset import MAX_SPEEDS, to_dataset


def save_result(result: Record, path: Path) -> Path:
    """Write a result in the format given by the suffix."""
    if path.suffix.lower() == ".nc":
        return save_dataset(partial(to_dataset, result), path)
    if path.suffix.lower() not in TABLES:
        raise SceneError(f'result file "{path}": expected a name that ends in .nc, .csv or .mat')
    if result.model.nu > MAX_SPEEDS:
        raise SceneError(
            f'result file "{path}": a table of a scene with {result.model.nu} speeds has too many '
            "columns; write .nc, or the quantities you need (result.quantity)"
        )
    quantities = [result.quantity(name) for name in result._quantities.scalars()]
    return write_table(result.t, result.event, quantities, path, result.model.scene.to_toml())


def save_dataset(build_dataset: Callable[[], Any], path: Path) -> Path:
    """Write a Dataset as NetCDF, followed by its hash."""
    with replace_atomically(path) as temporary:
        _write_netcdf(build_dataset(), temporary)
    return path


def _write_netcdf(data: Any, path: Path) -> None:
    try:
        import h5netcdf  # noqa: F401
    except ImportError as error:
        raise missing_package_error("io", "a NetCDF file", error) from None
    _require_disk_space(int(data.nbytes) + _NETCDF_OVERHEAD, path)
    data.to_netcdf(path, engine="h5netcdf")
    seal(path)


#: Upper bound of the bytes of a NetCDF file in addition to its arrays.
_NETCDF_OVERHEAD = 2_000_000


def _require_disk_space(size: int, path: Path) -> None:
    """EnvironmentFailure if the disk is too full, because HDF5 crashes the process then."""
    free = shutil.disk_usage(path.parent).free
    if free < size:
        raise EnvironmentFailure(
            f'"{path.parent}" has {free / 1e6:.1f} MB left, a NetCDF file of this result needs '
            f"{size / 1e6:.1f} MB; make room, take fewer samples or another place"
        )
