"""What a compiled scene answers about single states, or many: dynamics and its derivatives.

Every call takes one state or leading axes of them, checks their shapes, and writes into `out`
where one is given: a float64 array of the answer's shape, which is handed back.
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

from ..packing.coordinate_layout import refuse_dense
from .kinematics import KinematicQueries

if TYPE_CHECKING:
    from ..engine.mass_matrix_solver import MassMatrixSolver
    from ..engine.state_evaluation.single_state import SingleStateCalls
    from .derivatives import Derivatives


class DynamicsQueries(KinematicQueries):
    """A compiled scene, and its dynamics at states."""

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
        """udot (..., nu) from q (..., nq), u (..., nu), t (s) and extra efforts (..., nu; N, N*m).

        Driven coordinates take the drive's value whatever q and u say.  A batch (leading axes) goes
        through vector lanes where there is fused code, and through `threads` threads (None: as many
        as there are processors); with one engine a state's numbers depend neither on the batch
        around it nor on the threads, to the last bit.

        Raises SceneError for a shape that does not fit, NumericalFailure naming the state and the
        hinge whose motion is undetermined.
        """
        if threads is None:
            alone = self._alone
            if alone.library is not self.fusion.library:
                alone.renew()
            found: Array | None = alone.accelerations(t, q, u, efforts)
            if found is not None:
                return found if out is None else copy_to(out, found)
        from ..engine.state_evaluation.state_batch import StateBatch, accelerations

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
        """Efforts (..., nu) beyond the laws' own that give `udot`; for driven coordinates the
        drive's.  q (..., nq), u and udot (..., nu), t (s).

        Where loops are closed, `actuators` are what acts: hinges, or efforts of some of their
        speeds ("shoulder.effort"), as many as the mechanism has motions; the efforts of all others
        are zero.  Without, they are `loops.independent`.  udot may be that of these independent
        speeds alone, (..., mobility); all of it must go with the loops.

        Newton-Euler inverse dynamics over the tree, O(bodies), and a sweep more for each motion of
        a mechanism.  Raises SceneError for a shape that does not fit, accelerations that tear a
        loop, and actuators that are not as many as the motions; NumericalFailure where they do not
        decide them at the state.
        """
        if self.freedom is not None:
            from .constrained_inverse_dynamics import constrained_inverse_dynamics

            return copy_to(out, constrained_inverse_dynamics(self, q, u, udot, t, actuators))
        if actuators is not None:
            raise SceneError("actuators: no loop is closed in this scene, so that all speeds act")
        alone = self._alone
        if alone.inverse is None or alone.inverse is not self.fusion.inverse:
            alone.seek()
        found: Array | None = alone.efforts(t, q, u, udot)
        if found is not None:
            return found if out is None else copy_to(out, found)
        engine = self.looped
        memory, nu = engine.start_memory(), self.nu
        lead, (times, coordinates, speeds, rates) = batch(
            ("t", t, None), ("q", q, self.nq), ("u", u, nu), ("udot", udot, nu)
        )
        rows = np.empty((len(times), nu))
        states = zip(times.tolist(), coordinates, speeds, rates, strict=True)
        for k, (at, a, b, c) in enumerate(states):
            found = alone.efforts(at, a, b, c)
            rows[k] = engine.inverse_dynamics(at, a, b, c, memory) if found is None else found
        return copy_to(out, rows.reshape(*lead, nu))

    def bias(
        self, q: ArrayLike, u: ArrayLike, t: ArrayLike = 0.0, *, out: Array | None = None
    ) -> Array:
        """h (..., nu) of M(q) udot + h = efforts: what holds all speeds steady against gravity,
        laws, loads and turning axes; where loops are closed (..., mobility), as `mass_matrix`.

        Raises what `inverse_dynamics` raises.
        """
        if self.freedom is None:
            return self.inverse_dynamics(q, u, np.zeros(self.nu), t, out=out)
        places = list(self.freedom.places)
        return copy_to(out, self.inverse_dynamics(q, u, np.zeros(len(places)), t)[..., places])

    def gravity_efforts(self, q: ArrayLike, *, out: Array | None = None) -> Array:
        """Efforts (..., nu) that hold the scene at rest against gravity alone, laws, loads and
        drives left out; where loops are closed (..., mobility), as `mass_matrix`.

        Raises SceneError for a shape that does not fit, NumericalFailure where the independent
        speeds do not decide the others.
        """
        if self.freedom is None and not self.layout.modal:
            alone: Array | None = self._held.efforts(0.0, q, *self._still)
            if alone is not None:
                return alone if out is None else copy_to(out, alone)
        lead, (states,) = batch(("q", q, self.nq))
        found = np.array([self._against_gravity(one_state) for one_state in states])
        return copy_to(out, found.reshape(*lead, *found.shape[1:]))

    def _against_gravity(self, q: Array) -> Array:
        still, memory = self._still[0], self.looped.start_memory()
        found, strained = (
            engine.inverse_dynamics(0.0, q, still, still, memory)
            for engine in (self.looped.weighed, self.looped.inertia_alone)
        )
        if self.freedom is None:
            return found - strained
        return self.freedom.following(q, self.freedom.places).T @ (found - strained)

    @cached_property
    def _still(self) -> tuple[Array, Array]:
        return np.zeros(self.nu), np.zeros(self.nu)

    @cached_property
    def _held(self) -> SingleStateCalls:
        from ..engine.fused_code import NoFusedCode
        from ..engine.state_evaluation.single_state import SingleStateCalls

        return SingleStateCalls(self.looped.weighed, NoFusedCode())

    def mass_matrix(self, q: ArrayLike, *, out: Array | None = None) -> Array:
        """Symmetric (..., nu, nu) mass matrix at q (..., nq), kg, kg*m, kg*m2; driven coordinates
        as if free.  Where loops are closed it is that of the independent speeds alone, (...,
        mobility, mobility) in the order of `loops.independent`, driven ones left out.

        Raises SceneError for a shape that does not fit, NumericalFailure where the independent
        speeds do not decide the others.
        """
        if self.freedom is None:
            alone = self._alone
            if alone.inverse is None or alone.inverse is not self.fusion.inverse:
                alone.seek()
            matrix: Array | None = alone.mass(q)
            if matrix is not None:
                return matrix if out is None else copy_to(out, matrix)
            refuse_dense(self.nu, "the mass matrix")
        lead, (states,) = batch(("q", q, self.nq))
        if self.freedom is not None:
            from .constrained_inverse_dynamics import reduced_mass

            found = np.array([reduced_mass(self, one_state) for one_state in states])
            return copy_to(out, found.reshape(*lead, *found.shape[1:]))
        rows = np.empty((len(states), self.nu, self.nu))
        for k, one_state in enumerate(states):
            matrix = alone.mass(one_state)
            rows[k] = self.looped.mass_matrix(one_state) if matrix is None else matrix
        return copy_to(out, rows.reshape(*lead, self.nu, self.nu))

    def solve(self, q: ArrayLike, rhs: ArrayLike, *, out: Array | None = None) -> Array:
        """M(q)^-1 rhs: accelerations (..., nu) or (..., nu, k) that efforts rhs alone give.

        q (..., nq); rhs (nu,), one column for all states, or (..., nu, k), k columns (N, N*m), as
        `numpy.linalg.solve` has it.  M is never formed: the tree is factored once per state, and
        each column is O(bodies).  Speeds that a drive or a hold imposes, released later or not,
        stay unaccelerated: their rows of rhs are not read and their answers are zero.

        Raises SceneError for a shape that does not fit, NumericalFailure naming the hinge whose
        motion is undetermined.
        """
        alone, columns = columns_of("rhs", rhs, self.nu)
        k = columns.shape[-1]
        lead, (states, columns) = batch(("q", q, self.nq), ("rhs", columns, (self.nu, k)))
        answers = self._solver.solve(states, np.ascontiguousarray(columns.swapaxes(-1, -2)))
        found = answers.swapaxes(-1, -2).reshape(*lead, self.nu, k)
        return copy_to(out, np.ascontiguousarray(found[..., 0] if alone else found))

    @cached_property
    def _solver(self) -> MassMatrixSolver:
        from ..engine.mass_matrix_solver import MassMatrixSolver

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
        """Exact derivatives of the accelerations by q, u, efforts, t and named numbers.

        Arguments as for `accelerations`; `parameters` are names as in `with_parameters`.  With
        respect to q: nu tangent increments dphi, dq = N(q) dphi where qdot = N(q) u (rotation
        vectors in outboard axes for quaternions).  No compiler is needed.  `out` is what an
        earlier call gave, whose arrays are written into and which is returned.

        Raises SceneError for a name that the scene does not have and for scenes with releases,
        NumericalFailure where `accelerations` does and where a derivative does not exist.
        """
        names = require_texts("parameters", parameters, "rod1.mass")
        by = self._differentiations.get(names) or self._differentiated_by(names)
        found = by(q, u, t, efforts, lambda: self.accelerations(q, u, t, efforts))
        return found if out is None else found.kept_in(out)
