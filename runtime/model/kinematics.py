"""Where a scene's bodies are and how they move at states; what they carry; states moved on."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from mstmm.array_validation import Array, batch, copy_to
from mstmm.errors import NumericalFailure

from ..engine.compiled_scene import CompiledScene
from ..engine.observation_columns import POINT_COLUMNS, SUMS
from ..engine.state_evaluation.steady_motion import move_steadily

if TYPE_CHECKING:
    from ..engine.state_evaluation.kinematics import Brackets, Kinematics, Names
    from ..engine.state_evaluation.single_state import SingleStateCalls
    from .derivatives import Differentiation

_AXES = slice(15, 24)
_MOMENTA = slice(SUMS["momentum"][2].start, SUMS["angular_momentum"][2].stop)


class KinematicQueries(CompiledScene):
    """A compiled scene, and its kinematics at states.

    `of` names a body or an end, "rod1" or "rod1.tip", whose origin is meant, or several: then
    answers have an axis more for them.  Axes are inertial.  Coordinates and speeds are taken as
    they are given, those that a drive imposes or that loops decide as well.
    """

    def positions(self, q: ArrayLike, of: Names, *, out: Array | None = None) -> Array:
        """Places (..., 3) in m at q (..., nq).

        Raises SceneError, here and below, for a shape that does not fit and for a body or an end
        that there is not, with the nearest name.
        """
        found = self._kinematics.call("places", of)(q)
        if found is None:
            found = self._places(q, of)[..., POINT_COLUMNS["position"]]
        return copy_to(out, found)

    def poses(self, q: ArrayLike, of: Names, *, out: Array | None = None) -> Array:
        """Places and axes (..., 4, 4): the matrix that takes [x, y, z, 1] from the axes of the body
        or end to inertial ones."""
        alone: Array | None = self._kinematics.call("poses", of)(q)
        if alone is not None:
            return copy_to(out, alone)
        points = self._places(q, of)
        found = np.zeros((*points.shape[:-1], 4, 4))
        found[..., :3, :3] = points[..., _AXES].reshape(*points.shape[:-1], 3, 3)
        found[..., :3, 3] = points[..., POINT_COLUMNS["position"]]
        found[..., 3, 3] = 1.0
        return copy_to(out, found)

    def _places(self, q: ArrayLike, of: Names) -> Array:
        lead, (states,) = batch(("q", q, self.nq))
        return self._shaped(lead, of, self._kinematics.still(of, states))

    def velocities(
        self, q: ArrayLike, u: ArrayLike, of: Names, *, out: Array | None = None
    ) -> Array:
        """Velocity (m/s), then angular velocity (rad/s), (..., 6), at q (..., nq), u (..., nu)."""
        found = self._kinematics.call("velocities", of)(q, u)
        if found is None:
            lead, states = batch(("q", q, self.nq), ("u", u, self.nu))
            found = self._shaped(lead, of, self._kinematics.moving(of, *states))
        return copy_to(out, found)

    def jacobian(self, q: ArrayLike, of: Names, *, out: Array | None = None) -> Array:
        """J (..., 6, nu) with `velocities` = J u; of the tree, where loops are closed."""
        alone: Array | None = self._kinematics.call("jacobian", of)(q)
        if alone is not None:
            return copy_to(out, alone)
        lead, (states,) = batch(("q", q, self.nq))
        found = self._kinematics.each("jacobian", of, self._kinematics.jacobian, states)
        return copy_to(out, self._shaped(lead, of, found))

    def jacobian_rate(
        self, q: ArrayLike, u: ArrayLike, of: Names, *, out: Array | None = None
    ) -> Array:
        """dJ/dt (..., 6, nu) along u: accelerations of the point and of its turn are
        J udot + (dJ/dt) u.  Exact, no differences."""
        alone: Array | None = self._kinematics.call("jacobian_rate", of)(q, u)
        if alone is not None:
            return copy_to(out, alone)
        lead, (states, speeds) = batch(("q", q, self.nq), ("u", u, self.nu))
        found = self._kinematics.each("jacobian_rate", of, self._jacobian_rate, states, speeds)
        return copy_to(out, self._shaped(lead, of, found))

    def _jacobian_rate(self, of: Names, q: Array, u: Array) -> Array:
        """The same of one state, (k, 6, nu)."""
        return self._kinematics.jacobian_rate(of, q, u, self._turning(q, u))

    def energy(
        self, q: ArrayLike, u: ArrayLike, t: ArrayLike = 0.0, *, out: Array | None = None
    ) -> Array:
        """Total energy (...) in J as in a run at the time t (s): kinetic, that of gravity (zero at
        the inertial origin), of springs and of bent bodies; driven coordinates are where their
        drive has them.

        Raises NumericalFailure where `accelerations` does.
        """
        found = self._alone.energy(t, q, u)
        if found is None:
            found = np.asarray(self._sums(q, u, t)[..., SUMS["energy"][2]].sum(axis=-1))
        return copy_to(out, found)

    def energies(self, q: ArrayLike, u: ArrayLike, t: ArrayLike = 0.0) -> dict[str, Array]:
        """The three parts of `energy`, (...) each in J: kinetic, gravity, springs."""
        sums = self._sums(q, u, t)
        return {
            name.removeprefix("energy."): sums[..., columns.start]
            for name, (_, _, columns) in SUMS.items() if name.startswith("energy.")
        }  # fmt: skip

    def momentum(
        self, q: ArrayLike, u: ArrayLike, t: ArrayLike = 0.0, *, out: Array | None = None
    ) -> Array:
        """Momentum in kg*m/s, then angular momentum about the inertial origin in kg*m2/s, (..., 6);
        see `energy`."""
        found = self._alone.momentum(t, q, u)
        return copy_to(out, self._sums(q, u, t)[..., _MOMENTA] if found is None else found)

    def integrate(
        self, q: ArrayLike, u: ArrayLike, dt: ArrayLike, *, out: Array | None = None
    ) -> Array:
        """q + N(q) u dt (..., nq) of qdot = N(q) u: coordinates after dt (s) at steady rates;
        quaternions turn at a steady angular velocity and stay units."""
        alone: Array | None = self._alone.moved(dt, q, u)
        if alone is not None:
            return copy_to(out, alone)
        lead, (states, speeds, times) = batch(
            ("q", q, self.nq), ("u", u, self.nu), ("dt", dt, None)
        )
        if self._straight:
            return copy_to(out, (states + speeds * times[:, None]).reshape(*lead, self.nq))
        given = zip(states, speeds, times.tolist(), strict=True)
        rows = [self._moved(*one_state) for one_state in given]
        return copy_to(out, np.array(rows).reshape(*lead, self.nq))

    def _moved(self, q: Array, u: Array, dt: float) -> Array:
        for first in self._quaternions:
            q[first : first + 4] /= np.linalg.norm(q[first : first + 4])
        engine = self.looped.inertia_alone
        rates = engine.rates(0.0, q, u, engine.start_memory())
        return move_steadily(q, rates, dt, self._quaternions)

    @cached_property
    def _quaternions(self) -> list[int]:
        return [int(k) for group in self.layout.groups for k in group.quaternions()]

    def _sums(self, q: ArrayLike, u: ArrayLike, t: ArrayLike) -> Array:
        lead, given = batch(("t", t, None), ("q", q, self.nq), ("u", u, self.nu))
        times, states, speeds = given
        memory = np.tile(self.looped.start_memory(), (len(times), 1))
        seen = self.looped.observe(times, states, speeds, memory, (), ("sums",))
        if seen.failures:
            raise NumericalFailure(seen.failures[0])
        return seen.sums.reshape(*lead, -1)

    def _turning(self, q: Array, u: Array) -> Array | None:
        """The rate of increments by themselves (nu, nu); None where rates are the speeds."""
        if self._straight:
            return None
        if not self._steady:
            return self._differentiated_by(()).turning(q, u)
        return np.tensordot(u[self._curved], self._brackets, 1)

    @cached_property
    def _curved(self) -> list[int]:
        """Places of speeds that are no rates of coordinates."""
        hinges = (hinge for hinge in self.layout.hinges.values() if not hinge.straight)
        return [place for hinge in hinges for place in range(hinge.u, hinge.u + hinge.nu)]

    @cached_property
    def _brackets(self) -> Array:
        """(k, nu, nu): `_turning` by each of those speeds, where no place changes it."""
        q, units = np.zeros(self.nq), np.eye(self.nu)[self._curved]
        q[self._quaternions] = 1.0
        by = self._differentiated_by(())
        return np.array([by.turning(q, unit) for unit in units])

    def _bracket_entries(self) -> Brackets | None:
        """The same entry by entry, (by, row, column, value); None where places change it."""
        if self._straight:
            return []
        if not self._steady:
            return None
        where = np.argwhere(self._brackets).tolist()
        return [(self._curved[k], i, j, float(self._brackets[k, i, j])) for k, i, j in where]

    @cached_property
    def _steady(self) -> bool:
        return all(hinge.straight or hinge.steady for hinge in self.layout.hinges.values())

    @cached_property
    def _straight(self) -> bool:
        return all(hinge.straight for hinge in self.layout.hinges.values())

    def _differentiated_by(self, names: tuple[str, ...]) -> Differentiation:
        found = self._differentiations.get(names)
        if found is None:
            from .derivatives import Differentiation

            found = self._differentiations[names] = Differentiation(self, names)
        return found

    @cached_property
    def _differentiations(self) -> dict[tuple[str, ...], Differentiation]:
        return {}

    def _shaped(self, lead: tuple[int, ...], of: Names, found: Array) -> Array:
        """From (states, names, ...) to leading axes, and one name without an axis of its own."""
        shape = found.shape[2:] if isinstance(of, str) else found.shape[1:]
        return found.reshape(*lead, *shape)

    @cached_property
    def _kinematics(self) -> Kinematics:
        from ..engine.body_references import BodyReferences
        from ..engine.state_evaluation.kinematics import Kinematics

        references = BodyReferences(self.scene.skeleton)
        return Kinematics(self.looped, self.fusion, references, self._bracket_entries)

    @cached_property
    def _alone(self) -> SingleStateCalls:
        from ..engine.state_evaluation.single_state import SingleStateCalls

        return SingleStateCalls(self.looped, self.fusion)
