"""Harmonic response of a packed scene, by the looped engine in O(bodies).

Z(s) x = r with Z(s) = s^2 M + s C + K, the complex tangent of the residual
(derive/codegen/complex_sweep.py).  The contributions of the bodies are computed once; every s
requires one elimination.  Hysteretic damping adds i (K' - K), where K' belongs to a scene with its
stiffness increased by the loss factors.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array, Integers

from .tangent_matrix import TangentMatrix, count_negative

if TYPE_CHECKING:
    from .looped_engine import LoopedEngine

Complex = NDArray[np.complex128]


class DynamicStiffnessBodies(NamedTuple):
    """Flexible bodies with dynamic stiffness, by their indices in the tree.

    `stiffness` returns at s (k,) one matrix (k, 6 + n, 6 + n) for each body: loads on the frame, in
    three rotations and three displacements, and on the n shapes.
    """

    body_indices: tuple[int, ...]
    stiffness: Callable[[Complex], list[Complex]]


class HarmonicResponse:
    """Dynamic stiffness Z(s) of one scene about one state; use one instance per thread.

    `lanes` is the number of s evaluated together, 2 or 4; 0 for the maximum of the processor.
    `stiffer` is the scene with elastic stiffness increased by the loss factors; `exact` are bodies
    with dynamic stiffness.
    """

    def __init__(
        self, engine: LoopedEngine, t: float, q: Array, u: Array, a: Array, lanes: int = 0,
        stiffer: LoopedEngine | None = None, exact: DynamicStiffnessBodies | None = None,
    ) -> None:  # fmt: skip
        self.engine, self.tangent = engine, TangentMatrix(engine)
        self.tangent.residual(t, q, u, a)
        nu, coupled_count, count = engine.nu, self.tangent.off_tree_count, len(self.tangent.numbers)
        lane_doubles = 2 * int(engine.lib.MSTMM_MOST_LANES)
        self._record = record = engine.ffi.new("mstmm_response *")
        record.at, record.lanes, record.n_numbers = self.tangent.record, lanes, count
        if stiffer is not None:
            self._stiffer = TangentMatrix(stiffer)
            self._stiffer.residual(t, q, u, a)
            record.stiffer = self._stiffer.record
        self._arrays = {
            "contributions": _aligned_zeros(3 * count),
            "numbers": _aligned_zeros(lane_doubles * count),
            "workspace": _aligned_zeros(lane_doubles * engine.packed.workspace),
            "vectors": _aligned_zeros(lane_doubles * 2 * nu),
            "scratch": _aligned_zeros(3 * nu + 2 * coupled_count),
            "answers": _aligned_zeros(lane_doubles * coupled_count * nu),
            "closure": _aligned_zeros(lane_doubles * coupled_count * (4 * coupled_count + 2)),
        }
        for name, array in self._arrays.items():
            setattr(record, name, engine.pointer(array))
        if engine.lib.mstmm_response_begin(record):
            raise engine.evaluation_error(self.tangent.record.failure, t, *self.tangent.state)
        self._exact = exact
        if exact is not None:
            self._order = np.argsort(exact.body_indices)[::-1]
            self._exact_body_indices = np.array(exact.body_indices, dtype=np.int32)[self._order]
            record.exact_bodies = engine.ffi.from_buffer("int[]", self._exact_body_indices)
            record.n_exact = len(self._order)

    def amplitudes(self, s: Complex, columns: Array) -> tuple[Complex, Array, NDArray[np.int32]]:
        """Amplitudes x (k, n, nu) at every s (k,), 1/s, for n right-hand sides (n, nu).

        Also returns the growth of inertia in the elimination (k,) and the body where it occurs
        (k,).  An elimination loses as many digits as inertia grows; if it is singular, the growth
        is infinite and x is zero.
        """
        points, rows = np.ascontiguousarray(s), np.ascontiguousarray(columns, float)
        x = np.zeros((len(points), len(rows), self.engine.nu), dtype=np.complex128)
        growth, growth_bodies = np.zeros(len(points)), np.zeros(len(points), dtype=np.int32)
        pointer = self.engine.pointer
        exact_stiffness = self._stiffness(points)  # keeps the memory alive during the call
        self.engine.lib.mstmm_response_many(
            self._record, len(points), pointer(points.view(np.float64)), len(rows), pointer(rows),
            pointer(x.view(np.float64)), pointer(growth),
            self.engine.ffi.from_buffer("int[]", growth_bodies),
        )  # fmt: skip
        del exact_stiffness
        return x, growth, growth_bodies

    def _stiffness(self, points: Complex) -> Complex | None:
        if self._exact is None:
            return None
        parts = self._exact.stiffness(points)
        flat = [parts[k].reshape(len(points), -1) for k in self._order]
        stiffness_rows = np.ascontiguousarray(np.concatenate(flat, axis=1))
        self._record.exact_numbers = stiffness_rows.shape[1]
        self._record.exact = self.engine.pointer(stiffness_rows.view(np.float64))
        return stiffness_rows

    def omit_damping(self) -> None:
        """Omit the terms linear in s in subsequent calls."""
        self._arrays["contributions"][: len(self.tangent.numbers)] = 0.0

    def count_negative(self, squares: Array) -> Integers:
        """Number of negative pivots of a symmetric Z at every s^2 (k,) < 0; -1 for a zero pivot.

        It equals the number of negative eigenvalues (see `TangentMatrix.count_negative`).
        """
        sizes = self._sizes
        pivots = np.zeros((len(squares), int(np.square(sizes).sum())))
        record, points = self._record, np.sqrt(squares.astype(np.complex128))
        record.pivots, record.n_pivots = self.engine.pointer(pivots), pivots.shape[1]
        _, growth, _ = self.amplitudes(points, np.zeros((0, self.engine.nu)))
        record.pivots = self.engine.ffi.NULL
        is_regular = np.isfinite(growth)
        counts = count_negative(np.where(is_regular[:, None], pivots, 0.0), sizes)
        return np.where(is_regular, counts, -1)

    @cached_property
    def _sizes(self) -> Integers:
        """Sizes of the successive pivots."""
        return self.tangent.pivots()[0]


def _aligned_zeros(count: int) -> Array:
    """Array of zeros whose address is a multiple of 64."""
    buffer = np.zeros(count + 8)
    first = -(buffer.ctypes.data // 8) % 8
    return buffer[first : first + count]
