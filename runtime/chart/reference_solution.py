"""The reference: runs by methods of high order at tight tolerances, which have to agree.

Every candidate runs at two tolerances or more.  The reference is the run whose distances to its own
looser run and to the nearest run of another method are least; the larger of the two is the error
stated for it.  Where one candidate alone came to two runs, the distance of those two is all there
is, and is said to be.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure

from ..result.error_measure import Measure
from .chart_points import Setting
from .method_families import family
from .time_budget import REFERENCE, Budget
from .trial_run import Runs, Trial, error_of

if TYPE_CHECKING:
    from ..model.model import Model

#: Method -> relative tolerances, loose to tight: explicit ones of orders 8 and 13, implicit ones of
#: order 5 and two kinds.
CANDIDATES: Mapping[str, Sequence[float]] = {
    "dop853": (1e-10, 1e-12, 1e-13),
    "pirk13": (1e-10, 1e-12, 1e-13),
    "rodas5p": (1e-8, 1e-10, 1e-11),
    "kvaerno5": (1e-8, 1e-10, 1e-11),
}

#: A tolerance a hundred times tighter is expected to cost this many times as much at most.
_GROWTH = 4.0

Tell = Callable[[str], None]


@dataclass(frozen=True)
class Converged:
    """The reference run, its error, and how it was made in words."""

    run: Trial
    error: float
    made_by: str


def compute_reference(
    model: Model, name: str, measure: Measure, runs: Runs, tell: Tell
) -> Converged:
    """The reference of a model of this name.

    Raises NumericalFailure with the reasons if no candidate came to two runs.
    """
    made: dict[str, list[Trial]] = {}
    reasons: list[str] = []
    too_short = False
    late: set[str] = set()
    for method, tolerances in CANDIDATES.items():
        if family(method) in late:
            reasons.append(f"{method}: left out, for its family takes too long")
            continue
        found, why, slow = _tightening(model, name, method, tolerances, measure, runs, tell)
        too_short |= slow
        if why:
            reasons.append(f"{method}: {why}")
        if slow and len(found) < 2:
            late.add(family(method))
        if len(found) > 1:
            made[method] = found
    if not made:
        why = "; ".join(reasons)
        if not too_short:
            raise NumericalFailure(f"no reference was found: {why}")
        raise NumericalFailure(
            f"no reference was found within its part of the budget: {why}; give more budget, or "
            "end earlier"
        )
    return _best(made, measure)


def _tightening(
    model: Model, name: str, method: str, tolerances: Sequence[float], measure: Measure,
    runs: Runs, tell: Tell,
) -> tuple[list[Trial], str, bool]:  # fmt: skip
    """Runs that ended well, loose to tight; why there are no tighter ones; whether that was for
    want of time."""
    found: list[Trial] = []
    for tolerance in tolerances:
        setting = Setting(method, name, tolerance)
        limit = _limit(runs.budget)
        if found and _GROWTH * found[-1].cpu_s > limit:
            return found, f"{setting} would take too long", True
        tell(f"reference by {method}, {setting}")
        trial = runs.trial(model, setting, measure, limit)
        if trial.numbers is None:
            return found, f"{setting}: {trial.failure}", trial.late
        found.append(trial)
    return found, "", False


def _limit(budget: Budget) -> float:
    """Seconds for one run: half of what is left, so that another method has its turn."""
    return budget.left(REFERENCE) / 2


def _best(made: Mapping[str, list[Trial]], measure: Measure) -> Converged:
    """The run that agrees best with its own looser one and with another method."""
    measure.scale_by(_numbers(next(iter(made.values()))[-1]))
    judged = []
    for method, trials in made.items():
        run, looser = trials[-1], trials[-2]
        others = {
            other: _apart(run, theirs[-1], measure)
            for other, theirs in made.items()
            if other != method
        }
        partner = min(others, key=lambda name: others[name], default="")
        error = max(_apart(looser, run, measure), others.get(partner, 0.0))
        judged.append((error, method, partner))
    error, method, partner = min(judged)
    if not np.isfinite(error):
        raise NumericalFailure("no reference was found: its runs do not reach the same end")
    run, looser = made[method][-1], made[method][-2]
    measure.scale_by(_numbers(run))
    text = f"{method} with {run.setting}, compared with {looser.setting}"
    text += f" and with {partner}, {made[partner][-1].setting}" if partner else " alone"
    return Converged(run, error, text)


def _numbers(trial: Trial) -> Array:
    assert trial.numbers is not None
    return trial.numbers


def _apart(a: Trial, b: Trial, measure: Measure) -> float:
    found = error_of(a, b, measure)
    return found if isinstance(found, float) else np.inf
