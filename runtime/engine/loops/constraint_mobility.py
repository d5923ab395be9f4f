"""Mobility of constraint rows: response of the adjacent free bodies to a unit load of a row.

It is the reference for the row pivots.
"""

from __future__ import annotations

import numpy as np

from mstmm.array_validation import Array
from mstmm.ir.scene_structure import Key

from ...packing.records.couplings import WrittenCoupling
from ...packing.system import Numbers
from ..looped_engine import LoopedEngine
from .loop_workspace import LoopWorkspace


def row_mobilities(numbers: LoopWorkspace) -> Array:
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


def _coupling_mobility(
    numbers: LoopWorkspace, coupling: WrittenCoupling, masses: _BodyMasses
) -> float:
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
        self.engine, self.kind_indices = engine, engine.packed.system.distinct_indices
        self.distinct = list(engine.packed.system.distinct)
        self.cache: dict[tuple[Key, Numbers], tuple[Array, Array]] = {}

    def matrix(self, body: int) -> Array:
        return self._inertia_and_inverse(body)[0]

    def inverse(self, body: int) -> Array:
        return self._inertia_and_inverse(body)[1]

    def _inertia_and_inverse(self, body: int) -> tuple[Array, Array]:
        """Inertia matrix of a body, and its pseudo-inverse."""
        body_record = self.distinct[int(self.kind_indices[body])]
        kind = body_record.body, body_record.body_p
        if kind not in self.cache:
            matrix = self._inertia_matrix(*kind)
            self.cache[kind] = matrix, _pseudo_inverse(matrix)
        return self.cache[kind]

    def _inertia_matrix(self, body: Key, numbers: Numbers) -> Array:
        upper_triangle, engine = np.zeros(21), self.engine
        function = engine.packed.elements[body].functions["inertia"]
        c_function = engine.ffi.cast("int (*)(const double *, double *)", function)
        c_function(list(numbers), engine.ffi.from_buffer("double[]", upper_triangle))
        matrix = np.zeros((6, 6))
        matrix[np.triu_indices(6)] = upper_triangle
        return matrix + np.triu(matrix, 1).T
