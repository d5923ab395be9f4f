"""Where a result comes from: scene, settings, versions, kernels; to attributes and back."""

from __future__ import annotations

import hashlib
import json
import platform
from dataclasses import asdict, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm import risk, version
from mstmm.arrays import Array

from ...classical.schemes import scheme_of
from ...integrate.loop import Statistics, Status
from ...integrate.reached import from_dict
from ...integrate.settings import Settings
from ...integrate.steppers import AUTO, get
from ...kernels.identity import kernels_hash
from ...run import classical, second_opinion
from ...run.error_estimate import ErrorEstimate
from ...run.stretches import from_rows
from ...run.trajectory import Trajectory

if TYPE_CHECKING:
    from ..record import Record

#: Version of the layout of a saved result.
FORMAT = 1

_ERROR = ("horizon", "tenfold", "reference", "moved", "covered")

Variable = tuple[tuple[str, ...], Any, dict[str, str]]


def scene_hash(result: Record) -> str:
    """SHA-256 of the scene's text with every default filled in."""
    return hashlib.sha256(result.model.scene.to_toml().encode()).hexdigest()


def versions() -> dict[str, str]:
    """Versions of the programs used."""
    import scipy

    return {
        "mstmm": version.__version__, "numpy": np.__version__, "scipy": scipy.__version__,
        "python": platform.python_version(), "machine": platform.machine(),
    }  # fmt: skip


def attributes(result: Record) -> dict[str, Any]:
    """Attributes of the file: text, so that any reader of NetCDF shows them."""
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
        "versions": json.dumps(versions()),
        "settings": json.dumps(settings),
        "status": "INTERRUPTED" if run.status is None else run.status.name,
        "success": int(result.success),
        "message": run.message,
        "statistics": json.dumps(None if run.statistics is None else asdict(run.statistics)),
        "fail_time": np.nan if run.fail_time is None else run.fail_time,
        "notes": json.dumps(list(run.notes)),
        "risks": json.dumps(risk.to_rows(result.risks)),
        "known_risks": json.dumps(risk.to_rows(run.risks)),
        "told": int(run.told),
        "methods": json.dumps([asdict(stretch) for stretch in run.methods]),
        "error_estimate": json.dumps(None if run.reached is None else run.reached.to_dict()),
        "norm_residual": run.norm_residual,
        "certificate": str(result.certificate),
    }


def variables(result: Record) -> dict[str, Variable]:
    """What is too long for an attribute, or has a dimension of its own."""
    run = result.trajectory
    scene = {"long_name": "scene as TOML, defaults filled in"}
    event = {"long_name": "-(i + 1) just before, i + 1 just after event i"}
    memory = {"long_name": "memory: releases, turns of ball and free hinges"}
    found: dict[str, Variable] = {
        "scene": ((), result.model.scene.to_toml(), scene),
        "event": (("time",), run.event, event),
        "memory": (("time", "memory_place"), run.memory, memory),
    }
    if run.last is not None:
        about = {"units": "s", "long_name": "time of the last good state"}
        found["last_t"] = ((), run.last[0], about)
        found["last_q"] = (("coordinate",), run.last[1], {"long_name": "q of the last good state"})
        found["last_u"] = (("speed",), run.last[2], {"long_name": "u of the last good state"})
    if run.start is not None:
        for name, values, of in zip("qu", run.start, ("coordinate", "speed"), strict=True):
            found[f"start_{name}"] = ((of,), values, {"long_name": f"{name} at the beginning"})
    found |= _error(result.certificate.error)
    if run.settings.output_times is not None:
        times = np.array(run.settings.output_times)
        about = {"units": "s", "long_name": "output times asked for"}
        found["output_times"] = (("output_time",), times, about)
    return found


def _error(error: ErrorEstimate | None) -> dict[str, Variable]:
    """The estimated error over time, one column per unit."""
    if error is None:
        return {}
    long_name = "times that both runs reached"
    found: dict[str, Variable] = {
        "error_t": (("error_time",), error.t, {"units": "s", "long_name": long_name})
    }
    for kind in ("q", "u"):
        for k, (unit, values) in enumerate(getattr(error, kind).items()):
            long_name = f"estimated error of {kind}, largest so far"
            about = {"units": unit or "1", "long_name": long_name}
            about |= {name: json.dumps(getattr(error, name)) for name in _ERROR}
            found[f"error_{kind}_{k}"] = (("error_time",), values, about)
    return found


def error(data: Any) -> ErrorEstimate | None:
    """The estimate again; None if there was none."""
    columns = [name for name in data if str(name).startswith(("error_q_", "error_u_"))]
    if not columns:
        return None
    values: dict[str, dict[str, Array]] = {"q": {}, "u": {}}
    for name in columns:
        unit = data[name].attrs["units"]
        values[str(name)[6]]["" if unit == "1" else unit] = data[name].values
    kept = data[columns[0]].attrs
    rest = {name: json.loads(kept[name]) for name in _ERROR if name in kept}
    return ErrorEstimate(data["error_t"].values, values["q"], values["u"], **rest)


def _floats(data: Any, name: str) -> Array:
    """A variable as numbers; TypeError if it holds anything else."""
    values = data[name].values
    if values.dtype.kind not in "fiu":
        raise TypeError(f"{name} holds {values.dtype}, not numbers")
    return np.ascontiguousarray(values, dtype=np.float64)


def _number(value: Any) -> Any:
    """The same, if it is a number, a truth value or None."""
    if value is not None and not isinstance(value, (int, float)):
        raise TypeError(f"{value!r} stands where a number was")
    return value


def _settings(found: dict[str, Any]) -> Settings:
    """Settings of values that are of the kind that settings have."""
    for name, value in found.items():
        if name not in ("method", "output_times", "scheme", "tangent"):
            _number(value)
    method = found["method"]
    if method not in (AUTO, *second_opinion.METHODS, *classical.METHODS):
        get(method)
    if method in classical.METHODS:
        scheme_of(found.get("scheme", ""))
    return Settings(**found)


def trajectory(data: Any) -> Trajectory:
    """The states of a saved Dataset.

    Raises KeyError, ValueError or TypeError where it was changed; sizes are the caller's affair.
    """
    a = data.attrs
    times = tuple(_floats(data, "output_times").tolist()) if "output_times" in data else None
    settings = _settings(json.loads(a["settings"]) | {"output_times": times})
    statistics = json.loads(a["statistics"])
    if statistics is not None:
        later = ("crossings", "residuals", "tangents", "solves", "iterations",
                 "laws_tangents")  # fmt: skip
        known = dict.fromkeys(later, 0) | statistics  # older files do not tell of them
        statistics = Statistics(**{f.name: _number(known[f.name]) for f in fields(Statistics)})
    status = None if a["status"] == "INTERRUPTED" else Status[a["status"]]
    fail_time = None if np.isnan(a["fail_time"]) else float(a["fail_time"])
    t, q, u, memory, work, event = (
        _floats(data, name) for name in ("time", "q", "u", "memory", "work", "event")
    )
    if t.ndim != 1 or not np.all(np.diff(t) >= 0):
        raise ValueError("its times do not increase")
    last = None
    if "last_t" in data:
        last = (float(data["last_t"]), _floats(data, "last_q"), _floats(data, "last_u"))
    start = None
    if "start_q" in data:
        start = (_floats(data, "start_q"), _floats(data, "start_u"))
    return Trajectory(
        t, q, u, memory, work, event.astype(np.int64), status, str(a["message"]), settings,
        statistics, fail_time, tuple(json.loads(a["notes"])), float(a["norm_residual"]), last,
        start, risk.from_rows(json.loads(a.get("known_risks", "[]"))),
        from_rows(json.loads(a.get("methods", "[]"))),
        from_dict(json.loads(a.get("error_estimate", "null"))), bool(a.get("told", 1)),
    )  # fmt: skip
