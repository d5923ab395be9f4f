"""From a compiled scene to a result, by a run."""

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
    """One run, and a second one where its error is asked for; see `Model.simulate`.  `seen` is what
    a look at it has found; unless its method was `named`, a run by `auto` that has kept to its
    first one is recorded as one by that."""
    watch = RunMonitor(progress, settings, runs=2 if certify else 1, named=named)
    if checkpoint is not None:
        watch.checkpoint = Checkpoint(require_path("checkpoint", checkpoint), model, settings, q, u)
    run = first_run(model, settings, q, u, watch, resume)
    run = seen.given(run, q, u)
    error = second_run(model, run, q, u, watch) if certify and run.is_comparable else None
    if watch.notes:
        run = replace(run, notes=(*run.notes, *watch.notes))
    result = result_of(model, run, error)
    result.checkpoint = watch.checkpoint
    return result


def certify_result(result: Result, progress: Callable[[float, float], None] | None) -> Result:
    """The same result with its error estimated by a second, more accurate run from the start."""
    run, watch = result.trajectory, RunMonitor(progress, result.settings, runs=2)
    _, q, u = run.first
    error = second_run(result.model, run, q, u, watch)
    noted = replace(run, notes=(*run.notes, *watch.notes))
    made = result_of(result.model, noted, error)
    made.checkpoint = result.checkpoint
    return made
