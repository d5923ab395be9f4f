"""Kernel on the bytecode interpreter, which needs no compiler: arrays in, arrays out."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mstmm.array_validation import Array
from mstmm.ir import KernelIR
from mstmm.ir.tape import compile_tape

from . import prebuilt_kernels
from .c_records import c_tape


class TapeKernel:
    """Kernel of fixed size as a tape.  Not thread-safe."""

    def __init__(self, kernel: KernelIR) -> None:
        self._ffi, self._lib = prebuilt_kernels.module()
        self._references: list[object] = []
        tape = compile_tape(kernel)
        self._tape = c_tape(self._ffi, tape, self._references)
        self._work = self._reals(tape.slots)
        self._inputs = {p.name: self._reals(p.length()) for p in kernel.inputs}
        self._outputs = {p.name: self._reals(p.length()) for p in kernel.outputs}
        pointer, new = self._pointer, self._ffi.new
        self._in = new("real *[]", [pointer(x) for x in self._inputs.values()] or 1)
        self._out = new("real *[]", [pointer(x) for x in self._outputs.values()] or 1)

    def _reals(self, length: int) -> Array:
        return np.zeros(max(1, length))

    def _pointer(self, array: Array) -> object:
        buffer: object = self._ffi.from_buffer("real[]", array)
        return buffer

    def run(self, values: Mapping[str, Array]) -> tuple[int, dict[str, Array]]:
        """Evaluate (code, outputs); the code is 0, or that of the guard that failed.

        The outputs are views that the next run overwrites.  Omitted inputs keep their last values
        (initially 0).
        """
        for name, array in self._inputs.items():
            if name in values:
                array[: len(values[name])] = values[name]
        work = self._pointer(self._work)
        code = int(self._lib.mstmm_tape_run(self._tape, self._in, work, self._out))
        return code, self._outputs
