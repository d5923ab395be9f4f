"""State of the search for the smallest model: request, runner of trials, results so far."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import finite_float, integer, positive_float
from mstmm.errors import MstmmError, SceneError

from ...integrate.steppers import AUTO
from ...result.checks.flexible import MAX_SLOPE
from ..error_measure import PositionMeasure
from ..model_levels import exact_beam_names, with_model_level
from ..runs import Budget, Runs
from ..trial import Setting
from ..tuning import REDUCTION as TUNING
from .body_models import ErrorPrediction, predict_errors
from .trial_models import initial_rtol

if TYPE_CHECKING:
    from mstmm.scene import Scene

    from ...result.result import Result
    from ..error_measure import Measure
    from ..runs import Compile, Report
    from ..simulation import SimulatedScene
    from .body_models import Bodies, BodyModel
    from .trial_models import Renaming, TrialRunner


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
        """Run with one-way coupling of all flexible bodies; None if it fails or does not exist."""
        if exact_beam_names(scene):
            return None
        self.report("one-way coupling, for error estimates")
        times = np.linspace(0.0, self.request.t_end, self.request.samples)
        runs = Runs(self.request.t_end, times, self.budget)
        setting = Setting(AUTO, "one-way", initial_rtol(self.request.error))
        try:
            model = self.compile(with_model_level(scene, "one-way"))
        except (MstmmError, ArithmeticError, np.linalg.LinAlgError):
            return None
        limit = TUNING.one_way_budget * self.budget.remaining()
        return runs.try_simulate(model, setting.options, limit)[0]

    def error_predictions(
        self, one_way: Result | None, richest: SimulatedScene
    ) -> tuple[dict[str, ErrorPrediction], str]:
        """Error estimates by body from a run with one-way coupling, and why there are none, or "".

        Without such a run, they come from a run of the richest model.
        """
        evidence, reason = predict_errors(one_way, self.length)
        if evidence or not richest.flexible_bodies:
            return evidence, reason
        setting = Setting(AUTO, RICHEST, self.runner.rtol)
        limit = TUNING.one_way_budget * self.budget.remaining()
        result, failure = self.runner.runs.try_simulate(richest, setting.options, limit)
        if result is None:
            return {}, reason or failure
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
        return TUNING.model_error * self.remaining_target

    @property
    def remaining_target(self) -> float:
        """Target error less the error of the reference, if enough of it remains."""
        target = self.request.error
        remainder = target - self.reference_error
        return remainder if remainder > TUNING.min_remainder * target else target

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


@dataclass(frozen=True)
class Request:
    """Validated arguments of `mstmm.advise`."""

    t_end: float
    error: float
    of: tuple[str, ...]
    budget: float
    samples: int
    rounds: int


def advice_request(
    t_end: float, error: float, of: str | Sequence[str], budget: float, samples: int, rounds: int
) -> Request:
    """Validate the arguments of `mstmm.advise`; SceneError names the first invalid one."""
    quantities = (of,) if isinstance(of, str) else of
    if not isinstance(quantities, Sequence) or not all(isinstance(x, str) for x in quantities):
        raise SceneError(f"of = {of!r:.60}: expected the name of a quantity, or a list of names")
    target_error = finite_float("error", error, "an error above 0")
    is_relative = len(quantities) != 1  # a single quantity has a unit, and no upper limit
    if not target_error > 0 or (is_relative and target_error >= 1):
        limits = "above 0 and below 1" if is_relative else "above 0, in the unit of the quantity"
        raise SceneError(f"error = {target_error:g}: expected an error {limits}, such as 1e-3")
    return Request(
        positive_float("t_end", t_end, "a time in s"), target_error, tuple(quantities),
        positive_float("budget", budget, "a time in s"),
        integer("samples", samples, 2, "a whole number of samples, 2 or more"),
        integer("rounds", rounds, 0, "a whole number of rounds, 0 or more"),
    )  # fmt: skip
