"""Loaded library of derivatives: tangent kernels of one scene for many directions at a time."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mstmm.abi.derivative_library import ABI_VERSION, SYMBOL
from mstmm.array_validation import Array
from mstmm.errors import EnvironmentFailure


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
        descriptor = _CLibrary.in_dll(handle, SYMBOL)
        is_expected = descriptor.abi == ABI_VERSION and descriptor.key == key.encode()
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
