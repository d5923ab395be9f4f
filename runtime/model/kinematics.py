"""Kinematics, energies and momenta of a compiled scene at given states."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from mstmm.array_validation import Array, batch, copy_to
from mstmm.errors import NumericalFailure

from ..engine.compiled_scene import CompiledScene
from ..engine.quantity_registry import POINT_COLUMNS, SUMS
from ..engine.state_evaluation.state_calls import move_steadily

if TYPE_CHECKING:
    from ..engine.state_evaluation.kinematics import Brackets, Kinematics, Names
    from ..engine.state_evaluation.state_calls import SingleStateCalls
    from .derivatives import Differentiation

_AXES = slice(15, 24)
_MOMENTA = slice(SUMS["momentum"].columns.start, SUMS["angular_momentum"].columns.stop)


class KinematicQueries(CompiledScene):
    """Compiled scene with kinematics at given states.

    `of` names a body or an end, "rod1" or "rod1.tip", for its origin, or several: then answers have
    one more axis for them.  Axes are inertial.  Coordinates and speeds are used as given, also
    driven ones and those that loops determine.
    """

    def positions(self, q: ArrayLike, of: Names, *, out: Array | None = None) -> Array:
        """Positions (..., 3) in m at q (..., nq).

        All queries raise SceneError for a wrong shape and for an unknown body or end, with the
        nearest name.
        """
        points = self._kinematics.prepared_call("places", of)(q)
        if points is None:
            points = self._points(q, of)[..., POINT_COLUMNS["position"]]
        return copy_to(out, points)

    def poses(self, q: ArrayLike, of: Names, *, out: Array | None = None) -> Array:
        """Poses (..., 4, 4): matrices that transform [x, y, z, 1] to inertial axes.

        From the axes of the body or end, at q (..., nq).
        """
        single: Array | None = self._kinematics.prepared_call("poses", of)(q)
        if single is not None:
            return copy_to(out, single)
        points = self._points(q, of)
        matrices = np.zeros((*points.shape[:-1], 4, 4))
        matrices[..., :3, :3] = points[..., _AXES].reshape(*points.shape[:-1], 3, 3)
        matrices[..., :3, 3] = points[..., POINT_COLUMNS["position"]]
        matrices[..., 3, 3] = 1.0
        return copy_to(out, matrices)

    def _points(self, q: ArrayLike, of: Names) -> Array:
        lead, (states,) = batch(("q", q, self.nq))
        return self._reshape(lead, of, self._kinematics.points_at_rest(of, states))

    def velocities(
        self, q: ArrayLike, u: ArrayLike, of: Names, *, out: Array | None = None
    ) -> Array:
        """Velocity (m/s), then angular velocity (rad/s), (..., 6), at q (..., nq), u (..., nu)."""
        twists = self._kinematics.prepared_call("velocities", of)(q, u)
        if twists is None:
            lead, states = batch(("q", q, self.nq), ("u", u, self.nu))
            twists = self._reshape(lead, of, self._kinematics.velocities(of, *states))
        return copy_to(out, twists)

    def jacobian(self, q: ArrayLike, of: Names, *, out: Array | None = None) -> Array:
        """Jacobian J (..., 6, nu) with `velocities` = J u; that of the tree with closed loops."""
        single: Array | None = self._kinematics.prepared_call("jacobian", of)(q)
        if single is not None:
            return copy_to(out, single)
        lead, (states,) = batch(("q", q, self.nq))
        matrices = self._kinematics.evaluate_rows("jacobian", of, self._kinematics.jacobian, states)
        return copy_to(out, self._reshape(lead, of, matrices))

    def jacobian_rate(
        self, q: ArrayLike, u: ArrayLike, of: Names, *, out: Array | None = None
    ) -> Array:
        """Time derivative dJ/dt (..., 6, nu) of the Jacobian along u; exact.

        Acceleration and angular acceleration are J udot + (dJ/dt) u.
        """
        single: Array | None = self._kinematics.prepared_call("jacobian_rate", of)(q, u)
        if single is not None:
            return copy_to(out, single)
        lead, (states, speeds) = batch(("q", q, self.nq), ("u", u, self.nu))
        matrices = self._kinematics.evaluate_rows(
            "jacobian_rate", of, self._jacobian_rate, states, speeds
        )
        return copy_to(out, self._reshape(lead, of, matrices))

    def _jacobian_rate(self, of: Names, q: Array, u: Array) -> Array:
        """`jacobian_rate` (k, 6, nu) of one state."""
        return self._kinematics.jacobian_rate(of, q, u, self._increment_rates(q, u))

    def energy(
        self, q: ArrayLike, u: ArrayLike, t: ArrayLike = 0.0, *, out: Array | None = None
    ) -> Array:
        """Total energy (...) in J at time t (s): kinetic, gravity, springs and deformation.

        The energy of gravity is zero at the inertial origin.  Driven coordinates have the values of
        their drives.  Raises NumericalFailure where `accelerations` does.
        """
        total = self._single_state.energy(t, q, u)
        if total is None:
            total = np.asarray(
                self._observe_sums(q, u, t)[..., SUMS["energy"].columns].sum(axis=-1)
            )
        return copy_to(out, total)

    def energy_components(self, q: ArrayLike, u: ArrayLike, t: ArrayLike = 0.0) -> dict[str, Array]:
        """Parts of `energy` by name, (...) each in J: kinetic, gravity, springs."""
        sums = self._observe_sums(q, u, t)
        return {
            name.removeprefix("energy."): sums[..., kind.columns.start]
            for name, kind in SUMS.items() if name.startswith("energy.")
        }  # fmt: skip

    def momentum(
        self, q: ArrayLike, u: ArrayLike, t: ArrayLike = 0.0, *, out: Array | None = None
    ) -> Array:
        """Momentum (kg*m/s), then angular momentum about the inertial origin (kg*m2/s), (..., 6).

        State and time as in `energy`.
        """
        momenta = self._single_state.momentum(t, q, u)
        return copy_to(
            out, self._observe_sums(q, u, t)[..., _MOMENTA] if momenta is None else momenta
        )

    def integrate(
        self, q: ArrayLike, u: ArrayLike, dt: ArrayLike, *, out: Array | None = None
    ) -> Array:
        """Coordinates q + N(q) u dt (..., nq) after dt (s) at constant rates, with qdot = N(q) u.

        Quaternions rotate at a constant angular velocity and keep unit length.
        """
        single: Array | None = self._single_state.moved(dt, q, u)
        if single is not None:
            return copy_to(out, single)
        lead, (states, speeds, times) = batch(
            ("q", q, self.nq), ("u", u, self.nu), ("dt", dt, None)
        )
        if self._has_rate_speeds:
            return copy_to(out, (states + speeds * times[:, None]).reshape(*lead, self.nq))
        given = zip(states, speeds, times.tolist(), strict=True)
        rows = [self._advance(*state) for state in given]
        return copy_to(out, np.array(rows).reshape(*lead, self.nq))

    def _advance(self, q: Array, u: Array, dt: float) -> Array:
        for first in self._quaternions:
            q[first : first + 4] /= np.linalg.norm(q[first : first + 4])
        engine = self.looped.inertia_only
        rates = engine.rates(0.0, q, u, engine.start_memory())
        return move_steadily(q, rates, dt, self._quaternions)

    @cached_property
    def _quaternions(self) -> list[int]:
        return [int(k) for group in self.coordinate_layout.groups for k in group.quaternions()]

    def _observe_sums(self, q: ArrayLike, u: ArrayLike, t: ArrayLike) -> Array:
        lead, given = batch(("t", t, None), ("q", q, self.nq), ("u", u, self.nu))
        times, states, speeds = given
        memory = np.tile(self.looped.start_memory(), (len(times), 1))
        observed = self.looped.observe(times, states, speeds, memory, (), ("sums",))
        if observed.failures:
            raise NumericalFailure(observed.failures[0])
        return observed.sums.reshape(*lead, -1)

    def _increment_rates(self, q: Array, u: Array) -> Array | None:
        """Rate of tangent increments per increment (nu, nu); None if rates are the speeds."""
        if self._has_rate_speeds:
            return None
        if not self._has_constant_subspaces:
            return self._differentiation(()).rate_matrix(q, u)
        return np.tensordot(u[self._quasi_speeds], self._brackets, 1)

    @cached_property
    def _quasi_speeds(self) -> list[int]:
        """Indices of speeds that are not rates of coordinates."""
        hinges = (
            hinge for hinge in self.coordinate_layout.hinges.values() if not hinge.rates_are_speeds
        )
        return [place for hinge in hinges for place in range(hinge.u, hinge.u + hinge.nu)]

    @cached_property
    def _brackets(self) -> Array:
        """Derivative (k, nu, nu) of `_increment_rates` by quasi-speeds, if independent of q."""
        q, units = np.zeros(self.nq), np.eye(self.nu)[self._quasi_speeds]
        q[self._quaternions] = 1.0
        differentiation = self._differentiation(())
        return np.array([differentiation.rate_matrix(q, unit) for unit in units])

    def _bracket_entries(self) -> Brackets | None:
        """Entries (speed, row, column, value) of `_brackets`; None if they depend on q."""
        if self._has_rate_speeds:
            return []
        if not self._has_constant_subspaces:
            return None
        indices = np.argwhere(self._brackets).tolist()
        return [
            (self._quasi_speeds[k], i, j, float(self._brackets[k, i, j])) for k, i, j in indices
        ]

    @cached_property
    def _has_constant_subspaces(self) -> bool:
        return all(
            hinge.rates_are_speeds or hinge.constant_subspace
            for hinge in self.coordinate_layout.hinges.values()
        )

    @cached_property
    def _has_rate_speeds(self) -> bool:
        return all(hinge.rates_are_speeds for hinge in self.coordinate_layout.hinges.values())

    def _differentiation(self, names: tuple[str, ...]) -> Differentiation:
        differentiation = self._differentiations.get(names)
        if differentiation is None:
            from .derivatives import Differentiation

            differentiation = self._differentiations[names] = Differentiation(self, names)
        return differentiation

    @cached_property
    def _differentiations(self) -> dict[tuple[str, ...], Differentiation]:
        return {}

    def _reshape(self, lead: tuple[int, ...], of: Names, answers: Array) -> Array:
        """Answers (states, names, ...) with leading axes, and without an axis for a single name."""
        shape = answers.shape[2:] if isinstance(of, str) else answers.shape[1:]
        return answers.reshape(*lead, *shape)

    @cached_property
    def _kinematics(self) -> Kinematics:
        from ..engine.quantity_registry import BodyReferences
        from ..engine.state_evaluation.kinematics import Kinematics

        references = BodyReferences(self.scene.skeleton)
        return Kinematics(self.looped, self.fusion, references, self._bracket_entries)

    @cached_property
    def _single_state(self) -> SingleStateCalls:
        from ..engine.state_evaluation.state_calls import SingleStateCalls

        return SingleStateCalls(self.looped, self.fusion)
