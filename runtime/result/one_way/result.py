"""Result of a run with one-way bodies: everything as in `Result`, with the elastic part added."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import SceneError
from mstmm.risk import Risk

from ...engine.compiled import Compiled
from ...pack.flexible.rigidified import with_level
from ...pack.letting_go import releasable
from ...run.start import initial_state
from ..blows import is_struck
from ..flexible.bodies import FlexibleBodies
from ..flexible.coupling import couplings
from ..flexible.motion import Motion
from ..observed import Observed
from ..quantities import Quantities
from ..result import Result
from .motion import Superposition
from .response import Cost, OneWay, Response, respond, rigidity

if TYPE_CHECKING:
    from ...run.error_estimate import ErrorEstimate
    from ...run.trajectory import Trajectory


#: Share of the inertia at a hinge above which a one-way response errs by about 0.3 of itself:
#: 3 chi / (1 - chi), the factor for recoil and phase.
COUPLED = 0.09


def _too_coupled(share: tuple[str, float]) -> Risk:
    name, chi = share
    return Risk(
        "one-way-coupling", f'"{name}"',
        f'the vibration of "{name}" moves the hinge that carries it: a shape holds {chi:.2g} of '
        "the inertia there (chi), so that the one-way response may err by "
        f"{3 * chi / (1 - chi):.1f} of its deflection", 'use flexibility = "coupled"', chi,
        COUPLED,
    )  # fmt: skip


def _let_go(model: Compiled) -> tuple[Risk, ...]:
    """Each one-way body whose hinge releases it."""
    letting, rigid = set(releasable(model.scene)), rigidity(model)
    holders = {body: h.name for body, h in rigid.holders.items() if h.name in letting}
    return tuple(
        Risk(
            "one-way-release", f'"{name}"',
            f'hinge "{holders[name]}" lets go of "{name}", whose response stays that of a held '
            "body", 'use flexibility = "coupled"',
        )
        for name in rigid.one_way
        if name in holders
    )  # fmt: skip


def _not_struck(name: str) -> Risk:
    return Risk(
        "one-way-blow", f'"{name}"',
        f'the run has blows, of which the response of "{name}" knows nothing: it follows the loads '
        "between them alone", 'use flexibility = "coupled"',
    )  # fmt: skip


class OneWayResult(Result):
    """What a run gave whose one-way bodies were rigid in it, and their elastic response.

    q, u, loads of hinges, energies and momenta are those of the rigid run.  Motions of bodies and
    ends, and deflections and modal energies of one-way bodies, hold the elastic part, computed when
    the first of them is asked for.
    """

    def __init__(
        self, model: Compiled, run: Trajectory, error: ErrorEstimate | None = None
    ) -> None:
        super().__init__(model, run, error)
        self._observed = _Superposed(self, self._observed)
        self._quantities = Quantities(self._observed, self)

    @cached_property
    def rigid(self) -> Result:
        """The rigid run alone."""
        return Result(self.model, self.trajectory, self._error)

    @cached_property
    def _one_way(self) -> OneWay:
        return respond(self.model, self.trajectory)

    @property
    def cost(self) -> Cost:
        """What the elastic response took besides the rigid run.  Printable."""
        return self._one_way.cost

    def response(self, body: str) -> Response:
        """Modal coordinates of a one-way body with their rates; SceneError for other names."""
        found = self._one_way.responses
        if body not in found:
            raise SceneError(f'"{body}": expected a body that responds one way: {", ".join(found)}')
        return found[body]

    def _outside(self) -> tuple[Risk, ...]:
        """As of any result, and where the response is not to be trusted."""
        found = (*super()._outside(), *self._one_way.risks, *_let_go(self.model))
        if is_struck(self):
            found = (*found, *map(_not_struck, rigidity(self.model).one_way))
        return (*found, *map(_too_coupled, self.couplings.items()))

    @cached_property
    def couplings(self) -> dict[str, float]:
        """Bodies whose vibration moves the hinge that carries them by more than COUPLED, with the
        largest share chi of the inertia there that one of their shapes holds."""
        found = {name: float(np.max(chi)) for name, chi in couplings(self._flexible).items()}
        return {name: chi for name, chi in found.items() if chi > COUPLED}

    @cached_property
    def _flexible(self) -> FlexibleBodies:
        return _OneWayBodies(self)


class _Superposed(Observed):
    """What a run shows, with elastic motions on top of the rigid ones."""

    def __init__(self, result: OneWayResult, rigid: Observed) -> None:
        super().__init__(result.model, result.trajectory)
        self._result, self._rigid = result, rigid
        self._moved: dict[str, Array] = {}

    @cached_property
    def _superposition(self) -> Superposition:
        return Superposition(self._result.model, self._rigid, self._result._one_way.responses)

    def points(self, reference: str) -> Array:
        """(n, 24): motion of "body" or "body.end", see `Observation`."""
        if reference not in self._moved:
            moved = self._superposition.moved(reference)
            moved.flags.writeable = False
            self._moved[reference] = moved
        return self._moved[reference]


class _OneWayBodies(FlexibleBodies):
    """Motions of coupled bodies as they ran, and of one-way bodies as they responded."""

    def __init__(self, result: OneWayResult) -> None:
        super().__init__(result.model, result._observed)
        self._result = result
        rigid = rigidity(result.model)
        self._responding, self.unbalanced = rigid.one_way, rigid.passed
        self.known = {**self.known, **self._responding}
        self.one_way = self._responding

    def coupled_start(self) -> tuple[Compiled, Array]:
        """A model in which all of them are coupled, and its q at the start of the run."""
        model = self.model
        coupled = Compiled(with_level(model.scene, "coupled"), model.known)
        q, _ = initial_state(coupled)
        start = self.run.first[1]
        q[: len(start)] = start
        return coupled, q

    def motion(self, name: str, what: str = "its motion") -> Motion:
        """Motion of one flexible body."""
        if name not in self._responding:
            return super().motion(name, what)
        if name not in self._motions:
            found, points = self._result.response(name), self.observed.points(name)
            self._motions[name] = Motion(
                self._responding[name], self.run.t, found.eta, found.etad, found.etadd,
                points[:, 0:3], points[:, 15:24].reshape(-1, 3, 3), points[:, 3:6],
                points[:, 9:12], points[:, 6:9], points[:, 12:15],
            )  # fmt: skip
        return self._motions[name]
