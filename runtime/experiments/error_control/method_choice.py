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
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np

from mstmm.array_validation import Array, Integers
from mstmm.errors import MstmmError, NumericalFailure

from ...engine.jacobian import eigenvalues
from ...integrate.c_loop import Status
from ...integrate.settings import Settings
from ...integrate.steppers import AUTO, AUTO_EXPLICIT, get
from ...packing.scene_packing import reject_qr_steps
from ...result.checks.flexible import squared_frequencies
from ...run import external_integrators
from ...run.method_switching import implicit_method
from ...run.spectral_radius import fastest_at_start, fastest_possible
from ..tuning import ERROR_CONTROL as TUNING
from .error_extrapolation import Kind

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene
    from ...run.trajectory import Trajectory


# --- fast motions at the start --------------------------------------------------------------------

# The rates at the start are decomposed into eigenmotions.  One with eigenvalue lambda, amplitude a
# and damping ratio zeta has decayed to the target error after ln(a / target) / zeta radians.
# Implicit steps have to resolve it that long; explicit ones to the end, and more finely while its
# speed is above their tolerance.


@dataclass(frozen=True)
class Vibration:
    """Fast motions of a run from a given start.

    Attributes:
        rate: |lambda| of the fastest motion, 1/s.
        span: time of the run, s.
        rates, dampings: |lambda| and damping ratio of every motion, (k,).
        position_amplitudes, speed_amplitudes: amplitudes (k,) of coordinates and of speeds relative
            to the size of their unit (1 for rad and rad/s).  Empty if only the rate is known.
    """

    rate: float
    span: float
    rates: Array
    dampings: Array
    position_amplitudes: Array
    speed_amplitudes: Array

    @property
    def has_motions(self) -> bool:
        """Whether more than the rate is known."""
        return bool(len(self.rates))

    @property
    def fastest_damping(self) -> float:
        """Smallest damping ratio of the fastest motions."""
        return float(self._fastest_values(self.dampings).min(initial=1.0))

    def races(self, target: float) -> bool:
        """Whether the amplitude of a fastest motion is far above the target error."""
        amplitudes = self._fastest_values(self.position_amplitudes)
        return bool((amplitudes > TUNING.far_above * target).any())

    def _fastest_values(self, numbers: Array) -> Array:
        return numbers[self.rates >= TUNING.fast_share * self.rate]

    def radians(self, target: float) -> float:
        """Largest number of radians until the amplitude of a motion is below `target`."""
        return self._radians_above(self.position_amplitudes, target)

    def demanding_radians(self, target: float) -> float:
        """`radians`, weighted less for motions not far above `target`, whose phase may err more."""
        relative = np.minimum(self.position_amplitudes / (TUNING.far_above * target), 1.0)
        weights = relative**TUNING.weight_power
        return self._radians_above(self.position_amplitudes, target, weights)

    def radians_above_speed(self, target: float) -> float:
        """`radians` until the speed of a motion is below `target`."""
        return self._radians_above(self.speed_amplitudes, target)

    def outruns(self, steps: int) -> bool:
        """Whether so many steps over the run do not resolve the fastest motion."""
        return self.rate * self.span > TUNING.unresolved_step * steps

    def unresolved_amplitude(self, steps: int) -> float:
        """Largest amplitude of motions that so many steps do not resolve; 0 for none."""
        return float(
            self.position_amplitudes[self.rates * self.span > TUNING.unresolved_step * steps].max(
                initial=0.0
            )
        )

    def _radians_above(
        self, amplitudes: Array, target: float, weights: Array | float = 1.0
    ) -> float:
        if not len(self.rates):
            return self.rate * self.span
        is_above = amplitudes > target
        total = self.rates[is_above] * self.span
        with np.errstate(divide="ignore"):
            decay = np.log(amplitudes[is_above] / target) / self.dampings[is_above]
        weighted = np.minimum(decay, total) * np.broadcast_to(weights, amplitudes.shape)[is_above]
        return float(weighted.max(initial=0.0))


def initial_vibration(
    model: CompiledScene, t: float, q: Array, u: Array, span: float, few: float
) -> Vibration:
    """Fast motions of a run of `span` (s) from q (nq,), u (nu,) at t (s).

    Only the rate for scenes with many coordinates, and if it amounts to at most `few` radians.
    Raises SceneError for scenes without implicit steps, NumericalFailure if the start cannot be
    evaluated.
    """
    engine, empty = model.looped, np.zeros(0)
    y, memory = np.concatenate([q, u]), engine.start_memory()
    if len(y) > TUNING.max_coordinates:
        return Vibration(fastest_at_start(engine, t, q, u), span, empty, empty, empty, empty)
    reject_qr_steps(engine.packed)
    try:
        roots, vectors = eigenvalues(engine, t, y, memory)
        rate = float(np.abs(roots).max(initial=0.0))
        if rate * span <= few:
            return Vibration(rate, span, empty, empty, empty, empty)
        state = q[None].copy(), u[None].copy(), memory[None].copy()
        rates = np.hstack([x[0] for x in engine.accelerations(t, *state)])
        participations = np.linalg.lstsq(vectors, rates.astype(np.complex128), rcond=None)[0]
    except np.linalg.LinAlgError:
        raise NumericalFailure(f"the motions at t = {t:.9g} s are not finite") from None
    fast = np.abs(roots) * span > TUNING.slow_radians
    fast_rates, amplitudes = (np.abs(roots[fast]), np.abs(vectors[:, fast] * participations[fast]))
    amplitudes /= fast_rates
    q_parts = _relative_amplitudes(amplitudes[: len(q)], model.coordinate_layout.q_by_unit)
    u_parts = _relative_amplitudes(amplitudes[len(q) :], model.coordinate_layout.u_by_unit)
    dampings = np.maximum(-roots[fast].real, 0.0) / fast_rates
    return Vibration(rate, span, fast_rates, dampings, q_parts, u_parts)


def _relative_amplitudes(amplitudes: Array, by_unit: dict[str, Integers]) -> Array:
    """Largest amplitude (k,) of each motion; other units than angles relative to their largest."""
    relative = np.zeros(amplitudes.shape[1])
    for unit, places in by_unit.items():
        if len(places):
            largest = amplitudes[places].max(axis=0)
            scale = 1.0 if unit in ("rad", "rad/s") else float(largest.max(initial=0.0)) or 1.0
            relative = np.maximum(relative, largest / scale)
    return relative


# --- beam on one hinge ----------------------------------------------------------------------------


def starts_vibrating(model: CompiledScene, t: float, q: Array, u: Array) -> bool:
    """Whether a scene is a vibrating beam on one hinge at q (nq,), u (nu,) and t (s).

    Its motion is vibration about a slowly varying one, which an exponential method integrates with
    few steps.  With more hinges the vibrations change with their angles; without excitation the
    beam does not vibrate.

    Raises NumericalFailure if the start cannot be evaluated.
    """
    engine = model.looped
    shapes = np.zeros(engine.nu, bool)
    for body in model.coordinate_layout.modal.values():
        shapes[body.u_slice] = True
    is_small = engine.nu <= TUNING.max_beam_speeds
    if not is_small or not shapes.any() or np.count_nonzero(~shapes) > TUNING.max_rigid_speeds:
        return False
    state = q[None].copy(), u[None].copy(), engine.start_memory()[None]
    accelerations = np.abs(engine.accelerations(t, *state)[1][0])
    threshold = TUNING.excitation_share * accelerations.max()
    return bool(u[shapes].any() or accelerations[shapes].max() > threshold)


# --- choice of methods ----------------------------------------------------------------------------

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
