"""Dynamics of a compiled scene at single states or batches, and derivatives.

Every call takes one state or states with leading axes, and checks their shapes.  It writes into
`out`, if given, a float64 array of the shape of the answer, which is returned.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from mstmm.argument_validation import require_texts
from mstmm.array_validation import Array, batch, copy_to
from mstmm.array_validation import right_hand_sides as columns_of
from mstmm.errors import SceneError

from ..packing.coordinate_layout import check_dense_size
from .kinematics import KinematicQueries

if TYPE_CHECKING:
    from ..engine.compiled_derivatives import MassMatrixSolver
    from ..engine.state_evaluation.state_calls import SingleStateCalls
    from .derivatives import Derivatives


class DynamicsQueries(KinematicQueries):
    """Compiled scene with dynamics at given states."""

    def accelerations(
        self,
        q: ArrayLike,
        u: ArrayLike,
        t: ArrayLike = 0.0,
        efforts: ArrayLike | None = None,
        *,
        threads: int | None = None,
        out: Array | None = None,
    ) -> Array:
        """Accelerations udot (..., nu) at q (..., nq), u (..., nu) and t (s).

        `efforts` (..., nu; N, N*m) act in addition.  Driven coordinates have the values of their
        drives, whatever q and u are.  A batch (leading axes) uses `threads` threads (None: the
        number of processors) and, if there is fused code, vector lanes.  The result of a state does
        not depend on the batch and on the threads, bit for bit, unless the engine changes.

        Raises SceneError for a wrong shape, NumericalFailure naming the state and the hinge whose
        motion is undetermined.
        """
        if threads is None:
            calls = self._single_state
            if calls.library is not self.fusion.library:
                calls.renew()
            single: Array | None = calls.accelerations(t, q, u, efforts)
            if single is not None:
                return single if out is None else copy_to(out, single)
        from ..engine.state_evaluation.state_calls import StateBatch, accelerations

        extra = () if efforts is None else (("efforts", efforts, self.nu),)
        lead, given = batch(("t", t, None), ("q", q, self.nq), ("u", u, self.nu), *extra)
        states = StateBatch(lead, given[0], given[1], given[2], given[3] if extra else None)
        udot = accelerations(self.looped, self.fusion, states, threads)
        return copy_to(out, udot.reshape(*lead, self.nu))

    def inverse_dynamics(
        self,
        q: ArrayLike,
        u: ArrayLike,
        udot: ArrayLike,
        t: ArrayLike = 0.0,
        *,
        actuators: Sequence[str] | None = None,
        out: Array | None = None,
    ) -> Array:
        """Efforts (..., nu) in addition to hinge laws that give `udot`; drive efforts where driven.

        q (..., nq), u and udot (..., nu), t (s).  With closed loops, `actuators` are hinges, or
        efforts of some of their speeds ("shoulder.effort"), as many as the mobility; all other
        efforts are zero.  By default they are `loops.independent`.  udot may be that of the
        independent speeds alone, (..., mobility); a complete udot must satisfy the constraints.

        Newton-Euler inverse dynamics over the tree, O(bodies), and one more sweep per degree of
        freedom of a mechanism.  Raises SceneError for a wrong shape, accelerations that open a
        loop, and a number of actuators other than the mobility; NumericalFailure if they cannot
        drive all motions at the state.
        """
        if self.independent_speeds is not None:
            from .constrained_inverse_dynamics import constrained_inverse_dynamics

            return copy_to(out, constrained_inverse_dynamics(self, q, u, udot, t, actuators))
        if actuators is not None:
            raise SceneError(
                "actuators: expected a scene with closed loops, found a tree, where all speeds "
                "act; leave actuators out"
            )
        calls = self._single_state
        if calls.inverse is None or calls.inverse is not self.fusion.inverse:
            calls.seek()
        single: Array | None = calls.efforts(t, q, u, udot)
        if single is not None:
            return single if out is None else copy_to(out, single)
        engine = self.looped
        memory, nu = engine.start_memory(), self.nu
        lead, (times, coordinates, speeds, rates) = batch(
            ("t", t, None), ("q", q, self.nq), ("u", u, nu), ("udot", udot, nu)
        )
        rows = np.empty((len(times), nu))
        states = zip(times.tolist(), coordinates, speeds, rates, strict=True)
        for k, (time, a, b, c) in enumerate(states):
            single = calls.efforts(time, a, b, c)
            rows[k] = engine.inverse_dynamics(time, a, b, c, memory) if single is None else single
        return copy_to(out, rows.reshape(*lead, nu))

    def bias_efforts(
        self, q: ArrayLike, u: ArrayLike, t: ArrayLike = 0.0, *, out: Array | None = None
    ) -> Array:
        """Bias force h (..., nu) of M(q) udot + h = efforts; (..., mobility) with closed loops.

        From gravity, hinge laws, loads and gyroscopic terms.  Raises what `inverse_dynamics`
        raises.
        """
        if self.independent_speeds is None:
            return self.inverse_dynamics(q, u, np.zeros(self.nu), t, out=out)
        places = list(self.independent_speeds.indices)
        return copy_to(out, self.inverse_dynamics(q, u, np.zeros(len(places)), t)[..., places])

    def gravity_efforts(self, q: ArrayLike, *, out: Array | None = None) -> Array:
        """Efforts (..., nu) in equilibrium with gravity alone; (..., mobility) with closed loops.

        Without hinge laws, loads and drives.  Raises SceneError for a wrong shape, NumericalFailure
        if the independent speeds do not determine the others.
        """
        if self.independent_speeds is None and not self.coordinate_layout.modal:
            single: Array | None = self._gravity_calls.efforts(0.0, q, *self._zero_speeds)
            if single is not None:
                return single if out is None else copy_to(out, single)
        lead, (states,) = batch(("q", q, self.nq))
        rows = np.array([self._gravity_efforts_at(state) for state in states])
        return copy_to(out, rows.reshape(*lead, *rows.shape[1:]))

    def _gravity_efforts_at(self, q: Array) -> Array:
        zeros, memory = self._zero_speeds[0], self.looped.start_memory()
        with_gravity, without_gravity = (
            engine.inverse_dynamics(0.0, q, zeros, zeros, memory)
            for engine in (self.looped.gravity_only, self.looped.inertia_only)
        )
        if self.independent_speeds is None:
            return with_gravity - without_gravity
        return self.independent_speeds.motion_matrix(q, self.independent_speeds.indices).T @ (
            with_gravity - without_gravity
        )

    @cached_property
    def _zero_speeds(self) -> tuple[Array, Array]:
        return np.zeros(self.nu), np.zeros(self.nu)

    @cached_property
    def _gravity_calls(self) -> SingleStateCalls:
        from ..engine.fused_code import NoFusedCode
        from ..engine.state_evaluation.state_calls import SingleStateCalls

        return SingleStateCalls(self.looped.gravity_only, NoFusedCode())

    def mass_matrix(self, q: ArrayLike, *, out: Array | None = None) -> Array:
        """Symmetric mass matrix (..., nu, nu) at q (..., nq), kg, kg*m, kg*m2.

        Driven coordinates count as free.  With closed loops it is that of the independent speeds,
        (..., mobility, mobility) in the order of `loops.independent`, without driven ones.

        Raises SceneError for a wrong shape, NumericalFailure if the independent speeds do not
        determine the others.
        """
        if self.independent_speeds is None:
            calls = self._single_state
            if calls.inverse is None or calls.inverse is not self.fusion.inverse:
                calls.seek()
            matrix: Array | None = calls.mass(q)
            if matrix is not None:
                return matrix if out is None else copy_to(out, matrix)
            check_dense_size(self.nu, "the mass matrix")
        lead, (states,) = batch(("q", q, self.nq))
        if self.independent_speeds is not None:
            from .constrained_inverse_dynamics import reduced_mass

            reduced = np.array([reduced_mass(self, state) for state in states])
            return copy_to(out, reduced.reshape(*lead, *reduced.shape[1:]))
        rows = np.empty((len(states), self.nu, self.nu))
        for k, state in enumerate(states):
            matrix = calls.mass(state)
            rows[k] = self.looped.mass_matrix(state) if matrix is None else matrix
        return copy_to(out, rows.reshape(*lead, self.nu, self.nu))

    def solve(self, q: ArrayLike, rhs: ArrayLike, *, out: Array | None = None) -> Array:
        """Accelerations M(q)^-1 rhs (..., nu) or (..., nu, k) due to the efforts rhs alone.

        q (..., nq); rhs (nu,), one column for all states, or (..., nu, k), k columns (N, N*m), as
        in `numpy.linalg.solve`.  M is never formed: the tree is factorised once per state, and each
        column is O(bodies).  Driven and fixed speeds, also those released later, have no
        acceleration: their rows of rhs are ignored and their answers are zero.

        Raises SceneError for a wrong shape, NumericalFailure naming the hinge whose motion is
        undetermined.
        """
        is_single, columns = columns_of("rhs", rhs, self.nu)
        k = columns.shape[-1]
        lead, (states, columns) = batch(("q", q, self.nq), ("rhs", columns, (self.nu, k)))
        answers = self._solver.solve(states, np.ascontiguousarray(columns.swapaxes(-1, -2)))
        solutions = answers.swapaxes(-1, -2).reshape(*lead, self.nu, k)
        return copy_to(out, np.ascontiguousarray(solutions[..., 0] if is_single else solutions))

    @cached_property
    def _solver(self) -> MassMatrixSolver:
        from ..engine.compiled_derivatives import MassMatrixSolver

        return MassMatrixSolver(self.looped, self.fusion)

    def derivatives(
        self,
        q: ArrayLike,
        u: ArrayLike,
        t: ArrayLike = 0.0,
        efforts: ArrayLike | None = None,
        parameters: Sequence[str] = (),
        out: Derivatives | None = None,
    ) -> Derivatives:
        """Exact derivatives of the accelerations by q, u, efforts, t and named parameters.

        Arguments as for `accelerations`; `parameters` are names as in `with_parameters`.  With
        respect to q: nu tangent increments dphi, dq = N(q) dphi where qdot = N(q) u (rotation
        vectors in outboard axes for quaternions).  No compiler is needed.  `out` is the result of
        an earlier call, whose arrays are overwritten and which is returned.

        Raises SceneError for an unknown name and for scenes with releases, NumericalFailure where
        `accelerations` does and where a derivative does not exist.
        """
        names = require_texts("parameters", parameters, "rod1.mass")
        differentiation = self._differentiations.get(names) or self._differentiation(names)
        answer = differentiation(q, u, t, efforts, lambda: self.accelerations(q, u, t, efforts))
        return answer if out is None else answer.copy_to(out)
