"""Inputs among the numbers p of compiled code: positions, and values over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.numerics.piecewise_polynomial import NUMBERS_PER_PIECE

if TYPE_CHECKING:
    from ..packing.system import System

IndexPairs = Sequence[tuple[int, int]]

#: Index of the value among the numbers of a constant input; see `mstmm_input_now`.
_VALUE_INDEX = 1


class LiveInputs:
    """Inputs of a system among the numbers p that its compiled code reads.

    `read` contains pairs (index among the numbers of all inputs, index in p).  `indices` (inputs,
    `NUMBERS_PER_PIECE`) are the indices in p, -1 for numbers that are not read.
    """

    def __init__(self, system: System, read: IndexPairs) -> None:
        self._inputs = inputs = system.inputs
        self.indices: NDArray[np.int32] = np.full(
            (len(inputs), NUMBERS_PER_PIECE), -1, dtype=np.int32
        )
        for entry, memory_index in read:
            self.indices[entry // NUMBERS_PER_PIECE, entry % NUMBERS_PER_PIECE] = memory_index
        self._varying = [
            i for i, channel in enumerate(inputs) if channel.varies and (self.indices[i] >= 0).any()
        ]
        self._stored = [
            (i, memory_index) for i, memory_index in enumerate(system.held_inputs.memory_indices)
            if memory_index >= 0 and (self.indices[i] >= 0).any()
        ]  # fmt: skip

    @property
    def varies(self) -> bool:
        """True if any number in p changes with time or is stored in memory."""
        return bool(self._varying or self._stored)

    def numbers_in_run(self, p: Array, t: float, memory: Array) -> Array:
        """Numbers p (np,) at time t (s) of a run, with stored inputs from its `memory`."""
        numbers = self.numbers_at(p, np.array([t])).reshape(-1).copy()
        for i, memory_index in self._stored:
            is_read = self.indices[i] >= 0
            pieces = np.where(
                np.arange(NUMBERS_PER_PIECE) == _VALUE_INDEX, memory[memory_index], 0.0
            )
            numbers[self.indices[i, is_read]] = pieces[is_read]
        return numbers

    def numbers_at(self, p: Array, t: Array) -> Array:
        """Numbers p (n, np) at times t (n,), s; the given p (np,) if it is constant."""
        if not self._varying:
            return p
        rows = np.repeat(p[None], len(t), axis=0)
        for i in self._varying:
            is_read = self.indices[i] >= 0
            pieces = np.array([self._inputs[i].piece_at(time) for time in t.tolist()])
            rows[:, self.indices[i][is_read]] = pieces[:, is_read]
        return rows
