"""Whether a wanted error is reached by an explicit or by an implicit method, and by which one.

The explicit one follows the fastest vibration of the scene whatever the tolerance; steps of the
implicit one grow shorter with the tolerance.  Which costs less shows in a first run and in the
fastest motion: no run is made to compare the two.  Of the explicit ones that of lower order costs
less as long as tolerances are loose.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

from mstmm.arrays import Array
from mstmm.errors import MstmmError

from ...integrate.loop import Status
from ...integrate.settings import Settings
from ...integrate.steppers import AUTO, AUTO_EXPLICIT, get
from ...run import second_opinion
from ...run.fastest import Fastest, fastest_possible
from ...run.method_choice import implicit_method

if TYPE_CHECKING:
    from ...engine.compiled import Compiled
    from ...run.trajectory import Trajectory

#: |lambda| T from which the first run is an implicit one; and for an error from which on it may
#: leave small vibrations out.
_VIBRATING, _LEFT_OUT, _LOOSE = 2000.0, 700.0, 1e-4

#: The explicit method for loose tolerances, and the tolerance down to which it costs less than that
#: of higher order.
_LOOSE_EXPLICIT, _LOW_ORDER = "dopri5", 3e-6

#: Errors for which a first run is one of that, too; for smaller ones the other tells more.
_TELLING = 1e-6

#: The part of a run's steps that counts when stability has set them.
_PART = 0.1

#: Steps of an explicit run, at least, that are more than those of an implicit one.
_STIFF_STEPS = 500

#: Steps after which a first explicit run is given up where the method is free: `auto`, which
#: changes it where a scene is stiff, then does it.
_PILOT = 3000

#: h |lambda| of explicit steps that follow a vibration at a tolerance, and the order at which it
#: falls.
_FOLLOWED, _AT, _SLOWLY = 4.0, 1e-3, 16.0

#: An implicit step in explicit ones, and the order at which their number grows.
_STEP, _ORDER = 2.5, 4.0

#: Explicit ones among the methods of SciPy and SUNDIALS.
_EXPLICIT_OF_OTHERS = ("scipy-DOP853", "scipy-RK45")

#: The tolerance in what is wanted with which an explicit method is expected to reach it; that of
#: the last implicit run in this one, at most.
_EXPECTED, _NEAR = 1 / 20, 4.0

#: What `_fastest_possible` found.
_possible: WeakKeyDictionary[Compiled, float] = WeakKeyDictionary()


def is_explicit(run: Trajectory) -> bool:
    """Whether explicit methods alone made a run."""
    made = {one.method for one in run.methods} or {run.settings.method}
    return all(explicit(method) for method in made)


def explicit(method: str) -> bool:
    """Whether a method is explicit; `auto` begins so."""
    if method in second_opinion.METHODS:
        return method in _EXPLICIT_OF_OTHERS
    return method == AUTO or not get(method).implicit


def held_back(run: Trajectory) -> bool:
    """Whether stability set a part of the steps of a run that counts."""
    counted = run.statistics
    return counted is not None and counted.stability_limited_steps > _PART * counted.steps


def has_stops(model: Compiled) -> bool:
    """Whether hinges of a scene may meet stops."""
    scene = model.scene
    hinges = (*scene.hinge, *(x for chain in scene.chain for x in chain.hinge))
    return any(stop.acts for table in hinges for stop in table.law.limits)


def _fastest_possible(model: Compiled) -> float:
    """|lambda| of the fastest motion that the tables of a scene allow, 1/s; looked up once."""
    if model not in _possible:
        _possible[model] = math.inf if model.flexible else fastest_possible(model.scene)
    return _possible[model]


def _may_be_stiff(run: Trajectory) -> bool:
    """Whether stability set so many steps of a run that `auto` is to look why; it has, if it made
    this one."""
    counted = run.statistics
    if run.methods or counted is None:
        return False
    return counted.stability_limited and counted.steps > _STIFF_STEPS


class Family:
    """The method of each of several runs from one start."""

    def __init__(
        self, model: Compiled, settings: Settings, error: float, q: Array, u: Array
    ) -> None:
        self._settings, self._error = settings, error
        self._free = settings.method == AUTO
        self._many = _VIBRATING if error < _LOOSE else _LEFT_OUT
        self._span = settings.t_end - settings.t_start
        self._rate, self._rescued = 0.0, False
        if self._free and _fastest_possible(model) * self._span > self._many:
            try:
                fastest = Fastest(model.looped, model.looped.start_memory())
                self._rate = fastest.rate(settings.t_start, q, u)
            except MstmmError:  # a scene without tangent, or a start that the run itself will blame
                pass

    @property
    def begins_explicit(self) -> bool:
        """Whether the first run is an explicit one."""
        if not self._free:
            return explicit(self._settings.method)
        return self._rate * self._span <= self._many

    def next_is_explicit(self, rtol: float, asked: float, made: Sequence[Trajectory]) -> bool:
        """Whether the next run after these ones is an explicit one: `rtol` is its tolerance if it
        is of the same kind as the last one, `asked` the wanted error in the size of the motion."""
        kind, last = is_explicit(made[-1]), made[-1]
        if kind or not self._free or self._rescued:
            return kind
        expected = _EXPECTED * asked
        rate = max([self._rate, *(one.rate or 0.0 for run in made for one in run.methods)])
        growth = (last.settings.rtol / min(rtol, _NEAR * expected)) ** (1 / _ORDER)
        followed = rate * self._span / _FOLLOWED * (_AT / expected) ** (1 / _SLOWLY)
        return _STEP * last.statistics.steps * growth >= followed

    def method(self, kind: bool, rtol: float, made: Sequence[Trajectory]) -> str:
        """The method of the next run after these ones, an explicit one or not, at a tolerance."""
        if not self._free or self._rescued:
            return self._settings.method
        if not kind:
            return implicit_method(rtol if made else 1.0)
        if made and not self._rate and _may_be_stiff(made[-1]):
            return AUTO
        low = rtol > _LOW_ORDER and (made or self._error > _TELLING)
        return _LOOSE_EXPLICIT if low else AUTO_EXPLICIT

    def most_steps(self, method: str) -> int:
        """Steps after which a first run by this method is given up; 0 for no limit."""
        most = self._settings.max_steps
        if not self._free or method == AUTO or not explicit(method):
            return most
        return min(most or _PILOT, _PILOT)

    def rescues(self, lost: Trajectory) -> bool:
        """Whether this run, which has failed, is to be made by `auto`: where an implicit method
        finds no step, and where a first run was given up.  From then on all are."""
        method, most = lost.settings.method, lost.settings.max_steps
        given_up = lost.status is Status.TOO_MANY_STEPS and most != self._settings.max_steps
        if not self._free or method == AUTO or (explicit(method) and not given_up):
            return False
        self._rescued = True
        return True
