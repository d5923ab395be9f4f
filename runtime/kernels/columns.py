"""Loaded library of derivatives: tangent kernels of one scene for many directions at a time."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from mstmm.arrays import Array
from mstmm.border.columns import ABI, SYMBOL
from mstmm.errors import EnvironmentFailure


class _Call(ctypes.Structure):
    _fields_ = (
        ("inputs", ctypes.c_void_p * 6), ("strides", ctypes.c_longlong * 6),
        ("states", ctypes.c_longlong), ("n", ctypes.c_longlong), ("directions", ctypes.c_void_p),
        ("direction_stride", ctypes.c_longlong), ("result", ctypes.c_void_p),
    )  # fmt: skip


_RUN = ctypes.CFUNCTYPE(None, ctypes.POINTER(_Call))


class _Kernel(ctypes.Structure):
    _fields_ = (("width_in", ctypes.c_int), ("width_out", ctypes.c_int), ("run", _RUN))


class _Library(ctypes.Structure):
    _fields_ = (
        ("abi", ctypes.c_int), ("n_kernels", ctypes.c_int), ("key", ctypes.c_char_p),
        ("kernels", ctypes.POINTER(_Kernel)),
    )  # fmt: skip


def open_columns(path: Path, key: str) -> ColumnsLibrary:
    """Open a library of derivatives that was built with `key`.

    Raises EnvironmentFailure, with the library closed, if it cannot be loaded or has another key.
    """
    way_out = "remove it: mstmm cache clean"
    try:
        loaded = ctypes.CDLL(os.fspath(path), mode=os.RTLD_NOW | os.RTLD_LOCAL)
    except OSError as error:
        raise EnvironmentFailure(f"{path} cannot be loaded ({error}); {way_out}") from error
    try:
        found = _Library.in_dll(loaded, SYMBOL)
        right = found.abi == ABI and found.key == key.encode()
    except ValueError:
        right = False
    if not right:
        import _ctypes

        _ctypes.dlclose(loaded._handle)
        raise EnvironmentFailure(f"{path} is not the expected library of derivatives; {way_out}")
    return ColumnsLibrary(loaded, found)


class ColumnsLibrary:
    """Tangent kernels of one library, by index.  Safe to call from several threads."""

    def __init__(self, loaded: ctypes.CDLL, found: _Library) -> None:
        self._loaded = loaded
        self._kernels = [found.kernels[k] for k in range(found.n_kernels)]

    def run(self, kernel: int, inputs: Sequence[Array], directions: Array) -> Array:
        """Derivatives (states, n, width_out) along directions (states or 1, n, width_in).

        `inputs` are p, t, q, u, memory, efforts, each contiguous, (states or 1, width); an array
        with one row is shared by all states.
        """
        found = self._kernels[kernel]
        rows = np.ascontiguousarray(directions)
        states = max(len(rows), *map(len, inputs))
        result = np.empty((states, rows.shape[1], found.width_out))
        call = _Call(states=states, n=rows.shape[1])
        for k, array in enumerate(inputs):
            call.inputs[k] = array.ctypes.data
            call.strides[k] = array.shape[1] if len(array) > 1 else 0
        call.directions, call.result = rows.ctypes.data, result.ctypes.data
        call.direction_stride = rows[0].size if len(rows) > 1 else 0
        found.run(ctypes.byref(call))
        return result
