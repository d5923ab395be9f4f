"""Error extrapolation over tolerances, and the tolerance of the next run.

The run at the tightest tolerance is the reference: the distance of the others to it is about their
error.  Its own error is that of the next looser run, reduced by a cautious power of the tolerance,
times a factor for the scatter of single runs.  An observed power is used only up to this one, and a
smaller power applies between methods, because errors of another method may be larger at the same
tolerance.  The same estimate decides on a further run and is reported.

Hairer, Norsett, Wanner, Solving ODEs I, II.4 (tolerance and global error).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from mstmm.array_validation import Array

from ..tuning import ERROR_CONTROL as TUNING

#: Tightest meaningful tolerance.
TIGHTEST = 1e-13


class Kind(Enum):
    """Kind of a method, by its step control and the decrease of its error with the tolerance."""

    EXPLICIT = "explicit"
    IMPLICIT = "implicit"
    EXPONENTIAL = "exponential"


@dataclass(frozen=True)
class _KindParameters:
    """Parameters of a kind of method, set by benchmarks/error_control.

    Attributes:
        first: first tolerance relative to the target error, and its bounds.
        max_first: largest first tolerance relative to the target error.
        growth, limited_growth: error relative to the sum of local errors; and if stability limits
            the steps, because local errors are then those of fast motion, which hardly add up.
        power: error is proportional to this power of the tolerance.
        sum_power: the same for the sum of local errors.
        target_share: share of the target error at which a next tolerance by local errors aims.
        safety: factor on the error extrapolated by the power.
        divergence: distance, relative to the motion, beyond which runs do not show the power.
        min_factor: smallest ratio of a next tolerance to the one before.
    """

    first: tuple[float, float, float]
    max_first: float
    growth: float
    limited_growth: float
    power: float
    sum_power: float
    target_share: float
    safety: float
    divergence: float
    min_factor: float


_PARAMETERS = {
    Kind.EXPLICIT: _KindParameters(
        (3.0, 3e-4, 1e-3), 2.5e3, 3.0, 0.3, 0.75, 1.0, 0.2, 2.0, 0.7, 3e-6
    ),
    Kind.IMPLICIT: _KindParameters(
        (30.0, 3e-5, 3e-2), 1e6, 1.0, 1.0, 0.6, 0.9, 0.6, 1.5, 0.1, 1e-6
    ),
    Kind.EXPONENTIAL: _KindParameters(
        (30.0, 1e-4, 1e-2), 1e6, 1.0, 1.0, 0.6, 0.6, 0.4, 1.5, 0.1, 1e-4
    ),
}


@dataclass(frozen=True)
class ToleranceRun:
    """One run of a search over tolerances.

    Attributes:
        rtol: its relative tolerance.
        kind: kind of its method; of several methods explicit if all are.
        method: name of its method.
        distance: distance to the tightest run; 0 for that one, inf for other end times.
        local_error_sum: sum of its local errors; None if the method computes none.
        is_stability_limited: whether stability, not accuracy, limited many of its steps.
        growth: error relative to the sum of local errors, where it is better known than typically.
        radians: radians of vibration above the target error that implicit steps have to resolve.
        calm: whether vibration that explicit steps do not resolve is below the target error.
        divergence_fraction: share of the run after which it had diverged from the tightest one; 1
            if never.
    """

    rtol: float
    kind: Kind
    distance: float
    local_error_sum: float | None
    is_stability_limited: bool = False
    radians: float = 0.0
    calm: bool = False
    growth: float | None = None
    divergence_fraction: float = 1.0
    method: str = ""

    def compared_with(self, distances: Array) -> ToleranceRun:
        """Run with its distances (n,) to the tightest one; empty for another end time."""
        if not len(distances):
            return replace(self, distance=math.inf)
        diverged = np.flatnonzero(~(distances < _PARAMETERS[self.kind].divergence))
        parted = float(diverged[0]) / max(len(distances) - 1, 1) if len(diverged) else 1.0
        return replace(self, distance=float(distances.max()), divergence_fraction=parted)


def first_rtol(target: float, kind: Kind, radians: float = 0.0) -> float:
    """First tolerance: loose, to explore the motion.

    Tighter for implicit runs, which give no information until they resolve the `radians` of
    vibration.
    """
    factor, tightest, loosest = _PARAMETERS[kind].first
    rtol = min(max(factor * target, tightest), loosest)
    if kind is Kind.IMPLICIT and radians > 1.0:
        rtol = min(rtol, TUNING.rtol_per_radian * target / radians)
    return max(min(rtol, _PARAMETERS[kind].max_first * target), TIGHTEST)


def estimate_error(runs: Sequence[ToleranceRun]) -> float | None:
    """Estimated error of the last of `runs`; None for a single one.

    The runs are ordered from loose to tight, explicit ones after others.
    """
    if len(runs) < 2:
        return None
    before, last = runs[-2:]
    reduction = (last.rtol / before.rtol) ** _error_power(runs) if last.rtol < before.rtol else 1.0
    parameters = _PARAMETERS[last.kind]
    error = parameters.safety * before.distance * (TUNING.two_run_factor if len(runs) == 2 else 1.0)
    if before.distance < parameters.divergence:
        is_constant = last.calm and before.calm
        is_constant &= last.rtol >= 0.99 * TUNING.min_calm_ratio * before.rtol
        return error * (1.0 if is_constant else reduction)
    if (
        before.kind is last.kind is Kind.EXPLICIT
        and TUNING.late_divergence <= before.divergence_fraction < 1.0
    ):
        return min(error, TUNING.growth_safety * last.rtol * _error_growth(before))
    return error


def next_rtol(runs: Sequence[ToleranceRun], target: float, kind: Kind) -> float:
    """Tolerance of the next run, by a method of the given kind.

    `target` is the target error relative to the size of the motion (1 for angles and ratios).
    """
    last, error = runs[-1], estimate_error(runs)
    tightest, max_factor = TIGHTEST, TUNING.max_later_ratio
    if kind is not last.kind:
        return _rtol_of_other_kind(last, error, target, kind)
    if error is None or (runs[-2].kind, runs[-2].method) != (kind, last.method):
        tightest, max_factor = min(TUNING.rounding_rtol, last.rtol / 2), TUNING.max_first_ratio
        factor = _factor_by_local_errors(last, target)
    elif not runs[-2].distance < _PARAMETERS[kind].divergence:
        factor = TUNING.max_diverged_ratio
        if kind is Kind.EXPLICIT and runs[-2].divergence_fraction < 1.0:
            # Tolerance at which a run should not diverge, at the error growth of the diverged run.
            before, power = runs[-2], _PARAMETERS[kind].power
            share = TUNING.target_share * target / (before.rtol * _error_growth(before))
            ratio = before.rtol * min(share, 1.0) ** (1 / power) / last.rtol
            factor = min(max(ratio, TUNING.min_diverged_ratio), TUNING.max_diverged_ratio)
    else:
        share = TUNING.target_share if kind is Kind.EXPLICIT else TUNING.target_share_others
        factor, max_factor = (
            (share * target / error) ** (1 / _PARAMETERS[kind].power),
            TUNING.max_first_ratio,
        )
    return max(last.rtol * min(max(factor, _PARAMETERS[kind].min_factor), max_factor), tightest)


def _factor_by_local_errors(last: ToleranceRun, target: float) -> float:
    """Ratio of the next tolerance to the last one, from the sum of its local errors."""
    parameters = _PARAMETERS[last.kind]
    local_sum = last.local_error_sum or TUNING.sum_per_rtol * last.rtol
    growth = parameters.limited_growth if last.is_stability_limited else parameters.growth
    error = local_sum * (last.growth or growth + TUNING.growth_per_radian * last.radians)
    factor = float((parameters.target_share * target / error) ** (1 / parameters.sum_power))
    if not last.calm:
        return factor
    is_near = last.rtol <= TUNING.near_target * target
    return max(factor, TUNING.min_calm_ratio if is_near else TUNING.min_calm_ratio_far)


def _error_growth(run: ToleranceRun) -> float:
    """Growth of errors over the whole time, at the rate until a run had diverged."""
    ratio = max(_PARAMETERS[run.kind].divergence / run.rtol, 1.0)
    return float(ratio ** (1.0 / max(run.divergence_fraction, 0.1)))


def _rtol_of_other_kind(
    last: ToleranceRun, error: float | None, target: float, kind: Kind
) -> float:
    """First tolerance of another kind of method.

    For an explicit method after others it is tight enough for the target, because stability limits
    its steps anyway.
    """
    first = first_rtol(target, kind)
    if error is None or kind is not Kind.EXPLICIT:
        return first
    ratio = TUNING.target_share * target / (_PARAMETERS[kind].safety * error)
    sufficient = last.rtol * ratio ** (1 / TUNING.power_between_methods)
    return min(first, max(sufficient, TUNING.min_explicit_share * first, TIGHTEST))


def no_gain_reason(runs: Sequence[ToleranceRun]) -> str:
    """Reason that no tolerance helps, or ""."""
    is_constant = len(runs) > 3 and not _error_decreases(runs) and not _error_decreases(runs[:-1])
    is_constant = is_constant and runs[-2].distance < _PARAMETERS[runs[-1].kind].divergence
    if is_constant and runs[-1].rtol < TUNING.slow_decay_rtol:
        return (
            "the error no longer decreases with the tolerance (rounding, or jumps of forces within "
            "steps)"
        )
    if runs[-1].rtol < 2 * TIGHTEST:  # runs at nearly the same tolerance show no difference
        return f"tolerances below {TIGHTEST:.0e} are below rounding"
    return f"target not reached in {TUNING.max_runs} runs" if len(runs) >= TUNING.max_runs else ""


def _error_power(runs: Sequence[ToleranceRun]) -> float:
    """Power of the tolerance by which the error of the last run is taken to have decreased."""
    before, last = runs[-2:]
    observed, parameters = _observed_power(runs), _PARAMETERS[last.kind].power
    if before.kind is not last.kind or before.method != last.method:
        parameters = 0.0 if before.kind is Kind.EXPONENTIAL else TUNING.power_between_methods
    if observed is None:
        return TUNING.min_power if last.rtol <= TUNING.rounding_rtol else parameters
    if last.kind is Kind.EXPLICIT and observed > TUNING.power_noise:
        return parameters
    return min(max(TUNING.power_share * observed, TUNING.min_power), parameters)


def _error_decreases(runs: Sequence[ToleranceRun]) -> bool:
    observed = _observed_power(runs)
    return observed is None or observed > TUNING.min_power


def _observed_power(runs: Sequence[ToleranceRun]) -> float | None:
    """Power shown by the last three runs; None if they show none."""
    if len(runs) < 3:
        return None
    a, b, last = runs[-3:]
    if not a.kind is b.kind is last.kind or not a.method == b.method == last.method:
        return None
    if not 0 < b.distance < math.inf or not 0 < a.distance < math.inf:
        return None
    divergence = _PARAMETERS[last.kind].divergence
    if a.distance > divergence:
        return None if b.distance < divergence else 0.0
    return math.log(a.distance / b.distance) / math.log(a.rtol / b.rtol)
