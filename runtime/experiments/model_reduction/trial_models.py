"""Trial runs of models, compared with the richest model over the whole run or a window."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, cast

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import MstmmError, NumericalFailure
from mstmm.numerics.rotations import Vector
from mstmm.scene import Scene

from ...integrate.steppers import AUTO
from ..error_measure import Measure
from ..reference import agreeing_runs
from ..runs import Budget, Compile, Report, Runs
from ..trial import Setting, Trial, max_error
from ..tuning import REDUCTION as TUNING
from .scene_edits import rename_reference

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene
    from ...result.quantity_names import Quantity
    from ...result.result_record import Record
    from ..simulation import SimulatedScene


@dataclass(frozen=True)
class ComparisonWindow:
    """Time span over which models are compared.

    Attributes:
        t_end: end of the window or of the whole run, s.
        whole_t_end: end of the run that the advice is for, s.
        rise: ratio of the largest deflection of bodies in the run to that in the window.
    """

    t_end: float
    whole_t_end: float
    rise: float = 1.0

    @property
    def is_whole_run(self) -> bool:
        """Whether the whole run is compared."""
        return self.t_end >= self.whole_t_end

    @property
    def growth(self) -> float:
        """Factor on errors of a window: ratio of the times, and of the deflections."""
        return self.whole_t_end / self.t_end * self.rise

    def __str__(self) -> str:
        if self.is_whole_run:
            return f"the whole run of {self.whole_t_end:g} s"
        span = f"the first {self.t_end:.3g} s of {self.whole_t_end:g} s"
        return f"{span}, errors times {self.growth:.3g}"


@dataclass(frozen=True)
class TrialResult:
    """Result of the trial of a model.

    Attributes:
        name: description of the model.
        scene: scene of the model.
        model: compiled model; None if it could not be compiled or its run failed.
        error: error relative to the richest model, over the whole run; inf if it failed.
        cpu_s: CPU time of the run, s.
        reason: reason of the failure, else "".
    """

    name: str
    scene: Scene
    model: SimulatedScene | None
    error: float
    cpu_s: float
    reason: str = ""

    @property
    def compiled_model(self) -> SimulatedScene:
        """Compiled model of a trial that did not fail."""
        assert self.model is not None
        return self.model


def choose_window(
    model: SimulatedScene, t_end: float, samples: int, budget: Budget, measure: Measure, rtol: float
) -> ComparisonWindow:
    """Select the whole run, or a window if runs of the reference exceed their time limit.

    Raises NumericalFailure if the model cannot be simulated.
    """
    probe_end = TUNING.probe_fraction * t_end
    runs = Runs(probe_end, np.linspace(0.0, probe_end, samples), budget)
    limit = budget.remaining() * TUNING.reference_budget
    begin = budget.clock()
    trial = runs.trial(model, Setting(AUTO, "", rtol), measure, limit)
    spent = max(budget.clock() - begin, 1e-9)
    if trial.late:
        raise NumericalFailure(
            f"the richest model needs more than {limit:.3g} s for {probe_end:.3g} s, "
            "a twentieth of the run; give a larger --budget or an earlier end time"
        )
    if trial.numbers is None:
        raise NumericalFailure(trial.failure)
    cost = 3.0 * spent / TUNING.probe_fraction  # two runs, one of them tighter
    if cost <= TUNING.reference_budget * budget.remaining():
        return ComparisonWindow(t_end, t_end)
    fraction = TUNING.window_budget * budget.remaining() / cost
    return ComparisonWindow(max(min(fraction, 1.0), TUNING.probe_fraction) * t_end, t_end)


@dataclass
class TrialRunner:
    """Runner of trial models: compares them with the reference, and keeps the results.

    Attributes:
        span: compared time span.
        samples: number of times at which models are compared.
        budget: time limit.
        measure: error measure, scaled by the reference.
        compile: function that compiles a scene.
        report: callback with a sentence before every run.
        rtol: relative tolerance of trial runs.
        names: former names of bodies and ends -> names in the scene of the reference.
        reference: run of the richest model.
        floor: difference of two runs of the richest model.
        late: models that exceeded their time limit.
        runs: runs over the time span.
    """

    span: ComparisonWindow
    samples: int
    budget: Budget
    measure: Renaming
    compile: Compile
    report: Report
    rtol: float = TUNING.loosest_rtol
    names: Mapping[str, str] = field(default_factory=dict)
    reference: Trial = field(init=False)
    floor: float = 0.0
    late: list[str] = field(default_factory=list)
    _results: dict[str, TrialResult] = field(default_factory=dict)

    def __post_init__(self) -> None:
        times = np.linspace(0.0, self.span.t_end, self.samples)
        self.runs = Runs(self.span.t_end, times, self.budget)

    def make_reference(
        self, scene: Scene, model: SimulatedScene, name: str, asked: float, part: float
    ) -> TrialResult:
        """Run the richest model with tighter tolerances until two runs agree.

        `asked` is the target error, `part` relative to the size of the motion.  Raises
        NumericalFailure if they do not agree.
        """

        def difference(run: Trial, tighter: Trial) -> float:
            self.measure.set_scales(tighter.values)
            return self.distance(run, tighter)

        run, best = agreeing_runs(
            partial(self._run_richest, model, name), initial_rtol(part), difference, asked
        )
        self.rtol, self.reference, self.floor = run.setting.value, best.trial, best.error
        return replace(self._store_result(name, scene, model, run), error=best.error)

    def finer(self, scene: Scene, names: Mapping[str, str], name: str) -> Trial:
        """Run a model that is richer than the richest one, such as one with split beams.

        `names` are its names of bodies and ends.  Raises MstmmError if it cannot be compiled; a
        failure of the run is part of the trial.
        """
        return self._trial(name, scene, names)[1]

    def _trial(
        self, name: str, scene: Scene, names: Mapping[str, str],
        still: Mapping[str, Vector] | None = None,
    ) -> tuple[SimulatedScene, Trial]:  # fmt: skip
        """Compiled model of a scene, and its run."""
        self.report(name)
        model = self.compile(scene)
        self.measure.register(model, names, still)
        limit = self.budget.remaining() * TUNING.model_budget
        setting = Setting(AUTO, name, self.rtol)
        return model, self.runs.trial(model, setting, self.measure, limit)

    def distance(self, a: Trial, b: Trial) -> float:
        """Difference of two runs, extrapolated to the whole run; inf if unknown."""
        return max_error(a, b, self.measure)[0] * self.span.growth

    def use_as_reference(self, trial: Trial, names: Mapping[str, str]) -> None:
        """Use another run as the reference, with its names of bodies and ends; drop all results."""
        self.reference, self.names = trial, names
        self.measure.set_scales(trial.values)
        self._results.clear()

    def run_trial(
        self, name: str, scene: Scene, names: Mapping[str, str] | None = None,
        still: Mapping[str, Vector] | None = None,
    ) -> TrialResult:  # fmt: skip
        """Result of the trial of a scene, run once per name.

        `names`: former name of a body or end -> its name in the scene, by default as in the scene
        of the reference; `still`: name -> fixed position on the ground, m.
        """
        if name in self._results:
            return self._results[name]
        try:
            model, trial = self._trial(name, scene, self.names if names is None else names, still)
        except MstmmError as problem:
            failed = TrialResult(name, scene, None, math.inf, math.inf, str(problem))
            return self._results.setdefault(name, failed)
        if trial.late:
            self.late.append(name)
        return self._store_result(name, scene, model, trial)

    @property
    def results(self) -> tuple[TrialResult, ...]:
        """Results of all trials, in their order."""
        return tuple(self._results.values())

    def _store_result(
        self, name: str, scene: Scene, model: SimulatedScene, trial: Trial
    ) -> TrialResult:
        """Keep the result of a trial; of a short run the smallest of several CPU times."""
        if trial.numbers is None:
            tried = TrialResult(name, scene, None, math.inf, trial.cpu_s, trial.failure)
        else:
            error, reason = max_error(trial, self.reference, self.measure)
            cpu_s, left, calls = trial.cpu_s, self.budget.remaining(), TUNING.repeats - 1
            if cpu_s < TUNING.short_run:
                cpu_s = min(cpu_s, self.runs.cpu_s(model, trial.setting, left, calls) or cpu_s)
            tried = TrialResult(name, scene, model, error * self.span.growth, cpu_s, reason)
        self._results[name] = tried
        return tried

    def is_as_cheap(self, one: TrialResult, other: TrialResult) -> bool:
        """Whether a model is not slower than another, within the scatter of timings.

        If it seems slower, both are timed again in turn: other processes may have delayed it.
        """
        pair, times = (one, other), [one.cpu_s, other.cpu_s]
        for _ in range(TUNING.retimings):
            is_as_cheap = times[0] <= TUNING.equal_time_ratio * times[1]
            if is_as_cheap or not max(times) < TUNING.retimed_below:
                break
            for k, tried in enumerate(pair):
                setting = Setting(AUTO, tried.name, self.rtol)
                spent = self.runs.cpu_s(tried.compiled_model, setting, self.budget.remaining())
                if spent is None:
                    return False
                times[k] = min(times[k], spent)
        return times[0] <= TUNING.equal_time_ratio * times[1]

    def _run_richest(self, model: SimulatedScene, name: str, rtol: float) -> Trial:
        """Run the richest model; NumericalFailure if the run fails."""
        limit = self.budget.remaining() * 2 * TUNING.reference_budget
        self.report(f"{name}, rtol {rtol:.0e}")
        trial = self.runs.trial(model, Setting(AUTO, name, rtol), self.measure, limit)
        if trial.numbers is None:
            remedy = "; give a larger --budget" if trial.late else ""
            raise NumericalFailure(f"{name}: {trial.failure}{remedy}")
        return trial


def initial_rtol(part: float) -> float:
    """First relative tolerance for a target error relative to the size of the motion."""
    return min(max(TUNING.rtol_fraction * part, 100 * TUNING.tightest_rtol), TUNING.loosest_rtol)


# --- measure of models in which bodies and ends have other names ----------------------------------


class Renaming(Measure):
    """Error measure that reads results of renamed models by the former names."""

    def __init__(self, inner: Measure) -> None:
        self.measure = inner
        self.name, self.unit, self.scaling = inner.name, inner.unit, inner.scaling
        self._renamings: dict[
            int, tuple[CompiledScene, Mapping[str, str], Mapping[str, Vector]]
        ] = {}

    def register(
        self,
        model: CompiledScene,
        names: Mapping[str, str],
        still: Mapping[str, Vector] | None = None,
    ) -> None:
        """Register the names of a model: former name -> new name, or -> fixed position (3,), m."""
        self._renamings[id(model)] = (model, names, still or {})

    def names_of(self, model: CompiledScene) -> Mapping[str, str]:
        """Names of a model: former name -> new name."""
        return self._renamings[id(model)][1] if id(model) in self._renamings else {}

    def read(self, result: Record) -> Array:
        """Measured values (n, k) of a run at its samples."""
        if id(result.model) not in self._renamings:
            return self.measure.read(result)
        _, names, still = self._renamings[id(result.model)]
        return self.measure.read(cast("Record", _RenamedRecord(result, names, still)))

    def distance(self, a: Array, b: Array) -> Array:
        """Distances (n,) between two sets of measured values."""
        return self.measure.distance(a, b)

    def set_scales(self, numbers: Array) -> None:
        """Scale relative errors by the measured values of the reference."""
        self.measure.set_scales(numbers)


class _RenamedRecord:
    """Positions and quantities of a result, by the former names."""

    def __init__(
        self, result: Record, names: Mapping[str, str], still: Mapping[str, Vector]
    ) -> None:
        self._result, self._names, self._fixed_points = result, names, still

    def position(self, name: str) -> Array:
        if name in self._fixed_points:
            return np.tile(self._fixed_points[name], (len(self._result.t), 1))
        return self._result.position(rename_reference(name, self._names))

    def quantity(self, name: str) -> Quantity:
        return self._result.quantity(rename_reference(name, self._names))
