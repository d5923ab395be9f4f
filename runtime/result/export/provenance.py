"""Provenance of a result: scene, settings, versions, kernels, mesh files; and back."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm import risk, version
from mstmm.array_validation import Array
from mstmm.plain_data import from_plain, to_plain

from ...integrate.achieved_error import from_dict
from ...integrate.c_loop import Statistics, Status
from ...integrate.settings import Settings
from ...integrate.steppers import AUTO, get
from ...integrate.steppers.alpha_family import parse_scheme
from ...kernels.prebuilt_kernels import kernels_hash
from ...run import classical_run, external_integrators
from ...run.error_estimate import ErrorEstimate
from ...run.trajectory import Trajectory, from_rows

if TYPE_CHECKING:
    from ..result_record import Record

#: Version of the layout of a saved result.
FORMAT = 1

#: Fields of an error estimate, by the names of their attributes in the file.
_ERROR_ATTRIBUTES = {
    "horizon": "divergence_time", "tenfold": "tenfold_time", "reference": "reference",
    "moved": "excursion", "covered": "covered",
}  # fmt: skip

Variable = tuple[tuple[str, ...], Any, dict[str, str]]


def scene_hash(result: Record) -> str:
    """SHA-256 of the scene's text with every default filled in."""
    return hashlib.sha256(result.model.scene.to_toml().encode()).hexdigest()


def program_versions() -> dict[str, str]:
    """Versions of the programs used."""
    import scipy

    return {
        "mstmm": version.__version__, "numpy": np.__version__, "scipy": scipy.__version__,
        "python": platform.python_version(), "machine": platform.machine(),
    }  # fmt: skip


def file_attributes(result: Record) -> dict[str, Any]:
    """File attributes as text, so that every reader of NetCDF shows them."""
    run = result.trajectory
    settings = asdict(run.settings)
    settings.pop("output_times")
    return {
        "format": "mstmm result",
        "format_version": FORMAT,
        "scene_sha256": scene_hash(result),
        "kernels_sha256": kernels_hash(result.model.known),
        "engine": result.model.engine,
        "sweep": result.model.sweep,
        "versions": json.dumps(program_versions()),
        "settings": json.dumps(settings),
        "status": "INTERRUPTED" if run.status is None else run.status.name,
        "success": int(result.success),
        "message": run.message,
        "statistics": json.dumps(to_plain(run.statistics)),
        "fail_time": np.nan if run.fail_time is None else run.fail_time,
        "notes": json.dumps(list(run.notes)),
        "risks": json.dumps(risk.to_rows(result.risks)),
        "known_risks": json.dumps(risk.to_rows(run.risks)),
        "told": int(run.reported_risks),
        "methods": json.dumps(to_plain(run.methods)),
        "error_estimate": json.dumps(
            None if run.achieved_error is None else run.achieved_error.to_dict()
        ),
        "norm_residual": run.norm_residual,
        "certificate": str(result.certificate),
    }


def provenance_variables(result: Record) -> dict[str, Variable]:
    """Provenance that is too long for an attribute, or has its own dimension."""
    run = result.trajectory
    scene = {"long_name": "scene as TOML, including defaults"}
    event = {"long_name": "-(i + 1) just before, i + 1 just after event i"}
    memory = {"long_name": "memory: releases, turns of ball and free hinges"}
    file_variables: dict[str, Variable] = {
        "scene": ((), result.model.scene.to_toml(), scene),
        "event": (("time",), run.event, event),
        "memory": (("time", "memory_place"), run.memory, memory),
    }
    if run.last_state is not None:
        description = {"units": "s", "long_name": "time of the last good state"}
        file_variables["last_t"] = ((), run.last_state[0], description)
    states = {"last": (run.last_state or ())[1:], "start": run.start or ()}
    texts = {"last": "{} of the last good state", "start": "initial {}"}
    for prefix, state in states.items():
        for name, dimension, values in zip("qu", ("coordinate", "speed"), state, strict=False):
            description = {"long_name": texts[prefix].format(name)}
            file_variables[f"{prefix}_{name}"] = ((dimension,), values, description)
    file_variables |= _error_variables(result.certificate.error)
    if run.settings.output_times is not None:
        times = np.array(run.settings.output_times)
        description = {"units": "s", "long_name": "requested output times"}
        file_variables["output_times"] = (("output_time",), times, description)
    return file_variables


def _error_variables(error: ErrorEstimate | None) -> dict[str, Variable]:
    """Estimated error over time, one column per unit."""
    if error is None:
        return {}
    long_name = "times of both runs"
    result: dict[str, Variable] = {
        "error_t": (("error_time",), error.t, {"units": "s", "long_name": long_name})
    }
    for kind in ("q", "u"):
        for k, (unit, values) in enumerate(getattr(error, kind).items()):
            long_name = f"estimated error of {kind}, largest so far"
            description = {"units": unit or "1", "long_name": long_name}
            description |= {
                key: json.dumps(getattr(error, name)) for key, name in _ERROR_ATTRIBUTES.items()
            }
            result[f"error_{kind}_{k}"] = (("error_time",), values, description)
    return result


def error_estimate(data: Any) -> ErrorEstimate | None:
    """Error estimate of a saved Dataset; None if there was none."""
    columns = [name for name in data if str(name).startswith(("error_q_", "error_u_"))]
    if not columns:
        return None
    values: dict[str, dict[str, Array]] = {"q": {}, "u": {}}
    for name in columns:
        unit = data[name].attrs["units"]
        values[str(name)[6]]["" if unit == "1" else unit] = data[name].values
    first_attributes = data[columns[0]].attrs
    other_fields = {
        name: json.loads(first_attributes[key])
        for key, name in _ERROR_ATTRIBUTES.items()
        if key in first_attributes
    }
    return ErrorEstimate(data["error_t"].values, values["q"], values["u"], **other_fields)


def _read_floats(data: Any, name: str) -> Array:
    """Values of a variable as floats; TypeError if it holds anything else."""
    values = data[name].values
    if values.dtype.kind not in "fiu":
        raise TypeError(f"{name} holds {values.dtype}, not numbers")
    return np.ascontiguousarray(values, dtype=np.float64)


def _require_number(value: Any) -> Any:
    """Require a number, a bool or None, and return it."""
    if value is not None and not isinstance(value, (int, float)):
        raise TypeError(f"{value!r} found, expected a number")
    return value


def _read_settings(stored: dict[str, Any]) -> Settings:
    """Settings from saved values; TypeError for values of the wrong type."""
    for name, value in stored.items():
        if name not in ("method", "output_times", "scheme", "tangent"):
            _require_number(value)
    method = stored["method"]
    if method not in (AUTO, *external_integrators.METHODS, *classical_run.METHODS):
        get(method)
    if method in classical_run.METHODS:
        parse_scheme(stored.get("scheme", ""))
    return Settings(**stored)


def read_trajectory(data: Any) -> Trajectory:
    """States of a saved Dataset.

    Raises KeyError, ValueError or TypeError where it was changed; the caller checks sizes.
    """
    a = data.attrs
    times = tuple(_read_floats(data, "output_times").tolist()) if "output_times" in data else None
    settings = _read_settings(json.loads(a["settings"]) | {"output_times": times})
    statistics = json.loads(a["statistics"])
    if statistics is not None:
        statistics = from_plain(
            Statistics, {key: _require_number(count) for key, count in statistics.items()}
        )
    status = None if a["status"] == "INTERRUPTED" else Status[a["status"]]
    fail_time = None if np.isnan(a["fail_time"]) else float(a["fail_time"])
    t, q, u, memory, work, event = (
        _read_floats(data, name) for name in ("time", "q", "u", "memory", "work", "event")
    )
    if t.ndim != 1 or not np.all(np.diff(t) >= 0):
        raise ValueError("its times do not increase")
    last = None
    if "last_t" in data:
        last = (float(data["last_t"]), _read_floats(data, "last_q"), _read_floats(data, "last_u"))
    start = None
    if "start_q" in data:
        start = (_read_floats(data, "start_q"), _read_floats(data, "start_u"))
    return Trajectory(
        t, q, u, memory, work, event.astype(np.int64), status, str(a["message"]), settings,
        statistics, fail_time, tuple(json.loads(a["notes"])), float(a["norm_residual"]), last,
        start, risk.from_rows(json.loads(a.get("known_risks", "[]"))),
        from_rows(json.loads(a.get("methods", "[]"))),
        from_dict(json.loads(a.get("error_estimate", "null"))), bool(a.get("told", 1)),
    )  # fmt: skip


_EncodedVariable = tuple[tuple[str, ...], Any, dict[str, str], dict[str, Any]]


def mesh_variables(result: Record) -> dict[str, _EncodedVariable]:
    """Dataset variables of mesh files: bytes, and the path as an attribute."""
    rows: dict[str, _EncodedVariable] = {}
    for k, (path, content) in enumerate(sorted(result.mesh_contents().items())):
        attributes = {"long_name": "file of a mesh that shapes are drawn by", "path": path}
        values = np.frombuffer(content, dtype=np.uint8)
        rows[f"mesh_{k}"] = ((f"mesh_{k}_byte",), values, attributes, {"zlib": True})
    return rows


def saved_meshes(data: Any) -> Mapping[str, bytes]:
    """Contents of the mesh files of a saved result by their paths in its scene."""
    names = [name for name in data if str(name).startswith("mesh_") and "path" in data[name].attrs]
    return {str(data[n].attrs["path"]): data[n].values.astype(np.uint8).tobytes() for n in names}
