"""Loading of results from files, whose scenes are validated and compiled again."""

from __future__ import annotations

import gc
import sys
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from mstmm.argument_validation import require_path
from mstmm.errors import MstmmError, SceneError
from mstmm.optional_packages import missing_package_error
from mstmm.scene import Scene

from ..engine.fused_code import NoFusedCode
from ..kernels import kernel_store
from ..kernels.prebuilt_kernels import kernels_hash
from ..platform_support.safe_files import require_regular_file, seal_is_broken
from ..result.batch_result import BATCH_FORMAT
from ..result.export import provenance
from ..result.export.column_files import READERS, ColumnFile
from ..result.one_way.result import result_of
from ..result.result import Result
from ..result.result_record import Record
from ..run.trajectory import Trajectory
from .model import Model


def load_result(path: str | Path) -> Result | ColumnFile:
    """Load a saved result from a file.

    From NetCDF with its scene compiled again, so that every quantity is available; from CSV and
    MATLAB files (.csv, .mat) only the columns, which can be plotted and compared.

    Raises SceneError if the file is not a result, EnvironmentFailure without the extra io.
    """
    path = require_path("result file", path)
    require_regular_file(path, "result file")
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        return load_netcdf(path)
    if not path.is_file():
        raise SceneError(f'result file "{path}": there is no such file')
    columns = reader(path)
    columns.lost = frozenset({*dir(Result), *Record.__annotations__}) - frozenset(dir(columns))
    return columns


def load_netcdf(path: Path) -> Result:
    """Load a result saved as NetCDF; see `load_result`."""
    require_regular_file(path, "result file")
    try:
        import h5netcdf  # noqa: F401
        import xarray
    except ImportError as error:
        raise missing_package_error("io", "a NetCDF file", error) from None
    if not path.is_file():
        raise SceneError(f'result file "{path}": there is no such file')
    if seal_is_broken(path):  # before HDF5, which may crash or hang on such a file
        raise SceneError(
            f'result file "{path}": file corrupt or modified; regenerate it, or save your changes '
            "to another file"
        )
    data = _read_dataset(xarray, path)
    if data.attrs.get("format") == BATCH_FORMAT:
        raise SceneError(
            f'result file "{path}": this is a batch of runs; open it as a Dataset: '
            'xarray.open_dataset(path, engine="h5netcdf")'
        )
    if data.attrs.get("format") != "mstmm result" or "scene" not in data:
        raise SceneError(f'result file "{path}": not a result of mstmm')
    try:
        if int(data.attrs["format_version"]) > provenance.FORMAT:
            raise SceneError(
                f'result file "{path}": written by a newer mstmm; install that version'
            )
        return _rebuild_result(data, path)
    except MstmmError as error:
        if str(path) in str(error):
            raise
        raise SceneError(f'result file "{path}": {error}') from None
    except _CORRUPT_DATA_ERRORS as error:
        raise SceneError(
            f'result file "{path}": file corrupt or modified ({type(error).__name__}: {error}); '
            "regenerate it"
        ) from None


#: Exceptions due to numbers and texts that differ from those written.
_CORRUPT_DATA_ERRORS = (KeyError, ValueError, TypeError, AttributeError, IndexError, OverflowError)


def _read_dataset(xarray: Any, path: Path) -> Any:
    """Dataset of a file; raises SceneError for any error of the libraries in a corrupt file.

    Incomplete objects of the libraries report errors when they are deleted; they are deleted here,
    with the reports suppressed.
    """
    previous, sys.unraisablehook = sys.unraisablehook, lambda _: None
    try:
        try:
            with xarray.open_dataset(path, engine="h5netcdf", decode_times=False) as file:
                return file.load()
        except Exception as error:
            reason = str(error)
        gc.collect()  # the exception no longer refers to them
    finally:
        sys.unraisablehook = previous
    raise SceneError(f'result file "{path}": not a NetCDF file ({reason})')


def _with_missing_memory(model: Model, run: Trajectory) -> Trajectory:
    """Run with the columns of memory that older files do not have, as zeros.

    Until 2026-11-24: whether a step of a scene with loops ended near a singular pose; until
    2026-11-29: which rows are at rest.  Older runs did not depend on them.
    """
    system, rows = model.packed_scene.system, run.memory
    missing = [system.strain_index] * (system.strain_index >= 0), [*system.inactive_row_indices]
    for places in (missing[1], missing[0] + missing[1]):
        if places and rows.ndim == 2 and rows.shape[1] == system.n_memory - len(places):
            extended = np.zeros((len(rows), system.n_memory))
            extended[:, np.setdiff1d(np.arange(system.n_memory), places)] = rows
            return replace(run, memory=extended)
    return run


def _has_valid_sizes(model: Model, run: Trajectory) -> bool:
    """Whether all arrays of a run have the sizes that the scene and the samples imply."""
    n, memory = len(run.t), model.packed_scene.system.n_memory
    expected = {
        "q": (n, model.nq), "u": (n, model.nu), "memory": (n, memory), "work": (n,), "event": (n,),
    }  # fmt: skip
    states = [run.last_state[1:] if run.last_state is not None else None, run.start]
    states_fit = all(
        (q.shape, u.shape) == ((model.nq,), (model.nu,)) for q, u in filter(None, states)
    )
    return states_fit and all(getattr(run, name).shape == shape for name, shape in expected.items())


def _rebuild_result(data: Any, path: Path) -> Result:
    """Result of a saved run: scene and model compiled again, trajectory from the file.

    Raises one of _CORRUPT_DATA_ERRORS where numbers are missing or of another kind or size.
    """
    scene = Scene.from_data(tomllib.loads(str(data["scene"].item())), f"{path}: scene")
    elements, definitions = kernel_store.load_known(kernel_store.required_types(scene))
    scene.check_types(definitions)
    model = Model(scene, known=elements, sweep=data.attrs.get("sweep", "riccati"))
    model.fusion = NoFusedCode(f"the saved run was made by the {data.attrs['engine']} one")
    run = _with_missing_memory(model, provenance.read_trajectory(data))
    if not _has_valid_sizes(model, run):
        raise SceneError(f'result file "{path}": its states do not fit its scene')
    if data.attrs["kernels_sha256"] != kernels_hash(model.known):
        note = "saved with other kernels: quantities beyond q and u come from the present ones"
        run = replace(run, notes=(*run.notes, note))
    result = result_of(model, run, provenance.error_estimate(data))
    result.meshes = provenance.saved_meshes(data)
    return result
