"""Workspace results of the last correction of closed loops."""

from __future__ import annotations

from mstmm.array_validation import Array

from ...packing.records.couplings import WrittenCoupling
from ...packing.records.loops import WrittenClosure
from ..looped_engine import LoopedEngine


class LoopWorkspace:
    """Workspace of rows, closures and couplings of one packed scene."""

    def __init__(self, engine: LoopedEngine) -> None:
        records = engine.packed.written.loops
        assert records is not None
        self.engine, self.records = engine, records
        self.count = records.count

    def closing_label(self, row: int) -> str:
        """Label of the element to which a row belongs, for messages."""
        for closure in self.records.closures:
            if row in closure.rows.values():
                return self.engine.closing_label(closure.frame)
        return f'coupling "{self.coupling_name(row)}"'

    def coupling_name(self, row: int) -> str:
        """Name of the coupling to which a row belongs, or ""."""
        names = (
            coupling.coupling.name for coupling in self.records.couplings if coupling.row == row
        )
        return next(names, "")

    def inverses(self) -> Array:
        """Inverse pivots of the rows in the last correction, 0 for rows without a multiplier."""
        return self._row_values("INVERSE")

    def pivots(self) -> Array:
        """Pivots of the rows in the last correction."""
        return self._row_values("PIVOT")

    def _row_values(self, name: str) -> Array:
        lib, stride = self.engine.lib, int(self.engine.lib.MSTMM_ROW)
        first = self.records.offset + int(getattr(lib, f"MSTMM_ROW_{name}"))
        return self.engine.workspace_array()[first : first + stride * self.count : stride].copy()

    def values(self) -> Array:
        """Values of the couplings in the last gap correction."""
        first = self.records.offset + int(self.engine.lib.MSTMM_COUPLING_GAP)
        indices = [first + coupling.numbers for coupling in self.records.couplings]
        return self.engine.workspace_array()[indices]

    def coupling_derivatives(self, coupling: WrittenCoupling, tree_index: int) -> Array:
        """Derivatives -C (nu,) of a coupling with respect to the speeds of one of its hinges.

        Valid after a correction.
        """
        start = self.records.offset + coupling.columns[tree_index]
        return self.engine.workspace_array()[
            start : start + self.engine.packed.system.body(tree_index).nu
        ]

    def closure_matrix(self, closure: WrittenClosure, name: str) -> Array:
        """Matrix (6, 6) of a closure after a correction: W, J_A or J_B."""
        start = self.records.offset + closure.numbers
        start += int(getattr(self.engine.lib, f"MSTMM_CLOSURE_{name}"))
        return self.engine.workspace_array()[start : start + 36].reshape(6, 6).copy()
