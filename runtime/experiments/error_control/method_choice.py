"""Choice of the method for a target error.

Explicit methods resolve the fastest motion of the scene at any tolerance, and excited vibration
more finely at tighter ones; implicit methods resolve only what matters for the target error.  The
motions at the start and a first run show which costs less, without a run for comparison.  The
exponential method integrates vibration exactly while little else changes; it is tried first, for a
few steps, on a beam on one hinge that vibrates from the start.
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
from ...result.checks.flexible import squared_frequencies
from ...run import external_integrators
from ...run.method_switching import implicit_method
from ...run.spectral_radius import fastest_possible
from .error_extrapolation import Kind
from .initial_vibration import Vibration, initial_vibration, starts_vibrating

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene
    from ...run.trajectory import Trajectory


#: |lambda| T from which the first run is implicit, for an error of _LOOSE, and the power of its
#: growth for smaller errors: without knowledge of the motions at the start; and with it, in
#: addition to a factor on the radians of relevant vibration, which grows with the order of implicit
#: steps.
_LOOSE, _STIFF_UNKNOWN, _STIFF_UNKNOWN_POWER = 1e-3, 700.0, 0.25
_STIFF_KNOWN, _STIFF_KNOWN_POWER, _RADIAN_WEIGHT, _RADIAN_WEIGHT_POWER = 450.0, 0.09, 4.5, 0.06

#: Ratio to the target error from which vibration is well above it.
_WELL_ABOVE = 3.0

#: Explicit method for loose tolerances, and the tolerance down to which it costs less than that of
#: higher order.  If stability limits the steps, down to the second tolerance, because it damps its
#: errors at the stability limit: for motions with more than this damping ratio, or of amplitudes
#: far above the target error.
_LOOSE_EXPLICIT, _LOW_ORDER_RTOL, _LOW_ORDER_LIMITED_RTOL, _DAMPING_RATIO = (
    "dopri5",
    1e-4,
    1e-6,
    0.03,
)

#: Exponential method; smallest target error; steps after which its first run is stopped, constant
#: and per |lambda| T; largest |lambda| T relative to that for implicit methods.  Second line:
#: smallest |lambda| T per speed, for an error of _LOOSE, the power of its growth, and the weight of
#: radians that explicit steps have to resolve more finely.
(
    _EXPONENTIAL,
    _EXPONENTIAL_MIN_ERROR,
    _EXPONENTIAL_STEPS,
    _EXPONENTIAL_STEPS_PER_RADIAN,
    _EXPONENTIAL_MAX_RADIANS,
) = "exprb32", 1e-6, 15, 1 / 20, 4.0
_EXPONENTIAL_RADIANS, _EXPONENTIAL_POWER, _RESOLVED_WEIGHT = 250.0, 0.16, 2.0

#: Share of stability-limited steps from which a run counts as limited by stability.
_LIMITED_SHARE = 0.1

#: Smallest number of steps of an explicit run that may exceed that of an implicit one.
_STIFF_STEPS = 500

#: Steps after which a first explicit run is stopped, if the method is free, and repeated by `auto`,
#: which switches methods in stiff scenes.
_PILOT_STEPS = 3000

#: h |lambda| of explicit steps at the stability limit, and of those that resolve a vibration at a
#: tolerance, with the order of its decrease.
_STABLE_STEP, _RESOLVED_STEP, _RESOLVED_RTOL, _RESOLVED_ORDER = 4.0, 0.8, 1e-7, 9.0

#: Factor on the estimated steps of explicit runs, which other kinds predict poorly.
_UNCERTAINTY = 2.0

#: Cost of a step relative to an explicit one; order of the growth of exponential steps.
_STEP_COST, _EXPONENTIAL_ORDER = {Kind.IMPLICIT: 2.0, Kind.EXPONENTIAL: 3.0}, 3.0

#: Explicit methods of SciPy and SUNDIALS.
_EXTERNAL_EXPLICIT = ("scipy-DOP853", "scipy-RK45")

#: Tolerance relative to the target error at which an explicit method is expected to reach it.
_EXPECTED_RTOL = 1 / 20

#: Largest increase of the frequency of a shape by the free motion of its body.
_FREE_SHAPE_FACTOR = 8.0

#: Cached results of `_fastest_possible`.
_fastest_rates: WeakKeyDictionary[CompiledScene, float] = WeakKeyDictionary()


def run_kind(run: Trajectory) -> Kind:
    """Kind of the methods of a run; explicit if all are."""
    kinds = {method_kind(use.method) for use in run.methods} or {method_kind(run.settings.method)}
    return kinds.pop() if len(kinds) == 1 else Kind.IMPLICIT


def method_kind(method: str) -> Kind:
    """Kind of a method; `auto` starts with an explicit one."""
    if method == _EXPONENTIAL:
        return Kind.EXPONENTIAL
    if method in external_integrators.METHODS:
        explicit = method in _EXTERNAL_EXPLICIT
    else:
        explicit = method == AUTO or not get(method).implicit
    return Kind.EXPLICIT if explicit else Kind.IMPLICIT


def is_stability_limited(run: Trajectory) -> bool:
    """Whether stability limited a significant share of the steps of a run."""
    statistics = run.statistics
    return (
        statistics is not None
        and statistics.stability_limited_steps > _LIMITED_SHARE * statistics.steps
    )


def damps_own_errors(run: Trajectory) -> bool:
    """Whether the stability-limited steps of a run damp their own errors."""
    return run.settings.method == _LOOSE_EXPLICIT and is_stability_limited(run)


def _fastest_possible(model: CompiledScene) -> float:
    """Upper bound of |lambda| (1/s) of all motions of a scene; cached."""
    if model not in _fastest_rates:
        squares = [
            squared_frequencies(body).max(initial=0.0) for body in model.flexible_bodies.values()
        ]
        shape_rate = _FREE_SHAPE_FACTOR * math.sqrt(max(squares, default=0.0))
        _fastest_rates[model] = max(shape_rate, fastest_possible(model.scene))
    return _fastest_rates[model]


def _may_be_stiff(run: Trajectory) -> bool:
    """Whether stability limited a run so much that `auto` should make the next one."""
    statistics = run.statistics
    if run.methods or statistics is None:
        return False
    return statistics.stability_limited and statistics.steps > _STIFF_STEPS


class Family:
    """Choice of the methods of several runs from one start."""

    def __init__(
        self, model: CompiledScene, settings: Settings, error: float, q: Array, u: Array
    ) -> None:
        self._settings, self._error = settings, error
        self._is_free, self._is_rescued = settings.method == AUTO, False
        self._span, self._uses_exponential = settings.t_end - settings.t_start, False
        self._vibration: Vibration | None = None
        if not self._is_free or _fastest_possible(model) * self._span <= _STIFF_KNOWN:
            return
        try:
            self._vibration = initial_vibration(
                model, settings.t_start, q, u, self._span, _STIFF_KNOWN
            )
            minimum = self._threshold(_EXPONENTIAL_RADIANS, _EXPONENTIAL_POWER) * model.nu
            resolved = self._fastest_radians + _RESOLVED_WEIGHT * self.radians
            is_short = self._fastest_radians < _EXPONENTIAL_MAX_RADIANS * self._stiff_radians
            if resolved > minimum and is_short and error >= _EXPONENTIAL_MIN_ERROR:
                self._uses_exponential = starts_vibrating(model, settings.t_start, q, u)
        except MstmmError:  # no tangent matrix, or an invalid start, which the run reports
            pass

    @property
    def first_kind(self) -> Kind:
        """Kind of method of the first run."""
        if not self._is_free or self._is_rescued:
            return method_kind(self._settings.method)
        if self._uses_exponential:
            return Kind.EXPONENTIAL
        return Kind.IMPLICIT if self._fastest_radians > self._stiff_radians else Kind.EXPLICIT

    def leaves(self, run: Trajectory) -> bool:
        """Whether the explicit steps of a run do not resolve the fastest motion, if it is known."""
        vibration, statistics = self._known_vibration, run.statistics
        return (
            vibration is not None and statistics is not None and vibration.outruns(statistics.steps)
        )

    @cached_property
    def radians(self) -> float:
        """Radians of vibration well above the target error that need short steps; 0 if unknown."""
        vibration = self._known_vibration
        return 0.0 if vibration is None else vibration.demanding_radians(_WELL_ABOVE * self._error)

    def calm(self, run: Trajectory) -> bool:
        """Whether the motions that the steps of a run do not resolve are below the target error."""
        vibration, statistics = self._known_vibration, run.statistics
        if vibration is None or statistics is None:
            return False
        return 0.0 < vibration.unresolved_amplitude(statistics.steps) < self._error

    @property
    def _known_vibration(self) -> Vibration | None:
        """Motions at the start, if more than their rate is known."""
        return (
            self._vibration if self._vibration is not None and self._vibration.has_motions else None
        )

    @cached_property
    def _prefers_damping(self) -> bool:
        """Whether explicit steps should damp their errors at the stability limit.

        If the fastest motions are damped, or their amplitudes are far above the target error.
        """
        vibration = self._known_vibration
        return vibration is not None and (
            vibration.fastest_damping > _DAMPING_RATIO or vibration.races(self._error)
        )

    @property
    def _fastest_radians(self) -> float:
        """|lambda| T of the fastest motion; 0 if it is known to be slow."""
        return 0.0 if self._vibration is None else self._vibration.rate * self._span

    @cached_property
    def _stiff_radians(self) -> float:
        """|lambda| T from which implicit steps cost less than explicit ones."""
        if self._known_vibration is None:
            return self._threshold(_STIFF_UNKNOWN, _STIFF_UNKNOWN_POWER)
        weight = self._threshold(_RADIAN_WEIGHT, _RADIAN_WEIGHT_POWER)
        weighted = weight * self._known_vibration.radians(self._error)
        return self._threshold(_STIFF_KNOWN, _STIFF_KNOWN_POWER) + weighted

    def _threshold(self, at_loose: float, power: float) -> float:
        return at_loose * (_LOOSE / self._error) ** power

    def next_kind(self, rtol: float, asked: float, made: Sequence[Trajectory]) -> Kind:
        """Kind of method of the next run after those `made`.

        `rtol` is its tolerance if the kind stays the same; `asked` is the target error relative to
        the size of the motion.
        """
        last, kind = made[-1], run_kind(made[-1])
        if kind is Kind.EXPLICIT or self._keeps_method(made):
            return kind
        order = get(implicit_method(rtol)).order if kind is Kind.IMPLICIT else _EXPONENTIAL_ORDER
        growth = (last.settings.rtol / rtol) ** (1 / order)
        steps = _STEP_COST[kind] * last.statistics.steps * growth
        explicit_steps = _UNCERTAINTY * self._explicit_steps(_EXPECTED_RTOL * asked, made)
        return Kind.EXPLICIT if steps >= explicit_steps else kind

    def _explicit_steps(self, rtol: float, made: Sequence[Trajectory]) -> float:
        """Estimated number of explicit steps of a run."""
        rate = max([0.0, *(use.fastest_rate or 0.0 for run in made for use in run.methods)])
        radians = max(self._fastest_radians, rate * self._span)
        resolved = radians if self._vibration is None else self._vibration.radians_above_speed(rtol)
        return max(
            radians / _STABLE_STEP,
            resolved / _RESOLVED_STEP * (_RESOLVED_RTOL / rtol) ** (1 / _RESOLVED_ORDER),
        )

    def method(self, kind: Kind, rtol: float, made: Sequence[Trajectory]) -> str:
        """Method of the next run after those `made`, of a given kind and tolerance."""
        if self._keeps_method(made):
            return self._settings.method
        if kind is Kind.EXPONENTIAL:
            return _EXPONENTIAL
        if kind is Kind.IMPLICIT:
            return implicit_method(rtol)
        if made and self._vibration is None and _may_be_stiff(made[-1]):
            return AUTO
        prefers_damping = self._prefers_damping
        if not made:
            return _LOOSE_EXPLICIT if prefers_damping else AUTO_EXPLICIT
        min_rtol = _LOW_ORDER_RTOL
        if prefers_damping and is_stability_limited(made[-1]):
            min_rtol = _LOW_ORDER_LIMITED_RTOL
        return _LOOSE_EXPLICIT if rtol > min_rtol else AUTO_EXPLICIT

    def _keeps_method(self, made: Sequence[Trajectory]) -> bool:
        """Whether all runs use the method of the user, or `auto` once it has made a run."""
        return not self._is_free or self._is_rescued or bool(made and made[-1].methods)

    def max_first_steps(self, method: str) -> int:
        """Number of steps after which a first run by this method is stopped; 0 for no limit."""
        max_steps, kind = self._settings.max_steps, method_kind(method)
        if not self._is_free or method == AUTO or kind is Kind.IMPLICIT:
            return max_steps
        limit = int(_EXPONENTIAL_STEPS + _EXPONENTIAL_STEPS_PER_RADIAN * self._fastest_radians)
        if kind is Kind.EXPLICIT:
            expected = (
                0.0 if self._known_vibration is None else self._explicit_steps(self._error, ())
            )
            limit = max(_PILOT_STEPS, int(_UNCERTAINTY * expected))
        return min(max_steps or limit, limit)

    def rescues(self, lost: Trajectory) -> bool:
        """Whether to repeat a failed run by another method, and prepare for it.

        All further runs are by `auto` if an implicit method failed or a first explicit run was
        stopped.  If the exponential method was stopped, it is not used any more.
        """
        method, max_steps = lost.settings.method, lost.settings.max_steps
        given_up = lost.status is Status.TOO_MANY_STEPS and max_steps != self._settings.max_steps
        if not self._is_free or method == AUTO or lost.status is None:
            return False
        if self._uses_exponential and method_kind(method) is Kind.EXPONENTIAL:
            self._uses_exponential = False
            return True
        if method_kind(method) is Kind.EXPLICIT and not given_up:
            return False
        self._is_rescued = True
        return True
