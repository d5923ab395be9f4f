"""Fast calls for single states, with all constant data prepared in advance."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...kernels.fused_library import FusedLibrary
from ...kernels.prepared_calls import PreparedCall, prepare_call, unavailable_call
from ..fused_code import FusedCode
from ..live_inputs import LiveInputs
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
