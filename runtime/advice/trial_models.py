"""Models tried: each one run beside the richest one, over the whole time or a part of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from mstmm.errors import MstmmError, NumericalFailure
from mstmm.numerics.rotations import Vector
from mstmm.scene import Scene

from ..chart.chart_points import Setting
from ..chart.time_budget import Budget, OutOfTime
from ..chart.trial_run import Runs, Trial, max_error
from ..integrate.steppers import AUTO
from ..result.error_measure import Measure
from .measure_renaming import Renaming

if TYPE_CHECKING:
    from ..model.model import Model

#: Relative tolerance of runs that are compared, in the relative error asked for, and its bounds;
#: the reference's is so many times tighter, and they may be apart by this part of what is asked.
_PART, _LOOSEST, _TIGHTEST, _TIGHTER, _AGREE = 1e-3, 1e-6, 1e-12, 1e-2, 0.05

#: The part of the run by which its time is guessed, the parts of the budget that reference runs may
#: take and that a window aims at, and the part that one model may take.
_LOOK, _WHOLE, _WINDOW, _ONE = 1 / 20, 0.35, 0.1, 0.2

#: Runs shorter than this (s) are made so many times: the least time counts.
_SHORT, _REPEATS = 0.03, 3

#: A model counts as cheap as another up to this many times its time, for times scatter; those below
#: a time (s) are taken again so often at most where it seems to be dearer.
_AS_CHEAP, _TAKEN_AGAIN, _TURNS = 1.15, 0.5, 5

Compile = Callable[[Scene], "Model"]
Tell = Callable[[str], None]


@dataclass(frozen=True)
class ComparisonWindow:
    """The time over which models are compared.

    Attributes:
        t_end: s, of a window from the start, or of the whole run.
        wanted: s, end of the run that the advice is for.
        rise: how many times more bodies deflect after a window than in it.
    """

    t_end: float
    wanted: float
    rise: float = 1.0

    @property
    def whole(self) -> bool:
        """Whether all of the run is compared."""
        return self.t_end >= self.wanted

    @property
    def growth(self) -> float:
        """What errors of a window are multiplied by: they grow with the time at least, and with
        what deflects later."""
        return self.wanted / self.t_end * self.rise

    def __str__(self) -> str:
        if self.whole:
            return f"the whole run of {self.wanted:g} s"
        return f"the first {self.t_end:.3g} s of {self.wanted:g} s, errors times {self.growth:.3g}"


@dataclass(frozen=True)
class TrialResult:
    """A model that was run, or why it was not.

    Attributes:
        name: in words.
        error: against the richest model, over the whole run; inf where it gave none.
        cpu_s: processor time of the call, s.
        why: what kept it from a number, "" where nothing did.
    """

    name: str
    scene: Scene
    model: Model | None
    error: float
    cpu_s: float
    why: str = ""

    @property
    def running(self) -> Model:
        """The model of one that ran."""
        assert self.model is not None
        return self.model


def probe(model: Model, t_end: float, samples: int, budget: Budget, measure: Measure,
          rtol: float) -> ComparisonWindow:  # fmt: skip
    """The whole run where the reference's runs fit into their part of the budget, else a window.

    NumericalFailure where the model does not run.
    """
    look = Runs(_LOOK * t_end, np.linspace(0.0, _LOOK * t_end, samples), budget)
    limit = budget.left() * _WHOLE
    begin = budget.clock()
    trial = look.trial(model, Setting(AUTO, "", rtol), measure, limit)
    spent = max(budget.clock() - begin, 1e-9)
    if trial.late:
        raise NumericalFailure(
            f"a twentieth of the run, {_LOOK * t_end:.3g} s, takes the richest model more than "
            f"{limit:.3g} s; give more --budget, or end earlier"
        )
    if trial.numbers is None:
        raise NumericalFailure(trial.failure)
    cost = 3.0 * spent / _LOOK  # two runs, one of them tighter
    if cost <= _WHOLE * budget.left():
        return ComparisonWindow(t_end, t_end)
    part = _WINDOW * budget.left() / cost
    return ComparisonWindow(max(min(part, 1.0), _LOOK) * t_end, t_end)


class TrialRunner:
    """Runs models beside the reference and keeps what they gave.

    `measure` is scaled by the reference; `rtol` is the tolerance of the runs.
    """

    def __init__(
        self,
        span: ComparisonWindow,
        samples: int,
        budget: Budget,
        measure: Renaming,
        compile: Compile,
        tell: Tell,
    ) -> None:
        self.span, self.measure, self.budget = span, measure, budget
        self.runs = Runs(span.t_end, np.linspace(0.0, span.t_end, samples), budget)
        self.compile, self.tell = compile, tell
        self.rtol = _LOOSEST
        self.names: Mapping[str, str] = {}
        self.reference: Trial
        self.floor = 0.0
        self.late: list[str] = []  #: models that took more than their part of the budget
        self._found: dict[str, TrialResult] = {}

    def refer_to(
        self, scene: Scene, model: Model, name: str, asked: float, part: float
    ) -> TrialResult:
        """Run the richest model until two tolerances agree; `part` is what is asked in parts.

        NumericalFailure where they do not.
        """
        self.rtol = first_rtol(part)
        run = self._run(model, name, self.rtol)
        while True:
            tight = max(self.rtol * _TIGHTER, _TIGHTEST)
            tighter = self._run(model, name, tight)
            self.measure.scale_by(_numbers(tighter))
            apart = max_error(run, tighter, self.measure)
            far = math.inf if isinstance(apart, str) else apart * self.span.growth
            if far <= _AGREE * asked:
                break
            if tight <= _TIGHTEST:
                raise NumericalFailure(
                    f"two runs of the richest model are {far:.1e} apart at tolerances of "
                    f"{self.rtol:.0e} and {tight:.0e}, so that no error of {asked:.1e} can be "
                    "judged: end earlier, or allow a larger error"
                )
            self.rtol, run = tight, tighter
        self.reference, self.floor = tighter, far
        tried = self._kept(name, scene, model, run)
        return replace(tried, error=far)

    def finer(self, scene: Scene, names: Mapping[str, str], name: str) -> Trial:
        """A run of a model that is richer than the richest one.

        Raises MstmmError where it cannot be made; the trial says where it fails.
        """
        self.tell(name)
        model = self.compile(scene)
        self.measure.know(model, names)
        limit = self.budget.left() * _ONE
        return self.runs.trial(model, Setting(AUTO, name, self.rtol), self.measure, limit)

    def apart(self, a: Trial, b: Trial) -> float:
        """How far two runs are apart, over the whole run; inf where that is not known."""
        found = max_error(a, b, self.measure)
        return math.inf if isinstance(found, str) else found * self.span.growth

    def refer_again(self, trial: Trial, names: Mapping[str, str]) -> None:
        """Take another run as the reference, and other names that places have from now on."""
        self.reference, self.names = trial, names
        self.measure.scale_by(_numbers(trial))
        self._found.clear()

    def tried(
        self, name: str, scene: Scene, names: Mapping[str, str] | None = None,
        still: Mapping[str, Vector] | None = None,
    ) -> TrialResult:  # fmt: skip
        """A model that was run; `names` are other names that places have in it, those of the
        reference's scene unless given, `still` places that are on the ground, m."""
        if name not in self._found:
            self.tell(name)
            self._found[name] = self._try(name, scene, names, still)
        return self._found[name]

    @property
    def all(self) -> tuple[TrialResult, ...]:
        """Everything that was tried, in its order."""
        return tuple(self._found.values())

    def _try(
        self, name: str, scene: Scene, names: Mapping[str, str] | None,
        still: Mapping[str, Vector] | None,
    ) -> TrialResult:  # fmt: skip
        try:
            model = self.compile(scene)
            self.measure.know(model, self.names if names is None else names, still)
        except MstmmError as problem:
            return TrialResult(name, scene, None, math.inf, math.inf, str(problem))
        limit = self.budget.left() * _ONE
        trial = self.runs.trial(model, Setting(AUTO, name, self.rtol), self.measure, limit)
        if trial.late:
            self.late.append(name)
        return self._kept(name, scene, model, trial)

    def _kept(self, name: str, scene: Scene, model: Model, trial: Trial) -> TrialResult:
        if trial.numbers is None:
            tried = TrialResult(name, scene, None, math.inf, trial.cpu_s, trial.failure)
        else:
            found = max_error(trial, self.reference, self.measure)
            error, why = (math.inf, found) if isinstance(found, str) else (found, "")
            spent = self._least(model, trial)
            tried = TrialResult(name, scene, model, error * self.span.growth, spent, why)
        self._found[name] = tried
        return tried

    def _least(self, model: Model, trial: Trial) -> float:
        """The least time of several runs where they are short."""
        times = [trial.cpu_s]
        if trial.cpu_s < _SHORT:
            times += [
                self.runs.simulate(model, trial.setting, self.budget.left())[1]
                for _ in range(_REPEATS - 1)
            ]
        return min(times)

    def as_cheap(self, one: TrialResult, other: TrialResult) -> bool:
        """Whether a model takes no more time than another, up to what times scatter.  Where it
        seems to, both are timed again in turn, for something else may have kept it."""
        pair, least = (one, other), [one.cpu_s, other.cpu_s]
        for _ in range(_TURNS):
            if least[0] <= _AS_CHEAP * least[1] or not max(least) < _TAKEN_AGAIN:
                break
            for k, tried in enumerate(pair):
                setting = Setting(AUTO, tried.name, self.rtol)
                try:
                    spent = self.runs.simulate(tried.running, setting, self.budget.left())[1]
                except OutOfTime:
                    return False
                least[k] = min(least[k], spent)
        return least[0] <= _AS_CHEAP * least[1]

    def _run(self, model: Model, name: str, rtol: float) -> Trial:
        """One run of the richest model; NumericalFailure where it gives nothing."""
        limit = self.budget.left() * 2 * _WHOLE
        self.tell(f"{name}, rtol {rtol:.0e}")
        trial = self.runs.trial(model, Setting(AUTO, name, rtol), self.measure, limit)
        if trial.numbers is None:
            more = "; give more --budget" if trial.late else ""
            raise NumericalFailure(f"{name}: {trial.failure}{more}")
        return trial


def first_rtol(part: float) -> float:
    """The tolerance to begin with for an error in parts of the motion."""
    return min(max(_PART * part, 100 * _TIGHTEST), _LOOSEST)


def _numbers(trial: Trial) -> np.ndarray:
    assert trial.numbers is not None
    return trial.numbers
