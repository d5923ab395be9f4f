"""Choice of the result class for a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .result import Result

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..run.error_estimate import ErrorEstimate
    from ..run.trajectory import Trajectory


def result_of(model: CompiledScene, run: Trajectory, error: ErrorEstimate | None = None) -> Result:
    """Build the result of a run, with elastic responses where bodies are one-way."""
    expanded = model.packed_scene.expanded
    rigid = None if expanded is None else expanded.rigidified
    if rigid is None or not rigid.one_way:
        return Result(model, run, error)
    from .one_way.result import OneWayResult

    return OneWayResult(model, run, error)
