"""Method and tolerance over the whole run where models are compared over a window of it.

Errors of an integration do not grow with the time as those of a model do.  The reduced model is
cheap: its setting is judged by a run of its own at a tighter tolerance, from beginning to end.
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

#: What is left of the budget, and no less than this part of all of it, may be taken.
_SECONDS = 0.3

#: The first tolerance in the error in parts of the motion, and the tightest; by how much a setting
#: is tighter that judges another; what a next one aims at; most settings.
_FIRST, _TIGHTEST, _BESIDE, _AIM, _MOST = 0.1, 1e-12, 1e-2, 0.3, 6


def whole_run_tolerance(
    best: TrialResult, work: AdviceState, left: float
) -> SelectedSetting | None:
    """A tolerance of `auto` that errs by at most `left` over the whole run; None where none was
    found in time."""
    span, measure = work.bench.span, work.measure
    budget = Budget(max(_SECONDS * work.asked.budget, work.budget.left()), work.budget.clock)
    times = np.linspace(0.0, span.wanted, work.asked.samples)
    runs = Runs(span.wanted, times, budget)
    rtol = min(max(_FIRST * work.part, _TIGHTEST / _BESIDE), 1e-3)
    for _ in range(_MOST):
        setting = Setting(AUTO, best.name, rtol)
        beside = Setting(AUTO, best.name, rtol * _BESIDE)
        trial = runs.trial(best.running, setting, measure, budget.left() / 3)
        judge = runs.trial(best.running, beside, measure, budget.left() / 2)
        if trial.numbers is None or judge.numbers is None:
            return None
        error = max_error(trial, judge, measure)
        if isinstance(error, str):
            return None
        if error <= left:
            own = (best.error + error) / span.growth
            return SelectedSetting(best, Point(setting, own, trial.cpu_s, 1), whole=True)
        if rtol <= _TIGHTEST / _BESIDE:
            return None
        rtol = max(rtol * min(max(_AIM * left / error, 1e-4), 0.1), _TIGHTEST / _BESIDE)
    return None
