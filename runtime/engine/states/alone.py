"""One state at a time, as it is asked for a million times: what stays the same is made once."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mstmm.arrays import Array, plain

from ...kernels.fused import FusedLibrary
from ..code import Fusing
from ..engine import Engine
from ..live import LiveInputs


class Alone:
    """Calls on states that are already rows of doubles (nq,), (nu,).

    They give None where a state is none of these, or where something fails: the general way then
    serves it, or says what is wrong.  Safe to call from several threads.
    """

    def __init__(self, engine: Engine, fusion: Fusing) -> None:
        self._engine, self._fusion = engine, fusion
        self._nq, self._nu = engine.nq, engine.nu
        self._local = threading.local()
        self._buffer, self._real = engine.ffi.from_buffer, engine.ffi.typeof("double[]")
        self._none = engine.ffi.NULL
        self._accelerations = engine.lib.mstmm_alone_accelerations
        self._efforts = engine.lib.mstmm_alone_efforts
        self._mass = engine.lib.mstmm_alone_mass
        self._rigid = not engine.packed.layout.modal

    def accelerations(
        self, t: float, q: ArrayLike, u: ArrayLike, efforts: ArrayLike | None
    ) -> Array | None:
        """udot (nu,), a new array."""
        nu, buffer, real = self._nu, self._buffer, self._real
        if not (plain(q, self._nq) and plain(u, nu)):
            return None
        if efforts is None:
            extra = self._none
        elif plain(efforts, nu):
            extra = buffer(real, efforts)
        else:
            return None
        udot = np.empty(nu)
        failed = self._accelerations(
            self._record(), t, buffer(real, q), buffer(real, u), extra, buffer(real, udot)
        )
        return None if failed else udot

    def efforts(self, t: float, q: ArrayLike, u: ArrayLike, udot: ArrayLike) -> Array | None:
        """Efforts (nu,) beyond those of laws that give udot, a new array."""
        nu, buffer, real = self._nu, self._buffer, self._real
        if not (plain(q, self._nq) and plain(u, nu) and plain(udot, nu)):
            return None
        efforts = np.empty(nu)
        failed = self._efforts(
            self._record(), t, buffer(real, q), buffer(real, u), buffer(real, udot),
            buffer(real, efforts),
        )  # fmt: skip
        return None if failed else efforts

    def mass_matrix(self, q: ArrayLike) -> Array | None:
        """(nu, nu), a new array, where no body is flexible."""
        if not (self._rigid and plain(q, self._nq)):
            return None
        nu, buffer, real = self._nu, self._buffer, self._real
        matrix = np.empty((nu, nu))
        failed = self._mass(self._record(), buffer(real, q), buffer(real, matrix))
        return None if failed else matrix

    def _record(self) -> Any:
        """This thread's record, made again when there is code of the scene."""
        library = self._fusion.library
        try:
            known, record = self._local.made
        except AttributeError:
            known = record = None
        if record is None or known is not library:
            record = self._made(library)
            self._local.made = library, record
        return record

    def _made(self, library: FusedLibrary | None) -> Any:
        engine, fusion = self._engine, self._fusion
        record = engine.ffi.new("mstmm_alone *")
        record.model, record.workspace = engine.packed.model, engine.workspace()
        record.inertia = engine.inertia_alone.packed.model
        p = np.zeros(0) if library is None else np.array(fusion.numbers)
        arrays = (
            p, engine.start_memory(), np.zeros(engine.nu), np.empty(engine.nq),
            np.empty(2 * engine.nu),
        )  # fmt: skip
        kept: list[Any] = [engine.pointer(array) for array in arrays]
        record.p, record.memory, record.none, record.qdot, record.work = kept
        if library is not None:
            record.fused = library.descriptor
            live = LiveInputs(engine.packed.system, fusion.inputs)
            if live.varies:
                places: NDArray[np.int32] = live.places
                record.live.n, record.live.inputs = len(places), engine.packed.model.inputs
                record.live.places = place = engine.ffi.from_buffer("int[]", places)
                kept.append(place)
        self._local.kept = library, kept
        return record
