"""From a model to its chart: reference, levels of model, settings, rounds."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array, finite_float, integer
from mstmm.defaults import CHART_SAMPLES
from mstmm.errors import MstmmError, SceneError
from mstmm.scene import Scene

from ..integrate.steppers import AUTO
from ..result.error_measure import Measure
from .chart import Chart
from .chart_points import Level, Reference, Setting, Skipped
from .error_measure import measure_of
from .error_times import even, refine_times
from .method_families import PROMISING, checked_methods, without_twins
from .method_survey import Curve, Survey, curve
from .model_levels import Variant, ladder
from .pareto_front import bound_errors, split_warnings
from .planar_model import planar
from .reference_solution import Converged, Tell, compute_reference
from .repeated_timing import repeat_timings
from .time_budget import EARLY, REFERENCE, SETTINGS, Budget
from .trial_run import Runs, Trial, error_of, warnings_of

if TYPE_CHECKING:
    from ..model.model import Model

#: Relative tolerance of the runs, by the choice among methods, for the levels' own errors.
_TIGHT = 1e-8
#: Relative tolerance of the run whose steps tell how fast the motion is.
_SCOUT = 1e-6
#: Coordinates that change by less than this, in m and rad or of their own size, do not move.
_STILL = 1e-12
#: Levels with errors below this many times that tolerance are run as the reference was.
_GOOD = 1e3
#: Part of the budget by which the levels' own errors are to be found.
_LEVELS = 0.45
#: Why there is but one level.
_NO_MODELS = (
    "no models to compare: the scene has no flexible bodies, and no hinge that a motion in a plane "
    "would make smaller"
)
#: The name of the only level of a chart without levels of model.
AS_GIVEN = "as given"


@dataclass(frozen=True)
class ChartRequest:
    """What was asked for, checked."""

    t_end: float
    quantities: tuple[str, ...]
    methods: tuple[str, ...]
    models: bool
    error: float
    budget: float
    samples: int
    fixed: bool
    rounds: int


def request(
    t_end: float, quantities: Sequence[str], methods: Sequence[str] | None, models: bool,
    error: float, budget: float, samples: int | None, rounds: int,
) -> ChartRequest:  # fmt: skip
    """SceneError naming the first argument that makes no sense."""
    if isinstance(quantities, str) or isinstance(methods, str):
        raise SceneError('quantities and methods: expected lists of names, as in ["tip.position"]')
    return ChartRequest(
        _above_zero("t_end", t_end, "a time in s"), tuple(quantities), checked_methods(methods),
        bool(models), _above_zero("error", error, "an error"),
        _above_zero("budget", budget, "a time in s"),
        integer(
            "samples", CHART_SAMPLES if samples is None else samples, 2,
            "a whole number of samples, 2 or more",
        ),
        samples is not None,
        integer("rounds", rounds, 0, "a whole number of rounds, 0 or more"),
    )  # fmt: skip


def _above_zero(name: str, value: float, what: str) -> float:
    found = finite_float(name, value, f"{what} above 0")
    if not found > 0 or not math.isfinite(found):
        raise SceneError(f"{name} = {found:g}: expected {what} above 0")
    return found


def make_chart(
    model: Model, asked: ChartRequest, compile: Callable[[Scene], Model], title: str, tell: Tell,
    state: Callable[[str], None], budget: Budget | None = None,
) -> Chart:  # fmt: skip
    """The chart of a model; `compile` makes models of its other levels.

    `state` hears the plan and what becomes of it, `tell` every step.  Raises SceneError for an
    unknown quantity, NumericalFailure where there is no reference.
    """
    return _Charting(model, asked, compile, tell, state, budget or Budget(asked.budget)).chart(
        title
    )


class _Charting:
    def __init__(
        self, model: Model, asked: ChartRequest, compile: Callable[[Scene], Model], tell: Tell,
        state: Callable[[str], None], budget: Budget,
    ) -> None:  # fmt: skip
        if model.closed is None:
            asked = replace(asked, methods=without_twins(asked.methods))
        self.model, self.asked, self.compile = model, asked, compile
        self.tell, self.state, self.budget = tell, state, budget
        self.times = even(asked.t_end, asked.samples)
        self.runs = Runs(asked.t_end, self.times.at, budget)
        self.left_out: list[Skipped] = []
        self.levels: list[Level] = []

    def chart(self, title: str) -> Chart:
        asked = self.asked
        variants = ladder(self.model.scene) if asked.models else ()
        top = self._top(variants)
        start = top.simulate(0.0, method="dop853")
        measure = measure_of(top, start, asked.quantities, asked.models)
        self.state(self.budget.plan(len(asked.methods) * max(1, len(variants))))
        name = variants[-1].name if variants else AS_GIVEN
        if not asked.fixed:
            self._refine(top, name)
        best = compute_reference(top, name, measure, self.runs, self.tell)
        reference = Reference(
            best.error, best.made_by, name, measure.name, measure.unit, measure.scaling,
            best.run.ended, _still(best.run.q),
        )  # fmt: skip
        self._say(reference)
        curves = self._curves(variants, top, best, measure, reference)
        if reference.still:
            curves = []
        survey = Survey(best.run, measure, self.runs, self.tell)
        survey.make([one for one in curves if one.method in PROMISING], EARLY)
        found = survey.make([one for one in curves if one.method not in PROMISING], SETTINGS)
        points, missed = repeat_timings(
            found.points, found.models, asked.rounds, self.runs, self.tell
        )
        if missed and asked.rounds:
            why = f"{missed} of {len(points)} runs were timed less often than the others, for time"
            self.left_out.append(Skipped("", "", "", why, False))
        own = {
            level.name: level.error
            for level in self.levels
            if level.error is not None and level.name != reference.model
        }
        settled, warned = split_warnings(bound_errors(points, reference, own))
        return Chart(
            title, asked.t_end, len(self.times.at), reference, settled,
            tuple(self.levels), (*self.left_out, *found.left_out), asked.error, asked.budget,
            self.budget.spent, self.times.words,
            (*warnings_of(top.scene), *warned),
        )  # fmt: skip

    def _refine(self, top: Model, name: str) -> None:
        """More times where the motion is faster than even ones; none where that takes too long."""
        self.tell("times at which errors are looked at")
        setting = Setting(AUTO, name, _SCOUT)
        steps = self.runs.steps(top, setting, self.budget.share(REFERENCE))
        if not len(steps):
            return
        self.times = refine_times(even(steps[-1], self.asked.samples), steps)
        self.runs.times = self.times.at

    def _say(self, reference: Reference) -> None:
        """What is known once there is a reference."""
        self.state(f"reference by {reference.made_by}: its own error is {reference.error:.1e}")
        self.state(f"errors are looked at {self.times.words}")
        if reference.ended:
            self.state(f"the runs do not reach {self.asked.t_end:g} s: {reference.ended}")
        if reference.still:
            self.state("nothing moves in this scene: there is nothing to compare")

    def _top(self, variants: Sequence[Variant]) -> Model:
        """The model of the richest level; with others beside it compiled as they are."""
        return self.compile(variants[-1].scene) if variants else self.model

    def _curves(
        self, variants: Sequence[Variant], top: Model, best: Converged, measure: Measure,
        reference: Reference,
    ) -> list[Curve]:  # fmt: skip
        """All methods on all levels, the richest one last."""
        models: list[tuple[str, Model, float | None]] = []
        others = list(variants[:-1])
        if variants and (flat := planar(variants[-1], top, best.run.q)) is not None:
            others.append(flat)
        for variant in others:
            found = self._level(variant, best, measure)
            if found is not None:
                models.append((variant.name, *found))
        if self.asked.models and not others:
            self.left_out.append(Skipped("", "", "", _NO_MODELS, True))
        models.append((reference.model, top, None))
        self.levels.append(Level(reference.model, reference.error, _freedom(top), top.engine))
        return [
            curve(method, level, model, self.asked.t_end, reference.floor, own)
            for method in self.asked.methods
            for level, model, own in models
        ]

    def _level(
        self, variant: Variant, best: Converged, measure: Measure
    ) -> tuple[Model, float | None] | None:
        """The model of a level and its own error; None, with the reason kept, where it does not
        apply."""
        self.tell(f"level {variant.name}")
        try:
            model = self.compile(variant.scene)
            run = self._converged(model, variant.name, best, measure)
        except MstmmError as problem:
            self.left_out.append(Skipped("", variant.name, "", str(problem), True))
            return None
        if run.numbers is None and not run.late:
            self.left_out.append(Skipped("", variant.name, "", run.failure, True))
            return None
        own = "it took too long" if run.late else error_of(run, best.run, measure)
        if isinstance(own, str):
            why = f"no error of its own was found: {own}"
            self.left_out.append(Skipped("", variant.name, "", why, False))
        known = None if isinstance(own, str) else own
        self.levels.append(Level(variant.name, known, _freedom(model), model.engine))
        return model, known

    def _converged(self, model: Model, level: str, best: Converged, measure: Measure) -> Trial:
        """A run of a level whose own error is small beside that of the level; made as the reference
        was where the level is so good that this takes it."""
        limit = self.budget.share(_LEVELS)
        run = self.runs.trial(model, Setting(AUTO, level, _TIGHT), measure, limit)
        if run.numbers is None:
            return run
        error = error_of(run, best.run, measure)
        if isinstance(error, str) or error > _GOOD * _TIGHT:
            return run
        tight = replace(best.run.setting, model=level)
        tighter = self.runs.trial(model, tight, measure, limit)
        return run if tighter.numbers is None else tighter


def _freedom(model: Model) -> int:
    """Its speeds, of a mechanism those that its loops leave."""
    return model.nu if model.closed is None else model.closed.loops.mobility


def _still(q: Array) -> bool:
    """Whether no coordinate (n, nq) moves."""
    return bool((q.max(axis=0) - q.min(axis=0) <= _STILL * np.maximum(1.0, abs(q[0]))).all())
