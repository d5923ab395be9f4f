"""Solver for the mass matrix, M^-1 times columns, by the looped engine or compiled code."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import EnvironmentFailure

from .fused_code import FusedCode
from .looped_engine import LoopedEngine

if TYPE_CHECKING:
    from ..kernels.derivative_library import DerivativeLibrary

#: Measured compilation time (s), constant and per squared number of speeds, and time saved (s) per
#: state and per number in the right-hand sides.  Only ratios matter; fixed values make the choice
#: reproducible.
_COMPILE_SECONDS, _COMPILE_SECONDS_PER_PAIR = 0.2, 0.005
_SAVED_PER_STATE, _SAVED_PER_NUMBER = 1e-5, 3e-8


class MassMatrixSolver:
    """Solver for the mass matrix of one scene; thread-safe."""

    def __init__(self, engine: LoopedEngine, fusion: FusedCode) -> None:
        self._engine, self._fusion = engine, fusion
        self._lock = threading.Lock()
        self._saved_seconds = 0.0
        self._library: DerivativeLibrary | None = None
        self._has_searched = False
        self._obstacle = ""

    def solve(self, q: Array, columns: Array) -> Array:
        """Solve for columns (n, k, nu) at n states q (n, nq); returns (n, k, nu).

        Raises NumericalFailure, which names a motion without inertia.
        """
        if not columns.size:
            return columns.copy()
        library = self._expect(len(q), columns.size)
        if library is not None:
            solutions = self._solve_compiled(library, q, columns)
            if solutions is not None:
                return solutions
        rows = [
            self._engine.solve(q_row, column_rows)
            for q_row, column_rows in zip(q, columns, strict=True)
        ]
        return np.array(rows).reshape(columns.shape)

    def build(self) -> None:
        """Compile the code of the scene; raises EnvironmentFailure if that fails."""
        with self._lock:
            self._library = self._fusion.solution(build=True)

    @property
    def uses_compiled_code(self) -> bool:
        """True if compiled code of the scene is in use."""
        return self._library is not None

    def _expect(self, states: int, numbers: int) -> DerivativeLibrary | None:
        """Compiled code if it exists or the saved time exceeds that of its compilation."""
        with self._lock:
            self._saved_seconds += states * _SAVED_PER_STATE + numbers * _SAVED_PER_NUMBER
            is_worthwhile = (
                self._saved_seconds
                > _COMPILE_SECONDS + _COMPILE_SECONDS_PER_PAIR * self._engine.nu**2
            )
            if (
                self._library is None
                and not self._obstacle
                and (is_worthwhile or not self._has_searched)
            ):
                self._has_searched = True
                try:
                    self._library = self._fusion.solution(build=is_worthwhile)
                except EnvironmentFailure as error:
                    self._obstacle = str(error)
            return self._library

    def _solve_compiled(self, library: DerivativeLibrary, q: Array, columns: Array) -> Array | None:
        """Solutions by compiled code; None if a guard fails (the looped engine names the cause)."""
        numbers, nu = self._fusion.numbers, self._engine.nu
        zero_speeds = np.zeros((1, nu))
        memory = self._engine.start_memory()[None]
        inputs = [numbers[None], np.zeros((1, 1)), q, zero_speeds, memory, zero_speeds]
        solution_rows = library.run(0, inputs, columns)
        if not solution_rows[..., nu].all() or not np.isfinite(solution_rows).all():
            return None
        return np.ascontiguousarray(solution_rows[..., :nu])
