"""Simulation of a compiled scene: runs and their results."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from mstmm.argument_validation import require_path
from mstmm.array_validation import Array

from ..engine.compiled_scene import CompiledScene
from ..integrate.settings import Settings
from ..result.checks.answer_checks import apply_policy, check_start
from ..result.checks.check import RunStart
from ..result.checks.run_checks import PreRunFindings
from ..result.one_way.result import result_of
from ..result.result import Result
from ..run.checkpoint import Checkpoint
from ..run.run_execution import RunMonitor, first_run, second_run
from .error_control.tolerance_search import ToleranceSearch
from .run_request import ErrorRequest, Execution


def simulate(
    model: CompiledScene,
    settings: Settings,
    state: tuple[Array, Array],
    execution: Execution,
    request: ErrorRequest | None,
    *,
    certify: bool,
    named: bool,
) -> Result:
    """Result of a run from `state` (q, u), or of the runs for a target error; see `Model.simulate`.

    With `certify` its error is estimated by a second run.  Unless the user `named` the method, a
    run by `auto` that keeps to its first method is recorded as one by that method.
    """
    seen = check_start(RunStart(model, settings, *state), execution.on_risk)
    if request is None:
        result = _run(model, settings, state, seen, execution, certify, named)
    else:
        search = ToleranceSearch(model, settings, request, *state, seen, execution.progress)
        result = search.result()
        if certify and result.trajectory.is_comparable:
            result = certify_result(result, execution.progress)
    return apply_policy(result, execution.on_risk)


def _run(
    model: CompiledScene,
    settings: Settings,
    state: tuple[Array, Array],
    seen: PreRunFindings,
    execution: Execution,
    certify: bool,
    named: bool,
) -> Result:
    """Result of one run, with an error estimate from a second one if `certify`."""
    monitor = RunMonitor(execution.progress, settings, runs=2 if certify else 1, named=named)
    if execution.checkpoint is not None:
        path = require_path("checkpoint", execution.checkpoint)
        monitor.checkpoint = Checkpoint(path, model, settings, *state)
    run = first_run(model, settings, *state, monitor, execution.resume)
    run = seen.attach_to(run)
    error = second_run(model, run, *state, monitor) if certify and run.is_comparable else None
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
