"""Whether a wanted error is reached by an explicit or by an implicit method.

The explicit one follows the fastest vibration of the scene whatever the tolerance; steps of the
implicit one grow shorter with the tolerance.  Which costs less shows in a first run and in the
fastest motion: no run is made to compare the two.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from mstmm.arrays import Array
from mstmm.errors import MstmmError

from ..integrate.settings import Settings
from ..integrate.steppers import AUTO, AUTO_EXPLICIT, get
from ..run import second_opinion
from ..run.fastest import Fastest
from ..run.method_choice import implicit_method

if TYPE_CHECKING:
    from ..engine.compiled import Compiled
    from ..run.trajectory import Trajectory

#: |lambda| T of flexible bodies from which the first run is an implicit one.
_VIBRATING = 200.0

#: h |lambda| of explicit steps that follow a vibration at a tolerance, and the order at which it
#: falls.
_FOLLOWED, _AT, _SLOWLY = 4.0, 1e-3, 16.0

#: Hinges from which a look at all of them costs more than the fastest motion itself.
_MANY = 1000

#: An implicit step in explicit ones, and the order at which their number grows.
_STEP, _ORDER = 2.5, 5.0


def is_explicit(run: Trajectory) -> bool:
    """Whether an explicit method alone made a run."""
    return {one.method for one in run.methods} <= {AUTO_EXPLICIT} and not _implicit(run)


def _implicit(run: Trajectory) -> bool:
    counted = run.statistics
    return counted is not None and counted.tangents > 0


def _may_vibrate(model: Compiled, span: float) -> bool:
    """Whether a look at the fastest motion may pay: flexible bodies, or laws that are stiff beside
    the smallest inertia."""
    if model.flexible:
        return True
    scene = model.scene
    if len(scene.hinges) > _MANY:
        return True
    given = [one for hinge in scene.hinges for one in hinge.law.stiffness]
    stiffest = max(given + [spring.law.stiffness for spring in scene.spring], default=0.0)
    least = min((min(body.mass, max(body.inertia)) for body in scene.bodies), default=0.0)
    return stiffest * span**2 > _VIBRATING**2 * least


class Family:
    """The method of each of several runs from one start."""

    def __init__(self, model: Compiled, settings: Settings, q: Array, u: Array) -> None:
        self._settings = settings
        self._span = settings.t_end - settings.t_start
        self._rate = 0.0
        if settings.method == AUTO and _may_vibrate(model, self._span):
            try:
                fastest = Fastest(model.looped, model.looped.start_memory())
                self._rate = fastest.rate(settings.t_start, q, u)
            except MstmmError:  # a scene without tangent, or a start that the run itself will blame
                pass

    def first(self) -> str:
        """The method of the first run."""
        if self._settings.method == AUTO and self._rate * self._span > _VIBRATING:
            return implicit_method(1.0)
        return self._settings.method

    def method(self, rtol: float, made: Sequence[Trajectory]) -> str:
        """The method for a tolerance, after these runs, loose to tight."""
        if self._settings.method != AUTO:
            return self._settings.method
        implicit = [run for run in made if not is_explicit(run)]
        if not implicit or len(implicit) < len(made):
            return AUTO_EXPLICIT
        last = implicit[-1]
        rate = max([self._rate, *(one.rate or 0.0 for run in made for one in run.methods)])
        growth = (last.settings.rtol / rtol) ** (1 / _ORDER)
        followed = rate * self._span / _FOLLOWED * (_AT / rtol) ** (1 / _SLOWLY)
        if _STEP * last.statistics.steps * growth < followed:
            return implicit_method(rtol)
        return AUTO_EXPLICIT

    def is_explicit(self, method: str) -> bool:
        """Whether a run by this method will be an explicit one."""
        if method in (AUTO, AUTO_EXPLICIT) or method in second_opinion.METHODS:
            return True
        return not get(method).implicit
