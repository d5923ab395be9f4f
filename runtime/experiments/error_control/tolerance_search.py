"""Search for the tolerance that reaches a target error: `simulate(error=...)`.

A first run is loose and cheap: it shows whether the motion is stiff, the sum of its local errors,
and, by its distance to the next run, the error of that one.  Further runs use the tolerances from
`error_extrapolation`, until the estimate of the tightest run reaches the target error or no
improvement is possible.  The tightest run is the result.  Nothing depends on time measurements, so
that results are reproducible bit for bit.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array

from ...integrate.achieved_error import AchievedError, ErrorControlRun
from ...integrate.settings import Settings
from ...integrate.steppers import AUTO
from ...platform_support.interrupts import Interrupt, record_interrupts
from ...result.one_way.result import result_of
from ...run.error_estimate import compare
from ...run.run_execution import RunMonitor, first_run, return_start_cache, take_start_cache
from ..error_measure import Coordinates, Measure, Quantities
from ..run_request import ErrorRequest
from ..trial import ATOL_FRACTION, Setting, Trial, sample_distances
from ..tuning import ERROR_CONTROL as TUNING
from .error_extrapolation import (
    Kind,
    ToleranceRun,
    estimate_error,
    first_rtol,
    next_rtol,
    no_gain_reason,
)
from .method_choice import Family, damps_own_errors, is_stability_limited, run_kind

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene
    from ...result.checks.run_checks import PreRunFindings
    from ...result.result import Result
    from ...run.trajectory import Trajectory


Progress = Callable[[float, float], None]


class ToleranceSearch:
    """Runs for one target error.

    `settings` give everything except the tolerances; `seen` are the findings before the first run.
    """

    def __init__(
        self, model: CompiledScene, settings: Settings, wanted: ErrorRequest, q: Array, u: Array,
        seen: PreRunFindings, progress: Progress | None,
    ) -> None:  # fmt: skip
        self._model, self._q, self._u, self._findings = model, q, u, seen
        self._request, self._progress = wanted, progress
        self._times = settings.output_times
        self._settings = replace(settings, output_times=_comparison_times(settings))
        self._start_cache = take_start_cache(model, self._settings)
        self._family = Family(model, settings, wanted.error, q, u)
        self._measure: Measure | None = None if wanted.of else Coordinates(model)
        self._completed: list[Trial] = []  # the last one is the tightest
        self._tolerance_runs: list[ToleranceRun] = []
        self._failed: list[Trial] = []
        self._notes: list[str] = []

    def result(self) -> Result:
        """Result of the tightest run, with its estimated error.

        Ctrl-C ends the current run, whose result is returned; between two runs it is raised.
        """
        with record_interrupts() as interrupted:
            result = self._search(interrupted)
        return_start_cache(self._model, self._settings, self._start_cache)
        if interrupted and result.trajectory.status is not None:
            raise KeyboardInterrupt
        return result

    def _search(self, interrupted: Interrupt) -> Result:
        """Make runs until the target is reached, no tolerance helps, or `interrupted` is set."""
        method, rtol = self._first_setting()
        while True:
            failed = self._make_run(method, rtol)
            if failed is not None and self._family.rescues(failed):
                method, rtol = (AUTO, rtol) if self._completed else self._first_setting()
                continue
            if failed is not None and (not self._completed or failed.status is None):
                return self._failed_result(failed)
            reason = "interrupted by a signal" if interrupted else self._stop_reason(failed)
            if reason is not None:
                return self._best_result(reason)
            method, rtol = self._next_setting()

    # --- runs -----------------------------------------------------------------------------------

    def _make_run(self, method: str, rtol: float) -> Trajectory | None:
        """Make one run; return it if it did not reach its end."""
        rtol, atol = _round_tolerance(rtol), _round_tolerance(ATOL_FRACTION * rtol)
        max_steps = (
            self._settings.max_steps if self._completed else self._family.max_first_steps(method)
        )
        first_step = 0.0  # the default, which may be equal at all tolerances: runs share its error
        if self._completed:
            smallest_step = self._completed[-1].trajectory.statistics.smallest_step
            first_step = TUNING.first_step_ratio * (smallest_step or 0.0)
        settings = replace(
            self._settings, rtol=rtol, atol=atol, method=method, max_steps=max_steps,
            first_step=first_step,
        )  # fmt: skip
        monitor = RunMonitor(self._run_progress(), settings)
        start = time.process_time()
        run = first_run(
            self._model, settings, self._q, self._u, monitor, beginnings=self._start_cache
        )
        cpu_s = time.process_time() - start
        self._notes += [note for note in monitor.notes if note not in self._notes]
        setting = Setting(method, "", rtol)
        if not run.is_comparable:
            self._failed.append(Trial(setting, cpu_s, run, failure=run.message))
            return run
        self._completed.append(Trial(setting, cpu_s, run, self._compared_values(run)))
        self._add_tolerance_run()
        return None

    def _compared_values(self, run: Trajectory) -> Array:
        """Compared values of a run; for coordinates without creating a result."""
        if not self._request.of:
            return run.q
        result = result_of(self._model, self._findings.attach_to(run))
        if self._measure is None:
            self._measure = Quantities(result, self._request.of)
        return self._measure.read(result)

    def _add_tolerance_run(self) -> None:
        """Record the last run, the tightest so far, and its distance to the one before."""
        last = self._completed[-1]
        if self._tolerance_runs:
            distances = self._distances(self._completed[-2], last)
            self._tolerance_runs[-1] = self._tolerance_runs[-1].compared_with(distances)
        run, kind = last.trajectory, run_kind(last.trajectory)
        statistics, settings = run.statistics, run.settings
        self._tolerance_runs.append(
            ToleranceRun(
                settings.rtol, kind, 0.0,
                statistics.sum_of_local_errors,
                is_stability_limited(run), self._family.radians if kind is Kind.IMPLICIT else 0.0,
                kind is Kind.EXPLICIT and self._family.calm(run), self._error_growth(last, kind),
                method=settings.method,
            )
        )  # fmt: skip

    def _error_growth(self, last: Trial, kind: Kind) -> float | None:
        """Error of explicit steps relative to the sum of local errors, if known; else None.

        Shapes have far smaller motions than angles, and errors relative to these.  For motions that
        steps do not resolve, speeds have local errors without effect.
        """
        if kind is not Kind.EXPLICIT:
            return None
        if self._model.flexible_bodies and isinstance(self._measure, Coordinates):
            self._measure.set_scales(last.values)
            growth = min(TUNING.growth_length / self._measure.min_scale, TUNING.max_shape_growth)
            return growth * (TUNING.damped_share if damps_own_errors(last.trajectory) else 1.0)
        is_unresolved = self._family.leaves(last.trajectory) and not self._model.flexible_bodies
        return TUNING.growth_of_speeds if is_unresolved else None

    def _distances(self, trial: Trial, tightest: Trial) -> Array:
        """Distances (n,) of a run to the tightest one, relative to the size of the motion.

        One per sample; empty for other end times.
        """
        assert self._measure is not None
        self._measure.set_scales(tightest.values)
        return sample_distances(trial, tightest, self._measure) / self._motion_size

    def _run_progress(self) -> Progress | None:
        """Progress callback of the next run; each run takes half of the remaining progress."""
        progress, share = self._progress, 0.5 ** (len(self._completed) + 1)
        if progress is None:
            return None
        start, end = self._settings.t_start, self._settings.t_end

        def report(t: float, _: float) -> None:
            progress(start + (1.0 - 2.0 * share) * (end - start) + share * (t - start), end)

        return report

    # --- error estimate -------------------------------------------------------------------------

    @property
    def _motion_size(self) -> float:
        """Size of the compared motion if it has a unit; 1 for angles and ratios."""
        assert self._measure is not None
        if self._measure.unit in ("1", "rad"):
            return 1.0
        numbers = self._completed[-1].values
        start = np.broadcast_to(numbers[:1], numbers.shape)
        return float(self._measure.distance(numbers, start).max(initial=0.0)) or 1.0

    def _estimated_error(self) -> float | None:
        """Estimated error of the last run, in the unit of the target; None if unknown."""
        error = estimate_error(self._tolerance_runs)
        return None if error is None or error == math.inf else error * self._motion_size

    def _stop_reason(self, failed: Trajectory | None) -> str | None:
        """Reason to stop: "" if the target is reached, a text if it cannot be; None to continue.

        `failed` is a run that has just failed.
        """
        error = self._estimated_error()
        if error is not None and error <= self._request.error:
            return ""
        if failed is not None:
            return f"the next run, rtol {failed.settings.rtol:.0e}, failed: {failed.message}"
        return no_gain_reason(self._tolerance_runs) or None

    def _first_setting(self) -> tuple[str, float]:
        """Method and tolerance of the first run."""
        kind = self._family.first_kind
        rtol = first_rtol(self._request.error, kind, self._family.radians)
        return self._family.method(kind, rtol, ()), rtol

    def _next_setting(self) -> tuple[str, float]:
        """Method and tolerance of the next run."""
        target, before = self._request.error / self._motion_size, self._tolerance_runs[-1].kind
        rtol = next_rtol(self._tolerance_runs, target, before)
        made = [completed.trajectory for completed in self._completed]
        kind = self._family.next_kind(rtol, target, made)
        if kind is not before:
            rtol = next_rtol(self._tolerance_runs, target, kind)
        return self._family.method(kind, rtol, made), rtol

    # --- results --------------------------------------------------------------------------------

    def _failed_result(self, run: Trajectory) -> Result:
        """Result of an interrupted run, or of a failed first one."""
        reason = f"a run did not reach its end: {run.message}"
        achieved = self._achieved_error(run, None, reason, "no run reached its end")
        return result_of(self._model, self._as_requested(replace(run, achieved_error=achieved)))

    def _best_result(self, reason: str) -> Result:
        """Result of the tightest run; `reason` why the target is not reached, or ""."""
        best, error = self._completed[-1].trajectory, None
        if reason and len(self._completed) > 1:
            before = self._completed[-2].trajectory
            reference = f"rtol {before.settings.rtol:.0e}"
            error = compare(self._model.coordinate_layout, best, before, reference, self._q)
            if error.divergence_time is not None:
                reason = (
                    "small errors grow until the motion is unpredictable, at these "
                    f"tolerances from t = {error.divergence_time:.4g} s on (end earlier), and "
                    f"{reason}"
                )
        rtols = [f"{completed.setting.value:.1e}" for completed in self._completed]
        found = f"by runs with rtol {', '.join(rtols[:-1])} and {rtols[-1]}, the last one kept"
        if len(rtols) < 2:
            found = "one run alone, without comparison"
        reached = self._achieved_error(best, self._estimated_error(), reason, found)
        run = replace(best, achieved_error=reached, notes=(*best.notes, *self._notes))
        return result_of(self._model, self._as_requested(run), error)

    def _achieved_error(
        self, run: Trajectory, known: float | None, why: str, found: str
    ) -> AchievedError:
        runs = [
            _record(
                completed,
                None if completed is self._completed[-1] or compared.distance == math.inf
                else compared.distance * self._motion_size,
            )
            for completed, compared in zip(self._completed, self._tolerance_runs, strict=True)
        ]  # fmt: skip
        measure, s = self._measure, run.settings
        of, unit, scaling = ", ".join(self._request.of), "1", ""
        if measure is not None:
            of, unit, scaling = measure.name, measure.unit, measure.scaling
        return AchievedError(
            self._request.error, known, of, unit, scaling.replace("the reference", "the run"),
            s.method, s.rtol, s.atol, found, why, (*runs, *map(_record, self._failed)),
        )  # fmt: skip

    def _as_requested(self, run: Trajectory) -> Trajectory:
        """Run with the findings before it, at the output times of the user."""
        run = self._findings.attach_to(run)
        times, max_steps = self._times or self._settings.output_times, self._settings.max_steps
        if (times, max_steps) == (run.settings.output_times, run.settings.max_steps):
            return run
        assert times is not None  # the comparison times at least
        is_kept = np.isin(run.t, times)
        return replace(
            run, t=run.t[is_kept], q=run.q[is_kept], u=run.u[is_kept], memory=run.memory[is_kept],
            work=run.work[is_kept], event=run.event[is_kept],
            settings=replace(run.settings, output_times=times, max_steps=max_steps),
        )  # fmt: skip


def _comparison_times(settings: Settings) -> tuple[float, ...]:
    """Times at which runs are compared: the output times, and more if these are few."""
    start, end, wanted = settings.t_start, settings.t_end, settings.output_times
    if wanted is None:
        return tuple(np.unique(np.linspace(start, end, TUNING.default_samples)).tolist())
    if len(wanted) >= TUNING.sufficient_samples:
        return wanted
    return tuple(np.union1d(wanted, np.linspace(start, end, TUNING.compared_samples)).tolist())


def _round_tolerance(tolerance: float) -> float:
    """Tolerance rounded to two digits, which is easy to type."""
    return float(f"{tolerance:.1e}")


def _record(trial: Trial, distance: float | None = None) -> ErrorControlRun:
    """Record of a trial for the result, with its distance to the tightest one."""
    settings, statistics = trial.trajectory.settings, trial.trajectory.statistics
    return ErrorControlRun(
        settings.method, settings.rtol, settings.atol, distance,
        statistics.evaluations + statistics.residuals, trial.cpu_s, trial.failure,
    )  # fmt: skip
