"""Many independent runs of a model: side by side in the lanes of vectors, and on several threads.

Where the scene has compiled code and neither events, releases, memory nor drives, every
thread advances as many trajectories at a time as a vector has lanes, each with its own error
control.  Other scenes run one trajectory after the other on every thread.  Which way is taken
depends on the scene and the machine alone, so that the numbers of a trajectory depend neither on
the size of the batch, nor on its neighbours, nor on the number of threads.
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

from ...discontinuities.active_expressions import active_expressions
from ...integrate.c_loop import Failure, Integrator, Status, failure_text
from ...integrate.settings import Settings, validate
from ...integrate.steppers import AUTO, check_size, check_steps, get
from ...packing.scene_parameters import with_parameters
from ...packing.switch_margins import has_switches
from .. import classical_run, external_integrators
from ..integration_run import (
    advance,
    choice_of,
    make_run,
    project_samples,
    status_message,
    trajectory,
)
from ..method_segments import MethodSegment
from ..scene_system import SceneCode, SceneSystem
from .batch_inputs import BatchInput, BatchInputs, batch_inputs, rows_of
from .interruptible_threads import on_threads
from .simd_lanes import LaneInputs, Lanes, run_lanes

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene
    from ...kernels.fused_library import FusedLibrary


@dataclass(frozen=True)
class BatchModels:
    """The model of each run, with its own numbers and inputs."""

    models: tuple[CompiledScene, ...]
    given: BatchInputs

    def of(self, k: int) -> CompiledScene:
        """That of run k."""
        return self.given.model(self.models[k], k)


@dataclass(frozen=True)
class BatchData:
    """What n runs gave.

    Attributes:
        t: (m,) output times in s.
        q: (n, m, nq) coordinates, nan at times that a trajectory did not reach.
        u: (n, m, nu) speeds, likewise.
        success: (n,) True where a run reached its end, or an event stopped it.
        messages: n sentences; for a failure cause, time and element.
        evaluations: (n,) calls of the right-hand side.
        engine: how it was computed, in words.
        methods: n times what each run did, where runs choose among methods ("auto"); empty for
            those of one method.
        memory: (n, m, memory) of events, turns and controllers.
        settings: how all runs were made.
        models: the model of each.
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
class _Rows:
    """The arrays of a batch, filled by whoever runs a trajectory."""

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
    if len(q) == 1:  # one start serves as many as there are numbers
        given = {} if inputs is None else mapping_by_name("inputs", inputs)
        given |= mapping_by_name("parameters", parameters)
        many = max([1, *(rows_of(name, value) for name, value in given.items())])
        q, u = np.repeat(q, many, axis=0), np.repeat(u, many, axis=0)
    n, times = len(q), np.asarray(settings.output_times)
    alone_only = settings.method == AUTO or get(settings.method).implicit
    made, by_row = _models(model, parameters, n), batch_inputs(model, inputs, n)
    models = [model if isinstance(one, MstmmError) else one for one in made]
    failed = np.array([isinstance(one, MstmmError) for one in made], bool)
    alone_only = alone_only or (n > 0 and by_row.moves_breaks(model))
    library = None if alone_only else _lanes(model)
    count = min(thread_count(threads) or os.cpu_count() or 1, max(1, n))
    rows = _Rows(
        np.full((n, len(times), model.nq + model.nu), np.nan), np.zeros(n, dtype=bool),
        [str(one) if isinstance(one, MstmmError) else "" for one in made],
        np.zeros(n, dtype=np.int64), [()] * n,
        np.full((n, len(times), model.packed.system.n_memory), np.nan),
    )  # fmt: skip
    alike = _of_equal_times(model, models, settings)
    closing = model.packed.system.closes  # by numbers that all share
    ours = np.array([library is not None and alike[id(m)] and m.fusion.lanes is library
                     and (m is model or not closing) for m in models], bool) & ~failed  # fmt: skip
    if library is not None and ours.any():
        which = np.flatnonzero(ours)
        _side_by_side(model, library, models, by_row, settings, q, u, which, rows, count)
    alone = np.flatnonzero(~(ours | failed))
    if len(alone):
        _one_by_one(models, by_row, settings, q, u, alone, rows, count)
    how = "one after the other" if library is None else f"{library.lanes} side by side"
    nq = model.nq
    return BatchData(
        times, rows.samples[..., :nq].copy(), rows.samples[..., nq:].copy(), rows.success,
        tuple(rows.messages), rows.evaluations, f"{how} on {count} threads",
        tuple(rows.methods), rows.memory, settings, BatchModels(tuple(models), by_row),
    )  # fmt: skip


def _models(
    model: CompiledScene, parameters: Mapping[str, ArrayLike], n: int
) -> list[CompiledScene | MstmmError]:
    """The model of each trajectory, or why there is none, as where its loops stay open; equal
    numbers share one.

    Raises SceneError for a name or a value that the scene refuses, naming the trajectory.
    """
    if not parameters:
        return [model] * n
    columns = {}
    for name, values in mapping_by_name("parameters", parameters).items():
        column = finite_array(f'parameter "{name}"', values)
        if column.shape not in ((), (n,)):
            raise SceneError(f'parameter "{name}" has shape {column.shape}, expected ({n},)')
        columns[name] = np.broadcast_to(column, (n,))
    made: dict[tuple[float, ...], CompiledScene | MstmmError] = {}
    found = []
    for i in range(n):
        row = tuple(float(column[i]) for column in columns.values())
        if row not in made:
            made[row] = _made(model, dict(zip(columns, row, strict=True)), i)
        found.append(made[row])
    return found


def _made(model: CompiledScene, numbers: dict[str, float], i: int) -> CompiledScene | MstmmError:
    try:
        return model.with_parameters(numbers)
    except MstmmError as error:
        try:
            with_parameters(model.scene, numbers)
        except SceneError as refused:
            raise SceneError(f"trajectory {i}: {refused}") from None
        return error


def _of_equal_times(
    model: CompiledScene, models: list[CompiledScene], settings: Settings
) -> dict[int, bool]:
    """By the id of each model: do its expressions switch at the times of those of `model`?  Where
    not, the steps of one trajectory would have to end where another's do not."""

    def times(one: CompiledScene) -> list[list[float]]:
        known = one.packed.time_map(settings.t_start, settings.t_end)
        return [known.breaks.tolist(), known.starts.tolist(), known.longest.tolist()]

    expressions = active_expressions(model.scene)
    return {
        id(one): active_expressions(one.scene) == expressions or times(one) == times(model)
        for one in {id(one): one for one in models}.values()
    }


def _lanes(model: CompiledScene) -> FusedLibrary | None:
    """Code for several states side by side, where trajectories can be run on it."""
    packed = model.packed
    if has_switches(packed.scene):
        return None
    if packed.system.remembers or packed.scene.events or packed.system.driven:
        return None
    return model.fusion.ready_lanes(math.inf)


def _side_by_side(
    model: CompiledScene, library: FusedLibrary, models: list[CompiledScene], given: BatchInputs,
    settings: Settings, q: Array, u: Array, which: NDArray[np.int64], rows: _Rows, threads: int,
) -> None:  # fmt: skip
    engine = given.timed(model).looped
    code = _scalar(model, settings) if model.packed.system.closes else None
    systems = [SceneSystem(engine, code, with_power=False) for _ in range(threads)]
    start = np.ascontiguousarray(np.concatenate([q[which], u[which]], axis=1))
    begun = np.full(len(start), settings.t_start)
    start, _ = project_samples(systems[0], begun, start, np.zeros((len(start), 1)))
    numbers = np.ascontiguousarray([models[i].fusion.numbers for i in which])
    channels = [list((models[i].packed.channels | given.rows[i]).values()) for i in which]
    live = LaneInputs(engine, model.fusion.inputs, channels, numbers)
    lanes = Lanes(engine, library, settings, systems, numbers, model.nq + model.nu, live)
    samples, outcomes = run_lanes(lanes, start)
    for place, (i, outcome) in enumerate(zip(which, outcomes, strict=True)):
        rows.samples[i] = samples[place]
        status = Status(outcome.status)
        rows.evaluations[i] = outcome.evaluations
        rows.success[i] = status is Status.FINISHED
        span = settings.t_start, settings.t_end
        rows.messages[i] = _lanes_message(models[i], library, systems[0], outcome, span)
    flat = rows.samples[which].reshape(-1, model.nq + model.nu)
    times = np.tile(np.asarray(settings.output_times), len(which))
    flat, _ = project_samples(systems[0], times, flat, np.zeros((len(flat), 1)))
    rows.samples[which] = flat.reshape(len(which), -1, model.nq + model.nu)


def _lanes_message(
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
    untold = status in (Status.NOT_FINITE, Status.ACCEPT_FAILED)
    way_out = "simulate this one alone to learn the cause" if untold else ""
    if status is Status.POLE and (pole := model.packed.time_map(*span).pole):
        way_out = pole[1]
    return failure_text(failure, system.components(), cause=way_out) + last


def _one_by_one(
    models: list[CompiledScene], given: BatchInputs, settings: Settings, q: Array, u: Array,
    which: NDArray[np.int64], rows: _Rows, threads: int,
) -> None:  # fmt: skip
    compiled = {id(m): _scalar(m, settings) for m in models}
    stop = threading.Event()

    def look(_: Integrator) -> None:
        if stop.is_set():
            raise _Stopped

    def run(i: int) -> None:
        try:
            model, code = given.model(models[i], i), compiled[id(models[i])]
            if code is not None:
                code = replace(code, numbers=model.fusion.numbers)
            _alone(model, code, settings, q[i], u[i], i, rows, look)
        except _Stopped:
            return
        except MstmmError as error:  # this trajectory's own affair
            rows.messages[i] = str(error)

    on_threads(run, which.tolist(), threads, stop)


class _Stopped(Exception):
    """The batch has ended."""


def _scalar(model: CompiledScene, settings: Settings) -> SceneCode | None:
    """Everything that the trajectories share, before they begin on threads of their own."""
    library = model.fusion.ready(math.inf)
    if library is None:
        return None
    asks = settings.method == AUTO or get(settings.method).implicit
    implicit = model.fusion.ready_implicit(math.inf) if asks else None
    fusion = model.fusion
    return SceneCode(library, None, fusion.numbers, fusion.inputs, lambda: implicit)


def _alone(
    model: CompiledScene, compiled: SceneCode | None, settings: Settings, q: Array, u: Array,
    i: int, rows: _Rows, look: Callable[[Integrator], None],
) -> None:  # fmt: skip
    system = SceneSystem(model.looped, compiled, with_power=False)
    run = make_run(system, settings, q, u)
    choice = choice_of(system, settings, run)
    status = advance(run, look, choice=choice)
    found = trajectory(system, run, settings, status, status_message(system, run, status))
    places = np.searchsorted(np.asarray(settings.output_times), found.t)
    rows.samples[i, places] = np.concatenate([found.q, found.u], axis=1)
    rows.memory[i, places] = found.memory
    rows.success[i], rows.messages[i] = found.success, found.message
    rows.evaluations[i] = found.statistics.evaluations
    rows.methods[i] = () if choice is None else tuple(choice.stretches)


def prepare_batch(
    model: CompiledScene, settings: Settings, initial: tuple[ArrayLike, ArrayLike]
) -> tuple[Settings, Array, Array]:
    """(settings with output times, q (n, nq), u (n, nu)) of a batch; SceneError for a misfit."""
    settings = validate(settings)
    if not settings.t_end > settings.t_start:
        raise SceneError(f"t_end = {settings.t_end:g}: expected a time in s, after t_start")
    if settings.output_times is None:
        settings = replace(settings, output_times=(settings.t_end,))
    if not settings.output_times:
        raise SceneError("output_times: expected one time in s or more")
    if settings.method in (*external_integrators.METHODS, *classical_run.METHODS):
        raise SceneError(f'method "{settings.method}" makes one run at a time: use simulate')
    tableau = get(settings.first_method)
    check_size(tableau, model.nq + model.nu)
    check_steps(tableau, settings.step)
    q, u = split_state("initial_states", initial)
    lead, (q_rows, u_rows) = batch(("initial q", q, model.nq), ("initial u", u, model.nu))
    if len(lead) > 1:
        raise SceneError(f"initial_states have {len(lead)} leading axes, expected one: (n, nq)")
    return settings, q_rows, u_rows
