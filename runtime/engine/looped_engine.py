"""Looped engine: accelerations, inverse dynamics and mass matrix of a packed scene."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mstmm.abi.failure_codes import FailureCode
from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure, UndeterminedMotionError

from .engine_calls import EngineCalls
from .failure_source import find_nonfinite_expression


class LoopedEngine(EngineCalls):
    """Looped engine on one packed scene; errors name the causing expression or element."""

    def accelerations(
        self, t: ArrayLike, q: Array, u: Array, memory: Array, efforts: Array | None = None
    ) -> tuple[Array, Array]:
        """Compute qdot, udot of n states; q (n, nq), u (n, nu), memory (n, m), efforts (n, nu)."""
        n = len(q)
        times = np.empty(n)
        times[:] = t
        qdot, udot = np.empty((n, self.nq)), np.empty((n, self.nu))
        failure, failed_row = self.ffi.new("mstmm_failure *"), self.ffi.new("int64_t *")
        code = self.lib.mstmm_accelerations_many(
            self.packed.model, self.workspace(), n, self.pointer(times), self.pointer(q),
            self.pointer(u), self.pointer(memory),
            self.ffi.NULL if efforts is None else self.pointer(efforts),
            self.pointer(qdot), self.pointer(udot), failure, failed_row,
        )  # fmt: skip
        if code:
            row = int(failed_row[0])
            raise self.evaluation_error(failure, float(times[row]), q[row], u[row])
        if not np.isfinite(udot).all():
            row, column = (int(k[0]) for k in np.nonzero(~np.isfinite(udot)))
            name = self.packed.layout.u_name(column)
            raise self.not_finite(f"the acceleration of {name}", float(times[row]), q[row], u[row])
        return qdot, udot

    def evaluation_error(self, failure: Any, t: float, q: Array, u: Array) -> NumericalFailure:
        """Error for a state that cannot be evaluated; names the expression or the element."""
        cause = find_nonfinite_expression(self, t, q, u)
        if cause:
            return NumericalFailure(cause)
        text = self.failure_text(failure, t)
        if failure.reason == FailureCode.UNDETERMINED:
            return UndeterminedMotionError(text, int(failure.element))
        return NumericalFailure(text)

    def not_finite(self, what: str, t: float, q: Array, u: Array) -> NumericalFailure:
        """Error for a state with a non-finite quantity `what`; names the causing expression."""
        cause = find_nonfinite_expression(self, t, q, u)
        return NumericalFailure(f"{what} is not finite at t = {t:.9g} s{cause and ': '}{cause}")

    def inverse_dynamics(self, t: float, q: Array, u: Array, udot: Array, memory: Array) -> Array:
        """Efforts (nu,) that `udot` requires at one state, in addition to those of laws."""
        efforts = np.empty(self.nu)
        failure = self.ffi.new("mstmm_failure *")
        code = self.lib.mstmm_inverse_dynamics(
            self.packed.model, self.workspace(), t, self.pointer(q), self.pointer(u),
            self.pointer(memory), self.pointer(udot), self.pointer(efforts), failure,
        )  # fmt: skip
        if code:
            raise self.evaluation_error(failure, t, q, u)
        if not np.isfinite(efforts).all():
            name = self.packed.layout.u_name(int(np.argmin(np.isfinite(efforts))))
            raise self.not_finite(f"the effort of {name}", t, q, u)
        return efforts

    def mass_matrix_product(self, q: Array, accelerations: Array) -> Array:
        """Product of M(q) and n accelerations (n, nu), all speeds free; O(bodies) each."""
        engine, zero_speeds = self.inertia_only, np.zeros(self.nu)
        memory = engine.start_memory()
        base_efforts = engine.inverse_dynamics(0.0, q, zero_speeds, zero_speeds, memory)
        rows = [
            engine.inverse_dynamics(0.0, q, zero_speeds, row, memory) - base_efforts
            for row in np.ascontiguousarray(accelerations)
        ]
        return np.reshape(rows, (len(rows), self.nu))

    def kinetic_energies(self, q: Array, speeds: Array) -> Array:
        """Kinetic energies (n, bodies), J, at q (nq,) and n speeds (n, nu), O(bodies) each.

        Bodies are in the order of the topology; rotors count with the outboard body of their hinge,
        drives are ignored.
        """
        engine, n, zero_speeds = self.inertia_only, len(speeds), np.zeros(self.nu)
        energies = np.empty((n, self.packed.topology.count))
        failure = self.ffi.new("mstmm_failure *")
        contiguous_arrays = (np.ascontiguousarray(x, dtype=np.float64) for x in (q, speeds))
        memory, efforts = engine.start_memory(), np.empty(self.nu)
        code = self.lib.mstmm_kinetic_energies(
            engine.packed.model,
            engine.workspace(),
            n,
            *map(self.pointer, (*contiguous_arrays, memory, zero_speeds, efforts, energies)),
            failure,
        )
        if code:
            raise engine.evaluation_error(failure, 0.0, q, zero_speeds)
        return energies

    def mass_matrix(self, q: Array) -> Array:
        """Symmetric mass matrix (nu, nu) of one state; driven coordinates count as free."""
        if self.packed.layout.modal:
            matrix = self.mass_matrix_product(q, np.eye(self.nu)).T
            return np.asarray((matrix + matrix.T) / 2)
        engine, failure = self.inertia_only, self.ffi.new("mstmm_failure *")
        mass_matrix_values, work = np.empty((self.nu, self.nu)), np.empty(2 * self.nu)
        code = self.lib.mstmm_mass_matrix(
            engine.packed.model,
            engine.workspace(),
            self.pointer(q),
            self.pointer(engine.start_memory()),
            self.pointer(mass_matrix_values),
            self.pointer(work),
            failure,
        )
        if code:
            raise self.evaluation_error(failure, 0.0, q, np.zeros(self.nu))
        return mass_matrix_values

    def solve(self, q: Array, columns: Array, memory: Array | None = None) -> Array:
        """Product of M(q)^-1 and n columns of efforts (n, nu) at one state q (nq,).

        It is zero on prescribed speeds.  The mass matrix is factored once, and each column costs
        O(bodies); with sweeps "qr" and "refined" and with closed loops no factor is stored, and
        each column requires a sweep at rest with its efforts.  Without `memory` no hinge is
        released.
        """
        engine = self.inertia_only
        memory = engine.start_memory() if memory is None else memory
        if self.packed.qr or self.packed.refined or self.packed.system.has_loops:
            # Time-dependent couplings cause motion without efforts: subtract it by a zero column.
            columns = np.vstack([columns, np.zeros(self.nu)])
            n, zero_speeds = len(columns), np.zeros(columns.shape)
            state_rows = np.tile(q, (n, 1)), zero_speeds, np.tile(memory, (n, 1))
            accelerations_found = engine.accelerations(0.0, *state_rows, columns)[1]
            return np.asarray(accelerations_found[:-1] - accelerations_found[-1])
        solutions = np.empty(columns.shape)
        failure = self.ffi.new("mstmm_failure *")
        code = self.lib.mstmm_solve(
            engine.packed.model, engine.workspace(), len(columns), self.pointer(q),
            self.pointer(memory), self.pointer(columns), self.pointer(solutions), failure,
        )  # fmt: skip
        if code:
            raise engine.evaluation_error(failure, 0.0, q, np.zeros(self.nu))
        if not np.isfinite(solutions).all():
            name = self.packed.layout.u_name(int(np.nonzero(~np.isfinite(solutions))[1][0]))
            raise engine.not_finite(f"the solution for {name}", 0.0, q, np.zeros(self.nu))
        return solutions

    def rates(self, t: float, q: Array, u: Array, memory: Array) -> Array:
        """Rates qdot (nq,) of one state by kinematics, without requiring positive inertia."""
        self.inverse_dynamics(t, q, u, np.zeros(self.nu), memory)
        model = self.packed.model
        first = int(model.scratch) + self.nq + self.nu + int(model.n_values)
        first += 3 * int(model.n_drives) + int(model.tape_slots)
        return self.workspace_array()[first : first + self.nq].copy()
