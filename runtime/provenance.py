"""Where a result comes from: scene, settings, versions, kernels; to attributes and back."""

from __future__ import annotations

import hashlib
import json
import platform
from dataclasses import asdict, fields
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np

import mstmm

from .integrate import Statistics, Status
from .simulate import Settings, Trajectory

if TYPE_CHECKING:
    from .result import Result

#: Version of the layout of a saved result.
FORMAT = 1


@cache
def kernels_hash() -> str:
    """SHA-256 of the manifest of the generated kernels: names and hashes of everything derived."""
    return hashlib.sha256(
        files("mstmm.generated").joinpath("manifest.json").read_bytes()
    ).hexdigest()


def scene_hash(result: Result) -> str:
    """SHA-256 of the scene's text with every default filled in."""
    return hashlib.sha256(result.model.scene.to_toml().encode()).hexdigest()


def versions() -> dict[str, str]:
    """Programs that took part."""
    import scipy

    return {
        "mstmm": mstmm.__version__, "numpy": np.__version__, "scipy": scipy.__version__,
        "python": platform.python_version(), "machine": platform.machine(),
    }  # fmt: skip


def attributes(result: Result) -> dict[str, Any]:
    """Attributes of the file: text, so that any reader of NetCDF shows them."""
    run = result.trajectory
    settings = asdict(run.settings)
    settings.pop("output_times")
    return {
        "format": "mstmm result",
        "format_version": FORMAT,
        "scene_sha256": scene_hash(result),
        "kernels_sha256": kernels_hash(),
        "versions": json.dumps(versions()),
        "settings": json.dumps(settings),
        "status": "INTERRUPTED" if run.status is None else run.status.name,
        "success": int(run.success),
        "message": run.message,
        "statistics": json.dumps(None if run.statistics is None else asdict(run.statistics)),
        "fail_time": np.nan if run.fail_time is None else run.fail_time,
        "notes": json.dumps(list(run.notes)),
        "norm_residual": run.norm_residual,
    }


def variables(result: Result) -> dict[str, tuple[tuple[str, ...], Any, dict[str, str]]]:
    """What is too long for an attribute, or has a dimension of its own."""
    run = result.trajectory
    scene = {"long_name": "scene as TOML, defaults filled in"}
    event = {"long_name": "-(i + 1) just before, i + 1 just after event i"}
    memory = {"long_name": "memory: releases, turns of ball and free hinges"}
    found: dict[str, tuple[tuple[str, ...], Any, dict[str, str]]] = {
        "scene": ((), result.model.scene.to_toml(), scene),
        "event": (("time",), run.event, event),
        "memory": (("time", "memory_place"), run.memory, memory),
    }
    if run.settings.output_times is not None:
        times = np.array(run.settings.output_times)
        about = {"units": "s", "long_name": "output times asked for"}
        found["output_times"] = (("output_time",), times, about)
    return found


def trajectory(data: Any) -> Trajectory:
    """The states of a saved Dataset."""
    a = data.attrs
    times = tuple(data["output_times"].values.tolist()) if "output_times" in data else None
    settings = Settings(**(json.loads(a["settings"]) | {"output_times": times}))
    statistics = json.loads(a["statistics"])
    if statistics is not None:
        statistics = Statistics(**{f.name: statistics[f.name] for f in fields(Statistics)})
    status = None if a["status"] == "INTERRUPTED" else Status[a["status"]]
    fail_time = None if np.isnan(a["fail_time"]) else float(a["fail_time"])
    t, q, u, memory, work, event = (
        np.ascontiguousarray(data[name].values)
        for name in ("time", "q", "u", "memory", "work", "event")
    )
    return Trajectory(
        t, q, u, memory, work, event.astype(np.int64), status, str(a["message"]), settings,
        statistics, fail_time, tuple(json.loads(a["notes"])), float(a["norm_residual"]),
    )  # fmt: skip
