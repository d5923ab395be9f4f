"""Work-precision chart of a scene with its plot, HTML page and JSON file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.array_validation import Array, integer, positive_float
from mstmm.defaults import CHART_SAMPLES
from mstmm.errors import EnvironmentFailure, MstmmError, SceneError

from ...integrate.steppers import AUTO
from ...platform_support.safe_files import write_text
from ..error_measure import Measure, select_measure
from ..method_families import PROMISING, require_methods, without_index3_duplicates
from ..model_levels import Variant, model_levels, planar_level
from ..reference import Converged, compute_reference
from ..runs import EARLY, REFERENCE, SETTINGS, Budget, Compile, Report, Runs, scene_warnings
from ..trial import Setting, Trial, max_error
from ..tuning import CHART as TUNING
from .chart_record import ChartRecord, Level, Reference, Skipped, bound_errors, split_warnings
from .html_page import page
from .matplotlib_plot import has_matplotlib, plot
from .method_survey import Curve, Survey, method_curve, repeat_timings

if TYPE_CHECKING:
    from ..simulation import SimulatedScene


@dataclass(frozen=True)
class Chart(ChartRecord):
    """Work-precision chart: CPU time against error of all methods.  Made by `mstmm.chart`.

    The attributes are those of `ChartRecord`.
    """

    def plot(self, path: str | Path | None = None) -> Any:
        """Plot as `matplotlib.figure.Figure`; needs the extra `plot`.

        With `path` (.png, .svg, .pdf) also write the file.
        """
        return plot(self, path)

    def to_html(self) -> str:
        """Self-contained HTML page: the plot, with details of a point on hover, and all tables."""
        return page(self)

    def save(self, folder: str | Path) -> tuple[Path, ...]:
        """Write chart.html, chart.json and, where matplotlib is installed, chart.png.

        Returns the paths of the files.  Raises EnvironmentFailure if the folder cannot be created
        or written to.
        """
        directory = Path(folder)
        try:
            directory.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise EnvironmentFailure(
                f'folder "{directory}": cannot be created: {error.strerror}'
            ) from None
        paths = []
        for name, text in (("chart.html", self.to_html()), ("chart.json", self.to_json())):
            write_text(directory / name, text)
            paths.append(directory / name)
        if has_matplotlib():
            self.plot(directory / "chart.png")
            paths.append(directory / "chart.png")
        return tuple(paths)


#: Coordinates that change by less than this (m, rad, or relative to their size) do not move.
_MOTION_TOLERANCE = 1e-12
#: Reason why there is only one model level.
_NO_MODELS = (
    "no model levels to compare: the scene has no flexible bodies, and no hinge that a planar "
    "motion would simplify"
)
#: Name of the only level of a chart without model levels.
AS_GIVEN = "as given"


@dataclass(frozen=True)
class ChartRequest:
    """Validated arguments of `mstmm.chart`."""

    t_end: float
    quantities: tuple[str, ...]
    methods: tuple[str, ...]
    models: bool
    error: float
    budget: float
    samples: int
    fixed: bool
    rounds: int


def chart_request(
    t_end: float, quantities: Sequence[str], methods: Sequence[str] | None, models: bool,
    error: float, budget: float, samples: int | None, rounds: int,
) -> ChartRequest:  # fmt: skip
    """Validate the arguments of `mstmm.chart`; SceneError names the first invalid one."""
    if isinstance(quantities, str) or isinstance(methods, str):
        raise SceneError('quantities, methods: expected lists of names, as in ["tip.position"]')
    return ChartRequest(
        positive_float("t_end", t_end, "a time in s"), tuple(quantities),
        require_methods(methods), bool(models), positive_float("error", error, "an error"),
        positive_float("budget", budget, "a time in s"),
        integer(
            "samples", CHART_SAMPLES if samples is None else samples, 2,
            "a whole number of samples, 2 or more",
        ),
        samples is not None,
        integer("rounds", rounds, 0, "a whole number of rounds, 0 or more"),
    )  # fmt: skip


def make_chart(
    model: SimulatedScene, request: ChartRequest, compile: Compile, title: str, report: Report,
    report_status: Report, budget: Budget | None = None,
) -> Chart:  # fmt: skip
    """Build the work-precision chart of a model; `compile` makes the models of its other levels.

    `report_status` is called with the time plan and the reference, `report` with a sentence before
    every run.  Raises SceneError for an unknown quantity, NumericalFailure if no reference is
    found.
    """
    return _ChartBuilder(
        model, request, compile, report, report_status, budget or Budget(request.budget)
    ).chart(title)


class _ChartBuilder:
    """Intermediate results of a chart: times, runs, model levels, skipped runs."""

    def __init__(
        self, model: SimulatedScene, request: ChartRequest, compile: Compile, report: Report,
        report_status: Report, budget: Budget,
    ) -> None:  # fmt: skip
        if model.loop_start is None:
            request = replace(request, methods=without_index3_duplicates(request.methods))
        self.model, self.request, self.compile = model, request, compile
        self.report, self.report_status, self.budget = report, report_status, budget
        self.times = equidistant_times(request.t_end, request.samples)
        self.runs = Runs(request.t_end, self.times.times, budget)
        self.skipped: list[Skipped] = []
        self.model_levels: list[Level] = []

    def chart(self, title: str) -> Chart:
        request = self.request
        variants = model_levels(self.model.scene) if request.models else ()
        richest = self.compile(variants[-1].scene) if variants else self.model
        start = richest.simulate(0.0, method="dop853")
        measure = select_measure(richest, start, request.quantities, request.models)
        self.report_status(self.budget.plan(len(request.methods) * max(1, len(variants))))
        name = variants[-1].name if variants else AS_GIVEN
        if not request.fixed:
            self._refine_times(richest, name)
        best = compute_reference(richest, name, measure, self.runs, self.report)
        q = best.trial.trajectory.q
        motion = q.max(axis=0) - q.min(axis=0)
        is_static = bool((motion <= _MOTION_TOLERANCE * np.maximum(1.0, abs(q[0]))).all())
        reference = Reference(
            best.error, best.made_by, name, measure.name, measure.unit, measure.scaling,
            best.trial.ended, is_static,
        )  # fmt: skip
        self._report_reference(reference)
        curves = self._curves(variants, richest, best, measure, reference)
        survey = Survey(best.trial, measure, self.runs, self.report)
        if not is_static:
            survey.run_curves([curve for curve in curves if curve.method in PROMISING], EARLY)
            others = [curve for curve in curves if curve.method not in PROMISING]
            survey.run_curves(others, SETTINGS)
        points, missed = repeat_timings(
            survey.points, survey.models, request.rounds, self.runs, self.report
        )
        if missed and request.rounds:
            reason = f"{missed} of {len(points)} runs were timed less often than the others, for"
            self.skipped.append(Skipped("", "", "", f"{reason} lack of time", False))
        level_errors = {
            level.name: level.error for level in self.model_levels[:-1] if level.error is not None
        }
        bounded = bound_errors(points, reference, level_errors)
        points_with_bounds, common_warnings = split_warnings(bounded)
        return Chart(
            title, request.t_end, len(self.times.times), reference, points_with_bounds,
            tuple(self.model_levels), (*self.skipped, *survey.skipped), request.error,
            request.budget, self.budget.elapsed_time, self.times.description,
            (*scene_warnings(richest.scene), *common_warnings),
        )  # fmt: skip

    def _refine_times(self, richest: SimulatedScene, name: str) -> None:
        """Add times where the motion is fast, unless the run for that takes too long."""
        self.report("run to choose the times of the error")
        setting = Setting(AUTO, name, TUNING.step_size_rtol)
        limit = self.budget.run_limit(REFERENCE)
        result, _ = self.runs.try_simulate(richest, setting.options, limit, own_steps=True)
        if result is None or not result.is_comparable or not len(result.t):
            return
        steps = result.t
        self.times = refine_times(equidistant_times(steps[-1], self.request.samples), steps)
        self.runs.times = self.times.times

    def _report_reference(self, reference: Reference) -> None:
        """Report the reference, and the times at which errors are evaluated."""
        self.report_status(
            f"reference: {reference.made_by}; its own error is {reference.error:.1e}"
        )
        self.report_status(f"errors are evaluated at {self.times.description}")
        if reference.stop_event:
            self.report_status(f"runs end before {self.request.t_end:g} s: {reference.stop_event}")
        if reference.is_static:
            self.report_status("the scene has no degrees of freedom: no methods are compared")

    def _curves(
        self,
        variants: Sequence[Variant],
        richest: SimulatedScene,
        best: Converged,
        measure: Measure,
        reference: Reference,
    ) -> list[Curve]:
        """Curves of all methods on all model levels, the richest level last."""
        models: list[tuple[str, SimulatedScene, float | None]] = []
        others = list(variants[:-1])
        if variants:
            planar = planar_level(variants[-1], richest, best.trial.trajectory.q)
            others += [] if planar is None else [planar]
        for variant in others:
            evaluated = self._evaluate_level(variant, best, measure)
            if evaluated is not None:
                models.append((variant.name, *evaluated))
        if self.request.models and not others:
            self.skipped.append(Skipped("", "", "", _NO_MODELS, True))
        models.append((reference.model, richest, None))
        self.model_levels.append(
            Level(reference.model, reference.error, _degrees_of_freedom(richest), richest.engine)
        )
        t_end, floor = self.request.t_end, reference.smallest_resolved_error
        return [
            method_curve(method, level, model, t_end, floor, level_error)
            for method in self.request.methods
            for level, model, level_error in models
        ]

    def _evaluate_level(
        self, variant: Variant, best: Converged, measure: Measure
    ) -> tuple[SimulatedScene, float | None] | None:
        """Model of a level and its error (None if unknown); None if the level does not apply.

        The reason is added to the skipped runs.
        """
        self.report(f"model level {variant.name}")
        try:
            model = self.compile(variant.scene)
            run = self._run_accurately(model, variant.name, best, measure)
        except MstmmError as problem:
            self.skipped.append(Skipped("", variant.name, "", str(problem), True))
            return None
        if run.numbers is None and not run.late:
            self.skipped.append(Skipped("", variant.name, "", run.failure, True))
            return None
        error, reason = math.inf, "the run took too long"
        if not run.late:
            error, reason = max_error(run, best.trial, measure)
        if reason:
            reason = f"error of the model level unknown: {reason}"
            self.skipped.append(Skipped("", variant.name, "", reason, False))
        level_error = None if reason else error
        self.model_levels.append(
            Level(variant.name, level_error, _degrees_of_freedom(model), model.engine)
        )
        return model, level_error

    def _run_accurately(
        self, model: SimulatedScene, level: str, best: Converged, measure: Measure
    ) -> Trial:
        """Run of a level whose integration error is small compared with the error of the level.

        An accurate level needs the setting of the reference for that.
        """
        limit = self.budget.run_limit(TUNING.level_budget)
        run = self.runs.trial(model, Setting(AUTO, level, TUNING.level_rtol), measure, limit)
        if run.numbers is None:
            return run
        error, reason = max_error(run, best.trial, measure)
        if reason or error > TUNING.accurate_level_factor * TUNING.level_rtol:
            return run
        tight = replace(best.trial.setting, model=level)
        tighter = self.runs.trial(model, tight, measure, limit)
        return run if tighter.numbers is None else tighter


def _degrees_of_freedom(model: SimulatedScene) -> int:
    """Number of degrees of freedom; of a mechanism, its mobility."""
    return model.nu if model.loop_start is None else model.loop_start.loops.mobility


#: Times closer together than this fraction of the run are merged.
_MERGE_FRACTION = 1e-12


@dataclass(frozen=True)
class Times:
    """Times of samples (n,), s, and a description of their distribution."""

    times: Array
    description: str


def equidistant_times(t_end: float, count: int) -> Times:
    """Equidistant times from 0 to t_end, s."""
    return Times(np.linspace(0.0, t_end, count), f"{count} equidistant times up to {t_end:.6g} s")


def refine_times(times: Times, steps: Array) -> Times:
    """Add the ends of steps (m,), s, to the intervals that contain several of them.

    Additional times beyond the largest number allowed are thinned out evenly.
    """
    first, last = times.times[0], times.times[-1]
    min_distance = _MERGE_FRACTION * (last - first)
    inside = steps[(steps > first) & (steps < last)]
    interval = np.searchsorted(times.times, inside) - 1
    is_fast = np.bincount(interval, minlength=len(times.times)) >= TUNING.fast_step_count
    distances = np.minimum(inside - times.times[interval], times.times[interval + 1] - inside)
    added = np.unique(inside[is_fast[interval] & (distances > min_distance)])
    max_count = (TUNING.max_count_factor - 1) * len(times.times)
    if len(added) > max_count:
        added = added[np.linspace(0, len(added) - 1, max_count).round().astype(int)]
    if not len(added):
        return times
    words = f"{times.description}, and {len(added)} more where the motion is fast"
    return Times(np.union1d(times.times, added), words)
