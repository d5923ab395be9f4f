"""Memory that C records point to."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.ir import KernelIR
from mstmm.ir.tape import Tape, compile_tape

from ...kernels.tape_kernel import c_tape

#: Numbers side by side: a sweep over many bodies meets them in this order.
_ROOM = 4096


class Memory:
    """Makes arrays, tapes and records of C; `kept` keeps them, `slots` is what a tape needs."""

    def __init__(self, ffi: Any) -> None:
        self.ffi, self.slots = ffi, 0
        self.kept: list[Any] = []
        #: C type -> a room, and how many of its numbers are taken.
        self._rooms: dict[str, tuple[Any, int]] = {}

    def new(self, kind: str, given: Any = None) -> Any:
        """A new record, or an array of them."""
        made = self.ffi.new(kind) if given is None else self.ffi.new(kind, given)
        self.kept.append(made)
        return made

    def reals(self, numbers: Sequence[float]) -> Any:
        """`real *` to numbers of their own, next to those asked for before."""
        return self._placed("real", list(numbers) or [0.0])

    def ints(self, numbers: Sequence[int]) -> Any:
        """`int *` to numbers of their own, next to those asked for before."""
        return self._placed("int", list(numbers) or [0])

    def _placed(self, kind: str, numbers: list[Any]) -> Any:
        count = len(numbers)
        room, taken = self._rooms.get(kind, (None, _ROOM))
        if taken + count > _ROOM:
            room, taken = self.new(f"{kind}[]", max(_ROOM, count)), 0
        room[taken : taken + count] = numbers
        self._rooms[kind] = room, taken + count
        return room + taken

    def array(self, numbers: Array) -> Any:
        """`real *` to the numbers of an array, row by row."""
        flat = np.ascontiguousarray(np.ravel(numbers) if np.size(numbers) else [0.0], dtype=float)
        self.kept.append(flat)
        return self.ffi.from_buffer("real[]", flat)

    def tape(self, tape: Tape) -> Any:
        """`mstmm_tape *`."""
        self.slots = max(self.slots, tape.slots)
        return c_tape(self.ffi, tape, self.kept)

    def expression(self, kernel: KernelIR | None) -> Any:
        """The tape of a kernel of expressions, NULL where there is none."""
        return self.ffi.NULL if kernel is None else self.tape(compile_tape(kernel))
