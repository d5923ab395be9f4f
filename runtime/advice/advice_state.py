"""What is known while an advice is made: the question, the bench, and what was told so far."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from mstmm.errors import MstmmError

from ..chart.chart_points import Setting
from ..chart.error_measure import Places
from ..chart.model_levels import with_model_level
from ..chart.time_budget import Budget, OutOfTime
from ..chart.trial_run import Runs
from ..integrate.steppers import AUTO
from ..result.flexible.risks import MAX_SLOPE
from .error_predictors import ErrorPrediction, predict_errors
from .request import Request
from .trial_models import first_rtol

if TYPE_CHECKING:
    from mstmm.scene import Scene

    from ..model.model import Model
    from ..result.error_measure import Measure
    from ..result.result import Result
    from .body_model_levels import Bodies, BodyModel
    from .measure_renaming import Renaming
    from .trial_models import Compile, Tell, TrialRunner

#: A model may err by this part of what is asked; the rest is for the integration, and for what lies
#: between the samples.
_ENOUGH = 0.9

#: A one-way run may take this part of the budget.
_FIRST = 0.3

#: Models are judged beside the error of the reference's own parts where that leaves this part of
#: what is asked.
_LEFT = 0.3

#: Name of the richest model, with which others are compared.
RICHEST = "the richest model"


@dataclass
class AdviceState:
    """The state of one advice.

    Attributes:
        scene, asked, budget, compile, tell: what it is about.
        measure, length, size: of errors; of the scene, m; of the motion, in the unit of errors.
        bench: where models are run.
        whole: body -> what it is at its richest, as the scene has it.
        bodies: the flexible bodies of the scene that is reduced.
        notes: what else there is to know.
        told: name of a model -> what became of its hinges and beams.
        parts: beam that is a part -> the beam of the scene.
        unseen: error of the reference's own parts.
        split_error: seen of one frame where beams stay whole; None where nothing was seen.
        skipped: models and changes that the budget left no time for.
    """

    scene: Scene
    asked: Request
    budget: Budget
    compile: Compile
    tell: Tell
    measure: Renaming = field(init=False)
    length: float = 1.0
    size: float = 1.0
    bench: TrialRunner = field(init=False)
    whole: dict[str, BodyModel] = field(default_factory=dict)
    bodies: Bodies = field(init=False)
    notes: list[str] = field(default_factory=list)
    told: dict[str, tuple[str, ...]] = field(default_factory=lambda: {RICHEST: ()})
    parts: Mapping[str, str] = field(default_factory=dict)
    unseen: float = 0.0
    split_error: float | None = None
    skipped: list[str] = field(default_factory=list)

    def least(self, scene: Scene) -> Result | None:
        """The run in which all bodies respond one way, or none deform; None where there is none."""
        self.tell("one-way, before anything else")
        times = np.linspace(0.0, self.asked.t_end, self.asked.samples)
        runs = Runs(self.asked.t_end, times, self.budget)
        setting = Setting(AUTO, "one-way", first_rtol(self.asked.error))
        try:
            model = self.compile(with_model_level(scene, "one-way"))
            return runs.simulate(model, setting, _FIRST * self.budget.left())[0]
        except (OutOfTime, MstmmError, ArithmeticError, np.linalg.LinAlgError):
            return None

    def known(self, first: Result | None, richest: Model) -> tuple[dict[str, ErrorPrediction], str]:
        """The evidence of a one-way run, of one of the richest model where there is none, and why
        there is none at all."""
        evidence, why = predict_errors(first, self.length)
        if evidence or not richest.flexible:
            return evidence, why
        setting = Setting(AUTO, RICHEST, self.bench.rtol)
        limit = _FIRST * self.budget.left()
        try:
            result, _ = self.bench.runs.simulate(richest, setting, limit)
        except (OutOfTime, MstmmError, ArithmeticError, np.linalg.LinAlgError) as problem:
            return {}, why or str(problem)
        return predict_errors(result, self.length)

    @property
    def in_measure(self) -> float:
        """What turns a displacement in m into the unit of errors."""
        if isinstance(self.measure.inner, Places):
            return 1.0 / self.length
        return 1.0 if self.measure.unit == "m" else self.size / self.length

    @property
    def enough(self) -> float:
        """The error against the reference that suffices for a model."""
        return _ENOUGH * self.beside_unseen

    @property
    def beside_unseen(self) -> float:
        """What is left of the error asked beside the reference's own, where that leaves any."""
        rest = self.asked.error - self.unseen
        return rest if rest > _LEFT * self.asked.error else self.asked.error

    @property
    def part(self) -> float:
        """The error asked in parts of the motion."""
        return (
            self.asked.error
            if self.measure.unit in ("1", "rad")
            else (self.asked.error / self.size)
        )

    def steep(self, known: ErrorPrediction | None) -> bool:
        """Whether one floating frame may be too little for a body."""
        if known is None:
            return False
        return known.frame_error * self.in_measure > self.asked.error or known.slope > MAX_SLOPE


def size_of(measure: Measure, result: Result | None) -> float:
    """How far what is compared goes in a run; 1 where that is not known."""
    if result is None or not result.is_comparable:
        return 1.0
    numbers = measure.read(result)
    measure.scale_by(numbers)
    start = np.broadcast_to(numbers[:1], numbers.shape)
    far = float(measure.apart(numbers, start).max(initial=0.0))
    return far if np.isfinite(far) and far > 0 else 1.0
