"""Reference solution: runs at tight tolerances that must agree.

A chart uses several high-order methods, each at two tolerances or more.  The reference is the run
that agrees best with a looser run of the same method and with the nearest run of another method;
its stated error is the larger of these two differences.  If only one candidate completes two runs,
the error is their difference, and the description says so.  Model reduction uses two runs by one
method that agree.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mstmm.errors import NumericalFailure

from .error_measure import Measure
from .method_families import family
from .runs import REFERENCE, Report, Runs
from .trial import Setting, Trial, max_error
from .tuning import CHART, REDUCTION

if TYPE_CHECKING:
    from .simulation import SimulatedScene


#: Method -> relative tolerances, loose to tight: explicit methods of orders 8 and 13, implicit
#: methods of order 5 of two families.
CANDIDATES: Mapping[str, Sequence[float]] = {
    "dop853": (1e-10, 1e-12, 1e-13),
    "pirk13": (1e-10, 1e-12, 1e-13),
    "rodas5p": (1e-8, 1e-10, 1e-11),
    "kvaerno5": (1e-8, 1e-10, 1e-11),
}


@dataclass(frozen=True)
class Converged:
    """Reference run, its error, and a description of the runs it was compared with."""

    trial: Trial
    error: float
    made_by: str


def compute_reference(
    model: SimulatedScene, name: str, measure: Measure, runs: Runs, report: Report
) -> Converged:
    """Compute the reference solution of a model; `name` is the name of its level.

    Raises NumericalFailure with the reasons if no candidate completes two runs.
    """
    trials_by_method: dict[str, list[Trial]] = {}
    reasons: list[str] = []
    is_short_of_time = False
    slow_families: set[str] = set()
    for method, tolerances in CANDIDATES.items():
        if family(method) in slow_families:
            reasons.append(f"{method}: skipped, its family of methods takes too long")
            continue
        trials, reason, is_slow = _run_candidate(
            model, name, method, tolerances, measure, runs, report
        )
        is_short_of_time |= is_slow
        if reason:
            reasons.append(f"{method}: {reason}")
        if is_slow and len(trials) < 2:
            slow_families.add(family(method))
        if len(trials) > 1:
            trials_by_method[method] = trials
    if not trials_by_method:
        reason = "; ".join(reasons)
        if not is_short_of_time:
            raise NumericalFailure(f"no reference was found: {reason}")
        raise NumericalFailure(
            f"no reference was found within its part of the budget: {reason}; give a larger budget "
            "or an earlier end time"
        )
    return _select_reference(trials_by_method, measure)


def agreeing_runs(
    run: Callable[[float], Trial],
    rtol: float,
    difference: Callable[[Trial, Trial], float],
    target: float,
) -> tuple[Trial, Converged]:
    """Run with tighter tolerances until two runs agree; the tighter one is the reference.

    `run` makes the run of a tolerance, beginning with `rtol`; `target` is the error that the
    reference has to resolve.  Raises NumericalFailure if the runs do not agree.
    """
    looser = run(rtol)
    while True:
        tighter_rtol = max(rtol * REDUCTION.reference_ratio, REDUCTION.tightest_rtol)
        tighter = run(tighter_rtol)
        error = difference(looser, tighter)
        if error <= REDUCTION.max_difference * target:
            return looser, Converged(tighter, error, f"compared with {looser.setting}")
        if tighter_rtol <= REDUCTION.tightest_rtol:
            raise NumericalFailure(
                f"two runs of the richest model with rtol {rtol:.0e} and {tighter_rtol:.0e} differ "
                f"by {error:.1e}: an error of {target:.1e} cannot be resolved; give an earlier end "
                "time or a larger target error"
            )
        rtol, looser = tighter_rtol, tighter


def _run_candidate(
    model: SimulatedScene, name: str, method: str, tolerances: Sequence[float], measure: Measure,
    runs: Runs, report: Report,
) -> tuple[list[Trial], str, bool]:  # fmt: skip
    """Run a method at its tolerances from loose to tight, until one fails or time is short.

    Returns the successful runs, the reason why there are no tighter ones, and whether that was a
    lack of time.
    """
    trials: list[Trial] = []
    for tolerance in tolerances:
        setting = Setting(method, name, tolerance)
        limit = runs.budget.remaining(REFERENCE) / 2  # the other half is for another method
        if trials and CHART.reference_growth * trials[-1].cpu_s > limit:
            return trials, f"{setting} would take too long", True
        report(f"reference by {method}, {setting}")
        trial = runs.trial(model, setting, measure, limit)
        if trial.numbers is None:
            return trials, f"{setting}: {trial.failure}", trial.late
        trials.append(trial)
    return trials, "", False


def _select_reference(trials_by_method: Mapping[str, list[Trial]], measure: Measure) -> Converged:
    """Run that agrees best with a looser run of its method and with another method."""
    measure.set_scales(next(iter(trials_by_method.values()))[-1].values)
    candidates = []
    for method, trials in trials_by_method.items():
        run, looser = trials[-1], trials[-2]
        distances = {
            other: max_error(run, other_trials[-1], measure)[0]
            for other, other_trials in trials_by_method.items()
            if other != method
        }
        partner = min(distances, key=lambda name: distances[name], default="")
        error = max(max_error(looser, run, measure)[0], distances.get(partner, 0.0))
        candidates.append((error, method, partner))
    error, method, partner = min(candidates)
    if not np.isfinite(error):
        raise NumericalFailure("no reference was found: the runs end at different times")
    run, looser = trials_by_method[method][-1], trials_by_method[method][-2]
    measure.set_scales(run.values)
    text = f"{method} with {run.setting}, compared with {looser.setting}"
    text += f" and with {partner}, {trials_by_method[partner][-1].setting}" if partner else " only"
    return Converged(run, error, text)
