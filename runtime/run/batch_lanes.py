"""Trajectories in SIMD lanes, by `integrate/c/simd_lanes.c`, and threads that stop on Ctrl-C."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.numerics.piecewise_polynomial import PiecewisePolynomial

from ..engine.inputs import IndexPairs, LiveInputs
from ..engine.looped_engine import LoopedEngine
from ..integrate.c_loop import Status
from ..integrate.c_tableau import c_tableau
from ..integrate.settings import Settings
from ..integrate.steppers import get
from ..kernels.c_records import Memory
from ..kernels.scene_libraries import FusedLibrary
from ..packing.records.model_record import write_inputs
from ..platform_support.interrupts import record_interrupts
from .integration_run import SLICE
from .scene_system import SceneSystem


class LaneInputs:
    """Inputs of all trajectories as fused code reads them.

    Constant inputs are written to the rows of `numbers` (n, np), varying ones to `records`.
    """

    def __init__(
        self,
        engine: LoopedEngine,
        read: IndexPairs,
        channels: Sequence[Sequence[PiecewisePolynomial]],
        numbers: Array,
    ) -> None:
        places = LiveInputs(engine.packed.system, read).indices
        self.memory = Memory(engine.ffi)
        self.varying = [
            k for k, row in enumerate(places)
            if (row >= 0).any() and any(channel[k].varies for channel in channels)
        ]  # fmt: skip
        for k, row in enumerate(places):
            is_read = row >= 0
            if is_read.any() and k not in self.varying:
                numbers[:, row[is_read]] = [
                    np.array(channel[k].piece_at(0.0))[is_read] for channel in channels
                ]
        self.indices = np.ascontiguousarray(places[self.varying])
        varying = [channel[k] for channel in channels for k in self.varying]
        self.records = write_inputs(varying, [-1] * len(varying), self.memory)

    def fill(self, view: Any, ffi: Any) -> None:
        """Write the varying inputs to a `mstmm_scene_lanes`."""
        view.live.n, view.live.inputs = len(self.varying), self.records
        view.live.places = ffi.from_buffer("int[]", self.indices)


@dataclass
class Lanes:
    """Common data of all trajectories, and a system per thread for projections."""

    engine: LoopedEngine
    library: FusedLibrary
    settings: Settings
    systems: list[SceneSystem]
    numbers: Array  # (n, np)
    width: int
    inputs: LaneInputs


def run_lanes(lanes: Lanes, start: Array) -> tuple[Array, Any]:
    """Samples (n, times, width), nan at times not reached, and n `mstmm_outcome`."""
    ffi, lib, settings = lanes.engine.ffi, lanes.engine.lib, lanes.settings
    n, times = len(start), np.asarray(settings.output_times, dtype=np.float64)
    samples, last = np.full((n, len(times), lanes.width), np.nan), np.zeros((n, lanes.width))
    outcomes = ffi.new("mstmm_outcome[]", n)
    many = ffi.new("mstmm_many *")
    keep_alive = _fill_problem(lanes, many.problem, times)
    many.n, many.outcomes = n, outcomes
    pointers = [lanes.engine.pointer(array) for array in (start, samples, last)]
    many.y0, many.samples, many.last = pointers
    numbers = lanes.engine.pointer(lanes.numbers)
    stop = threading.Event()
    groups = [_make_group(lanes, many, system, numbers, keep_alive) for system in lanes.systems]
    for group in groups:
        if lib.mstmm_group_start(group):
            raise SceneError(
                "simulate_batch: invalid settings; check t_end, after t_start, and the tolerances"
            )

    def work(group: Any) -> None:
        while not stop.is_set():
            if lib.mstmm_group_advance(group, SLICE) == Status.FINISHED:
                return

    run_on_threads(work, groups, len(groups), stop)
    return samples, outcomes


def _fill_problem(lanes: Lanes, run: Any, times: Array) -> list[Any]:
    """Fill the run that all trajectories copy; returns the objects it points to."""
    engine, settings = lanes.engine, lanes.settings
    atol = np.full(lanes.width, float(settings.atol))
    time_map = engine.packed.time_map(settings.t_start, settings.t_end)
    starts, longest = time_map.starts, time_map.longest
    arrays = [np.array(x) for x in (atol, time_map.breaks, times, starts, longest)]
    pointers = [engine.pointer(array) for array in arrays]
    run.tableau = c_tableau(engine.ffi, get(settings.method))
    run.t_start, run.t_end, run.rtol = settings.t_start, settings.t_end, settings.rtol
    run.fixed_step = settings.step or 0.0
    run.max_step, run.max_steps = settings.max_step, settings.max_steps
    run.first_step = settings.first_step
    run.atol, run.breaks, run.outputs, run.bound_starts, run.bounds = pointers
    run.n_breaks, run.n_outputs, run.n_bounds = len(time_map.breaks), len(times), len(starts)
    pole = engine.pointer(np.array([time_map.pole[0]])) if time_map.pole else engine.ffi.NULL
    run.pole = pole
    return [*arrays, *pointers, pole]


def _make_group(
    lanes: Lanes, many: Any, scene_system: SceneSystem, numbers: Any, keep_alive: list[Any]
) -> Any:
    """`mstmm_group *` of one thread, with its own workspace and system."""
    ffi, lib = lanes.engine.ffi, lanes.engine.lib
    group, system = ffi.new("mstmm_group *"), ffi.new("mstmm_system *")
    view = ffi.new("mstmm_scene_lanes *")
    view.fused, view.p, view.settle = lanes.library.descriptor, numbers, scene_system.run
    view.p_stride = lanes.numbers.shape[1]
    scratch = np.zeros(max(1, lib.mstmm_lanes_numbers(view.fused)))
    view.numbers = lanes.engine.pointer(scratch)
    lib.mstmm_scene_lanes_system(view, system, group)
    system.n_memory = 0  # only single runs keep memory of nearly singular configurations
    group.many = many
    workspace = np.zeros(max(1, lib.mstmm_group_size(system, many.problem.tableau)))
    group.workspace = lanes.engine.pointer(workspace)
    lanes.inputs.fill(view, ffi)
    keep_alive += [system, view, scratch, workspace, lanes.inputs]
    return group


T = TypeVar("T")


def run_on_threads(
    work: Callable[[T], None], items: Iterable[T], threads: int, stop: threading.Event
) -> None:
    """Call `work` for every item on several threads, and raise the first exception of a call.

    After a failure or an interrupt `stop` is set, which `work` must check often, and no further
    call starts.  Raises KeyboardInterrupt after an interrupt, once all threads have stopped.
    """
    with record_interrupts() as interrupted, ThreadPoolExecutor(threads) as pool:
        futures = [pool.submit(work, item) for item in items]
        waiting, failed = set(futures), False
        while waiting and not (failed or interrupted):
            done, waiting = wait(waiting, timeout=SLICE, return_when=FIRST_EXCEPTION)
            failed = any(future.exception() is not None for future in done)
        if waiting:
            stop.set()
            pool.shutdown(cancel_futures=True)
    for future in futures:
        if not future.cancelled():
            future.result()
    if waiting:
        raise KeyboardInterrupt
