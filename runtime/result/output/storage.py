"""Results into files: NetCDF through xarray and h5netcdf (extra: io), CSV and MATLAB's."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from mstmm.errors import EnvironmentFailure, SceneError
from mstmm.extras import missing

from ...host.files import replacing, seal
from ..record import Record
from .dataset import MOST_SPEEDS, dataset
from .tabled import TABLES, write


def save(result: Record, path: Path) -> Path:
    """Write a result; the suffix says how."""
    if path.suffix.lower() == ".nc":
        return save_dataset(partial(dataset, result), path)
    if path.suffix.lower() not in TABLES:
        raise SceneError(f'result file "{path}": expected a name that ends in .nc, .csv or .mat')
    if result.model.nu > MOST_SPEEDS:
        raise SceneError(
            f'result file "{path}": a table of a scene with {result.model.nu} speeds has too many '
            "columns; write .nc, or the quantities you need (result.quantity)"
        )
    quantities = [result.quantity(name) for name in result._quantities.scalars()]
    return write(result.t, result.event, quantities, path, result.model.scene.to_toml())


def save_dataset(made: Callable[[], Any], path: Path) -> Path:
    """Write a Dataset as NetCDF, with a hash of itself at its end."""
    with replacing(path) as temporary:
        _netcdf(made(), temporary)
    return path


def _netcdf(data: Any, path: Path) -> None:
    try:
        import h5netcdf  # noqa: F401
    except ImportError as error:
        raise missing("io", "a NetCDF file", error) from None
    _room_for(int(data.nbytes) + _OVERHEAD, path)
    data.to_netcdf(path, engine="h5netcdf")
    seal(path)


#: Bytes of a NetCDF file beside its arrays, generously.
_OVERHEAD = 2_000_000


def _room_for(size: int, path: Path) -> None:
    """EnvironmentFailure if the disk is too full.  HDF5 crashes the process where it runs full."""
    free = shutil.disk_usage(path.parent).free
    if free < size:
        raise EnvironmentFailure(
            f'"{path.parent}" has {free / 1e6:.1f} MB left, a NetCDF file of this result needs '
            f"{size / 1e6:.1f} MB; make room, take fewer samples or another place"
        )
