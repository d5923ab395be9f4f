"""Runs of bodies that the looped engine sweeps as links."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .packed import Packed


def attach_runs(packed: Packed) -> None:
    """Split the bodies into runs and give their links a place behind the blocks."""
    ffi, model, count = packed.ffi, packed.model, max(1, int(packed.model.n_bodies))
    runs, numbers = ffi.new("mstmm_branch[]", count), ffi.new("real *[]", count)
    size, gathered = ffi.new("int64_t *"), ffi.NULL
    if len(np.unique(packed.records.column("link"))) > count // 4:
        gathered = ffi.new("real[]", count * packed.lib.MSTMM_LINK_NUMBERS)
    found = packed.lib.mstmm_fill_runs(model, runs, numbers, gathered, model.scratch, size)
    shorter = ffi.new("mstmm_branch[]", max(1, found))  # often one run for thousands of bodies
    ffi.memmove(shorter, runs, found * ffi.sizeof("mstmm_branch"))
    model.runs, model.n_runs = shorter, found
    model.scratch += size[0]
    packed.kept += [shorter, numbers, gathered]
