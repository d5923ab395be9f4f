"""Accelerations of many states: in SIMD lanes with fused code, and in threads.

The result of a state does not depend on the other states, on their number or on the number of
threads: every state of a batch is evaluated by the same code.  C runs without the interpreter's
lock.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from mstmm.arrays import Array, threads_of
from mstmm.errors import NumericalFailure

from ...kernels.fused import FusedLibrary
from ..code import Fusing
from ..engine import Engine
from ..live import LiveInputs

#: Smallest work for which a thread is started, about 0.2 ms, in states times speeds.
_LEAST_LANES, _LEAST_LOOPED = 20000, 2000


@dataclass(frozen=True)
class States:
    """Batch of n states: t (n,), q (n, nq), u (n, nu), extra efforts (n, nu) or None.

    `lead` is the shape of the leading axes of the caller's arrays, () for one state.
    """

    lead: tuple[int, ...]
    t: Array
    q: Array
    u: Array
    efforts: Array | None


@dataclass(frozen=True)
class Failed:
    """First state of a range that could not be evaluated."""

    index: int
    failure: Any


def processors() -> int:
    """Number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def accelerations(
    engine: Engine, fusing: Fusing, states: States, threads: int | None = None
) -> Array:
    """Compute udot (n, nu) of a batch with at most `threads` threads (None: one per processor).

    One state (no leading axis) uses the scalar code, others the lanes.  Raises SceneError for an
    invalid number of threads; NumericalFailure or UndeterminedMotion that names the state and the
    hinge.
    """
    n, udot = len(states.q), np.empty((len(states.q), engine.nu))
    live = LiveInputs(engine.packed.system, fusing.inputs)
    if not states.lead and fusing.library is not None:
        numbers = live.at(fusing.numbers, states.t).ravel()
        failed = _one(engine, fusing.library, numbers, states, udot)
    else:
        lanes = fusing.ready_lanes(n) if states.lead and n else None
        if lanes is None:
            run, step, least = _looped(engine, states, udot), 1, _LEAST_LOOPED
        else:
            run = _lanes(engine, lanes, live.at(fusing.numbers, states.t), states, udot)
            step, least = lanes.lanes, _LEAST_LANES
        smallest = -(-least // max(1, engine.nu))
        failed = in_threads(run, n, step, smallest, threads_of(threads) or processors())
    if failed is not None:
        raise _error(engine, states, failed)
    _refuse_not_finite(engine, states, udot)
    return udot


def in_threads(
    run: Callable[[int, int], Failed | None], n: int, step: int, smallest: int, threads: int
) -> Failed | None:
    """Call run(first, end) over 0..n in ranges that begin at multiples of `step`.

    Only the last range may be shorter than `smallest`.  Returns the failure of the lowest index.
    """
    pieces = max(1, min(threads, n // max(1, smallest)))
    if pieces == 1:
        return run(0, n)
    width = -(-n // pieces)
    width = -(-width // step) * step
    starts = range(0, n, width)
    with ThreadPoolExecutor(len(starts)) as pool:
        found = list(pool.map(run, starts, [min(n, start + width) for start in starts]))
    return next((failed for failed in found if failed is not None), None)


def _one(
    engine: Engine, library: FusedLibrary, numbers: Array, states: States, udot: Array
) -> Failed | None:
    efforts = np.zeros(engine.nu) if states.efforts is None else states.efforts[0]
    code, _, udot[0] = library.evaluate(
        numbers, float(states.t[0]), states.q[0], states.u[0], engine.start_memory(), efforts
    )
    return Failed(0, _failure(engine, library, code)) if code else None


def _lanes(
    engine: Engine, library: FusedLibrary, numbers: Array, states: States, udot: Array
) -> Callable[[int, int], Failed | None]:
    memory = engine.start_memory()

    def run(first: int, end: int) -> Failed | None:
        part = slice(first, end)
        efforts = None if states.efforts is None else states.efforts[part]
        codes = library.many(
            numbers if numbers.ndim == 1 else numbers[part], states.t[part], states.q[part],
            states.u[part], memory, efforts, udot[part],
        )  # fmt: skip
        bad = np.flatnonzero(codes)
        if not len(bad):
            return None
        at = int(bad[0])
        return Failed(first + at, _failure(engine, library, int(codes[at])))

    return run


def _failure(engine: Engine, library: FusedLibrary, code: int) -> Any:
    reason, element, detail = library.failures[code - 1]
    return engine.ffi.new("mstmm_failure *", {"reason": reason, "element": element, "code": detail})


def _looped(engine: Engine, states: States, udot: Array) -> Callable[[int, int], Failed | None]:
    """Evaluation of a range by the looped engine; every thread has a workspace."""
    memory = np.tile(engine.start_memory(), (len(states.q), 1))

    def run(first: int, end: int) -> Failed | None:
        qdot = np.empty((end - first, engine.nq))
        failure, at = engine.ffi.new("mstmm_failure *"), engine.ffi.new("int64_t *")
        given = states.efforts
        code = engine.lib.mstmm_accelerations_many(
            engine.packed.model, engine.workspace(), end - first,
            *(engine.pointer(x[first:end]) for x in (states.t, states.q, states.u, memory)),
            engine.ffi.NULL if given is None else engine.pointer(given[first:end]),
            engine.pointer(qdot), engine.pointer(udot[first:end]), failure, at,
        )  # fmt: skip
        return Failed(first + int(at[0]), failure) if code else None

    return run


def _error(engine: Engine, states: States, failed: Failed) -> NumericalFailure:
    i = failed.index
    error = engine.failed(failed.failure, float(states.t[i]), states.q[i], states.u[i])
    error.args = (f"{_named(states.lead, i)}{error}",)
    return error


def _named(lead: tuple[int, ...], index: int) -> str:
    """Prefix of a message with the index of a state on the leading axes; "" for one state."""
    if not lead:
        return ""
    place = [int(k) for k in np.unravel_index(index, lead)]
    return f"state {place if len(place) > 1 else place[0]}: "


def _refuse_not_finite(engine: Engine, states: States, udot: Array) -> None:
    if np.isfinite(udot).all():
        return
    row, column = (int(k[0]) for k in np.nonzero(~np.isfinite(udot)))
    name = engine.packed.layout.u_name(column)
    raise engine.not_finite(
        f"{_named(states.lead, row)}the acceleration of {name}",
        float(states.t[row]), states.q[row], states.u[row],
    )  # fmt: skip
