"""From what is expected to the cheapest choices that were seen to suffice.

Each body begins with the least choice that is expected to suffice.  Where the model made of them
does not, the bodies of which most is expected get richer; where it does, each body is tried with
less, until nothing less suffices.  The richest model always does.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

from .body_model_levels import LINEAR, ONE_WAY, RIGID, STIFFENED, VIBRATION, Bodies, BodyModel
from .error_predictors import ErrorPrediction
from .trial_models import TrialResult, TrialRunner

#: A choice is expected to suffice below this part of what is asked, and is not tried where more
#: than so many times of it is expected; a one-way response, which takes its time, than so many.
_ENOUGH, _HOPELESS, _DOUBTFUL = 0.5, 50.0, 3.0

#: Bodies get richer together where this part of the largest error is expected of them.
_TOGETHER = 0.1

Choices = dict[str, BodyModel]


@dataclass
class ModelSearch:
    """The search over one scene.

    `enough` is the error that suffices, `in_measure` turns metres into the unit of errors;
    `skipped` are the bodies of which less was not tried, as the time had ended.
    """

    bodies: Bodies
    bench: TrialRunner
    evidence: Mapping[str, ErrorPrediction]
    enough: float
    in_measure: float
    time_left: Callable[[], bool]
    failed: set[tuple[str, BodyModel]] = field(default_factory=set)
    made: dict[str, Choices] = field(default_factory=dict)
    out_of_time: bool = False
    skipped: list[str] = field(default_factory=list)

    def run(self) -> tuple[Choices, TrialResult]:
        """The choices, and the model that was made of them."""
        choices, tried = self._climb()
        return self._descend(choices, tried)

    def expected(self, name: str, choice: BodyModel) -> float | None:
        """Error expected of a choice for one body, None where nothing is known."""
        known = self.evidence.get(name)
        return None if known is None else known.error(choice) * self.in_measure

    def tried(self, choices: Mapping[str, BodyModel]) -> TrialResult:
        """The model with these choices."""
        name = self.name(choices)
        self.made[name] = dict(choices)
        return self.bench.tried(name, self.bodies.scene_of(choices))

    def name(self, choices: Mapping[str, BodyModel]) -> str:
        """A model in words; bodies with the same choice together."""
        together: dict[str, list[str]] = {}
        for body, choice in choices.items():
            together.setdefault(str(choice), []).append(body)
        return "; ".join(f"{', '.join(names)}: {what}" for what, names in together.items())

    # --- up -------------------------------------------------------------------------------------

    def _climb(self) -> tuple[Choices, TrialResult]:
        choices = {name: self._first(name) for name in self.bodies.richest}
        while True:
            tried = self.tried(choices)
            if tried.error <= self.enough or choices == self.bodies.richest:
                return choices, tried
            if not self._more_time():
                self.skipped = list(choices)
                return dict(self.bodies.richest), self.tried(self.bodies.richest)
            choices = self.richer(choices)

    def _first(self, name: str) -> BodyModel:
        """The least choice that is expected to suffice."""
        part = _ENOUGH * self.enough / len(self.bodies.richest)
        for choice in self._upward(name):
            known = self.expected(name, choice)
            if known is not None and known <= part and self._sound(name, choice):
                return choice
        return self.bodies.richest[name]

    def _sound(self, name: str, choice: BodyModel) -> bool:
        """Whether a level is used within its range: linear kinematics of a body that stiffens by
        its loads may diverge, whatever it deflects."""
        known = self.evidence.get(name)
        return known is None or choice.level not in (ONE_WAY, LINEAR) or not known.stiffens

    def _upward(self, name: str) -> Iterator[BodyModel]:
        """Choices from the least to the richest; shapes are added where they deflect most.

        One-way responses are no step on the way: where they are cheaper shows when they are run.
        """
        richest = self.bodies.richest[name]
        yield BodyModel(RIGID)
        for shapes in self._shapes_upward(name):
            yield BodyModel(LINEAR, shapes)
            if richest.level == STIFFENED:
                yield BodyModel(STIFFENED, shapes)

    def _shapes_upward(self, name: str) -> Iterator[tuple[tuple[str, int], ...]]:
        richest = self.bodies.richest[name]
        counts = dict(richest.shapes)
        if VIBRATION in counts:
            yield from (((VIBRATION, n),) for n in range(counts[VIBRATION] + 1))
            return
        now = BodyModel(STIFFENED)
        while now.shapes != richest.shapes:
            have = dict(now.shapes)
            open_ones = [word for word, most in counts.items() if have.get(word, 0) < most]
            word = max(open_ones, key=lambda one: self._next_size(name, one, have.get(one, 0)))
            now = now.with_count(word, have.get(word, 0) + 1)
            yield now.shapes

    def _next_size(self, name: str, direction: str, have: int) -> float:
        """How much the next shape in a direction deflects; bending before twist and axial shapes
        where nothing is known."""
        known = self.evidence.get(name)
        if known is None:
            return -have - (0.5 if direction in ("twist", "axial") else 0.0)
        return known.by_shape.get(f"{direction}{have + 1}", 0.0)

    def richer(self, choices: Choices) -> Choices:
        """The bodies of which most is expected, one choice up."""
        rising = {name for name in choices if choices[name] != self.bodies.richest[name]}
        known = {name: self.expected(name, choices[name]) for name in rising}
        sizes = {name: math.inf if size is None else size for name, size in known.items()}
        most = max(sizes.values())
        raised = dict(choices)
        for name, size in sizes.items():
            if size >= _TOGETHER * most:
                raised[name] = self._above(name, choices[name])
        return raised

    def _above(self, name: str, choice: BodyModel) -> BodyModel:
        """The next choice of which less is expected; the richest where there is none."""
        upward = list(self._upward(name))
        now = self.expected(name, choice)
        for other in upward[upward.index(choice) + 1 :] if choice in upward else ():
            known = self.expected(name, other)
            less = known is None or now is None or known < _ENOUGH * now
            if less and self._sound(name, other):
                return other
        return self.bodies.richest[name]

    # --- down -----------------------------------------------------------------------------------

    def _descend(self, choices: Choices, best: TrialResult) -> tuple[Choices, TrialResult]:
        """Less of each body, those with most shapes first, as long as it suffices and is no
        dearer."""
        order = sorted(choices, key=lambda name: -choices[name].total)
        for k, name in enumerate(order):
            lowered = True
            while lowered:
                lowered = False
                for choice in self._less(name, choices[name]):
                    if (name, choice) in self.failed or not self._worth_trying(name, choice):
                        continue
                    if not self._more_time():
                        self.skipped = self.skipped or order[k:]
                        return choices, best
                    other = {**choices, name: choice}
                    tried = self.tried(other)
                    if tried.error <= self.enough and self.bench.as_cheap(tried, best):
                        choices, best, lowered = other, tried, True
                        break
                    self.failed.add((name, choice))
        return choices, best

    def _worth_trying(self, name: str, choice: BodyModel) -> bool:
        known = self.expected(name, choice)
        most = _DOUBTFUL if choice.level == ONE_WAY else _HOPELESS
        return known is None or known <= most * self.enough

    def _less(self, name: str, choice: BodyModel) -> Iterator[BodyModel]:
        """What is less than a choice, the least first."""
        if choice.level == RIGID:
            return
        yield BodyModel(RIGID)
        if choice.level == ONE_WAY:
            return
        yield BodyModel(
            ONE_WAY, self.bodies.richest[name].shapes
        )  # oscillators cost next to nothing
        for word, n in reversed(choice.shapes):
            for count in sorted({0, n // 2, max(n - 1, 0)} - {n}):
                less = choice.with_count(word, count)
                if less.total or word == VIBRATION:
                    yield less
        if choice.level == STIFFENED:
            yield BodyModel(LINEAR, choice.shapes)

    def _more_time(self) -> bool:
        if not self.time_left():
            self.out_of_time = True
        return not self.out_of_time
