"""Memory that C records point to."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.ir import KernelIR
from mstmm.ir.tape import Tape, compile_tape

from ...kernels.tape_kernel import c_tape

#: Length of the blocks that hold small arrays side by side, in the order in which a sweep over many
#: bodies reads them.
_BLOCK_LENGTH = 4096


class Memory:
    """Allocator of C arrays, tapes and records.

    `keep_alive` are the references that keep them alive, `slots` is the largest workspace of a
    tape.
    """

    def __init__(self, ffi: Any) -> None:
        self.ffi, self.slots = ffi, 0
        self.keep_alive: list[Any] = []
        #: C type -> current block, and the length used.
        self._blocks: dict[str, tuple[Any, int]] = {}

    def new(self, kind: str, given: Any = None) -> Any:
        """Allocate a record or an array of them."""
        data = self.ffi.new(kind) if given is None else self.ffi.new(kind, given)
        self.keep_alive.append(data)
        return data

    def reals(self, numbers: Sequence[float]) -> Any:
        """Pointer `real *` to a copy of the numbers, stored after those of the last call."""
        return self._store("real", list(numbers) or [0.0])

    def ints(self, numbers: Sequence[int]) -> Any:
        """Pointer `int *` to a copy of the numbers, stored after those of the last call."""
        return self._store("int", list(numbers) or [0])

    def _store(self, kind: str, numbers: list[Any]) -> Any:
        count = len(numbers)
        block, used = self._blocks.get(kind, (None, _BLOCK_LENGTH))
        if used + count > _BLOCK_LENGTH:
            block, used = self.new(f"{kind}[]", max(_BLOCK_LENGTH, count)), 0
        block[used : used + count] = numbers
        self._blocks[kind] = block, used + count
        return block + used

    def array(self, numbers: Array) -> Any:
        """Pointer `real *` to the entries of an array, row by row."""
        flat = np.ascontiguousarray(np.ravel(numbers) if np.size(numbers) else [0.0], dtype=float)
        self.keep_alive.append(flat)
        return self.ffi.from_buffer("real[]", flat)

    def tape(self, tape: Tape) -> Any:
        """Pointer `mstmm_tape *` to a copy of the tape."""
        self.slots = max(self.slots, tape.slots)
        return c_tape(self.ffi, tape, self.keep_alive)

    def expression(self, kernel: KernelIR | None) -> Any:
        """Tape of a kernel of expressions; NULL without one."""
        return self.ffi.NULL if kernel is None else self.tape(compile_tape(kernel))
