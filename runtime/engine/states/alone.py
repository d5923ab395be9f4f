"""Fast calls for single states: everything that does not change is prepared once."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...kernels.fused import FusedLibrary
from ...kernels.prepared import Call, nothing, prepared
from ..code import Fusing
from ..engine import Engine
from ..live import LiveInputs

#: Calls on scenes with more bodies or speeds release Python's lock, with one record per thread, and
#: have no prepared call of the mass matrix.
MOST = 100

#: Code of the scene: that of accelerations, that of inverse dynamics and the mass matrix.
Libraries = tuple[FusedLibrary | None, FusedLibrary | None]
#: Calls of a record.
_CALLS = ("accelerations", "efforts", "mass", "energy", "momentum", "moved")


def small(engine: Engine) -> bool:
    """True if calls are so short that Python's lock need not be released."""
    return engine.packed.topology.count <= MOST and engine.nu <= MOST


class Alone:
    """Calls on single states that are rows of doubles (nq,), (nu,).

    They return None for other arguments and for any failure: the caller then uses the general call,
    which evaluates the state or reports what is wrong.  Safe to call from several threads.

    Attributes:
        accelerations: (t, q, u, efforts or None) -> udot (nu,).
        efforts: (t, q, u, udot) -> efforts (nu,) in addition to those of laws.
        mass: (q) -> (nu, nu), if no body is flexible.
        energy: (t, q, u) -> (); momentum: (t, q, u) -> (6,).
        moved: (dt, q, u) -> (nq,), if no body is flexible.
        library, inverse: code of the scene in use; call `renew` if the fusion has other code.
    """

    accelerations: Call
    efforts: Call
    mass: Call
    energy: Call
    momentum: Call
    moved: Call

    def __init__(self, engine: Engine, fusion: Fusing) -> None:
        self._engine, self._fusion = engine, fusion
        self._local = threading.local()
        self._asked = 0
        self.renew()

    def renew(self) -> None:
        """Use the code that exists for the scene now."""
        by = self._fusion.library, self._fusion.inverse
        record = _Record(self._engine, self._fusion, by) if small(self._engine) else None
        for name in _CALLS:
            setattr(self, name, self._of_thread(name) if record is None else getattr(record, name))
        self.library, self.inverse = by

    def seek(self) -> None:
        """Look for code of inverse dynamics at call numbers 1, 2, 4, 8, ..."""
        fusion = self._fusion
        if fusion.inverse is None:
            self._asked += 1
            if self._asked & (self._asked - 1) == 0:
                fusion.ready_inverse(self._asked)
        if self.inverse is not fusion.inverse:
            self.renew()

    def _of_thread(self, name: str) -> Call:
        """Call that uses the record of the current thread."""

        def call(*given: Any) -> Any:
            return getattr(self._made(), name)(*given)

        return call

    def _made(self) -> _Record:
        """Record of this thread, created again when there is new code of the scene."""
        by = self.library, self.inverse
        made: _Record | None = getattr(self._local, "made", None)
        if made is None or made.by != by:
            made = self._local.made = _Record(self._engine, self._fusion, by, released=True)
        return made


class _Record:
    """Prepared calls of `Alone` with their memory; `by` is the code of the scene that they use."""

    def __init__(
        self, engine: Engine, fusion: Fusing, by: Libraries, released: bool = False
    ) -> None:
        nq, nu = engine.nq, engine.nu
        self._ffi, self.by = engine.ffi, by
        ffi = engine.ffi
        self._record = record = ffi.new("mstmm_alone *")
        record.model, record.inertia = engine.packed.model, engine.inertia_alone.packed.model
        fused = any(one is not None for one in self.by)
        p = np.array(fusion.numbers) if fused else np.zeros(0)
        arrays = p, engine.start_memory(), np.zeros(nu), np.empty(nq), np.empty(2 * nu)
        self._pointed: list[Any] = [engine.pointer(array) for array in arrays]
        record.p, record.memory, record.none, record.qdot, record.work = self._pointed
        if released:
            record.workspace = engine.workspace()
        else:  # the thread's own workspace is used by other calls
            self._point("workspace", "real[]", np.zeros(engine.packed.workspace))
        record.fused, record.inverse = (
            ffi.NULL if one is None else one.descriptor for one in self.by
        )
        fours = [int(k) for group in engine.packed.layout.groups for k in group.quaternions()]
        record.n_quaternions = len(fours)
        self._point("quaternions", "int[]", np.array(fours, dtype=np.int32))
        if fused:
            self._follow(engine, LiveInputs(engine.packed.system, fusion.inputs))
        self._prepare(engine, released)

    def _prepare(self, engine: Engine, released: bool) -> None:
        nq, nu = engine.nq, engine.nu

        def call(name: str, widths: tuple[int, ...], shape: tuple[int, ...], **how: bool) -> Call:
            return prepared(
                f"mstmm_alone_{name}", self._record, widths, shape, released=released,
                kept=(engine, self.by, self._pointed), **how,
            )  # fmt: skip

        self.accelerations = call(
            "accelerations", (nq, nu, nu), (nu,), numbered=True, optional=True
        )
        self.efforts = call("efforts", (nq, nu, nu), (nu,), numbered=True)
        self.energy = call("energy", (nq, nu), (), numbered=True)
        self.momentum = call("momentum", (nq, nu), (6,), numbered=True)
        rigid = not engine.packed.layout.modal
        self.mass = call("mass", (nq,), (nu, nu)) if rigid and nu <= MOST else nothing
        self.moved = call("moved", (nq, nu), (nq,), numbered=True) if rigid else nothing

    def _point(self, name: str, kind: str, array: NDArray[Any]) -> None:
        pointer = self._ffi.from_buffer(kind, array)
        self._pointed.append(pointer)
        setattr(self._record, name, pointer)

    def _follow(self, engine: Engine, live: LiveInputs) -> None:
        if live.varies:
            places: NDArray[np.int32] = live.places
            to = self._record.live
            to.n, to.inputs = len(places), engine.packed.model.inputs
            to.places = place = engine.ffi.from_buffer("int[]", places)
            self._pointed.append(place)
