"""One state at a time, as it is asked for a million times: what stays the same is made once."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mstmm.arrays import Array, row

from ..code import Fusing
from ..engine import Engine
from ..live import LiveInputs

#: Mass matrices of more speeds take so long that nothing is kept for them.
_MOST_KEPT = 100


class Alone:
    """Calls on states that are already rows of doubles (nq,), (nu,).

    They give None where a state is none of these, or where something fails: the general way then
    serves it, or says what is wrong.  Safe to call from several threads.
    """

    def __init__(self, engine: Engine, fusion: Fusing) -> None:
        self._engine, self._fusion = engine, fusion
        self._nq, self._nu = engine.nq, engine.nu
        self._local = threading.local()
        self._none = engine.ffi.NULL
        self._accelerations = engine.lib.mstmm_alone_accelerations
        self._efforts = engine.lib.mstmm_alone_efforts
        self._mass = engine.lib.mstmm_alone_mass
        self._kept = not engine.packed.layout.modal and engine.nu <= _MOST_KEPT
        self._asked = 0

    def accelerations(
        self, t: float, q: ArrayLike, u: ArrayLike, efforts: ArrayLike | None
    ) -> Array | None:
        """udot (nu,), a new array."""
        at, speeds = row(q, self._nq), row(u, self._nu)
        extra = self._none if efforts is None else row(efforts, self._nu)
        if at is None or speeds is None or extra is None:
            return None
        made = self._made()
        if self._accelerations(made.record, t, at, speeds, extra):
            return None
        return made.found.copy()

    def efforts(self, t: float, q: ArrayLike, u: ArrayLike, udot: ArrayLike) -> Array | None:
        """Efforts (nu,) beyond those of laws that give udot, a new array."""
        at, speeds, rates = row(q, self._nq), row(u, self._nu), row(udot, self._nu)
        if at is None or speeds is None or rates is None:
            return None
        made = self._made(inverse=True)
        if self._efforts(made.record, t, at, speeds, rates):
            return None
        return made.found.copy()

    def mass_matrix(self, q: ArrayLike) -> Array | None:
        """(nu, nu), a new array, where no body is flexible."""
        at = row(q, self._nq) if self._kept else None
        if at is None:
            return None
        made = self._made(inverse=True)
        if self._mass(made.record, at):
            return None
        return made.matrix.copy()

    def _made(self, inverse: bool = False) -> _Record:
        """This thread's record, made again when there is more code of the scene."""
        fusion = self._fusion
        if inverse and fusion.inverse is None:
            self._ask()
        try:
            made: _Record = self._local.made
            if made.library is fusion.library and made.inverse is fusion.inverse:
                return made
        except AttributeError:
            pass
        self._local.made = made = _Record(self._engine, fusion, self._kept)
        return made

    def _ask(self) -> None:
        """Look for code of inverse dynamics at the first call, and at those numbers that double."""
        self._asked += 1
        if self._asked & (self._asked - 1) == 0:
            self._fusion.ready_inverse(self._asked)


class _Record:
    """The record of one thread, with all that it points to.

    Attributes:
        record: for C.
        library, inverse: code of the scene that it knows.
        found, matrix: (nu,), (nu, nu), written by calls.
    """

    __slots__ = ("_pointed", "found", "inverse", "library", "matrix", "record")

    def __init__(self, engine: Engine, fusion: Fusing, kept: bool) -> None:
        nq, nu = engine.nq, engine.nu
        self.library, self.inverse = fusion.library, fusion.inverse
        self.found, self.matrix = np.empty(nu), np.empty((nu, nu) if kept else (0, 0))
        self.record = record = engine.ffi.new("mstmm_alone *")
        record.model, record.workspace = engine.packed.model, engine.workspace()
        record.inertia = engine.inertia_alone.packed.model
        fused = self.library is not None or self.inverse is not None
        p = np.array(fusion.numbers) if fused else np.zeros(0)
        arrays = (
            p, engine.start_memory(), np.zeros(nu), np.empty(nq), np.empty(2 * nu), self.found,
            self.matrix.reshape(-1),
        )  # fmt: skip
        self._pointed: list[Any] = [engine.pointer(array) for array in arrays]
        (record.p, record.memory, record.none, record.qdot, record.work, record.found,
         record.matrix) = self._pointed  # fmt: skip
        record.fused, record.inverse = (
            engine.ffi.NULL if one is None else one.descriptor
            for one in (self.library, self.inverse)
        )
        if fused:
            self._follow(engine, LiveInputs(engine.packed.system, fusion.inputs))

    def _follow(self, engine: Engine, live: LiveInputs) -> None:
        if live.varies:
            places: NDArray[np.int32] = live.places
            to = self.record.live
            to.n, to.inputs = len(places), engine.packed.model.inputs
            to.places = place = engine.ffi.from_buffer("int[]", places)
            self._pointed.append(place)
