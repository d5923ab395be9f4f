"""Mobility of constraint rows: response of the free adjacent bodies to a unit load of a row.

It is the reference for the pivots of the rows.
"""

from __future__ import annotations

import numpy as np

from mstmm.arrays import Array
from mstmm.ir.structure import Key

from ...pack.records.couplings import WrittenCoupling
from ...pack.system import Numbers
from ..engine import Engine
from .numbers import LoopNumbers


def mobilities(numbers: LoopNumbers) -> Array:
    """Mobility J M^-1 J^T of both ends of every row (rows,), after a correction.

    Rows between bodies without mass get the mean of the others.
    """
    found, masses = np.zeros(numbers.count), _Masses(numbers.engine)
    for one in numbers.records.closures:
        for body, name in ((one.inboard, "J_A"), (one.outboard, "J_B")):
            if body >= 0:
                columns, inverse = numbers.numbers_of(one, name), masses.inverse(body)
                for direction, row in one.rows.items():
                    column = columns[direction]
                    found[row] += column @ inverse @ column
    for coupling in numbers.records.couplings:
        found[coupling.row] = _of_coupling(numbers, coupling, masses)
    known = found[found > 0]
    found[~(found > 0)] = known.mean() if len(known) else 1.0
    return found


def _of_coupling(numbers: LoopNumbers, one: WrittenCoupling, masses: _Masses) -> float:
    """Mobility C^T D^-1 C of a coupling, summed over its hinges.

    D is that of the hinge's single body; a hinge that closes a loop counts as its rows do.
    """
    found, closures = 0.0, {closure.frame: closure for closure in numbers.records.closures}
    for place in one.columns:
        slopes = numbers.slopes_of(one, place)
        if place not in closures:
            found += _of_hinge(numbers.engine, place, slopes, masses)
            continue
        closure = closures[place]
        for body, name in ((closure.inboard, "J_A"), (closure.outboard, "J_B")):
            if body >= 0:
                column = slopes @ numbers.numbers_of(closure, name)[: len(slopes)]
                found += float(column @ masses.inverse(body) @ column)
    return found


def _of_hinge(engine: Engine, place: int, slopes: Array, masses: _Masses) -> float:
    body, lib = engine.packed.system.body(place), engine.lib
    free = [k for k in range(body.nu) if not body.imposed[k]]
    at = int(engine.packed.written.blocks[place]) + int(lib.MSTMM_BLOCK_FIXED)
    at += int(lib.MSTMM_SPEED_H_FREE) * body.nu
    motions = engine.workspace_array()[at : at + 6 * len(free)].reshape(6, len(free))
    inertia = motions.T @ masses.matrix(place) @ motions + np.diag(np.array(body.rotor)[free])
    return float(slopes[free] @ _inverse(inertia) @ slopes[free])


def _inverse(matrix: Array) -> Array:
    """Pseudo-inverse: directions without inertia do not move."""
    return np.asarray(np.linalg.pinv(matrix, rcond=1e-12, hermitian=True), dtype=np.float64)


class _Masses:
    """Mass matrices of single bodies about input ends, and inverses; equal bodies share them."""

    def __init__(self, engine: Engine) -> None:
        self.engine, self.which = engine, engine.packed.system.which
        self.distinct = list(engine.packed.system.distinct)
        self.known: dict[tuple[Key, Numbers], tuple[Array, Array]] = {}

    def matrix(self, body: int) -> Array:
        return self._both(body)[0]

    def inverse(self, body: int) -> Array:
        return self._both(body)[1]

    def _both(self, body: int) -> tuple[Array, Array]:
        one = self.distinct[int(self.which[body])]
        kind = one.body, one.body_p
        if kind not in self.known:
            matrix = self._made(*kind)
            self.known[kind] = matrix, _inverse(matrix)
        return self.known[kind]

    def _made(self, body: Key, numbers: Numbers) -> Array:
        upper, engine = np.zeros(21), self.engine
        function = engine.packed.elements[body].functions["inertia"]
        call = engine.ffi.cast("int (*)(const double *, double *)", function)
        call(list(numbers), engine.ffi.from_buffer("double[]", upper))
        matrix = np.zeros((6, 6))
        matrix[np.triu_indices(6)] = upper
        return matrix + np.triu(matrix, 1).T
