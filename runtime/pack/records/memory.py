"""Memory that C records point to."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mstmm.arrays import Array
from mstmm.ir import KernelIR
from mstmm.ir.tape import Tape, compile_tape

from ...kernels.tape import c_tape


class Memory:
    """Makes arrays, tapes and records of C; `kept` keeps them, `slots` is what a tape needs."""

    def __init__(self, ffi: Any) -> None:
        self.ffi, self.slots = ffi, 0
        self.kept: list[Any] = []

    def new(self, kind: str, given: Any = None) -> Any:
        """A new record, or an array of them."""
        made = self.ffi.new(kind) if given is None else self.ffi.new(kind, given)
        self.kept.append(made)
        return made

    def reals(self, numbers: Sequence[float]) -> Any:
        """`real *` to numbers of their own."""
        return self.new("real[]", list(numbers) or [0.0])

    def ints(self, numbers: Sequence[int]) -> Any:
        """`int *` to numbers of their own."""
        return self.new("int[]", list(numbers) or [0])

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
