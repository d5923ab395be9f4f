"""Accelerations of a batch of states, in SIMD lanes with fused code and in threads.

The result of a state does not depend on the other states, their number or the number of threads:
the same code evaluates every state of a batch.  C code runs without the interpreter lock.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from mstmm.array_validation import Array, thread_count
from mstmm.errors import NumericalFailure

from ...kernels.fused_library import FusedLibrary
from ..fused_code import FusedCode
from ..live_inputs import LiveInputs
from ..looped_engine import LoopedEngine

#: Smallest work that justifies a thread, about 0.2 ms, in states times speeds.
_MIN_WORK_LANES, _MIN_WORK_LOOPED = 20000, 2000


@dataclass(frozen=True)
class StateBatch:
    """Batch of n states: t (n,), q (n, nq), u (n, nu), extra efforts (n, nu) or None.

    `leading_shape` is the shape of the leading axes of the caller's arrays, () for one state.
    """

    leading_shape: tuple[int, ...]
    t: Array
    q: Array
    u: Array
    efforts: Array | None


@dataclass(frozen=True)
class FailedState:
    """First state of a range with a failed evaluation."""

    index: int
    failure: Any


def processor_count() -> int:
    """Number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def accelerations(
    engine: LoopedEngine, fusing: FusedCode, states: StateBatch, threads: int | None = None
) -> Array:
    """Compute udot (n, nu) of a batch with at most `threads` threads (None: one per processor).

    One state (no leading axis) uses the fused scalar code, batches the fused vector lanes; the
    looped engine does both where there is no fused code.  Raises SceneError for an
    invalid number of threads, and NumericalFailure or UndeterminedMotionError, which name the state
    and the hinge.
    """
    n, udot = len(states.q), np.empty((len(states.q), engine.nu))
    live = LiveInputs(engine.packed.system, fusing.inputs)
    if not states.leading_shape and fusing.library is not None:
        numbers = live.numbers_at(fusing.numbers, states.t).ravel()
        first_failure = _evaluate_single(engine, fusing.library, numbers, states, udot)
    else:
        lanes = fusing.ready_lanes(n) if states.leading_shape and n else None
        if lanes is None:
            evaluate_range, step, min_work = (
                _looped_evaluation(engine, states, udot),
                1,
                _MIN_WORK_LOOPED,
            )
        else:
            evaluate_range = _lane_evaluation(
                engine, lanes, live.numbers_at(fusing.numbers, states.t), states, udot
            )
            step, min_work = lanes.lanes, _MIN_WORK_LANES
        min_range = -(-min_work // max(1, engine.nu))
        first_failure = run_in_threads(
            evaluate_range, n, step, min_range, thread_count(threads) or processor_count()
        )
    if first_failure is not None:
        raise _state_error(engine, states, first_failure)
    _check_finite(engine, states, udot)
    return udot


def run_in_threads(
    run: Callable[[int, int], FailedState | None], n: int, step: int, smallest: int, threads: int
) -> FailedState | None:
    """Call run(first, end) in threads over ranges of 0..n that begin at multiples of `step`.

    Only the last range may be shorter than `smallest`.  Returns the failure of the lowest index.
    """
    pieces = max(1, min(threads, n // max(1, smallest)))
    if pieces == 1:
        return run(0, n)
    width = -(-n // pieces)
    width = -(-width // step) * step
    starts = range(0, n, width)
    with ThreadPoolExecutor(len(starts)) as pool:
        failures = list(pool.map(run, starts, [min(n, start + width) for start in starts]))
    return next((failure for failure in failures if failure is not None), None)


def _evaluate_single(
    engine: LoopedEngine, library: FusedLibrary, numbers: Array, states: StateBatch, udot: Array
) -> FailedState | None:
    efforts = np.zeros(engine.nu) if states.efforts is None else states.efforts[0]
    code, _, udot[0] = library.evaluate(
        numbers, float(states.t[0]), states.q[0], states.u[0], engine.start_memory(), efforts
    )
    return FailedState(0, _failure_record(engine, library, code)) if code else None


def _lane_evaluation(
    engine: LoopedEngine, library: FusedLibrary, numbers: Array, states: StateBatch, udot: Array
) -> Callable[[int, int], FailedState | None]:
    memory = engine.start_memory()

    def run(first: int, end: int) -> FailedState | None:
        selection = slice(first, end)
        efforts = None if states.efforts is None else states.efforts[selection]
        codes = library.accelerations_batch(
            numbers if numbers.ndim == 1 else numbers[selection],
            states.t[selection],
            states.q[selection],
            states.u[selection],
            memory,
            efforts,
            udot[selection],
        )
        failed_rows = np.flatnonzero(codes)
        if not len(failed_rows):
            return None
        first_failed = int(failed_rows[0])
        return FailedState(
            first + first_failed, _failure_record(engine, library, int(codes[first_failed]))
        )

    return run


def _failure_record(engine: LoopedEngine, library: FusedLibrary, code: int) -> Any:
    reason, element, detail = library.failures[code - 1]
    return engine.ffi.new("mstmm_failure *", {"reason": reason, "element": element, "code": detail})


def _looped_evaluation(
    engine: LoopedEngine, states: StateBatch, udot: Array
) -> Callable[[int, int], FailedState | None]:
    """Evaluation of a range by the looped engine; every thread has its own workspace."""
    memory = np.tile(engine.start_memory(), (len(states.q), 1))

    def run(first: int, end: int) -> FailedState | None:
        qdot = np.empty((end - first, engine.nq))
        failure, failed_row = engine.ffi.new("mstmm_failure *"), engine.ffi.new("int64_t *")
        efforts = states.efforts
        code = engine.lib.mstmm_accelerations_many(
            engine.packed.model, engine.workspace(), end - first,
            *(engine.pointer(array[first:end]) for array in (states.t, states.q, states.u, memory)),
            engine.ffi.NULL if efforts is None else engine.pointer(efforts[first:end]),
            engine.pointer(qdot), engine.pointer(udot[first:end]), failure, failed_row,
        )  # fmt: skip
        return FailedState(first + int(failed_row[0]), failure) if code else None

    return run


def _state_error(engine: LoopedEngine, states: StateBatch, failed: FailedState) -> NumericalFailure:
    i = failed.index
    error = engine.evaluation_error(failed.failure, float(states.t[i]), states.q[i], states.u[i])
    error.args = (f"{_state_prefix(states.leading_shape, i)}{error}",)
    return error


def _state_prefix(lead: tuple[int, ...], index: int) -> str:
    """Message prefix with the index of a state on the leading axes; "" for one state."""
    if not lead:
        return ""
    indices = [int(k) for k in np.unravel_index(index, lead)]
    return f"state {indices if len(indices) > 1 else indices[0]}: "


def _check_finite(engine: LoopedEngine, states: StateBatch, udot: Array) -> None:
    if np.isfinite(udot).all():
        return
    row, column = (int(k[0]) for k in np.nonzero(~np.isfinite(udot)))
    name = engine.packed.layout.u_name(column)
    raise engine.not_finite(
        f"{_state_prefix(states.leading_shape, row)}the acceleration of {name}",
        float(states.t[row]), states.q[row], states.u[row],
    )  # fmt: skip
