"""Runs of bodies that the looped engine sweeps as links."""

from __future__ import annotations

from typing import Any

from ..system import System
from .body_records import connection_numbers, link_kernel
from .memory import Memory


def attach_runs(model: Any, system: System, memory: Memory, lib: Any, place: int) -> int:
    """Split the bodies into runs and give their links a place in the workspace; returns the place
    behind them."""
    ffi, count = memory.ffi, max(1, system.count)
    runs, numbers = ffi.new("mstmm_branch[]", count), memory.new("real *[]", count)
    size, gathered = ffi.new("int64_t *"), ffi.NULL
    links = [bool(link_kernel(body)) for body in system.distinct]
    if sum(links) + (not all(links)) > count // 4:
        own = system.rows(lambda body: int(lib.MSTMM_LINK_OWN) + len(connection_numbers(body)))
        gathered = memory.new("real[]", max(1, int(own.sum())))
    found = lib.mstmm_fill_runs(model, runs, numbers, gathered, place, size)
    shorter = memory.new("mstmm_branch[]", max(1, found))  # often one run for thousands of bodies
    ffi.memmove(shorter, runs, found * ffi.sizeof("mstmm_branch"))
    model.runs, model.n_runs = shorter, found
    return place + int(size[0])
