"""Inputs in the numbers p of compiled code: where they stand, and what they are at other times."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mstmm.arrays import Array
from mstmm.numbers.pieces import COUNT

if TYPE_CHECKING:
    from ..pack.system import System

Places = Sequence[tuple[int, int]]


class LiveInputs:
    """The numbers of a system's inputs among those that code compiled for it reads.

    `read` are (place among the numbers of inputs, place in p).  `places` (inputs, COUNT) are the
    latter, -1 for what is not read; `varies` says whether any of it changes with time, or is `held`
    in memory.
    """

    def __init__(self, system: System, read: Places) -> None:
        self._inputs = inputs = system.inputs
        self.places: NDArray[np.int32] = np.full((len(inputs), COUNT), -1, dtype=np.int32)
        for entry, place in read:
            self.places[entry // COUNT, entry % COUNT] = place
        self._moving = [
            i for i, one in enumerate(inputs) if one.varies and (self.places[i] >= 0).any()
        ]
        self._held = any(
            place >= 0 and (self.places[i] >= 0).any() for i, place in enumerate(system.held.places)
        )

    @property
    def varies(self) -> bool:
        """Whether p is not the same at all times."""
        return bool(self._moving) or self._held

    def at(self, p: Array, t: Array) -> Array:
        """p (np,) at the times t (n,): (n, np); p itself where it is always the same."""
        if not self._moving:
            return p
        rows = np.repeat(p[None], len(t), axis=0)
        for i in self._moving:
            there = self.places[i] >= 0
            pieces = np.array([self._inputs[i].at(time) for time in t.tolist()])
            rows[:, self.places[i][there]] = pieces[:, there]
        return rows
