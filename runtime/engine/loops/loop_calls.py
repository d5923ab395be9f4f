"""Calls of the looped engine for closed loops."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array

from ..looped_engine import LoopedEngine
from .constraint_mobility import row_mobilities
from .loop_workspace import LoopWorkspace

#: Fraction of its reference below which a pivot is rounding.  The reference is the mobility of the
#: row, except for rows with pivots below the second fraction of it because of heavy bodies.
PIVOT_ROUNDING, _HEAVY_BODY_RATIO = 1e-8, 1e-3
#: Fraction of its mobility below which a pivot is that of a redundant row: misfits up to 4e-3 rad.
REDUNDANT_PIVOT = 1e-6
#: Fractions of the mobility below which a reference, and any pivot, count as zero.
_MIN_REFERENCE, _MIN_PIVOT = 1e-12, 1e-15


class LoopCalls(LoopWorkspace):
    """Position gaps and velocity errors of the loops of one packed scene, and their corrections.

    The reference for the pivot of every row is the mobility of its ends at `q` (nq,) as free
    bodies; `mobility` (rows,) replaces it if these ends have no mass.  Drives and couplings have
    their values at `t` (s), unless another time is given.
    """

    def __init__(
        self, engine: LoopedEngine, q: Array, mobility: Array | None = None, t: float = 0.0
    ) -> None:
        super().__init__(engine)
        self.t = t
        records, self.model = self.records, engine.packed.model
        self.memory = engine.start_memory()
        quaternions = np.append(engine.packed.layout.quaternions, 0).astype(np.int32)
        self._quaternions = quaternions
        self.mobility = np.ones(self.count)
        self.correction(self.position_level, q, np.zeros(engine.nu))
        self.mobility = row_mobilities(self) if mobility is None else mobility
        for row, scale in enumerate(self.mobility.tolist()):
            records.scale(row, scale)
            records.set_pivot_floor(row, records.floor(row) or PIVOT_ROUNDING * scale)

    @property
    def position_level(self) -> int:
        return int(self.engine.lib.MSTMM_GAP)

    @property
    def velocity_level(self) -> int:
        return int(self.engine.lib.MSTMM_SLIP)

    def correction(
        self, level: int, q: Array, u: Array, give: float = 0.0, t: float | None = None
    ) -> tuple[Array, Array]:
        """Correction along the speeds (nu,) and row errors (rows,); see sweep.h."""
        engine, t = self.engine, self.t if t is None else t
        change, errors = np.zeros(engine.nu), np.zeros(max(1, self.count))
        failure = engine.ffi.new("mstmm_failure *")
        code = engine.lib.mstmm_correction(
            self.model, engine.workspace(), level, give, t, engine.pointer(q), engine.pointer(u),
            engine.pointer(self.memory), engine.pointer(change), engine.pointer(errors), failure,
        )  # fmt: skip
        if code:
            raise engine.evaluation_error(failure, t, q, u)
        return change, errors[: self.count]

    def choose(self, q: Array) -> bool:
        """Choose among interchangeable redundant rows; True for a new choice.

        The previous choice is kept unless it is much worse than the best one at q (nq,).
        """
        engine = self.engine
        is_changed, failure = engine.ffi.new("int *"), engine.ffi.new("mstmm_failure *")
        code = engine.lib.mstmm_choose_rows(
            self.model, engine.workspace(), self.t, engine.pointer(q), engine.pointer(self.memory),
            is_changed, failure,
        )  # fmt: skip
        if code:
            raise engine.evaluation_error(failure, self.t, q, np.zeros(engine.nu))
        return bool(is_changed[0])

    def inactive_rows(self) -> NDArray[np.bool_]:
        """Mask (rows,) of rows that are not chosen: interchangeable ones are used instead."""
        return self.records.inactive_rows(self.memory)

    def released_rows(self) -> list[int]:
        """Rows of hinges that are released according to `memory`."""
        releases = (int(self.model.rows[row].release) for row in range(self.count))
        return [
            row
            for row, memory_index in enumerate(releases)
            if memory_index >= 0 and self.memory[memory_index]
        ]

    def solve_multipliers(self, q: Array, errors: Array, give: float) -> Array:
        """Multipliers (rows,) of rows with errors `errors` and compliance `give`; see sweep.h."""
        engine, multipliers = self.engine, np.zeros(max(1, self.count))
        failure = engine.ffi.new("mstmm_failure *")
        code = engine.lib.mstmm_self_stress(
            self.model, engine.workspace(), give, engine.pointer(errors), engine.pointer(q),
            engine.pointer(self.memory), engine.pointer(multipliers), failure,
        )  # fmt: skip
        if code:
            raise engine.evaluation_error(failure, 0.0, q, np.zeros(engine.nu))
        return multipliers[: self.count]

    def move(self, q: Array, change: Array) -> Array:
        """Move q (nq,) by a change along the speeds (nu,)."""
        engine, q_moved, t = self.engine, q.copy(), self.t
        failure = engine.ffi.new("mstmm_failure *")
        code = engine.lib.mstmm_move_positions(
            self.model, engine.workspace(), t, engine.pointer(q_moved), engine.pointer(change),
            engine.pointer(self.memory), len(self._quaternions) - 1,
            engine.ffi.from_buffer("int[]", self._quaternions), failure,
        )  # fmt: skip
        if code:
            raise engine.evaluation_error(failure, t, q, change)
        return q_moved

    def driven_state(self, q: Array, u: Array) -> tuple[Array, Array]:
        """State (q, u) with driven coordinates and speeds set to their prescribed values."""
        engine, q, u, t = self.engine, q.copy(), u.copy(), self.t
        failure = engine.ffi.new("mstmm_failure *")
        code = engine.lib.mstmm_fill_driven(
            self.model, engine.workspace(), t, engine.pointer(q), engine.pointer(u),
            engine.pointer(self.memory), failure,
        )  # fmt: skip
        if code:
            raise engine.evaluation_error(failure, t, q, u)
        return q, u

    def set_pivot_reference(self, states: Sequence[Array]) -> set[int]:
        """Set the reference for pivots far below their mobilities from closed states (nq,).

        Such rows are independent, with heavy bodies outboard of them; their reference is the
        largest pivot at these states.  Returns the rows with pivots at rounding level in all
        states.
        """
        floors = [self.records.floor(row) for row in range(self.count)]
        for row in range(self.count):
            self.records.set_pivot_floor(row, _MIN_REFERENCE * float(self.mobility[row]))
        reference_pivots = np.zeros(self.count)
        for q in states:
            self.correction(self.velocity_level, q, np.zeros(self.engine.nu))
            reference_pivots = np.maximum(
                reference_pivots, np.where(self.inverses() > 0, self.pivots(), 0.0)
            )
        for row, (pivot, mobility) in enumerate(zip(reference_pivots, self.mobility, strict=True)):
            is_heavy = 0.0 < pivot < _HEAVY_BODY_RATIO * mobility and not self.records.is_rotor_row(
                row
            )
            floor = max(PIVOT_ROUNDING * pivot, _MIN_PIVOT * mobility) if is_heavy else floors[row]
            self.records.set_pivot_floor(row, min(floor, floors[row]))
        return {row for row in range(self.count) if not reference_pivots[row]} - {
            *self.records.optional_rows
        }

    def max_rounding_ratio(self, q: Array) -> float:
        """Largest ratio of rounding level to pivot over all rows, at a closed state."""
        self.correction(self.velocity_level, q, np.zeros(self.engine.nu))
        return float((self.inverses() * self.records.floors).max(initial=0.0))
