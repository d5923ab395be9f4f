"""Batches: independent runs of a model in SIMD lanes and on several threads.

Where the scene has fused code and neither events, releases, memory nor drives, each thread advances
as many trajectories at a time as a vector has lanes, each with its own error control.  Other scenes
run one trajectory after the other on each thread.  The choice depends only on the scene and the
machine, so that the numbers of a trajectory do not depend on the size of the batch, on the other
trajectories or on the number of threads.
"""

from __future__ import annotations

import math
import os
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mstmm.array_validation import (
    Array,
    batch,
    finite_array,
    mapping_by_name,
    split_state,
    thread_count,
)
from mstmm.errors import MstmmError, SceneError

from ..discontinuities.active_expressions import active_expressions
from ..integrate.c_loop import Failure, Integrator, Status, failure_text
from ..integrate.settings import Settings, validate
from ..integrate.steppers import AUTO, check_size, check_steps, get
from ..packing.event_functions import has_switches
from ..packing.scene_parameters import with_parameters
from . import classical_run, external_integrators
from .batch_inputs import BatchInput, BatchInputs, batch_inputs, row_count
from .batch_lanes import LaneInputs, Lanes, run_lanes, run_on_threads
from .integration_run import (
    advance,
    make_run,
    method_choice,
    project_samples,
    status_message,
    trajectory,
)
from .scene_system import SceneCode, SceneSystem
from .trajectory import MethodSegment

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..kernels.scene_libraries import FusedLibrary


@dataclass(frozen=True)
class BatchModels:
    """Models of the runs, with their parameters and inputs."""

    models: tuple[CompiledScene, ...]
    inputs: BatchInputs

    def model_of_run(self, k: int) -> CompiledScene:
        """Model of run k."""
        return self.inputs.model(self.models[k], k)


@dataclass(frozen=True)
class BatchData:
    """Result of n runs.

    Attributes:
        t: (m,) output times in s.
        q: (n, m, nq) coordinates, nan at times that a trajectory did not reach.
        u: (n, m, nu) speeds, likewise.
        success: (n,) True where a run reached its end, or an event stopped it.
        messages: n sentences; for a failure cause, time and element.
        evaluations: (n,) calls of the right-hand side.
        engine: description of the computation.
        methods: for each run the segments of method "auto", else empty.
        memory: (n, m, memory) of events, turns and controllers.
        settings: of all runs.
        models: models of the runs.
    """

    t: Array
    q: Array
    u: Array
    success: NDArray[np.bool_]
    messages: tuple[str, ...]
    evaluations: NDArray[np.int64]
    engine: str
    methods: tuple[tuple[MethodSegment, ...], ...]
    memory: Array
    settings: Settings
    models: BatchModels

    def __repr__(self) -> str:
        count = f"{int(self.success.sum())} of {len(self.success)}"
        return f"<{type(self).__name__}: {count} runs succeeded>"


@dataclass
class _BatchArrays:
    """Arrays of a batch, to which each thread writes the rows of its trajectories."""

    samples: Array  # (n, m, nq + nu)
    success: NDArray[np.bool_]
    messages: list[str]
    evaluations: NDArray[np.int64]
    methods: list[tuple[MethodSegment, ...]]
    memory: Array  # (n, m, memory)


def simulate_batch(
    model: CompiledScene,
    settings: Settings,
    q: Array,
    u: Array,
    parameters: Mapping[str, ArrayLike],
    inputs: Mapping[str, BatchInput] | None,
    threads: int | None,
) -> BatchData:
    """See `Model.simulate_batch`; settings hold the output times."""
    if len(q) == 1:  # a single initial state serves all parameters and inputs
        given = {} if inputs is None else mapping_by_name("inputs", inputs)
        given |= mapping_by_name("parameters", parameters)
        n = max([1, *(row_count(name, value) for name, value in given.items())])
        q, u = np.repeat(q, n, axis=0), np.repeat(u, n, axis=0)
    n, times = len(q), np.asarray(settings.output_times)
    made, given_inputs = _models_or_errors(model, parameters, n), batch_inputs(model, inputs, n)
    models = [model if isinstance(m, MstmmError) else m for m in made]
    failed = np.array([isinstance(m, MstmmError) for m in made], bool)
    is_sequential = settings.method == AUTO or get(settings.method).implicit
    is_sequential = is_sequential or (n > 0 and given_inputs.moves_breaks(model))
    library = None if is_sequential else _lane_library(model)
    count = min(thread_count(threads) or os.cpu_count() or 1, max(1, n))
    arrays = _BatchArrays(
        np.full((n, len(times), model.nq + model.nu), np.nan), np.zeros(n, dtype=bool),
        [str(m) if isinstance(m, MstmmError) else "" for m in made],
        np.zeros(n, dtype=np.int64), [()] * n,
        np.full((n, len(times), model.packed_scene.system.n_memory), np.nan),
    )  # fmt: skip
    same_times = _has_same_times(model, models, settings)
    closes = model.packed_scene.system.has_loops  # loops are closed with the parameters of `model`
    in_lanes = np.array([library is not None and same_times[id(m)] and m.fusion.lanes is library
                         and (m is model or not closes) for m in models], bool)  # fmt: skip
    in_lanes &= ~failed
    if library is not None and in_lanes.any():
        rows = np.flatnonzero(in_lanes)
        _run_in_lanes(model, library, models, given_inputs, settings, q, u, rows, arrays, count)
    rows = np.flatnonzero(~(in_lanes | failed))
    if len(rows):
        _run_sequentially(models, given_inputs, settings, q, u, rows, arrays, count)
    order = "one after the other" if library is None else f"{library.lanes} side by side"
    nq = model.nq
    return BatchData(
        times, arrays.samples[..., :nq].copy(), arrays.samples[..., nq:].copy(), arrays.success,
        tuple(arrays.messages), arrays.evaluations, f"{order} on {count} threads",
        tuple(arrays.methods), arrays.memory, settings, BatchModels(tuple(models), given_inputs),
    )  # fmt: skip


def _models_or_errors(
    model: CompiledScene, parameters: Mapping[str, ArrayLike], n: int
) -> list[CompiledScene | MstmmError]:
    """Model of each trajectory, or the error that prevents it, such as loops that stay open.

    Equal parameters share a model.  Raises SceneError for a name or a value that the scene rejects,
    with the number of the trajectory.
    """
    if not parameters:
        return [model] * n
    columns = {}
    for name, values in mapping_by_name("parameters", parameters).items():
        column = finite_array(f'parameter "{name}"', values)
        if column.shape not in ((), (n,)):
            raise SceneError(f'parameter "{name}" has shape {column.shape}, expected ({n},)')
        columns[name] = np.broadcast_to(column, (n,))
    by_parameters: dict[tuple[float, ...], CompiledScene | MstmmError] = {}
    models = []
    for i in range(n):
        row = tuple(float(column[i]) for column in columns.values())
        if row not in by_parameters:
            by_parameters[row] = _model_or_error(model, dict(zip(columns, row, strict=True)), i)
        models.append(by_parameters[row])
    return models


def _model_or_error(
    model: CompiledScene, values: dict[str, float], i: int
) -> CompiledScene | MstmmError:
    try:
        return model.with_parameters(values)
    except MstmmError as error:
        try:
            with_parameters(model.scene, values)
        except SceneError as scene_error:
            raise SceneError(f"trajectory {i}: {scene_error}") from None
        return error


def _has_same_times(
    model: CompiledScene, models: list[CompiledScene], settings: Settings
) -> dict[int, bool]:
    """Id of each model -> True if its expressions switch at the same times as those of `model`.

    The steps of all lanes end at the same breaks.
    """

    def times(m: CompiledScene) -> list[list[float]]:
        time_map = m.packed_scene.time_map(settings.t_start, settings.t_end)
        return [time_map.breaks.tolist(), time_map.starts.tolist(), time_map.longest.tolist()]

    expressions = active_expressions(model.scene)
    return {
        key: active_expressions(m.scene) == expressions or times(m) == times(model)
        for key, m in {id(m): m for m in models}.items()
    }


def _lane_library(model: CompiledScene) -> FusedLibrary | None:
    """Fused code for SIMD lanes; None for scenes whose trajectories cannot run in lanes."""
    packed = model.packed_scene
    if has_switches(packed.scene):
        return None
    if packed.system.uses_memory or packed.scene.events or packed.system.driven:
        return None
    return model.fusion.ready_lanes(math.inf)


def _run_in_lanes(
    model: CompiledScene, library: FusedLibrary, models: list[CompiledScene],
    given_inputs: BatchInputs, settings: Settings, q: Array, u: Array, rows: NDArray[np.int64],
    arrays: _BatchArrays, threads: int,
) -> None:  # fmt: skip
    engine = given_inputs.with_times(model).looped
    code = _sequential_code(model, settings) if model.packed_scene.system.has_loops else None
    systems = [SceneSystem(engine, code, with_power=False) for _ in range(threads)]
    start = np.ascontiguousarray(np.concatenate([q[rows], u[rows]], axis=1))
    start_times = np.full(len(start), settings.t_start)
    start, _ = project_samples(systems[0], start_times, start, np.zeros((len(start), 1)))
    numbers = np.ascontiguousarray([models[i].fusion.numbers for i in rows])
    channels = [
        list((models[i].packed_scene.channels | given_inputs.rows[i]).values()) for i in rows
    ]
    lane_inputs = LaneInputs(engine, model.fusion.inputs, channels, numbers)
    lanes = Lanes(engine, library, settings, systems, numbers, model.nq + model.nu, lane_inputs)
    samples, outcomes = run_lanes(lanes, start)
    for i, trajectory_samples, outcome in zip(rows, samples, outcomes, strict=True):
        arrays.samples[i] = trajectory_samples
        status = Status(outcome.status)
        arrays.evaluations[i] = outcome.evaluations
        arrays.success[i] = status is Status.FINISHED
        span = settings.t_start, settings.t_end
        arrays.messages[i] = _lane_message(models[i], library, systems[0], outcome, span)
    flat = arrays.samples[rows].reshape(-1, model.nq + model.nu)
    times = np.tile(np.asarray(settings.output_times), len(rows))
    flat, _ = project_samples(systems[0], times, flat, np.zeros((len(flat), 1)))
    arrays.samples[rows] = flat.reshape(len(rows), -1, model.nq + model.nu)


def _lane_message(
    model: CompiledScene, library: FusedLibrary, system: SceneSystem, outcome: Any,
    span: tuple[float, float],
) -> str:  # fmt: skip
    status = Status(outcome.status)
    if status is Status.FINISHED:
        return f"finished at t = {outcome.t:.9g} s"
    last = f"; last good state at t = {outcome.t:.9g} s"
    if status is Status.RHS_FAILED:
        reason, element, code = library.failures[outcome.code - 1]
        failure = model.looped.ffi.new("mstmm_failure *", [reason, element, code])
        return model.looped.failure_text(failure, outcome.fail_time) + last
    component = None if outcome.component < 0 else int(outcome.component)
    failure = Failure(status, float(outcome.fail_time), component, None, int(outcome.code))
    unknown_cause = status in (Status.NOT_FINITE, Status.ACCEPT_FAILED)
    hint = "simulate this trajectory alone to find the cause" if unknown_cause else ""
    if status is Status.POLE and (pole := model.packed_scene.time_map(*span).pole):
        hint = pole[1]
    return failure_text(failure, system.components(), cause=hint) + last


def _run_sequentially(
    models: list[CompiledScene], given_inputs: BatchInputs, settings: Settings, q: Array, u: Array,
    rows: NDArray[np.int64], arrays: _BatchArrays, threads: int,
) -> None:  # fmt: skip
    codes = {id(m): _sequential_code(m, settings) for m in models}
    stop = threading.Event()

    def check_stop(_: Integrator) -> None:
        if stop.is_set():
            raise _BatchStopped

    def run(i: int) -> None:
        try:
            model, code = given_inputs.model(models[i], i), codes[id(models[i])]
            if code is not None:
                code = replace(code, numbers=model.fusion.numbers)
            _run_trajectory(model, code, settings, q[i], u[i], i, arrays, check_stop)
        except _BatchStopped:
            return
        except MstmmError as error:  # the failure of one trajectory does not end the batch
            arrays.messages[i] = str(error)

    run_on_threads(run, rows.tolist(), threads, stop)


class _BatchStopped(Exception):
    """The batch was interrupted or has failed."""


def _sequential_code(model: CompiledScene, settings: Settings) -> SceneCode | None:
    """Fused code for one state at a time, built before the threads start; None without code."""
    library = model.fusion.ready(math.inf)
    if library is None:
        return None
    is_implicit = settings.method == AUTO or get(settings.method).implicit
    implicit = model.fusion.ready_implicit(math.inf) if is_implicit else None
    fusion = model.fusion
    return SceneCode(library, None, fusion.numbers, fusion.inputs, lambda: implicit)


def _run_trajectory(
    model: CompiledScene, code: SceneCode | None, settings: Settings, q: Array, u: Array,
    i: int, arrays: _BatchArrays, check_stop: Callable[[Integrator], None],
) -> None:  # fmt: skip
    system = SceneSystem(model.looped, code, with_power=False)
    run = make_run(system, settings, q, u)
    choice = method_choice(system, settings, run)
    status = advance(run, check_stop, choice=choice)
    result = trajectory(system, run, settings, status, status_message(system, run, status))
    columns = np.searchsorted(np.asarray(settings.output_times), result.t)
    arrays.samples[i, columns] = np.concatenate([result.q, result.u], axis=1)
    arrays.memory[i, columns] = result.memory
    arrays.success[i], arrays.messages[i] = result.success, result.message
    arrays.evaluations[i] = result.statistics.evaluations
    arrays.methods[i] = () if choice is None else tuple(choice.segments)


def prepare_batch(
    model: CompiledScene, settings: Settings, initial: tuple[ArrayLike, ArrayLike]
) -> tuple[Settings, Array, Array]:
    """Validated settings with output times, q (n, nq) and u (n, nu) of a batch.

    Raises SceneError for invalid settings or array sizes.
    """
    settings = validate(settings)
    if not settings.t_end > settings.t_start:
        raise SceneError(
            f"t_end: expected a time after t_start = {settings.t_start:g} s, found "
            f"{settings.t_end:g} s"
        )
    if settings.output_times is None:
        settings = replace(settings, output_times=(settings.t_end,))
    if not settings.output_times:
        raise SceneError("output_times: expected at least one time in s, found none")
    if settings.method in (*external_integrators.METHODS, *classical_run.METHODS):
        raise SceneError(f'method "{settings.method}" cannot run batches; use simulate')
    tableau = get(settings.first_method)
    check_size(tableau, model.nq + model.nu)
    check_steps(tableau, settings.step)
    q, u = split_state("initial_states", initial)
    lead, (q_rows, u_rows) = batch(("initial q", q, model.nq), ("initial u", u, model.nu))
    if len(lead) > 1:
        raise SceneError(
            f"initial_states: expected one leading axis, (n, nq) and (n, nu), found {len(lead)}"
        )
    return settings, q_rows, u_rows
