"""Calls on single states, prepared in advance, and on batches of states."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array, thread_count
from mstmm.errors import NumericalFailure

from ...kernels.prepared_calls import PreparedCall, prepare_call, unavailable_call
from ...kernels.scene_libraries import FusedLibrary
from ..fused_code import FusedCode
from ..inputs import LiveInputs
from ..looped_engine import LoopedEngine

#: Maximum number of bodies and of speeds of a small scene.  Calls on larger scenes release the
#: interpreter lock, with one record per thread, and have no prepared call of the mass matrix.
MAX_SIZE = 100

#: Fused code for accelerations, and for inverse dynamics and the mass matrix.
Libraries = tuple[FusedLibrary | None, FusedLibrary | None]
#: Calls of a record.
_CALL_NAMES = ("accelerations", "efforts", "mass", "energy", "momentum", "moved")


def is_small(engine: LoopedEngine) -> bool:
    """True if calls are so short that the interpreter lock need not be released."""
    return engine.packed.topology.count <= MAX_SIZE and engine.nu <= MAX_SIZE


class SingleStateCalls:
    """Calls on single states given as rows of doubles (nq,), (nu,); thread-safe.

    They return None for other arguments and for any failure; the caller then uses the general call,
    which evaluates the state or reports the error.

    Attributes:
        accelerations: (t, q, u, efforts or None) -> udot (nu,).
        efforts: (t, q, u, udot) -> efforts (nu,) in addition to those of laws.
        mass: (q) -> (nu, nu), if no body is flexible.
        energy: (t, q, u) -> (); momentum: (t, q, u) -> (6,).
        moved: (dt, q, u) -> (nq,), if no body is flexible.
        library, inverse: fused code in use; call `renew` if the fusion has other code.
    """

    accelerations: PreparedCall
    efforts: PreparedCall
    mass: PreparedCall
    energy: PreparedCall
    momentum: PreparedCall
    moved: PreparedCall

    def __init__(self, engine: LoopedEngine, fusion: FusedCode) -> None:
        self._engine, self._fusion = engine, fusion
        self._local = threading.local()
        self._request_count = 0
        self.renew()

    def renew(self) -> None:
        """Switch to the fused code that exists now."""
        libraries = self._fusion.library, self._fusion.inverse
        record = _Record(self._engine, self._fusion, libraries) if is_small(self._engine) else None
        for name in _CALL_NAMES:
            setattr(
                self, name, self._thread_call(name) if record is None else getattr(record, name)
            )
        self.library, self.inverse = libraries

    def seek(self) -> None:
        """Search for code of inverse dynamics at calls number 1, 2, 4, 8, ..."""
        fusion = self._fusion
        if fusion.inverse is None:
            self._request_count += 1
            if self._request_count & (self._request_count - 1) == 0:
                fusion.ready_inverse(self._request_count)
        if self.inverse is not fusion.inverse:
            self.renew()

    def _thread_call(self, name: str) -> PreparedCall:
        """Call that uses the record of the current thread."""

        def call(*given: Any) -> Any:
            return getattr(self._thread_record(), name)(*given)

        return call

    def _thread_record(self) -> _Record:
        """Record of this thread, recreated when there is new fused code."""
        libraries = self.library, self.inverse
        record: _Record | None = getattr(self._local, "made", None)
        if record is None or record.by != libraries:
            record = self._local.made = _Record(
                self._engine, self._fusion, libraries, released=True
            )
        return record


class _Record:
    """Prepared calls of `SingleStateCalls` with their memory; `by` is their fused code."""

    def __init__(
        self, engine: LoopedEngine, fusion: FusedCode, by: Libraries, released: bool = False
    ) -> None:
        nq, nu = engine.nq, engine.nu
        self._ffi, self.by = engine.ffi, by
        ffi = engine.ffi
        self._record = record = ffi.new("mstmm_alone *")
        record.model, record.inertia = engine.packed.model, engine.inertia_only.packed.model
        is_fused = any(library is not None for library in self.by)
        p = np.array(fusion.numbers) if is_fused else np.zeros(0)
        arrays = p, engine.start_memory(), np.zeros(nu), np.empty(nq), np.empty(2 * nu)
        self._references: list[Any] = [engine.pointer(array) for array in arrays]
        record.p, record.memory, record.none, record.qdot, record.work = self._references
        if released:
            record.workspace = engine.workspace()
        else:  # other calls use the workspace of the thread
            self._point("workspace", "real[]", np.zeros(engine.packed.workspace))
        record.fused, record.inverse = (
            ffi.NULL if library is None else library.descriptor for library in self.by
        )
        quaternion_starts = [
            int(k) for group in engine.packed.layout.groups for k in group.quaternions()
        ]
        record.n_quaternions = len(quaternion_starts)
        self._point("quaternions", "int[]", np.array(quaternion_starts, dtype=np.int32))
        if is_fused:
            self._follow(engine, LiveInputs(engine.packed.system, fusion.inputs))
        self._prepare(engine, released)

    def _prepare(self, engine: LoopedEngine, released: bool) -> None:
        nq, nu = engine.nq, engine.nu

        def call(
            name: str, widths: tuple[int, ...], shape: tuple[int, ...], **how: bool
        ) -> PreparedCall:
            return prepare_call(
                f"mstmm_alone_{name}", self._record, widths, shape, released=released,
                kept=(engine, self.by, self._references), **how,
            )  # fmt: skip

        self.accelerations = call(
            "accelerations", (nq, nu, nu), (nu,), numbered=True, optional=True
        )
        self.efforts = call("efforts", (nq, nu, nu), (nu,), numbered=True)
        self.energy = call("energy", (nq, nu), (), numbered=True)
        self.momentum = call("momentum", (nq, nu), (6,), numbered=True)
        rigid = not engine.packed.layout.modal
        self.mass = call("mass", (nq,), (nu, nu)) if rigid and nu <= MAX_SIZE else unavailable_call
        self.moved = call("moved", (nq, nu), (nq,), numbered=True) if rigid else unavailable_call

    def _point(self, name: str, kind: str, array: NDArray[Any]) -> None:
        pointer = self._ffi.from_buffer(kind, array)
        self._references.append(pointer)
        setattr(self._record, name, pointer)

    def _follow(self, engine: LoopedEngine, live: LiveInputs) -> None:
        if live.varies:
            indices: NDArray[np.int32] = live.indices
            live_record = self._record.live
            live_record.n, live_record.inputs = len(indices), engine.packed.model.inputs
            live_record.places = place_pointer = engine.ffi.from_buffer("int[]", indices)
            self._references.append(place_pointer)


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
            evaluate_range = _looped_evaluation(engine, states, udot)
            step = 1
            min_work = _MIN_WORK_LOOPED
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


def move_steadily(q: Array, rates: Array, dt: float, quaternions: Iterable[int]) -> Array:
    """Advance q (nq,) by dt (s) at constant `rates` (nq,).

    Unit quaternions, which begin at the indices `quaternions`, rotate at constant angular velocity
    and retain unit length.
    """
    moved = q + rates * dt
    for first in quaternions:
        quaternion = slice(first, first + 4)
        rate = float(np.linalg.norm(rates[quaternion]))
        if rate > 0:
            moved[quaternion] = (
                np.cos(rate * dt) * q[quaternion] + np.sin(rate * dt) / rate * rates[quaternion]
            )
    return moved
