"""Tolerance over the whole run where models are compared only over a window of it.

Integration errors do not grow with time as model errors do.  The reduced model is cheap: its
tolerance is verified by a tighter run over the whole time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..chart.chart_points import Point, Setting
from ..chart.time_budget import Budget
from ..chart.trial_run import Runs, max_error
from ..integrate.steppers import AUTO
from .method_selection import SelectedSetting
from .trial_models import TrialResult

if TYPE_CHECKING:
    from .advice_state import AdviceState

#: Smallest fraction of the budget for this search, whatever remains of the budget.
_MIN_BUDGET = 0.3

#: First tolerance relative to the relative target error, and tightest tolerance; ratio of the
#: tolerance of the verification; error that the next tolerance aims at, as a fraction of the
#: allowed error; largest number of tolerances.
_FIRST, _TIGHTEST, _VERIFICATION_RATIO, _TARGET_FRACTION, _MAX_TRIALS = 0.1, 1e-12, 1e-2, 0.3, 6


def whole_run_tolerance(
    best: TrialResult, state: AdviceState, allowed_error: float
) -> SelectedSetting | None:
    """Tolerance of method "auto" whose error over the whole run is at most `allowed_error`.

    None if none is found in time.
    """
    span, measure = state.runner.span, state.measure
    budget = Budget(
        max(_MIN_BUDGET * state.request.budget, state.budget.remaining()), state.budget.clock
    )
    times = np.linspace(0.0, span.whole_t_end, state.request.samples)
    runs = Runs(span.whole_t_end, times, budget)
    rtol = min(max(_FIRST * state.relative_target, _TIGHTEST / _VERIFICATION_RATIO), 1e-3)
    for _ in range(_MAX_TRIALS):
        setting = Setting(AUTO, best.name, rtol)
        tighter = Setting(AUTO, best.name, rtol * _VERIFICATION_RATIO)
        trial = runs.trial(best.compiled_model, setting, measure, budget.remaining() / 3)
        verification = runs.trial(best.compiled_model, tighter, measure, budget.remaining() / 2)
        if trial.numbers is None or verification.numbers is None:
            return None
        error = max_error(trial, verification, measure)
        if isinstance(error, str):
            return None
        if error <= allowed_error:
            total_error = (best.error + error) / span.growth
            return SelectedSetting(
                best, Point(setting, total_error, trial.cpu_s, 1), covers_whole_run=True
            )
        if rtol <= _TIGHTEST / _VERIFICATION_RATIO:
            return None
        rtol = max(
            rtol * min(max(_TARGET_FRACTION * allowed_error / error, 1e-4), 0.1),
            _TIGHTEST / _VERIFICATION_RATIO,
        )
    return None
