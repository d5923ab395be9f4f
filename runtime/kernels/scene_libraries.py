"""Loaded libraries of one scene: its compiled accelerations, and its derivatives."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mstmm.abi import derivative_library as derivative_abi
from mstmm.abi import fused_library as fused_abi
from mstmm.array_validation import Array
from mstmm.errors import EnvironmentFailure

from . import prebuilt_kernels

# --- fused library --------------------------------------------------------------------------------

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
        abi_number = ctypes.c_int.in_dll(loaded, fused_abi.SYMBOL)
    except ValueError:
        raise EnvironmentFailure(
            f"{path} is no fused library: it has no {fused_abi.SYMBOL}; "
            "remove it: mstmm cache clean"
        ) from None
    # The ABI number is the first field of every layout, so that it can be read before the others.
    if abi_number.value != fused_abi.ABI_VERSION:
        raise EnvironmentFailure(
            f"{path} was built for layout {abi_number.value}, this mstmm has "
            f"{fused_abi.ABI_VERSION}; remove it: mstmm cache clean"
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


# --- library of derivatives -----------------------------------------------------------------------


class _CCall(ctypes.Structure):
    _fields_ = (
        ("inputs", ctypes.c_void_p * 6), ("strides", ctypes.c_longlong * 6),
        ("states", ctypes.c_longlong), ("n", ctypes.c_longlong), ("directions", ctypes.c_void_p),
        ("direction_stride", ctypes.c_longlong), ("result", ctypes.c_void_p),
    )  # fmt: skip


_RUN_TYPE = ctypes.CFUNCTYPE(None, ctypes.POINTER(_CCall))


class _CKernel(ctypes.Structure):
    _fields_ = (("width_in", ctypes.c_int), ("width_out", ctypes.c_int), ("run", _RUN_TYPE))


class _CLibrary(ctypes.Structure):
    _fields_ = (
        ("abi", ctypes.c_int), ("n_kernels", ctypes.c_int), ("key", ctypes.c_char_p),
        ("kernels", ctypes.POINTER(_CKernel)),
    )  # fmt: skip


def open_derivative_library(path: Path, key: str) -> DerivativeLibrary:
    """Open a library of derivatives that was built with `key`.

    Raises EnvironmentFailure, with the library closed, if it cannot be loaded or has another key.
    """
    remedy = "remove it: mstmm cache clean"
    try:
        handle = ctypes.CDLL(os.fspath(path), mode=os.RTLD_NOW | os.RTLD_LOCAL)
    except OSError as error:
        raise EnvironmentFailure(f"{path} cannot be loaded ({error}); {remedy}") from error
    try:
        descriptor = _CLibrary.in_dll(handle, derivative_abi.SYMBOL)
        is_expected = (
            descriptor.abi == derivative_abi.ABI_VERSION and descriptor.key == key.encode()
        )
    except ValueError:
        is_expected = False
    if not is_expected:
        import _ctypes

        _ctypes.dlclose(handle._handle)
        raise EnvironmentFailure(f"{path} is not the expected library of derivatives; {remedy}")
    return DerivativeLibrary(handle, descriptor)


class DerivativeLibrary:
    """Compiled directional derivatives of a scene's functions; safe to call from several threads.

    A kernel is named by its index in the library.
    """

    def __init__(self, loaded: ctypes.CDLL, found: _CLibrary) -> None:
        self._library = loaded
        self._kernels = [found.kernels[k] for k in range(found.n_kernels)]

    def run(self, kernel: int, inputs: Sequence[Array], directions: Array) -> Array:
        """Derivatives (states, n, width_out) along directions (states or 1, n, width_in).

        `inputs` are p, t, q, u, memory, efforts, each contiguous, (states or 1, width); an array
        with one row is shared by all states.
        """
        kernel_record = self._kernels[kernel]
        rows = np.ascontiguousarray(directions)
        states = max(len(rows), *map(len, inputs))
        result = np.empty((states, rows.shape[1], kernel_record.width_out))
        call = _CCall(states=states, n=rows.shape[1])
        for k, array in enumerate(inputs):
            call.inputs[k] = array.ctypes.data
            call.strides[k] = array.shape[1] if len(array) > 1 else 0
        call.directions, call.result = rows.ctypes.data, result.ctypes.data
        call.direction_stride = rows[0].size if len(rows) > 1 else 0
        kernel_record.run(ctypes.byref(call))
        return result
