"""Amplitudes of a packed scene under harmonic pushes, by the looped engine in O(bodies).

Z(s) x = r with Z(s) = s^2 M + s C + K, the tangent of the residual in complex numbers
(derive/print/complex.py): what bodies bring is put together once, every s is one elimination.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mstmm.arrays import Array

from .tangent import Tangent

if TYPE_CHECKING:
    from .engine import Engine

Complex = NDArray[np.complex128]


class Response:
    """Z(s) of one scene about one state; each thread needs its own.

    `lanes` is how many s go at a time, 2 or 4; 0 for as many as the processor takes.
    """

    def __init__(
        self, engine: Engine, t: float, q: Array, u: Array, a: Array, lanes: int = 0
    ) -> None:
        self.engine, self.tangent = engine, Tangent(engine)
        self.tangent.residual(t, q, u, a)
        nu, m, count = engine.nu, self.tangent.coupled, len(self.tangent.numbers)
        several = 2 * int(engine.lib.MSTMM_MOST_LANES)
        self._record = record = engine.ffi.new("mstmm_response *")
        record.at, record.lanes, record.n_numbers = self.tangent.record, lanes, count
        self._kept = {
            "brought": _aligned(2 * count),
            "numbers": _aligned(several * count),
            "workspace": _aligned(several * engine.packed.workspace),
            "vectors": _aligned(several * 2 * nu),
            "scratch": _aligned(3 * nu + m),
            "answers": _aligned(several * m * nu),
            "closure": _aligned(several * m * (4 * m + 2)),
        }
        for name, array in self._kept.items():
            setattr(record, name, engine.pointer(array))
        if engine.lib.mstmm_response_begin(record):
            raise engine.failed(self.tangent.record.failure, t, *self.tangent.state)

    def amplitudes(self, s: Complex, columns: Array) -> tuple[Complex, Array, NDArray[np.int32]]:
        """x (k, n, nu) at every s (k,) in 1/s of n right-hand sides (n, nu), by how much the
        elimination made inertia larger (k,), and the body where (k,).

        An elimination loses as many digits as inertia grows; where it is singular the growth is
        infinite, and x is zero.
        """
        points, rows = np.ascontiguousarray(s), np.ascontiguousarray(columns, float)
        x = np.zeros((len(points), len(rows), self.engine.nu), dtype=np.complex128)
        growth, grown = np.zeros(len(points)), np.zeros(len(points), dtype=np.int32)
        pointer = self.engine.pointer
        self.engine.lib.mstmm_response_many(
            self._record, len(points), pointer(points.view(np.float64)), len(rows), pointer(rows),
            pointer(x.view(np.float64)), pointer(growth),
            self.engine.ffi.from_buffer("int[]", grown),
        )  # fmt: skip
        return x, growth, grown


def _aligned(count: int) -> Array:
    """So many zeros that begin where 64 divides the address."""
    room = np.zeros(count + 8)
    first = -(room.ctypes.data // 8) % 8
    return room[first : first + count]
