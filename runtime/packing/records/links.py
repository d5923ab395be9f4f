"""C records of the runs of bodies that the looped engine sweeps as links."""

from __future__ import annotations

from typing import Any

from ..system import System
from .body_records import connection_numbers, link_kernel
from .memory import Memory


def attach_runs(model: Any, system: System, memory: Memory, lib: Any, place: int) -> int:
    """Split the bodies into runs and reserve workspace for their links at offset `place`.

    Returns the offset behind them.
    """
    ffi, max_count = memory.ffi, max(1, system.count)
    buffer, numbers = ffi.new("mstmm_branch[]", max_count), memory.new("real *[]", max_count)
    size, gathered = ffi.new("int64_t *"), ffi.NULL
    is_link = [bool(link_kernel(body)) for body in system.distinct]
    if sum(is_link) + (not all(is_link)) > max_count // 4:
        lengths = system.rows(lambda body: int(lib.MSTMM_LINK_OWN) + len(connection_numbers(body)))
        gathered = memory.new("real[]", max(1, int(lengths.sum())))
    count = lib.mstmm_fill_runs(model, buffer, numbers, gathered, place, size)
    runs = memory.new("mstmm_branch[]", max(1, count))  # often one run for thousands of bodies
    ffi.memmove(runs, buffer, count * ffi.sizeof("mstmm_branch"))
    model.runs, model.n_runs = runs, count
    return place + int(size[0])
