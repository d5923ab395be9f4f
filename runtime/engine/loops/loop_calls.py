"""Calls of the looped engine for closed loops, and the mobility of constraint rows."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.ir.scene_structure import Key

from ...packing.records.loop_records import WrittenClosure, WrittenCoupling
from ...packing.system import Numbers
from ..looped_engine import LoopedEngine

#: Fraction of its reference below which a pivot is rounding.  The reference is the mobility of the
#: row, except for rows with pivots below the second fraction of it because of heavy bodies.
PIVOT_ROUNDING, _HEAVY_BODY_RATIO = 1e-8, 1e-3
#: Fraction of its mobility below which a pivot is that of a redundant row: misfits up to 4e-3 rad.
REDUNDANT_PIVOT = 1e-6
#: Fractions of the mobility below which a reference, and any pivot, count as zero.
_MIN_REFERENCE, _MIN_PIVOT = 1e-12, 1e-15


class LoopCalls:
    """Position gaps and velocity errors of the loops of one packed scene, and their corrections.

    The reference for the pivot of every row is the mobility of its ends at `q` (nq,) as free
    bodies; `mobility` (rows,) replaces it if these ends have no mass.  Drives and couplings have
    their values at `t` (s), unless another time is given.
    """

    def __init__(
        self, engine: LoopedEngine, q: Array, mobility: Array | None = None, t: float = 0.0
    ) -> None:
        records = engine.packed.written.loops
        assert records is not None
        self.engine, self.records, self.model = engine, records, engine.packed.model
        self.count, self.t = records.count, t
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
        t = self.t if t is None else t
        change, errors = np.zeros(self.engine.nu), np.zeros(max(1, self.count))
        arrays = q, u, self.memory, change, errors
        self.engine.call("correction", (t, q, u), level, give, t, *arrays)
        return change, errors[: self.count]

    def choose(self, q: Array) -> bool:
        """Choose among interchangeable redundant rows; True for a new choice.

        The previous choice is kept unless it is much worse than the best one at q (nq,).
        """
        is_changed = self.engine.ffi.new("int *")
        state = self.t, q, np.zeros(self.engine.nu)
        self.engine.call("choose_rows", state, self.t, q, self.memory, is_changed)
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
        multipliers, state = np.zeros(max(1, self.count)), (0.0, q, np.zeros(self.engine.nu))
        self.engine.call("self_stress", state, give, errors, q, self.memory, multipliers)
        return multipliers[: self.count]

    def move(self, q: Array, change: Array) -> Array:
        """Move q (nq,) by a change along the speeds (nu,)."""
        q_moved, quaternions = q.copy(), self._quaternions
        indices = len(quaternions) - 1, self.engine.ffi.from_buffer("int[]", quaternions)
        arrays = q_moved, change, self.memory
        self.engine.call("move_positions", (self.t, q, change), self.t, *arrays, *indices)
        return q_moved

    def driven_state(self, q: Array, u: Array) -> tuple[Array, Array]:
        """State (q, u) with driven coordinates and speeds set to their prescribed values."""
        q, u = q.copy(), u.copy()
        self.engine.call("fill_driven", (self.t, q, u), self.t, q, u, self.memory)
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

    # --- workspace of the last correction -------------------------------------------------------

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


def row_mobilities(numbers: LoopCalls) -> Array:
    """Mobility J M^-1 J^T (rows,) of both ends of every row, after a correction.

    Rows between massless bodies get the mean of the others.
    """
    mobility, body_masses = np.zeros(numbers.count), _BodyMasses(numbers.engine)
    for closure in numbers.records.closures:
        for body, name in ((closure.inboard, "J_A"), (closure.outboard, "J_B")):
            if body >= 0:
                columns, inverse = numbers.closure_matrix(closure, name), body_masses.inverse(body)
                for direction, row in closure.rows.items():
                    column = columns[direction]
                    mobility[row] += column @ inverse @ column
    for coupling in numbers.records.couplings:
        mobility[coupling.row] = _coupling_mobility(numbers, coupling, body_masses)
    known_mobilities = mobility[mobility > 0]
    mobility[~(mobility > 0)] = known_mobilities.mean() if len(known_mobilities) else 1.0
    return mobility


def _coupling_mobility(numbers: LoopCalls, coupling: WrittenCoupling, masses: _BodyMasses) -> float:
    """Mobility C^T D^-1 C of a coupling, summed over its hinges.

    D is that of the single body of the hinge; a closing hinge counts like its rows.
    """
    mobility, closures = 0.0, {closure.frame: closure for closure in numbers.records.closures}
    for tree_index in coupling.columns:
        derivatives = numbers.coupling_derivatives(coupling, tree_index)
        if tree_index not in closures:
            mobility += _hinge_mobility(numbers.engine, tree_index, derivatives, masses)
            continue
        closure = closures[tree_index]
        for body, name in ((closure.inboard, "J_A"), (closure.outboard, "J_B")):
            if body >= 0:
                column = derivatives @ numbers.closure_matrix(closure, name)[: len(derivatives)]
                mobility += float(column @ masses.inverse(body) @ column)
    return mobility


def _hinge_mobility(
    engine: LoopedEngine, tree_index: int, slopes: Array, masses: _BodyMasses
) -> float:
    body, lib = engine.packed.system.body(tree_index), engine.lib
    free_speeds = [k for k in range(body.nu) if not body.imposed[k]]
    start = int(engine.packed.written.blocks[tree_index]) + int(lib.MSTMM_BLOCK_FIXED)
    start += int(lib.MSTMM_SPEED_H_FREE) * body.nu
    motion_subspace = engine.workspace_array()[start : start + 6 * len(free_speeds)].reshape(
        6, len(free_speeds)
    )
    inertia = motion_subspace.T @ masses.matrix(tree_index) @ motion_subspace + np.diag(
        np.array(body.rotor)[free_speeds]
    )
    return float(slopes[free_speeds] @ _pseudo_inverse(inertia) @ slopes[free_speeds])


def _pseudo_inverse(matrix: Array) -> Array:
    """Pseudo-inverse, in which directions without inertia do not move."""
    return np.asarray(np.linalg.pinv(matrix, rcond=1e-12, hermitian=True), dtype=np.float64)


class _BodyMasses:
    """Mass matrices of single bodies about input ends and their inverses, cached by body data."""

    def __init__(self, engine: LoopedEngine) -> None:
        self._system, self._matrix = engine.packed.system, cache(engine.inertia_matrix)
        self._inverse = cache(lambda *kind: _pseudo_inverse(self._matrix(*kind)))

    def matrix(self, body: int) -> Array:
        return self._matrix(*self._kind(body))

    def inverse(self, body: int) -> Array:
        return self._inverse(*self._kind(body))

    def _kind(self, body: int) -> tuple[Key, Numbers]:
        record = self._system.body(body)
        return record.body, record.body_p
