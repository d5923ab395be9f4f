"""Simulation of a compiled scene: runs and their results."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from mstmm.argument_validation import require_path
from mstmm.array_validation import Array

from ..engine.compiled_scene import CompiledScene
from ..integrate.settings import Settings
from ..result.factory import result_of
from ..result.result import Result
from ..risk_checks.pre_run import PreRunFindings
from ..run.checkpoint import Checkpoint
from ..run.run_execution import RunMonitor, first_run, second_run


def simulate(
    model: CompiledScene,
    settings: Settings,
    q: Array,
    u: Array,
    *,
    seen: PreRunFindings,
    certify: bool,
    progress: Callable[[float, float], None] | None,
    checkpoint: str | Path | None,
    resume: bool,
    named: bool = True,
) -> Result:
    """Result of one run, with an error estimate from a second one if `certify`.

    See `Model.simulate`.  `seen` are the findings before the run.  Unless the user `named` the
    method, a run by `auto` that keeps to its first method is recorded as one by that method.
    """
    monitor = RunMonitor(progress, settings, runs=2 if certify else 1, named=named)
    if checkpoint is not None:
        path = require_path("checkpoint", checkpoint)
        monitor.checkpoint = Checkpoint(path, model, settings, q, u)
    run = first_run(model, settings, q, u, monitor, resume)
    run = seen.attach_to(run, q, u)
    error = second_run(model, run, q, u, monitor) if certify and run.is_comparable else None
    if monitor.notes:
        run = replace(run, notes=(*run.notes, *monitor.notes))
    result = result_of(model, run, error)
    result.checkpoint = monitor.checkpoint
    return result


def certify_result(result: Result, progress: Callable[[float, float], None] | None) -> Result:
    """Result with its error estimated by a second, more accurate run from the start."""
    run, monitor = result.trajectory, RunMonitor(progress, result.settings, runs=2)
    _, q, u = run.first
    error = second_run(result.model, run, q, u, monitor)
    run_with_notes = replace(run, notes=(*run.notes, *monitor.notes))
    certified = result_of(result.model, run_with_notes, error)
    certified.checkpoint = result.checkpoint
    return certified
