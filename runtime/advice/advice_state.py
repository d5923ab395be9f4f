"""State of the search for the smallest model: request, runner of trials, results so far."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from mstmm.errors import MstmmError

from ..chart.chart_points import Setting
from ..chart.error_measure import PositionMeasure
from ..chart.model_levels import with_model_level
from ..chart.time_budget import Budget, OutOfTime
from ..chart.trial_run import Runs
from ..integrate.steppers import AUTO
from ..result.flexible.risks import MAX_SLOPE
from .error_predictors import ErrorPrediction, predict_errors
from .request import Request
from .trial_models import initial_rtol

if TYPE_CHECKING:
    from mstmm.scene import Scene

    from ..model.model import Model
    from ..result.error_measure import Measure
    from ..result.result import Result
    from .body_model_levels import Bodies, BodyModel
    from .measure_renaming import Renaming
    from .trial_models import Compile, Report, TrialRunner

#: Largest error of a model as a fraction of the target error; the rest is for the integration, and
#: for times between the samples.
_MODEL_ERROR = 0.9

#: Fraction of the budget for a run with one-way coupling.
_ONE_WAY_BUDGET = 0.3

#: The error of a split reference is subtracted from the target error if at least this fraction of
#: the target error remains.
_MIN_REMAINDER = 0.3

#: Name of the richest model, which all others are compared with.
RICHEST = "the richest model"


@dataclass
class AdviceState:
    """State of the search for one advice.

    Attributes:
        scene: given scene.
        request: validated arguments.
        budget: time limit.
        compile: function that compiles a scene.
        report: callback with a sentence before every run.
        measure: error measure.
        length: length of the scene, m.
        size: size of the motion, in the unit of errors.
        runner: runner of trial models.
        unsplit_models: body -> its richest model in the scene, without splitting.
        bodies: flexible bodies of the scene that is reduced.
        notes: limits of the advice, a sentence each.
        change_texts: name of a model -> sentences on the changes of its hinges and beams.
        parts: part of a split beam -> beam of the given scene.
        reference_error: estimated error of the reference itself, by the number of its parts.
        split_error: measured error of one frame where beams are not split; None if not measured.
        skipped: models and changes that were skipped for lack of time.
    """

    scene: Scene
    request: Request
    budget: Budget
    compile: Compile
    report: Report
    measure: Renaming = field(init=False)
    length: float = 1.0
    size: float = 1.0
    runner: TrialRunner = field(init=False)
    unsplit_models: dict[str, BodyModel] = field(default_factory=dict)
    bodies: Bodies = field(init=False)
    notes: list[str] = field(default_factory=list)
    change_texts: dict[str, tuple[str, ...]] = field(default_factory=lambda: {RICHEST: ()})
    parts: Mapping[str, str] = field(default_factory=dict)
    reference_error: float = 0.0
    split_error: float | None = None
    skipped: list[str] = field(default_factory=list)

    def run_one_way(self, scene: Scene) -> Result | None:
        """Run with one-way coupling of all flexible bodies; None if it fails."""
        self.report("one-way coupling, for error estimates")
        times = np.linspace(0.0, self.request.t_end, self.request.samples)
        runs = Runs(self.request.t_end, times, self.budget)
        setting = Setting(AUTO, "one-way", initial_rtol(self.request.error))
        try:
            model = self.compile(with_model_level(scene, "one-way"))
            return runs.simulate(model, setting, _ONE_WAY_BUDGET * self.budget.remaining())[0]
        except (OutOfTime, MstmmError, ArithmeticError, np.linalg.LinAlgError):
            return None

    def error_predictions(
        self, one_way: Result | None, richest: Model
    ) -> tuple[dict[str, ErrorPrediction], str]:
        """Error estimates by body from a run with one-way coupling, and why there are none, or "".

        Without such a run, they come from a run of the richest model.
        """
        evidence, reason = predict_errors(one_way, self.length)
        if evidence or not richest.flexible_bodies:
            return evidence, reason
        setting = Setting(AUTO, RICHEST, self.runner.rtol)
        limit = _ONE_WAY_BUDGET * self.budget.remaining()
        try:
            result, _ = self.runner.runs.simulate(richest, setting, limit)
        except (OutOfTime, MstmmError, ArithmeticError, np.linalg.LinAlgError) as problem:
            return {}, reason or str(problem)
        return predict_errors(result, self.length)

    @property
    def error_per_metre(self) -> float:
        """Factor from a displacement in m to the unit of errors."""
        if isinstance(self.measure.measure, PositionMeasure):
            return 1.0 / self.length
        return 1.0 if self.measure.unit == "m" else self.size / self.length

    @property
    def error_budget(self) -> float:
        """Largest sufficient error of a model relative to the reference."""
        return _MODEL_ERROR * self.remaining_target

    @property
    def remaining_target(self) -> float:
        """Target error less the error of the reference, if enough of it remains."""
        remainder = self.request.error - self.reference_error
        return remainder if remainder > _MIN_REMAINDER * self.request.error else self.request.error

    @property
    def relative_target(self) -> float:
        """Target error relative to the size of the motion."""
        return (
            self.request.error
            if self.measure.unit in ("1", "rad")
            else (self.request.error / self.size)
        )

    def may_need_splitting(self, prediction: ErrorPrediction | None) -> bool:
        """Whether one floating frame may not suffice for a body."""
        if prediction is None:
            return False
        return (
            prediction.frame_error * self.error_per_metre > self.request.error
            or prediction.slope > MAX_SLOPE
        )


def motion_size(measure: Measure, result: Result | None) -> float:
    """Largest distance from the start in a run, by the error measure; 1 if unknown."""
    if result is None or not result.is_comparable:
        return 1.0
    numbers = measure.read(result)
    measure.set_scales(numbers)
    start = np.broadcast_to(numbers[:1], numbers.shape)
    distance = float(measure.distance(numbers, start).max(initial=0.0))
    return distance if np.isfinite(distance) and distance > 0 else 1.0
