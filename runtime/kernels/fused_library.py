"""Loaded fused library: the compiled accelerations of one scene, for one state or a batch."""

from __future__ import annotations

import ctypes
import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mstmm.abi.fused_library import ABI_VERSION, SYMBOL
from mstmm.array_validation import Array
from mstmm.errors import EnvironmentFailure

from . import prebuilt_kernels

Codes = NDArray[np.int32]


def open_library(path: Path, key: str) -> FusedLibrary:
    """Open a fused library that was built with `key`.

    The cache must have verified its checksum: loaders crash on truncated files.  Raises
    EnvironmentFailure, with the library closed, if the file cannot be loaded (missing, no library,
    built for another machine), is no fused library, or has another ABI number or key.
    """
    try:
        handle = ctypes.CDLL(os.fspath(path), mode=os.RTLD_NOW | os.RTLD_LOCAL)
    except OSError as error:
        raise EnvironmentFailure(
            f"the compiled library {path} cannot be loaded ({error}); remove it: mstmm cache clean"
        ) from error
    try:
        return FusedLibrary(_find_descriptor(handle, path, key), handle)
    except EnvironmentFailure:
        _close(handle)
        raise


def _find_descriptor(loaded: ctypes.CDLL, path: Path, key: str) -> Any:
    """`const mstmm_fused *` of a loaded library; EnvironmentFailure if it is another library."""
    ffi, _ = prebuilt_kernels.module()
    try:
        abi_number = ctypes.c_int.in_dll(loaded, SYMBOL)
    except ValueError:
        raise EnvironmentFailure(
            f"{path} is no fused library: it has no {SYMBOL}; remove it: mstmm cache clean"
        ) from None
    # The ABI number is the first field of every layout, so that it can be read before the others.
    if abi_number.value != ABI_VERSION:
        raise EnvironmentFailure(
            f"{path} was built for layout {abi_number.value}, this mstmm has {ABI_VERSION}; "
            "remove it: mstmm cache clean"
        )
    descriptor = ffi.cast("const mstmm_fused *", ctypes.addressof(abi_number))
    stored_key = prebuilt_kernels.text(ffi, descriptor.key)
    if stored_key != key:
        raise EnvironmentFailure(
            f"{path} was built for the key {stored_key[:12]}, expected {key[:12]}; "
            "remove it: mstmm cache clean"
        )
    return descriptor


def _close(loaded: ctypes.CDLL) -> None:
    import _ctypes

    _ctypes.dlclose(loaded._handle)


class FusedLibrary:
    """Functions of one fused library.  Safe to call from several threads.

    `failures[code - 1]` is (reason, element, code) of a guard code, as in the looped engine;
    `descriptor` is `const mstmm_fused *` of the prebuilt module.
    """

    def __init__(self, descriptor: Any, loaded: ctypes.CDLL) -> None:
        self.descriptor, self._library = descriptor, loaded
        self.ffi, _ = prebuilt_kernels.module()
        self.nq, self.nu = int(descriptor.nq), int(descriptor.nu)
        self.np, self.n_memory = int(descriptor.np), int(descriptor.n_memory)
        self.lanes = int(descriptor.lanes)
        failure_table = [int(descriptor.failures[i]) for i in range(3 * descriptor.n_failures)]
        self.failures = [
            (failure_table[i], failure_table[i + 1], failure_table[i + 2])
            for i in range(0, len(failure_table), 3)
        ]

    def pointer(self, array: Array) -> Any:
        """`double *` to a contiguous array of doubles."""
        return self.ffi.from_buffer("double[]", array)

    def evaluate(
        self, p: Array, t: float, q: Array, u: Array, memory: Array, efforts: Array
    ) -> tuple[int, Array, Array]:
        """Evaluate (code, qdot, udot) of one state; contiguous arrays of the library's sizes."""
        call = SingleStateCall(self, p)
        call.t[0], call.q[:], call.u[:] = t, q, u
        call.memory[: self.n_memory], call.efforts[:] = memory[: self.n_memory], efforts
        return call(), call.qdot, call.udot

    def accelerations_batch(
        self,
        p: Array,
        t: Array,
        q: Array,
        u: Array,
        memory: Array,
        efforts: Array | None,
        udot: Array,
        qdot: Array | None = None,
    ) -> Codes:
        """Fill udot (n, nu), and qdot (n, nq) if given, for n states; returns their codes (n,).

        q (n, nq), u (n, nu), efforts (n, nu) or None; t (n,) or (1,), p (n, np) or (np,), memory
        (n, m) or (m,) with m at least n_memory: one row is shared by all states.  The result of a
        state depends on no other state; that of a state with a nonzero code is invalid.  All arrays
        are contiguous.
        """
        n, null = len(q), self.ffi.NULL
        codes = np.zeros(n, dtype=np.int32)
        batch = self.ffi.new("mstmm_batch *")
        pointers = [
            null if array is None else self.pointer(array)
            for array in (p, t, q, u, memory, efforts, qdot, udot)
        ]
        code_pointer = self.ffi.from_buffer("int[]", codes)
        batch.n, batch.codes = n, code_pointer
        batch.p, batch.t, batch.q, batch.u, batch.memory, batch.efforts = pointers[:6]
        batch.qdot, batch.udot = pointers[6:]
        batch.p_stride = p.shape[1] if p.ndim == 2 else 0
        batch.t_stride = 1 if len(t) > 1 else 0
        batch.memory_stride = memory.shape[1] if memory.ndim == 2 else 0
        batch.efforts_stride = self.nu
        if n:
            self.descriptor.accelerations_many(batch)
        return codes


class SingleStateCall:
    """Arrays of one state with prepared pointers: write q, u, ... and call the object.

    Not thread-safe: every thread needs its own.
    """

    def __init__(self, library: FusedLibrary, p: Array) -> None:
        self.p = np.array(p, dtype=np.float64)
        self.t = np.zeros(1)
        self.q, self.u = np.zeros(library.nq), np.zeros(library.nu)
        self.memory, self.efforts = np.zeros(library.n_memory), np.zeros(library.nu)
        self.qdot, self.udot = np.zeros(library.nq), np.zeros(library.nu)
        self._library = library
        self._function = library.descriptor.accelerations
        self._pointers = tuple(
            library.pointer(array)
            for array in (
                self.p, self.t, self.q, self.u, self.memory, self.efforts, self.qdot, self.udot,
            )
        )  # fmt: skip

    def __call__(self) -> int:
        """Fill qdot and udot; returns 0, or a guard code, with which their content is invalid."""
        return int(self._function(*self._pointers))
