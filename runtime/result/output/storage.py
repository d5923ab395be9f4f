"""Results into files: NetCDF through xarray and h5netcdf (extra: io), and CSV."""

from __future__ import annotations

import csv
import shutil
from collections.abc import Callable
from pathlib import Path

from mstmm.errors import EnvironmentFailure, SceneError
from mstmm.extras import missing

from ...host.files import replacing, seal
from ..record import Record
from .dataset import MOST_SPEEDS, dataset


def save(result: Record, path: Path) -> Path:
    """Write a result; the suffix says how."""
    writers: dict[str, Callable[[Record, Path], None]] = {".nc": _netcdf, ".csv": _csv}
    writer = writers.get(path.suffix.lower())
    if writer is None:
        raise SceneError(f'result file "{path}": expected a name that ends in .nc or .csv')
    with replacing(path) as temporary:
        writer(result, temporary)
    return path


def _netcdf(result: Record, path: Path) -> None:
    data = dataset(result)
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


def _csv(result: Record, path: Path) -> None:
    """One row per sample, one column per number; the header holds names and units."""
    if result.model.nu > MOST_SPEEDS:
        raise SceneError(
            f'result file "{path}": a table of a scene with {result.model.nu} speeds has too many '
            "columns; write .nc, or the quantities you need (result.quantity)"
        )
    quantities = [result.quantity(name) for name in result._quantities.scalars()]
    header = ["time [s]", "event"]
    header += [f"{q.name} [{q.unit}]" if q.unit else q.name for q in quantities]
    columns = [result.t.tolist(), result.event.tolist(), *(q.values.tolist() for q in quantities)]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(header)
        writer.writerows(zip(*columns, strict=True))
