"""mstmm's two engines as functions of the signature of native.h."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

import mstmm

from . import native


class _Context(ctypes.Structure):
    _fields_ = [
        ("f", ctypes.c_void_p), ("model", ctypes.c_void_p), ("workspace", ctypes.c_void_p),
        ("failure", ctypes.c_int * 4),
    ]  # fmt: skip


def looped_subject(model: mstmm.Model, q: np.ndarray, u: np.ndarray) -> native.Subject:
    """Looped engine."""
    engine = model.looped
    ffi = engine.ffi
    source = (native.HERE / "mstmm_looped.c").read_text()
    shared_library = ctypes.CDLL(
        str(native.compile_library("mstmm_looped", source, ["-O2", "-std=gnu17"]))
    )
    f: Any = ctypes.c_void_p.in_dll(shared_library, "looped_accelerations").value
    function = ffi.addressof(engine.lib, "mstmm_accelerations")
    addresses = [int(ffi.cast("intptr_t", x)) for x in (function, engine.packed.model)]
    workspace = native.aligned_copy(np.zeros(int(engine.packed.model.workspace)))
    context = _Context(*addresses, workspace.ctypes.data)
    return native.Subject(
        f, ctypes.addressof(context), q, u, memory=engine.start_memory(),
        owner=(shared_library, context, workspace, model),
    )  # fmt: skip


def fused_subject(model: mstmm.Model, q: np.ndarray, u: np.ndarray) -> native.Subject:
    """Fused engine with run-time parameters."""
    library = model.fusion.library
    ffi = library.ffi
    address = int(ffi.cast("intptr_t", library.descriptor.accelerations))
    return native.Subject(
        address, np.asarray(model.fusion.numbers), q, u, memory=model.looped.start_memory(),
        owner=model,
    )  # fmt: skip


class Lanes:
    """The fused code over SIMD lanes on states q (n, nq), u (n, nu): one call in C for all."""

    def __init__(self, model: mstmm.Model, q: np.ndarray, u: np.ndarray) -> None:
        library = model.fusion.ready_lanes(1e12)
        ffi, self.function = library.ffi, library.descriptor.accelerations_many
        self.udot = native.aligned_copy(np.zeros_like(u))
        self.codes = np.zeros(len(q), dtype=np.int32)
        self.arrays = {
            "p": native.aligned_copy(model.fusion.numbers), "t": np.zeros(1),
            "q": native.aligned_copy(q), "u": native.aligned_copy(u),
            "memory": model.looped.start_memory(), "udot": self.udot,
        }  # fmt: skip
        self.batch = ffi.new("mstmm_batch *")
        self.batch.n, self.batch.codes = len(q), ffi.from_buffer("int[]", self.codes)
        for name, array in self.arrays.items():
            setattr(self.batch, name, ffi.from_buffer("double[]", array))

    def __call__(self) -> None:
        """Compute udot of all states; RuntimeError if one is rejected."""
        if self.function(self.batch):
            raise RuntimeError("a state was rejected")
