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
from ..tuning import ERROR_CONTROL as TUNING
from .error_extrapolation import Kind
from .initial_vibration import Vibration, initial_vibration, starts_vibrating

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene
    from ...run.trajectory import Trajectory


#: Explicit method for loose tolerances, and exponential method.
_LOOSE_EXPLICIT, _EXPONENTIAL = "dopri5", "exprb32"

#: Cost of a step relative to an explicit one.
_STEP_COST = {Kind.IMPLICIT: 2.0, Kind.EXPONENTIAL: 3.0}

#: Explicit methods of SciPy and SUNDIALS.
_EXTERNAL_EXPLICIT = ("scipy-DOP853", "scipy-RK45")


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
    limited_steps = run.statistics.stability_limited_steps
    return limited_steps > TUNING.limited_share * run.statistics.steps


def damps_own_errors(run: Trajectory) -> bool:
    """Whether the stability-limited steps of a run damp their own errors."""
    return run.settings.method == _LOOSE_EXPLICIT and is_stability_limited(run)


def _fastest_possible(model: CompiledScene) -> float:
    """Upper bound of |lambda| (1/s) of all motions of a scene; cached."""
    if model not in _fastest_rates:
        squares = [
            squared_frequencies(body).max(initial=0.0) for body in model.flexible_bodies.values()
        ]
        shape_rate = TUNING.free_shape_factor * math.sqrt(max(squares, default=0.0))
        _fastest_rates[model] = max(shape_rate, fastest_possible(model.scene))
    return _fastest_rates[model]


class Family:
    """Choice of the methods of several runs from one start."""

    def __init__(
        self, model: CompiledScene, settings: Settings, error: float, q: Array, u: Array
    ) -> None:
        self._settings, self._error = settings, error
        self._is_free, self._is_rescued = settings.method == AUTO, False
        self._span, self._uses_exponential = settings.t_end - settings.t_start, False
        self._vibration: Vibration | None = None
        if not self._is_free or _fastest_possible(model) * self._span <= TUNING.stiff_known:
            return
        try:
            self._vibration = initial_vibration(
                model, settings.t_start, q, u, self._span, TUNING.stiff_known
            )
            minimum = self._threshold(TUNING.exponential_radians, TUNING.exponential_power)
            minimum *= model.nu
            resolved = self._fastest_radians + TUNING.resolved_weight * self.radians
            is_short = self._fastest_radians < TUNING.exponential_max_radians * self._stiff_radians
            if resolved > minimum and is_short and error >= TUNING.exponential_min_error:
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
        vibration = self._known_vibration
        return vibration is not None and vibration.outruns(run.statistics.steps)

    @cached_property
    def radians(self) -> float:
        """Radians of vibration well above the target error that need short steps; 0 if unknown."""
        vibration = self._known_vibration
        target = TUNING.well_above * self._error
        return 0.0 if vibration is None else vibration.demanding_radians(target)

    def calm(self, run: Trajectory) -> bool:
        """Whether the motions that the steps of a run do not resolve are below the target error."""
        vibration = self._known_vibration
        if vibration is None:
            return False
        return 0.0 < vibration.unresolved_amplitude(run.statistics.steps) < self._error

    @property
    def _known_vibration(self) -> Vibration | None:
        """Motions at the start, if more than their rate is known."""
        return (
            self._vibration if self._vibration is not None and self._vibration.has_motions else None
        )

    @property
    def _fastest_radians(self) -> float:
        """|lambda| T of the fastest motion; 0 if it is known to be slow."""
        return 0.0 if self._vibration is None else self._vibration.rate * self._span

    @cached_property
    def _stiff_radians(self) -> float:
        """|lambda| T from which implicit steps cost less than explicit ones."""
        if self._known_vibration is None:
            return self._threshold(TUNING.stiff_unknown, TUNING.stiff_unknown_power)
        weight = self._threshold(TUNING.radian_weight, TUNING.radian_weight_power)
        weighted = weight * self._known_vibration.radians(self._error)
        return self._threshold(TUNING.stiff_known, TUNING.stiff_known_power) + weighted

    def _threshold(self, at_loose: float, power: float) -> float:
        return at_loose * (TUNING.loose_error / self._error) ** power

    def next_kind(self, rtol: float, asked: float, made: Sequence[Trajectory]) -> Kind:
        """Kind of method of the next run after those `made`.

        `rtol` is its tolerance if the kind stays the same; `asked` is the target error relative to
        the size of the motion.
        """
        last, kind = made[-1], run_kind(made[-1])
        if kind is Kind.EXPLICIT or self._keeps_method(made):
            return kind
        order = TUNING.exponential_order
        if kind is Kind.IMPLICIT:
            order = get(implicit_method(rtol)).order
        growth = (last.settings.rtol / rtol) ** (1 / order)
        steps = _STEP_COST[kind] * last.statistics.steps * growth
        explicit_steps = self._explicit_steps(TUNING.expected_rtol * asked, made)
        return Kind.EXPLICIT if steps >= TUNING.uncertainty * explicit_steps else kind

    def _explicit_steps(self, rtol: float, made: Sequence[Trajectory]) -> float:
        """Estimated number of explicit steps of a run."""
        rate = max([0.0, *(use.fastest_rate or 0.0 for run in made for use in run.methods)])
        radians = max(self._fastest_radians, rate * self._span)
        resolved = radians if self._vibration is None else self._vibration.radians_above_speed(rtol)
        refinement = (TUNING.resolved_rtol / rtol) ** (1 / TUNING.resolved_order)
        return max(radians / TUNING.stable_step, resolved / TUNING.resolved_step * refinement)

    def method(self, kind: Kind, rtol: float, made: Sequence[Trajectory]) -> str:
        """Method of the next run after those `made`, of a given kind and tolerance."""
        if self._keeps_method(made):
            return self._settings.method
        if kind is Kind.EXPONENTIAL:
            return _EXPONENTIAL
        if kind is Kind.IMPLICIT:
            return implicit_method(rtol)
        if made and self._vibration is None and not made[-1].methods:
            statistics = made[-1].statistics  # stability may have set the steps of a stiff scene
            if statistics.stability_limited and statistics.steps > TUNING.stiff_steps:
                return AUTO
        # Explicit steps should damp their errors at the stability limit if the fastest motions are
        # damped, or their amplitudes are far above the target error.
        vibration = self._known_vibration
        prefers_damping = vibration is not None and (
            vibration.fastest_damping > TUNING.damping_ratio or vibration.races(self._error)
        )
        if not made:
            return _LOOSE_EXPLICIT if prefers_damping else AUTO_EXPLICIT
        min_rtol = TUNING.low_order_rtol
        if prefers_damping and is_stability_limited(made[-1]):
            min_rtol = TUNING.low_order_limited_rtol
        return _LOOSE_EXPLICIT if rtol > min_rtol else AUTO_EXPLICIT

    def _keeps_method(self, made: Sequence[Trajectory]) -> bool:
        """Whether all runs use the method of the user, or `auto` once it has made a run."""
        return not self._is_free or self._is_rescued or bool(made and made[-1].methods)

    def max_first_steps(self, method: str) -> int:
        """Number of steps after which a first run by this method is stopped; 0 for no limit."""
        max_steps, kind = self._settings.max_steps, method_kind(method)
        if not self._is_free or method == AUTO or kind is Kind.IMPLICIT:
            return max_steps
        steps = TUNING.exponential_steps_per_radian * self._fastest_radians
        limit = int(TUNING.exponential_steps + steps)
        if kind is Kind.EXPLICIT:
            expected = (
                0.0 if self._known_vibration is None else self._explicit_steps(self._error, ())
            )
            limit = max(TUNING.pilot_steps, int(TUNING.uncertainty * expected))
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
