"""Runs of bodies that the looped engine sweeps as links."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .pack import Packed


def attach_runs(packed: Packed) -> None:
    """Split the bodies into runs and give their links a place behind the blocks."""
    ffi, model, count = packed.ffi, packed.model, max(1, int(packed.model.n_bodies))
    runs, numbers = ffi.new("mstmm_branch[]", count), ffi.new("real *[]", count)
    size = ffi.new("int64_t *")
    found = packed.lib.mstmm_fill_runs(model, runs, numbers, model.scratch, size)
    shorter = ffi.new("mstmm_branch[]", max(1, found))  # often one run for thousands of bodies
    ffi.memmove(shorter, runs, found * ffi.sizeof("mstmm_branch"))
    model.runs, model.n_runs = shorter, found
    model.scratch += size[0]
    packed.kept += [shorter, numbers]
