"""C records of flexible bodies and their sections."""

from __future__ import annotations

from typing import Any

from ..system import Arrays, ModalNumbers, SectionNumbers
from .memory import Memory

_AXES, _PAIRS = "xyz", ("xx", "xy", "xz", "yy", "yz", "zz")


class ModalRecords:
    """Records `mstmm_modal` and `mstmm_section`.

    Attributes:
        size: length of their workspace.
        modal, sections: body, by position in the tree -> offset of its numbers in the workspace.
    """

    def __init__(self, memory: Memory, lib: Any) -> None:
        self.memory, self.lib, self.size = memory, lib, 0
        self.modal: dict[int, int] = {}
        self.sections: dict[int, int] = {}
        self._modal: dict[int, Any] = {}
        self._sections: dict[int, Any] = {}

    def add_modal(self, place: int, modal: ModalNumbers) -> Any:
        """Create the `mstmm_modal *` of the body at position `place` in the tree."""
        record, array = self.memory.new("mstmm_modal *"), self.memory.array
        record.n, record.q, record.u = modal.n, modal.q, modal.u
        self._moments(record.moments, modal.moments)
        if modal.drag is not None:
            record.drag = self.memory.new("mstmm_moments *")
            self._moments(record.drag, modal.drag)
        matrices = modal.matrices.named
        record.stiffness, record.damping = array(matrices["stiffness"]), array(matrices["damping"])
        self.modal[place] = self._reserve(self.lib.mstmm_modal_numbers(modal.n))
        self._modal[place] = record
        return record

    def add_section(self, place: int, section: SectionNumbers) -> Any:
        """Create the `mstmm_section *` in the connection of the body at position `place`."""
        record, array = self.memory.new("mstmm_section *"), self.memory.array
        modal = self._modal[section.frame]
        record.modal, record.inward = modal, int(section.inward)
        inputs = section.inputs.named
        record.point, record.end = array(inputs["r"]), self.memory.reals(section.end)
        record.phi, record.theta = array(inputs["phi"]), array(inputs["theta"])
        for k, axis in enumerate(_AXES):
            record.drawn[k] = array(inputs[f"g_{axis}"])
            record.turned[k] = array(inputs[f"h_{axis}"])
        self.sections[place] = self._reserve(self.lib.mstmm_section_numbers(modal.n))
        self._sections[place] = record
        return record

    def shift_offsets(self, first: int) -> int:
        """Shift all offsets to begin at `first`; returns the offset behind the numbers."""
        for offsets, records in ((self.modal, self._modal), (self.sections, self._sections)):
            for place, record in records.items():
                offsets[place] += first
                record.place = offsets[place]
        return first + self.size

    def _moments(self, record: Any, moments: Arrays) -> None:
        array, named = self.memory.array, moments.named
        record.rigid, record.c = array(named["p"]), array(named["C"])
        record.p, record.b = array(named["P"]), array(named["B"])
        for k, pair in enumerate(_PAIRS):
            record.z[k] = array(named[f"Z_{pair}"])
        for k, axis in enumerate(_AXES):
            record.y[k] = array(named[f"Y_{axis}"])
            record.g[k] = array(named[f"G_{axis}"])
        record.m = array(named["M"])

    def _reserve(self, count: int) -> int:
        first = self.size
        self.size += int(count)
        return first
