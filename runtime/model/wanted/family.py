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

from ...integrate.settings import Settings
from ...integrate.steppers import AUTO, AUTO_EXPLICIT, get
from ...run import second_opinion
from ...run.fastest import Fastest, may_be_fast
from ...run.method_choice import implicit_method

if TYPE_CHECKING:
    from ...engine.compiled import Compiled
    from ...run.trajectory import Trajectory

#: |lambda| T from which the first run is an implicit one; and for an error from which on it may
#: leave small vibrations out.
_VIBRATING, _LEFT_OUT, _LOOSE = 1000.0, 200.0, 1e-4

#: h |lambda| of explicit steps that follow a vibration at a tolerance, and the order at which it
#: falls.
_FOLLOWED, _AT, _SLOWLY = 4.0, 1e-3, 16.0

#: An implicit step in explicit ones, and the order at which their number grows.
_STEP, _ORDER = 2.5, 4.0

#: Explicit ones among the methods of SciPy and SUNDIALS.
_EXPLICIT_OF_OTHERS = ("scipy-DOP853", "scipy-RK45")

#: The tolerance of the last implicit run in that of a first explicit one, at most; how many times
#: more implicit runs may cost once there are two, for an explicit one would begin anew.
_NEAR, _BEHIND = 4.0, 2.0


def is_explicit(run: Trajectory) -> bool:
    """Whether explicit methods alone made a run."""
    made = {one.method for one in run.methods} or {run.settings.method}
    return all(explicit(method) for method in made)


def explicit(method: str) -> bool:
    """Whether a method is explicit; `auto` begins so."""
    if method in second_opinion.METHODS:
        return method in _EXPLICIT_OF_OTHERS
    return method == AUTO or not get(method).implicit


def _held_back(run: Trajectory) -> bool:
    """Whether stability set many steps of a run that was not free to change its method."""
    counted = run.statistics
    return not run.methods and counted is not None and counted.stability_limited


class Family:
    """The method of each of several runs from one start."""

    def __init__(
        self, model: Compiled, settings: Settings, error: float, q: Array, u: Array
    ) -> None:
        self._settings = settings
        self._many = _VIBRATING if error < _LOOSE else _LEFT_OUT
        self._span = settings.t_end - settings.t_start
        self._rate, self._rescued = 0.0, False
        pays = bool(model.flexible) or may_be_fast(model.scene, _LEFT_OUT / (self._span or 1e-300))
        if settings.method == AUTO and pays:
            try:
                fastest = Fastest(model.looped, model.looped.start_memory())
                self._rate = fastest.rate(settings.t_start, q, u)
            except MstmmError:  # a scene without tangent, or a start that the run itself will blame
                pass

    def first(self) -> str:
        """The method of the first run."""
        if self._settings.method != AUTO or not self._rate:
            return self._settings.method
        return implicit_method(1.0) if self._rate * self._span > self._many else AUTO_EXPLICIT

    def rescues(self, method: str) -> bool:
        """Whether a run by this method that has failed is to be made by `auto`, which does without
        an implicit method that finds no step; from then on all are."""
        if self._settings.method != AUTO or explicit(method):
            return False
        self._rescued = True
        return True

    def method(self, rtol: float, fresh: float, made: Sequence[Trajectory]) -> str:
        """The method of the next run after these ones: `rtol` is its tolerance if it is of the same
        kind as the last one, `fresh` that of a first explicit one."""
        if self._settings.method != AUTO or self._rescued:
            return self._settings.method
        implicit = [run for run in made if not is_explicit(run)]
        if not implicit:
            return AUTO if _held_back(made[-1]) else AUTO_EXPLICIT
        if len(implicit) < len(made):
            return AUTO_EXPLICIT
        last = implicit[-1]
        rate = max([self._rate, *(one.rate or 0.0 for run in made for one in run.methods)])
        growth = (last.settings.rtol / min(rtol, _NEAR * fresh)) ** (1 / _ORDER)
        followed = rate * self._span / _FOLLOWED * (_AT / fresh) ** (1 / _SLOWLY)
        if len(implicit) > 1:
            followed *= _BEHIND
        if _STEP * last.statistics.steps * growth < followed:
            return implicit_method(rtol)
        return AUTO_EXPLICIT
