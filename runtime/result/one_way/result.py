"""Result of a run with one-way bodies: `Result` with the elastic part added.

Small elastic motions of bodies are superposed on the rigid motion of a tree. A small motion
displaces the point at r by a + psi x r (inertial axes) and rotates its surroundings by psi. Hinges
transmit it unchanged, because their coordinates are those of the rigid run. A flexible body adds
the small motion of its outboard section and subtracts that of its inboard section, as far as the
hinge there constrains it. A hinge that is part of a closed loop transmits nothing: it rotates by
the rotation of the section, and the section has no other motion.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.risk import Risk
from mstmm.scene import split_reference

from ...engine.compiled_scene import CompiledScene
from ...packing.expansion import with_level
from ...packing.packed_scene import releasable_hinges
from ...packing.rigid_substitution import constrained_rotations
from ...run.start_state import initial_state
from ..checks.conservation import has_impacts
from ..flexible.modal_participation import participation_by_body
from ..flexible.motion import Motion, section_rotations
from ..flexible.section_loads import FlexibleBodies
from ..observations import Observations
from ..quantities import Quantities
from ..result import Result
from .response import (
    OneWayResponses,
    Response,
    ResponseCost,
    compute_responses,
    rigidified_bodies,
    split_node,
)

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene
    from ...flexible.modal_parts import ModalPort
    from ...run.error_estimate import ErrorEstimate
    from ...run.trajectory import Trajectory
    from ..observations import Observations


@dataclass(frozen=True)
class Jet:
    """Vector over time with its first and second rate, (n, 3) each, inertial axes."""

    value: Array
    rate: Array
    second: Array

    def __add__(self, other: Jet) -> Jet:
        return Jet(self.value + other.value, self.rate + other.rate, self.second + other.second)

    def __neg__(self) -> Jet:
        return Jet(-self.value, -self.rate, -self.second)

    def cross(self, other: Jet) -> Jet:
        """Cross product self x other."""
        a, b = self, other
        return Jet(
            np.cross(a.value, b.value),
            np.cross(a.rate, b.value) + np.cross(a.value, b.rate),
            np.cross(a.second, b.value)
            + 2 * np.cross(a.rate, b.rate)
            + np.cross(a.value, b.second),
        )


@dataclass(frozen=True)
class SmallMotion:
    """Small motion of a rigid frame: displacement a + psi x r of every point r."""

    origin: Jet
    rotation: Jet

    def __add__(self, other: SmallMotion) -> SmallMotion:
        return SmallMotion(self.origin + other.origin, self.rotation + other.rotation)

    def __neg__(self) -> SmallMotion:
        return SmallMotion(-self.origin, -self.rotation)


class Superposition:
    """Small motions of all nodes of a tree, from the responses of its one-way bodies."""

    def __init__(
        self, model: CompiledScene, rigid: Observations, responses: Mapping[str, Response]
    ) -> None:
        self.model, self.rigid, self.responses = model, rigid, responses
        self.substitution = rigidified_bodies(model)
        packed = rigid.engine.packed
        self.topology, self.hinges = packed.topology, packed.scene.hinges
        self.names, self.order = packed.scene.bodies, packed.topology.order
        self.ends = frozenset(self.substitution.nodes.values())
        self._sections: dict[tuple[str, str], SmallMotion] = {}
        self._constrained_motions: dict[str, SmallMotion] = {}

    def superposed_motion(self, reference: str) -> Array:
        """Motion (n, 24) of "body" or "body.end" including elastic motions inboard of it.

        Columns as in `Observations.points`.
        """
        points = self.rigid.points(reference)
        small = self.small_motion(reference)
        return points if small is None else _add_small_motion(points, small)

    def small_motion(self, reference: str) -> SmallMotion | None:
        """Small motion at a reference; None if no one-way body is inboard of it."""
        body_index = self.rigid.engine.packed.end(reference)[0]
        body, end = split_reference(reference)
        total: SmallMotion | None = None
        exit_end = end if body in self.responses else ""
        is_passed_on = True
        while body_index >= 0:
            name = self.names.name(self.order[body_index])
            if name in self.ends and is_passed_on:
                exit_end = split_node(name)[1]
            if name in self.responses:
                contribution = -self.constrained_motion(name)
                if exit_end:
                    contribution = contribution + self.section(name, exit_end)
                total, exit_end = contribution if total is None else total + contribution, ""
            is_passed_on = (
                self.hinges.name(self.topology.scene_indices(body_index)[1])
                not in self.substitution.loop_hinges
            )
            body_index = self.topology.parents[body_index]
        return total

    def section(self, name: str, end: str) -> SmallMotion:
        """Small motion of a section of a one-way body relative to its rigid position."""
        if (name, end) not in self._sections:
            port = self.substitution.one_way[name].ports[end]
            self._sections[name, end] = self._section(name, port)
        return self._sections[name, end]

    def _section(self, name: str, port: ModalPort) -> SmallMotion:
        points, response = self.rigid.points(name), self.responses[name]
        zero = np.zeros((len(points), 3))
        position = _origin_motion(points) + _to_inertial(points, zero + port.position, zero, zero)
        rates = (response.eta, response.etad, response.etadd)
        shift = _to_inertial(points, *(eta @ port.phi.T for eta in rates))
        rotation = _to_inertial(points, *(eta @ port.theta.T for eta in rates))
        return SmallMotion(shift + -rotation.cross(position), rotation)

    def constrained_motion(self, name: str) -> SmallMotion:
        """Part of the inboard section's small motion that the hinge there constrains."""
        if name not in self._constrained_motions:
            self._constrained_motions[name] = self._find_constrained_motion(name)
        return self._constrained_motions[name]

    def _find_constrained_motion(self, name: str) -> SmallMotion:
        end = self.substitution.inboard_ends[name]
        port, hinge = (
            self.substitution.one_way[name].ports[end],
            self.substitution.inboard_hinges.get(name),
        )
        shift = port.phi
        if hinge is None or (hinge.facts is not None and hinge.facts.free_body):
            shift = np.zeros_like(shift)
        zero = np.zeros((3, 3))
        constrained_rotation = (
            zero if hinge is None else constrained_rotations(hinge, port.rotation, unknown=zero)
        )
        return self._section(
            name, replace(port, phi=shift, theta=constrained_rotation @ port.theta)
        )


def _origin_motion(points: Array) -> Jet:
    return Jet(points[:, 0:3], points[:, 3:6], points[:, 6:9])


def _to_inertial(points: Array, value: Array, rate: Array, second: Array) -> Jet:
    """Vector of body components over time, in inertial axes."""
    rotation = points[:, 15:24].reshape(-1, 3, 3)
    spin, spin_rate = points[:, 9:12], points[:, 12:15]
    inertial_value, rate, second = (
        np.einsum("tij,tj->ti", rotation, v) for v in (value, rate, second)
    )
    transport = np.cross(spin, inertial_value)
    return Jet(
        inertial_value,
        transport + rate,
        np.cross(spin_rate, inertial_value)
        + np.cross(spin, transport)
        + 2 * np.cross(spin, rate)
        + second,
    )


def _add_small_motion(points: Array, small: SmallMotion) -> Array:
    """Points (n, 24) with a small motion added: positions to first order, rotations exp(psi~) R."""
    origin = _origin_motion(points)
    origin = origin + small.origin + small.rotation.cross(origin)
    spin, spin_rate, small_rotation = points[:, 9:12], points[:, 12:15], small.rotation
    result = np.array(points)
    result[:, 0:9] = np.concatenate([origin.value, origin.rate, origin.second], axis=1)
    result[:, 9:12] = spin + small_rotation.rate + np.cross(small_rotation.value, spin)
    result[:, 12:15] = spin_rate + small_rotation.second + np.cross(small_rotation.rate, spin)
    result[:, 12:15] += np.cross(small_rotation.value, spin_rate)
    rotation = points[:, 15:24].reshape(-1, 3, 3)
    result[:, 15:24] = (section_rotations(small_rotation.value) @ rotation).reshape(-1, 9)
    return result


#: Share of the inertia at a hinge above which the relative error of a one-way response exceeds
#: about 0.3: 3 chi / (1 - chi), the factor for recoil and phase.
MAX_UNCOUPLED_SHARE = 0.09


def _coupling_risk(share: tuple[str, float]) -> Risk:
    name, chi = share
    return Risk(
        "one-way-coupling", f'"{name}"',
        f'the vibration of "{name}" moves its inboard hinge: a shape has {chi:.2g} of the inertia '
        "there (chi), so that the relative error of the one-way response may reach "
        f"{3 * chi / (1 - chi):.1f}", 'use flexibility = "coupled"', chi,
        MAX_UNCOUPLED_SHARE,
    )  # fmt: skip


def _release_risks(model: CompiledScene) -> tuple[Risk, ...]:
    """Findings: each one-way body whose hinge releases it."""
    releasing_hinges, rigid = set(releasable_hinges(model.scene)), rigidified_bodies(model)
    holders = {
        body: h.name for body, h in rigid.inboard_hinges.items() if h.name in releasing_hinges
    }
    return tuple(
        Risk(
            "one-way-release", f'"{name}"',
            f'hinge "{holders[name]}" releases "{name}", whose one-way response remains that of an '
            "attached body", 'use flexibility = "coupled"',
        )
        for name in rigid.one_way
        if name in holders
    )  # fmt: skip


def _impact_risk(name: str) -> Risk:
    return Risk(
        "one-way-blow", f'"{name}"',
        f'the run has impacts, which do not excite the one-way response of "{name}": it follows '
        "the loads between them only", 'use flexibility = "coupled"',
    )  # fmt: skip


class OneWayResult(Result):
    """Result of a run with rigid one-way bodies, including their elastic response.

    q, u, loads of hinges, energies and momenta are those of the rigid run. Motions of bodies and
    ends, and deflections and modal energies of one-way bodies, include the elastic part, computed
    on first use.
    """

    def __init__(
        self, model: CompiledScene, run: Trajectory, error: ErrorEstimate | None = None
    ) -> None:
        super().__init__(model, run, error)
        self._observations = _SuperposedObservations(self, self._observations)
        self._quantities = Quantities(self._observations, self)

    @cached_property
    def rigid(self) -> Result:
        """Result of the rigid run without elastic response."""
        return Result(self.model, self.trajectory, self._error)

    @cached_property
    def _one_way(self) -> OneWayResponses:
        return compute_responses(self.model, self.trajectory)

    @property
    def cost(self) -> ResponseCost:
        """Cost of the elastic response in addition to the rigid run. Printable."""
        return self._one_way.cost

    def response(self, body: str) -> Response:
        """Modal coordinates of a one-way body with their rates; SceneError for other names."""
        responses = self._one_way.responses
        if body not in responses:
            raise SceneError(f'"{body}": expected a one-way body: {", ".join(responses)}')
        return responses[body]

    def _model_risks(self) -> tuple[Risk, ...]:
        """Findings of any result, and those about the elastic response."""
        risks = (*super()._model_risks(), *self._one_way.risks, *_release_risks(self.model))
        if has_impacts(self):
            risks = (*risks, *map(_impact_risk, rigidified_bodies(self.model).one_way))
        return (*risks, *map(_coupling_risk, self.couplings.items()))

    @cached_property
    def couplings(self) -> dict[str, float]:
        """Bodies whose vibration moves their hinge significantly, with the largest share chi.

        Bodies with a share of the inertia at the hinge, of one of their shape functions, above
        `MAX_UNCOUPLED_SHARE`.
        """
        largest_shares = {
            name: float(np.max(chi)) for name, chi in participation_by_body(self._flexible).items()
        }
        return {name: chi for name, chi in largest_shares.items() if chi > MAX_UNCOUPLED_SHARE}

    @cached_property
    def _flexible(self) -> FlexibleBodies:
        return _OneWayBodies(self)


class _SuperposedObservations(Observations):
    """Observations of a run with elastic motions superposed on the rigid ones."""

    def __init__(self, result: OneWayResult, rigid: Observations) -> None:
        super().__init__(result.model, result.trajectory)
        self._result, self._rigid = result, rigid
        self._motions: dict[str, Array] = {}

    @cached_property
    def _superposition(self) -> Superposition:
        return Superposition(self._result.model, self._rigid, self._result._one_way.responses)

    def points(self, reference: str) -> Array:
        """Motion (n, 24) of "body" or "body.end", see `Observation`."""
        if reference not in self._motions:
            motion = self._superposition.superposed_motion(reference)
            motion.flags.writeable = False
            self._motions[reference] = motion
        return self._motions[reference]


class _OneWayBodies(FlexibleBodies):
    """Motions of coupled bodies in the run, and of one-way bodies with their response."""

    def __init__(self, result: OneWayResult) -> None:
        super().__init__(result.model, result._observations)
        self._result = result
        rigid = rigidified_bodies(result.model)
        self._one_way_bodies, self.unbalanced = rigid.one_way, rigid.passed
        self.modal_bodies = {**self.modal_bodies, **self._one_way_bodies}
        self.one_way = self._one_way_bodies

    def coupled_start(self) -> tuple[CompiledScene, Array]:
        """Model in which all flexible bodies are coupled, and its q at the start of the run."""
        model = self.model
        coupled = CompiledScene(with_level(model.scene, "coupled"), model.known)
        q, _ = initial_state(coupled)
        start = self.run.first[1]
        q[: len(start)] = start
        return coupled, q

    def motion(self, name: str, what: str = "its motion") -> Motion:
        """Motion of one flexible body."""
        if name not in self._one_way_bodies:
            return super().motion(name, what)
        if name not in self._motions:
            response, points = self._result.response(name), self.observations.points(name)
            body, modal = self._one_way_bodies[name], (response.eta, response.etad, response.etadd)
            self._motions[name] = Motion.of_points(body, self.run.t, modal, points)
        return self._motions[name]


def result_of(model: CompiledScene, run: Trajectory, error: ErrorEstimate | None = None) -> Result:
    """Build the result of a run, with elastic responses where bodies are one-way."""
    expanded = model.packed_scene.expanded
    rigid = None if expanded is None else expanded.rigidified
    if rigid is None or not rigid.one_way:
        return Result(model, run, error)
    return OneWayResult(model, run, error)
