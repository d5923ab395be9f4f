"""C records of hinge laws; those of a pattern are filled once and copied."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...kernels import prebuilt_kernels
from ...kernels.c_records import CRecords
from ..system import LawNumbers, LawRun, System
from .memory import Memory


class LawRecords:
    """Records of a system's laws, run by run."""

    def __init__(self, system: System, memory: Memory) -> None:
        self.memory, self.functions = memory, prebuilt_kernels.element("sweep", "laws").functions
        self.records = CRecords(memory.ffi, "mstmm_law", sum(run.count for run in system.laws))
        memory.keep_alive.append(self.records)
        first = 0
        for run in system.laws:
            self._fill_run(run, first)
            first += run.count

    def _fill_run(self, run: LawRun, first: int) -> None:
        if run.count == len(run.pattern):
            for number, (law, body, twist, efforts) in enumerate(run.iterate_laws(), first):
                record = self.records.array[number]
                self._fill(record, law)
                record.body, record.twist = body, twist
                record.effort = self.memory.ints(efforts)
            return
        prototypes = CRecords(self.memory.ffi, "mstmm_law", len(run.pattern))
        for record, law in zip(prototypes.array, run.pattern, strict=True):
            self._fill(record, law)
        numbers = slice(first, first + run.count)
        repeats, k_in_pattern = np.divmod(np.arange(run.count), len(run.pattern))
        self.records.copy(numbers, prototypes, k_in_pattern)
        member = np.array([law.member for law in run.pattern])[k_in_pattern]
        turn = np.array([law.turn for law in run.pattern])[k_in_pattern]
        column = self.records.column
        column("body")[numbers] = run.position + repeats * run.period + member
        column("twist")[numbers] = np.where(
            turn < 0, -1, run.twist + repeats * run.rotation_count + turn
        )
        for k, law in enumerate(run.pattern):
            pointers = column("effort")[numbers][k :: len(run.pattern)]
            indices = np.array(law.efforts, dtype=np.int32)
            self.memory.keep_alive.append(indices)
            pointers[:] = indices.ctypes.data
            if len(indices) > 1:
                pointers += indices.strides[0] * np.arange(len(pointers), dtype=pointers.dtype)

    def _fill(self, record: Any, law: LawNumbers) -> None:
        """Fill the fields that all repeats of a law share."""
        record.kind, record.evaluate = int(law.turn >= 0), self.functions[law.kernel]
        record.evaluate_slope = self.functions[f"{law.kernel}_slope"]
        record.coordinate, record.speed, record.n = law.coordinate, law.speed, law.n
        record.p, record.axes = self.memory.reals(law.p), self.memory.ffi.NULL
        if law.axes:
            record.axes = self.memory.reals(law.axes)
