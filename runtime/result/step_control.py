"""Step control of a run: expected drift of energy and momentum, and better settings.

Control of local errors lets energy drift by up to nine times the tolerance, and errors of motions
are four to sixty times the drift, relative to what moves; both counted on the runs of
benchmarks/risk_checks.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..integrate.achieved_error import AchievedError
from ..integrate.settings import Settings
from ..integrate.steppers import get, names
from .verdict import DEFAULT_ACCURACY, DEFAULT_DRIFT

#: Drift above which energy and momentum are not conserved, for any settings: the error of the
#: motion is then about `DEFAULT_ACCURACY`.
MAX_DRIFT = DEFAULT_ACCURACY / 20

#: Drift that control of local errors leaves, in tolerances.
_DRIFT_PER_TOLERANCE = 10.0

#: Recommended settings are to leave this part of the bound.
_SAFETY_FACTOR = 0.2

#: Drifts decrease by less than the order of a method while steps are long: by this part of it, and
#: at most by the second value.
_ORDER_REDUCTION, _MAX_DRIFT_ORDER = 0.75, 4.0

#: Tolerances below this are rounding.
_MIN_TOLERANCE = 1e-13

#: Order assumed for methods without a tableau.
_DEFAULT_ORDER = 2


@dataclass(frozen=True)
class StepControl:
    """Fixed steps of a method of an order, tolerances, or a target error.

    Attributes:
        step: s; None for adaptive steps.
        rtol, atol: its tolerances.
        order: of the method.
        target_error: target error of the whole run, relative or in rad; 0 if in other units, None
            without a target.
    """

    step: float | None
    rtol: float
    atol: float
    order: int
    target_error: float | None = None

    @property
    def bound(self) -> float:
        """Largest relative drift of energy and momentum that counts as conserved."""
        if self.target_error is not None:
            return max(DEFAULT_DRIFT, self.target_error)
        return MAX_DRIFT if self.step is not None else _drift_bound(max(self.rtol, self.atol))

    def finer(self, drift: float) -> str:
        """Advice on step or tolerances for a relative drift that is too large."""
        if self.step is not None:
            order = min(_ORDER_REDUCTION * self.order, _MAX_DRIFT_ORDER)
            shorter = self.step * (_SAFETY_FACTOR * self.bound / drift) ** (1 / order)
            return f"use a step below {shorter:.2g} s, or an adaptive method"
        drift_ratio = drift / max(self.rtol, self.atol)
        is_expected = (
            drift_ratio <= _SAFETY_FACTOR * _DRIFT_PER_TOLERANCE and self.target_error is None
        )
        reduction = _SAFETY_FACTOR * (MAX_DRIFT if is_expected else DEFAULT_DRIFT) / drift
        if self.target_error:
            return f"request an error below {reduction * self.target_error:.1g}"
        if reduction * self.rtol < _MIN_TOLERANCE:
            return "check efforts, loads and drives for jumps and for unbounded values"
        return (
            f"use rtol = {reduction * self.rtol:.1g} and atol = {reduction * self.atol:.1g}, "
            f"or less"
        )


def _drift_bound(tolerance: float) -> float:
    return min(max(DEFAULT_DRIFT, _DRIFT_PER_TOLERANCE * tolerance), MAX_DRIFT)


def step_control(settings: Settings, reached: AchievedError | None) -> StepControl:
    """Step control of a run."""
    has_tableau = settings.method in names()
    order = get(settings.method).order if has_tableau else _DEFAULT_ORDER
    target_error = None
    if reached is not None:
        target_error = reached.target if reached.unit in ("1", "rad") else 0.0
    return StepControl(settings.step, settings.rtol, settings.atol, order, target_error)
