"""By which kind of method a wanted error is reached, and by which one.

The explicit one follows the fastest motion of the scene whatever the tolerance, and vibration that
is excited ever more closely; the implicit one follows what of it counts for what is asked.  Which
costs less shows in the motions at the start and in a first run: no run is made to compare the
two.  The exponential one follows vibration exactly as long as nothing else changes much: a beam on
one hinge that something shakes from the start is tried by it first, for a few steps.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

from mstmm.array_validation import Array
from mstmm.errors import MstmmError

from ...integrate.c_loop import Status
from ...integrate.settings import Settings
from ...integrate.steppers import AUTO, AUTO_EXPLICIT, get
from ...risk_checks.excitation_bandwidth import squared_frequencies
from ...run import external_integrators
from ...run.method_switching import implicit_method
from ...run.spectral_radius import fastest_possible
from .error_extrapolation import Kind
from .initial_vibration import Vibration, initial_vibration
from .struck_beam import starts_vibrating

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene
    from ...run.trajectory import Trajectory

#: |lambda| T from which the first run is an implicit one, for an error of _LOOSE, and the power by
#: which it rises for smaller ones: where the motions at the start are not known; and where they
#: are, beside so many times the radians of vibration that counts, which rises with the order of
#: implicit steps.
_LOOSE, _VIBRATING, _RISES = 1e-3, 700.0, 0.25
_SMOOTH, _RISES_SMOOTH, _COUNTS, _RISES_COUNTED = 450.0, 0.09, 4.5, 0.06

#: Vibration is well above what is asked that is so many times that.
_WELL = 3.0

#: The explicit method for loose tolerances, and the tolerance down to which it costs less than that
#: of higher order; and where stability sets the steps, for at its bound that one keeps errors that
#: this one damps: of motions that are damped by more than this ratio, or far above what is asked.
_LOOSE_EXPLICIT, _LOW_ORDER, _LOW_WHERE_HELD, _DAMPED = "dopri5", 1e-4, 1e-6, 0.03

#: The exponential method; for errors from this one on; steps after which its first run is given up,
#: and that number in |lambda| T.  It pays from this |lambda| T on, for an error of _LOOSE and a
#: speed, with the power by which it rises, radians that explicit steps have to follow more closely
#: counted so many times more; up to so many times those from which implicit steps pay.
_EXPONENTIAL, _PAYS, _SHORT, _LONG, _LASTING = "exprb32", 1e-6, 15, 1 / 20, 4.0
_SWINGING, _RISES_SWINGING, _FOLLOWING = 250.0, 0.16, 2.0

#: The part of a run's steps that counts when stability has set them.
_PART = 0.1

#: Steps of an explicit run, at least, that are more than those of an implicit one.
_STIFF_STEPS = 500

#: Steps after which a first explicit run is given up where the method is free: `auto`, which
#: changes it where a scene is stiff, then does it.
_PILOT = 3000

#: h |lambda| of explicit steps that stability sets, and of those that follow a vibration at a
#: tolerance, with the order at which it falls.
_STABLE, _FOLLOWED, _AT, _SLOWLY = 4.0, 0.8, 1e-7, 9.0

#: Explicit runs behind others, which tell little of them, are as many.
_ANEW = 2.0

#: A step in explicit ones; the order at which the number of exponential ones grows.
_STEP, _ORDER = {Kind.IMPLICIT: 2.0, Kind.EXPONENTIAL: 3.0}, 3.0

#: Explicit ones among the methods of SciPy and SUNDIALS.
_EXPLICIT_OF_OTHERS = ("scipy-DOP853", "scipy-RK45")

#: The tolerance in what is wanted with which an explicit method is expected to reach it.
_EXPECTED = 1 / 20

#: How many times faster a shape may be than by itself where its body is free to move.
_FREED = 8.0

#: What `_fastest_possible` found.
_possible: WeakKeyDictionary[CompiledScene, float] = WeakKeyDictionary()


def run_kind(run: Trajectory) -> Kind:
    """The kind of the method that made a run; explicit if all were."""
    kinds = {method_kind(one.method) for one in run.methods} or {method_kind(run.settings.method)}
    return kinds.pop() if len(kinds) == 1 else Kind.IMPLICIT


def method_kind(method: str) -> Kind:
    """The kind of a method; `auto` begins by an explicit one."""
    if method == _EXPONENTIAL:
        return Kind.EXPONENTIAL
    if method in external_integrators.METHODS:
        explicit = method in _EXPLICIT_OF_OTHERS
    else:
        explicit = method == AUTO or not get(method).implicit
    return Kind.EXPLICIT if explicit else Kind.IMPLICIT


def is_stability_limited(run: Trajectory) -> bool:
    """Whether stability set a part of the steps of a run that counts."""
    counted = run.statistics
    return counted is not None and counted.stability_limited_steps > _PART * counted.steps


def damps_own_errors(run: Trajectory) -> bool:
    """Whether steps of a run, set by stability, damp their own errors."""
    return run.settings.method == _LOOSE_EXPLICIT and is_stability_limited(run)


def _fastest_possible(model: CompiledScene) -> float:
    """|lambda| of the fastest motion that the tables of a scene allow, 1/s; looked up once."""
    if model not in _possible:
        shapes = [squared_frequencies(body).max(initial=0.0) for body in model.flexible.values()]
        shaped = _FREED * math.sqrt(max(shapes, default=0.0))
        _possible[model] = max(shaped, fastest_possible(model.scene))
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
        self, model: CompiledScene, settings: Settings, error: float, q: Array, u: Array
    ) -> None:
        self._settings, self._error = settings, error
        self._free, self._rescued = settings.method == AUTO, False
        self._span, self._tried = settings.t_end - settings.t_start, False
        self._fast: Vibration | None = None
        if not self._free or _fastest_possible(model) * self._span <= _SMOOTH:
            return
        try:
            self._fast = initial_vibration(model, settings.t_start, q, u, self._span, _SMOOTH)
            swinging = self._rising(_SWINGING, _RISES_SWINGING) * model.nu
            followed = self._lasts + _FOLLOWING * self.radians
            lasting = self._lasts < _LASTING * self._many
            if followed > swinging and lasting and error >= _PAYS:
                self._tried = starts_vibrating(model, settings.t_start, q, u)
        except MstmmError:  # a scene without tangent, or a start that the run itself will blame
            pass

    @property
    def begins(self) -> Kind:
        """The kind of the first run."""
        if not self._free or self._rescued:
            return method_kind(self._settings.method)
        if self._tried:
            return Kind.EXPONENTIAL
        return Kind.IMPLICIT if self._lasts > self._many else Kind.EXPLICIT

    def leaves(self, run: Trajectory) -> bool:
        """Whether explicit steps of a run do not follow the fastest motion, which is known."""
        known, counted = self._known, run.statistics
        return known is not None and counted is not None and known.outruns(counted.steps)

    @cached_property
    def radians(self) -> float:
        """Those of vibration that is well above what is asked, as far as that demands short steps,
        where the motions at the start are known; else 0."""
        return 0.0 if self._known is None else self._known.demanding(_WELL * self._error)

    def calm(self, run: Trajectory) -> bool:
        """Whether the motions that steps of a run have left behind are below what is asked."""
        known, counted = self._known, run.statistics
        if known is None or counted is None:
            return False
        return 0.0 < known.left_behind(counted.steps) < self._error

    @property
    def _known(self) -> Vibration | None:
        """The motions at the start, where more than their rate is known."""
        return self._fast if self._fast is not None and self._fast.known else None

    @cached_property
    def _damping(self) -> bool:
        """Whether it pays that explicit steps at their bound of stability damp their errors: where
        the fastest motions are damped as well, or far above what is asked."""
        known = self._known
        return known is not None and (known.fastest_damping > _DAMPED or known.races(self._error))

    @property
    def _lasts(self) -> float:
        """|lambda| T of the fastest motion; 0 where it is known to be slow."""
        return 0.0 if self._fast is None else self._fast.rate * self._span

    @cached_property
    def _many(self) -> float:
        """|lambda| T from which implicit steps cost less."""
        if self._known is None:
            return self._rising(_VIBRATING, _RISES)
        counted = self._rising(_COUNTS, _RISES_COUNTED) * self._known.radians(self._error)
        return self._rising(_SMOOTH, _RISES_SMOOTH) + counted

    def _rising(self, at_loose: float, power: float) -> float:
        return at_loose * (_LOOSE / self._error) ** power

    def next(self, rtol: float, asked: float, made: Sequence[Trajectory]) -> Kind:
        """The kind of the next run after these ones: `rtol` is its tolerance if it is of the same
        kind as the last one, `asked` the wanted error in the size of the motion."""
        last, kind = made[-1], run_kind(made[-1])
        if kind is Kind.EXPLICIT or self._settled_on(made):
            return kind
        order = get(implicit_method(rtol)).order if kind is Kind.IMPLICIT else _ORDER
        growth = (last.settings.rtol / rtol) ** (1 / order)
        steps = _STEP[kind] * last.statistics.steps * growth
        others = _ANEW * self._explicit_steps(_EXPECTED * asked, made)
        return Kind.EXPLICIT if steps >= others else kind

    def _explicit_steps(self, rtol: float, made: Sequence[Trajectory]) -> float:
        """How many explicit steps a run would take, about."""
        rate = max([0.0, *(one.rate or 0.0 for run in made for one in run.methods)])
        lasts = max(self._lasts, rate * self._span)
        followed = lasts if self._fast is None else self._fast.speeding(rtol)
        return max(lasts / _STABLE, followed / _FOLLOWED * (_AT / rtol) ** (1 / _SLOWLY))

    def method(self, kind: Kind, rtol: float, made: Sequence[Trajectory]) -> str:
        """The method of the next run after these ones, of a kind, at a tolerance."""
        if self._settled_on(made):
            return self._settings.method
        if kind is Kind.EXPONENTIAL:
            return _EXPONENTIAL
        if kind is Kind.IMPLICIT:
            return implicit_method(rtol)
        if made and self._fast is None and _may_be_stiff(made[-1]):
            return AUTO
        damping = self._damping
        if not made:
            return _LOOSE_EXPLICIT if damping else AUTO_EXPLICIT
        least = _LOW_WHERE_HELD if damping and is_stability_limited(made[-1]) else _LOW_ORDER
        return _LOOSE_EXPLICIT if rtol > least else AUTO_EXPLICIT

    def _settled_on(self, made: Sequence[Trajectory]) -> bool:
        """Whether the method stays what the user named, or `auto` where that has made a run."""
        return not self._free or self._rescued or bool(made and made[-1].methods)

    def most_steps(self, method: str) -> int:
        """Steps after which a first run by this method is given up; 0 for no limit."""
        most, kind = self._settings.max_steps, method_kind(method)
        if not self._free or method == AUTO or kind is Kind.IMPLICIT:
            return most
        few = int(_SHORT + _LONG * self._lasts)
        if kind is Kind.EXPLICIT:
            foreseen = 0.0 if self._known is None else self._explicit_steps(self._error, ())
            few = max(_PILOT, int(_ANEW * foreseen))
        return min(most or few, few)

    def rescues(self, lost: Trajectory) -> bool:
        """Whether this run, which has failed, is to be made by another method: by `auto` where an
        implicit one finds no step, and where a first explicit run was given up, from then on all;
        where the exponential one was given up, as if it had not been tried."""
        method, most = lost.settings.method, lost.settings.max_steps
        given_up = lost.status is Status.TOO_MANY_STEPS and most != self._settings.max_steps
        if not self._free or method == AUTO or lost.status is None:
            return False
        if self._tried and method_kind(method) is Kind.EXPONENTIAL:
            self._tried = False
            return True
        if method_kind(method) is Kind.EXPLICIT and not given_up:
            return False
        self._rescued = True
        return True
