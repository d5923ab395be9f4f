"""`simulate(error=...)`: the runs by which a wanted error is reached, and what is known of it.

A first run is loose and cheap: it shows whether the motion is stiff and what local errors add up
to, and by how far it is from the next one, the error of that.  The next ones come at the tolerances
that `looks` makes of what is known, until the estimate of the tightest one is what was wanted, or
nothing better can be had.  The tightest one is kept.  Nothing depends on a clock, so that all of it
repeats itself to the last bit.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array

from ...integrate.achieved_error import AchievedError, ErrorControlRun
from ...integrate.settings import Settings
from ...integrate.steppers import AUTO
from ...platform_support.interrupts import Interrupt, record_interrupts
from ...result.error_measure import Coordinates, Measure, Quantities
from ...result.factory import result_of
from ...run.error_estimate import compare
from ...run.run_execution import RunMonitor, first_run
from ...run.start_cache import return_start_cache, take_start_cache
from ..run_results import certify_result
from .error_extrapolation import (
    Kind,
    ToleranceRun,
    estimate_error,
    first_rtol,
    next_rtol,
    no_gain_reason,
)
from .error_request import ErrorRequest
from .method_choice import Family, damps_own_errors, is_stability_limited, run_kind

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene
    from ...result.result import Result
    from ...risk_checks.pre_run import PreRunFindings
    from ...run.trajectory import Trajectory

#: Absolute tolerance in the relative one.
_ATOL = 0.01

#: Samples where nobody asked for others, those that are looked at in any case, and how many of the
#: user's are enough to look at them alone.
_SAMPLES, _LOOKS, _ENOUGH = 201, 101, 50

#: The error of bodies that bend in what local errors sum up to, by the length that their shapes
#: move by (m), and at most, and the part of it where steps damp it; and where steps do not follow
#: the fastest motions.
_SHAPED, _MOST_SHAPED, _DAMPED, _OF_SPEEDS = 5e-3, 20.0, 0.1, 0.2

#: First step of a run in the smallest step of the one before.
_SHORTER = 0.3

Progress = Callable[[float, float], None]


@dataclass(frozen=True)
class _Made:
    """A run that reached its end, with the numbers of what is compared."""

    run: Trajectory
    numbers: Array
    cpu_s: float
    kind: Kind


class ToleranceSearch:
    """The runs for one wanted error.  `settings` say all but the tolerances; `seen` is what a look
    at the first one has found."""

    def __init__(
        self, model: CompiledScene, settings: Settings, wanted: ErrorRequest, q: Array, u: Array,
        seen: PreRunFindings, progress: Progress | None,
    ) -> None:  # fmt: skip
        self._model, self._q, self._u, self._seen = model, q, u, seen
        self._wanted, self._progress = wanted, progress
        self._times = settings.output_times
        self._settings = replace(settings, output_times=_looked_at(settings))
        self._beginnings = take_start_cache(model, self._settings)
        self._family = Family(model, settings, wanted.error, q, u)
        self._measure: Measure | None = None if wanted.of else Coordinates(model)
        self._made: list[_Made] = []  # the one to keep is the last
        self._looks: list[ToleranceRun] = []
        self._failed: list[ErrorControlRun] = []
        self._notes: list[str] = []

    def result(self) -> Result:
        """The run that is kept, with what is known of its error.

        Ctrl-C ends the run that is going on; between two of them there is none to be returned.
        """
        with record_interrupts() as interrupted:
            found = self._found_by(interrupted)
        return_start_cache(self._model, self._settings, self._beginnings)
        if interrupted and found.trajectory.status is not None:
            raise KeyboardInterrupt
        return found

    def _found_by(self, interrupted: Interrupt) -> Result:
        """Run after run, until one is good enough, nothing helps, or `interrupted` is set."""
        method, rtol = self._first()
        while True:
            lost = self._run(method, rtol)
            if lost is not None and self._family.rescues(lost):
                method, rtol = (AUTO, rtol) if self._made else self._first()
                continue
            if lost is not None and (not self._made or lost.status is None):
                return self._lost(lost)
            why = "a signal came" if interrupted else self._settled(lost)
            if why is not None:
                return self._kept(why)
            method, rtol = self._next()

    # --- runs -----------------------------------------------------------------------------------

    def _run(self, method: str, rtol: float) -> Trajectory | None:
        """Make one run; returned where it did not reach its end."""
        rtol, atol = _short(rtol), _short(_ATOL * rtol)
        most = self._settings.max_steps if self._made else self._family.most_steps(method)
        settings = replace(
            self._settings, rtol=rtol, atol=atol, method=method, max_steps=most,
            first_step=self._first_step(),
        )  # fmt: skip
        watch = RunMonitor(self._told(), settings)
        begin = time.process_time()
        run = first_run(self._model, settings, self._q, self._u, watch, beginnings=self._beginnings)
        spent = time.process_time() - begin
        self._notes += [note for note in watch.notes if note not in self._notes]
        if not run.is_comparable:
            self._failed.append(_attempt(run, spent, None, run.message))
            return run
        self._made.append(_Made(run, self._numbers(run), spent, run_kind(run)))
        self._look()
        return None

    def _first_step(self) -> float:
        """Length (s) of the first step of the next run, 0 for the usual one of the first run.  The
        usual one may be the same at all tolerances, and what is compared would share its error."""
        counted = self._made[-1].run.statistics if self._made else None
        return _SHORTER * ((counted and counted.smallest_step) or 0.0)

    def _numbers(self, run: Trajectory) -> Array:
        """What is compared, of a run: of coordinates no result has to be made."""
        if not self._wanted.of:
            return run.q
        result = result_of(self._model, self._seen.given(run, self._q, self._u))
        if self._measure is None:
            self._measure = Quantities(result, self._wanted.of)
        return self._measure.read(result)

    def _look(self) -> None:
        """Look at the last run, the tightest one so far, and at how far the one before is from it:
        that much are earlier ones, too."""
        last = self._made[-1]
        if self._looks:
            way = self._apart(self._made[-2], last)
            self._looks[-1] = self._looks[-1].seen(way)
        counted = last.run.statistics
        summed = None if counted is None else counted.sum_local_error
        rtol, held = last.run.settings.rtol, is_stability_limited(last.run)
        radians = self._family.radians if last.kind is Kind.IMPLICIT else 0.0
        calm = last.kind is Kind.EXPLICIT and self._family.calm(last.run)
        growth = self._growth(last)
        method = last.run.settings.method
        self._looks.append(
            ToleranceRun(rtol, last.kind, 0.0, summed, held, radians, calm, growth, method=method)
        )

    def _growth(self, last: _Made) -> float | None:
        """The error of explicit steps in what local errors sum up to, where it is known: shapes
        move by far less than angles do, and err in parts of that; of motions that steps do not
        follow speeds have local errors, which leave no trace."""
        if last.kind is not Kind.EXPLICIT:
            return None
        if self._model.flexible and isinstance(self._measure, Coordinates):
            self._measure.scale_by(last.numbers)
            shaped = min(_SHAPED / self._measure.least, _MOST_SHAPED)
            return shaped * (_DAMPED if damps_own_errors(last.run) else 1.0)
        left = self._family.leaves(last.run) and not self._model.flexible
        return _OF_SPEEDS if left else None

    def _apart(self, one: _Made, tightest: _Made) -> Array:
        """(n,) how far a run is from the tightest one at each sample, in the size of the motion;
        empty where they end elsewhere."""
        assert self._measure is not None
        n = min(len(one.numbers), len(tightest.numbers))
        if not n or abs(len(one.numbers) - len(tightest.numbers)) > 1:
            return np.zeros(0)
        self._measure.scale_by(tightest.numbers)
        return self._measure.apart(one.numbers[:n], tightest.numbers[:n]) / self._size

    def _told(self) -> Progress | None:
        """Progress of the next run: each takes half of what is left."""
        progress, share = self._progress, 0.5 ** (len(self._made) + 1)
        if progress is None:
            return None
        start, end = self._settings.t_start, self._settings.t_end

        def tell(t: float, _: float) -> None:
            progress(start + (1.0 - 2.0 * share) * (end - start) + share * (t - start), end)

        return tell

    # --- what is known --------------------------------------------------------------------------

    @property
    def _size(self) -> float:
        """Of the motion of what is compared, where that has a unit; 1 for angles and parts."""
        assert self._measure is not None
        if self._measure.unit in ("1", "rad"):
            return 1.0
        numbers = self._made[-1].numbers
        start = np.broadcast_to(numbers[:1], numbers.shape)
        return float(self._measure.apart(numbers, start).max(initial=0.0)) or 1.0

    def _known(self) -> float | None:
        """Estimated error of the last run, in the unit of what is wanted; None where nothing is
        known of it."""
        found = estimate_error(self._looks)
        return None if found is None or found == math.inf else found * self._size

    def _settled(self, lost: Trajectory | None) -> str | None:
        """Nothing where the wanted error is reached, else why it never will be; None where a
        further run may.  `lost` is a run that has just failed."""
        known = self._known()
        if known is not None and known <= self._wanted.error:
            return ""
        if lost is not None:
            return f"the next run, rtol {lost.settings.rtol:.0e}, failed: {lost.message}"
        return no_gain_reason(self._looks) or None

    def _first(self) -> tuple[str, float]:
        """Method and tolerance of the first run."""
        kind = self._family.begins
        rtol = first_rtol(self._wanted.error, kind, self._family.radians)
        return self._family.method(kind, rtol, ()), rtol

    def _next(self) -> tuple[str, float]:
        """Method and tolerance of the next run."""
        part, before = self._wanted.error / self._size, self._looks[-1].kind
        rtol = next_rtol(self._looks, part, before)
        made = [one.run for one in self._made]
        kind = self._family.next(rtol, part, made)
        if kind is not before:
            rtol = next_rtol(self._looks, part, kind)
        return self._family.method(kind, rtol, made), rtol

    # --- results --------------------------------------------------------------------------------

    def _lost(self, run: Trajectory) -> Result:
        """What an interrupted run, or a first one that failed, left."""
        why = f"a run did not reach its end: {run.message}"
        known = self._reached(run, None, why, "no run reached its end")
        return result_of(self._model, self._as_asked(replace(run, reached=known)))

    def _kept(self, why: str) -> Result:
        """The tightest run as a result; `why` it is not what was wanted, "" where it is."""
        made, error = self._made[-1], None
        if why and len(self._made) > 1:
            before = self._made[-2].run
            reference = f"rtol {before.settings.rtol:.0e}"
            error = compare(self._model.layout, made.run, before, reference, self._q)
            if error.horizon is not None:
                why = (
                    "small errors grow until the motion cannot be told any more, at these "
                    f"tolerances from t = {error.horizon:.4g} s on (end earlier), and {why}"
                )
        reached = self._reached(made.run, self._known(), why, self._found())
        run = replace(made.run, reached=reached, notes=(*made.run.notes, *self._notes))
        return result_of(self._model, self._as_asked(run), error)

    def _found(self) -> str:
        """How the estimate was made, in words."""
        rtols = [f"{one.run.settings.rtol:.1e}" for one in self._made]
        if len(rtols) < 2:
            return "one run alone, with which nothing was compared"
        return f"by runs with rtol {', '.join(rtols[:-1])} and {rtols[-1]}, the last one kept"

    def _reached(self, run: Trajectory, known: float | None, why: str, found: str) -> AchievedError:
        runs = [
            _attempt(
                one.run, one.cpu_s,
                None if one is self._made[-1] or look.apart == math.inf
                else look.apart * self._size,
            )
            for one, look in zip(self._made, self._looks, strict=True)
        ]  # fmt: skip
        measure, s = self._measure, run.settings
        of, unit, scaling = ", ".join(self._wanted.of), "1", ""
        if measure is not None:
            of, unit, scaling = measure.name, measure.unit, measure.scaling
        return AchievedError(
            self._wanted.error, known, of, unit, scaling.replace("the reference", "the run"),
            s.method, s.rtol, s.atol, found, why, (*runs, *self._failed),
        )  # fmt: skip

    def _as_asked(self, run: Trajectory) -> Trajectory:
        """The run with what was seen before it, at the samples that the user asked for."""
        run = self._seen.given(run, self._q, self._u)
        times, most = self._times or self._settings.output_times, self._settings.max_steps
        if (times, most) == (run.settings.output_times, run.settings.max_steps):
            return run
        assert times is not None  # what is looked at, if nothing else
        keep = np.isin(run.t, times)
        return replace(
            run, t=run.t[keep], q=run.q[keep], u=run.u[keep], memory=run.memory[keep],
            work=run.work[keep], event=run.event[keep],
            settings=replace(run.settings, output_times=times, max_steps=most),
        )  # fmt: skip


def simulate(
    model: CompiledScene,
    settings: Settings,
    wanted: ErrorRequest,
    q: Array,
    u: Array,
    *,
    seen: PreRunFindings,
    certify: bool,
    progress: Progress | None,
) -> Result:
    """The result of a search, and with `certify` of a second run beside it."""
    result = ToleranceSearch(model, settings, wanted, q, u, seen, progress).result()
    return (
        certify_result(result, progress) if certify and result.trajectory.is_comparable else result
    )


def _looked_at(settings: Settings) -> tuple[float, ...]:
    """Times at which runs are compared: the user's, and others between where those are few."""
    start, end, wanted = settings.t_start, settings.t_end, settings.output_times
    if wanted is None:
        return tuple(np.unique(np.linspace(start, end, _SAMPLES)).tolist())
    if len(wanted) >= _ENOUGH:
        return wanted
    return tuple(np.union1d(wanted, np.linspace(start, end, _LOOKS)).tolist())


def _short(tolerance: float) -> float:
    """A tolerance of two digits, which a user can type."""
    return float(f"{tolerance:.1e}")


def _attempt(
    run: Trajectory, cpu_s: float, apart: float | None, failure: str = ""
) -> ErrorControlRun:
    s, counted = run.settings, run.statistics
    evaluations = 0 if counted is None else counted.evaluations + counted.residuals
    return ErrorControlRun(s.method, s.rtol, s.atol, apart, evaluations, cpu_s, failure)
