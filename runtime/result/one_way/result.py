"""Result of a run with one-way bodies: `Result` with the elastic part added."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.risk import Risk

from ...engine.compiled_scene import CompiledScene
from ...packing.packed_scene import releasable_hinges
from ...packing.rigid_substitution import with_level
from ...run.start_state import initial_state
from ..checks.conservation import has_impacts
from ..flexible.body_motions import FlexibleBodies
from ..flexible.modal_participation import participation_by_body
from ..flexible.motion import Motion
from ..observations import Observations
from ..quantities import Quantities
from ..result import Result
from .elastic_superposition import Superposition
from .response import OneWayResponses, Response, ResponseCost, compute_responses, rigidified_bodies

if TYPE_CHECKING:
    from ...run.error_estimate import ErrorEstimate
    from ...run.trajectory import Trajectory


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
            self._motions[name] = Motion(
                self._one_way_bodies[name], self.run.t, response.eta, response.etad, response.etadd,
                points[:, 0:3], points[:, 15:24].reshape(-1, 3, 3), points[:, 3:6],
                points[:, 9:12], points[:, 6:9], points[:, 12:15],
            )  # fmt: skip
        return self._motions[name]
