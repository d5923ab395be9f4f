"""Search for the cheapest sufficient models of the flexible bodies.

Each body starts with the smallest model that suffices by its error estimate.  If the scene does not
suffice then, the bodies with the largest estimates get richer models; if it does, smaller models
are tried for each body until none suffices.  The richest model always suffices.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

from ..tuning import REDUCTION as TUNING
from .body_models import (
    LINEAR,
    ONE_WAY,
    RIGID,
    STIFFENED,
    VIBRATION,
    Bodies,
    BodyModel,
    ErrorPrediction,
)
from .trial_models import TrialResult, TrialRunner

Choices = dict[str, BodyModel]


@dataclass
class ModelSearch:
    """Search over the models of the flexible bodies of one scene.

    Attributes:
        bodies: the flexible bodies.
        runner: runner of trial models.
        evidence: error estimates by body.
        allowed_error: allowed error.
        error_per_metre: factor from m to the unit of errors.
        has_time_left: whether there is time for more trials.
        failed_models: (body, model) that were tried without success.
        choices_by_name: name of a scene model -> its choices.
        out_of_time: whether the time limit has been reached.
        skipped: bodies whose smaller models were not tried for lack of time.
    """

    bodies: Bodies
    runner: TrialRunner
    evidence: Mapping[str, ErrorPrediction]
    allowed_error: float
    error_per_metre: float
    has_time_left: Callable[[], bool]
    failed_models: set[tuple[str, BodyModel]] = field(default_factory=set)
    choices_by_name: dict[str, Choices] = field(default_factory=dict)
    out_of_time: bool = False
    skipped: list[str] = field(default_factory=list)

    def run(self) -> tuple[Choices, TrialResult]:
        """Run the search; return the models of the bodies and the trial of the scene."""
        choices, tried = self._enlarge()
        return self._reduce(choices, tried)

    def expected_error(self, name: str, choice: BodyModel) -> float | None:
        """Estimated error of a model of one body; None without estimate."""
        prediction = self.evidence.get(name)
        return None if prediction is None else prediction.error(choice) * self.error_per_metre

    def try_choices(self, choices: Mapping[str, BodyModel]) -> TrialResult:
        """Trial of the scene with these models of its bodies."""
        name = self.name(choices)
        self.choices_by_name[name] = dict(choices)
        return self.runner.run_trial(name, self.bodies.scene_of(choices))

    def name(self, choices: Mapping[str, BodyModel]) -> str:
        """Description of the scene; bodies with the same model are listed together."""
        bodies_by_model: dict[str, list[str]] = {}
        for body, choice in choices.items():
            bodies_by_model.setdefault(str(choice), []).append(body)
        return "; ".join(
            f"{', '.join(bodies)}: {model}" for model, bodies in bodies_by_model.items()
        )

    # --- richer models ------------------------------------------------------------------------

    def _enlarge(self) -> tuple[Choices, TrialResult]:
        """Make bodies richer until the scene suffices."""
        choices = {name: self._initial_choice(name) for name in self.bodies.richest}
        while True:
            tried = self.try_choices(choices)
            if tried.error <= self.allowed_error or choices == self.bodies.richest:
                return choices, tried
            if not self._has_time():
                self.skipped = list(choices)
                return dict(self.bodies.richest), self.try_choices(self.bodies.richest)
            choices = self.richer(choices)

    def _initial_choice(self, name: str) -> BodyModel:
        """The smallest model that is expected to suffice."""
        limit = TUNING.sufficient_estimate * self.allowed_error / len(self.bodies.richest)
        for choice in self._choices_upward(name):
            estimate = self.expected_error(name, choice)
            if estimate is not None and estimate <= limit and self._is_valid(name, choice):
                return choice
        return self.bodies.richest[name]

    def _is_valid(self, name: str, choice: BodyModel) -> bool:
        """Whether a level is valid: linear kinematics may diverge for a body stiffened by loads."""
        prediction = self.evidence.get(name)
        is_linear = choice.level in (ONE_WAY, LINEAR)
        return prediction is None or not is_linear or not prediction.stiffens

    def _choices_upward(self, name: str) -> Iterator[BodyModel]:
        """Models from the smallest to the richest; shapes with the largest deflection come first.

        One-way coupling is not included: only a run shows whether it is cheaper.
        """
        richest = self.bodies.richest[name]
        yield BodyModel(RIGID)
        for shapes in self._shape_counts_upward(name):
            if self.bodies.has_linear_model(name):
                yield BodyModel(LINEAR, shapes)
            if richest.level == STIFFENED:
                yield BodyModel(STIFFENED, shapes)

    def _shape_counts_upward(self, name: str) -> Iterator[tuple[tuple[str, int], ...]]:
        richest = self.bodies.richest[name]
        counts = dict(richest.shapes)
        if VIBRATION in counts:
            yield from (((VIBRATION, n),) for n in range(counts[VIBRATION] + 1))
            return
        model = BodyModel(STIFFENED)
        while model.shapes != richest.shapes:
            present = dict(model.shapes)
            deflections = {
                direction: self._next_shape_deflection(name, direction, present.get(direction, 0))
                for direction, max_count in counts.items()
                if present.get(direction, 0) < max_count
            }
            direction = max(deflections, key=lambda key: deflections[key])
            model = model.with_count(direction, present.get(direction, 0) + 1)
            yield model.shapes

    def _next_shape_deflection(self, name: str, direction: str, count: int) -> float:
        """Deflection by the next shape after `count` shapes in a direction, m.

        Without estimate a rank: few shapes first, bending before twist and axial shapes.
        """
        prediction = self.evidence.get(name)
        if prediction is None:
            return -count - (0.5 if direction in ("twist", "axial") else 0.0)
        return prediction.by_shape.get(f"{direction}{count + 1}", 0.0)

    def richer(self, choices: Choices) -> Choices:
        """Choices with richer models of the bodies with the largest estimated errors."""
        candidates = {name for name in choices if choices[name] != self.bodies.richest[name]}
        estimates = {name: self.expected_error(name, choices[name]) for name in candidates}
        errors = {name: math.inf if error is None else error for name, error in estimates.items()}
        max_error = max(errors.values())
        richer = dict(choices)
        for name, error in errors.items():
            if error >= TUNING.joint_fraction * max_error:
                richer[name] = self._next_choice(name, choices[name])
        return richer

    def _next_choice(self, name: str, choice: BodyModel) -> BodyModel:
        """The next model with a smaller estimated error; the richest if there is none."""
        models = list(self._choices_upward(name))
        current = self.expected_error(name, choice)
        for model in models[models.index(choice) + 1 :] if choice in models else ():
            estimate = self.expected_error(name, model)
            limit = math.inf if current is None else TUNING.sufficient_estimate * current
            if (estimate is None or estimate < limit) and self._is_valid(name, model):
                return model
        return self.bodies.richest[name]

    # --- smaller models -----------------------------------------------------------------------

    def _reduce(self, choices: Choices, best: TrialResult) -> tuple[Choices, TrialResult]:
        """Make bodies smaller, most shapes first, while the scene suffices and is not slower."""
        order = sorted(choices, key=lambda name: -choices[name].total)
        for k, name in enumerate(order):
            is_reduced = True
            while is_reduced:
                is_reduced = False
                for choice in self._smaller_choices(name, choices[name]):
                    estimate = self.expected_error(name, choice)
                    is_one_way = choice.level == ONE_WAY
                    factor = TUNING.max_one_way_estimate if is_one_way else TUNING.max_estimate
                    if estimate is not None and estimate > factor * self.allowed_error:
                        continue
                    if (name, choice) in self.failed_models:
                        continue
                    if not self._has_time():
                        self.skipped = self.skipped or order[k:]
                        return choices, best
                    smaller = {**choices, name: choice}
                    tried = self.try_choices(smaller)
                    if tried.error <= self.allowed_error and self.runner.is_as_cheap(tried, best):
                        choices, best, is_reduced = smaller, tried, True
                        break
                    self.failed_models.add((name, choice))
        return choices, best

    def _smaller_choices(self, name: str, choice: BodyModel) -> Iterator[BodyModel]:
        """Models smaller than a given one, the smallest first."""
        if choice.level == RIGID:
            return
        yield BodyModel(RIGID)
        if choice.level == ONE_WAY:
            return
        has_linear = self.bodies.has_linear_model(name)
        if has_linear:
            # All shapes: their oscillators are computed after the run, at negligible cost.
            yield BodyModel(ONE_WAY, self.bodies.richest[name].shapes)
        for direction, n in reversed(choice.shapes):
            for count in sorted({0, n // 2, max(n - 1, 0)} - {n}):
                smaller = choice.with_count(direction, count)
                if smaller.total or direction == VIBRATION:
                    yield smaller
        if choice.level == STIFFENED and has_linear:
            yield BodyModel(LINEAR, choice.shapes)

    def _has_time(self) -> bool:
        if not self.has_time_left():
            self.out_of_time = True
        return not self.out_of_time
