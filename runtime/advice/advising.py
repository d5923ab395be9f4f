"""From a model to its advice: evidence, reference, search, setting, and what each choice does."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import real, whole
from mstmm.defaults import METHOD, RTOL
from mstmm.errors import MstmmError, NumericalFailure, SceneError

from ..chart.budget import Budget, OutOfTime
from ..chart.measure import Places, measure_of, whole_length
from ..chart.models import Variant, at_level, ladder
from ..chart.planar import planar
from ..chart.point import Point, Setting
from ..chart.trial import Runs, Trial
from ..integrate.steppers import AUTO
from ..result.flexible.certify import SLOPE
from ..result.measure import Measure
from .choice import RIGID, Bodies, Choice, given
from .evidence import Evidence, gathered
from .hinges import Change, applied, needless, rigid
from .merging import merged
from .record import Advice, BodyAdvice, TriedModel
from .renaming import Renaming, composed
from .search import AS_CHEAP, Choices, Search
from .settings import Chosen, cheapest, compared
from .splitting import Split, in_parts, unfit
from .trials import Bench, Compile, Tell, Tried, first_rtol, probe
from .words import reason

if TYPE_CHECKING:
    from mstmm.scene import Scene
    from mstmm.scene.tables.beam import Beam
    from mstmm.scene.tables.elastic import Elastic

    from ..model.model import Model
    from ..result.result import Result

#: A model may err by this part of what is asked, and with the integration by this one; the rest is
#: for what lies between the samples.
_ENOUGH, _WITH_SETTING = 0.9, 0.95

#: A one-way run may take this part of the budget; the search ends when this part is spent; methods
#: may take this part of it.
_FIRST, _SEARCH, _SETTINGS = 0.3, 0.6, 0.3

#: Models whose settings are tried: the one found, and others that suffice and took no longer than
#: so many times its time; than so many where they err by less than this part of what is asked.
_FINALISTS, _NEARLY, _ROOMIER, _ROOMY = 3, 1.5, 4.0, 0.3

#: Hinges may be made rigid up to this part of what is asked; springs left out up to one, or to so
#: many times the error that there is; what is expected to err by so many times of it is not tried.
_RIGID, _NEEDLESS, _HARDLY, _UNLIKELY = 0.5, 0.1, 1.1, 5.0

#: Beams are split until the next halving changes less than this part of what is asked; what the
#: finer ones err by themselves is so many times less, and models are judged beside it where it
#: leaves this part of what is asked.
_PARTS, _FALLS, _LEFT = 0.5, 4.0, 0.3

#: Most by which errors of a window are multiplied for what deflects more after it.
_RISE = 100.0

#: A planar scene is the same motion: it may err by this part of what is asked.
_SAME = 0.01

#: Names of two of the models tried.
RICHEST, AS_GIVEN = "the richest model", "as given"


@dataclass(frozen=True)
class Request:
    """What was asked for, checked."""

    t_end: float
    error: float
    of: tuple[str, ...]
    budget: float
    samples: int
    rounds: int


def request(
    t_end: float, error: float, of: str | Sequence[str], budget: float, samples: int, rounds: int
) -> Request:
    """SceneError naming the first argument that makes no sense."""
    asked = real("error", error, "an error above 0 and below 1")
    if not 0 < asked < 1:
        raise SceneError(f"error = {asked:g}: expected an error above 0 and below 1, such as 1e-3")
    return Request(
        _above_zero("t_end", t_end), asked, (of,) if isinstance(of, str) else tuple(of),
        _above_zero("budget", budget),
        whole("samples", samples, 2, "a whole number of samples, 2 or more"),
        whole("rounds", rounds, 0, "a whole number of rounds, 0 or more"),
    )  # fmt: skip


def _above_zero(name: str, value: float) -> float:
    found = real(name, value, "a time in s above 0")
    if not found > 0 or not math.isfinite(found):
        raise SceneError(f"{name} = {found:g}: expected a time in s above 0")
    return found


def advised(
    model: Model, asked: Request, compile: Compile, tell: Tell, state: Tell,
    budget: Budget | None = None,
) -> Advice:  # fmt: skip
    """The advice for a model; `compile` makes models of its other levels.

    `state` hears what is compared, `tell` every run.  Raises SceneError for an unknown quantity,
    NumericalFailure where the scene cannot be run or no error of this size be judged.
    """
    return _Advising(model, asked, compile, tell, state, budget or Budget(asked.budget)).advice()


class _Advising:
    def __init__(
        self, model: Model, asked: Request, compile: Compile, tell: Tell, state: Tell,
        budget: Budget,
    ) -> None:  # fmt: skip
        self.scene, self.asked, self.budget = model.scene, asked, budget
        self.compile, self.tell, self.state = compile, tell, state
        self.notes: list[str] = []
        self.parts: Mapping[str, str] = {}  # beam that is a part -> the beam of the scene
        self.unseen = 0.0  # error of the reference's own parts
        self.split_error: float | None = None  # seen of one frame where beams stay whole
        self.told: dict[str, tuple[str, ...]] = {RICHEST: ()}  # name of a model -> its hinges

    def advice(self) -> Advice:
        asked = self.asked
        top = ladder(self.scene)[-1]
        model = self.compile(top.scene)
        start = model.simulate(0.0, method="dop853")
        self.measure = Renaming(measure_of(model, start, asked.of, True))
        first = self._least(self.scene)
        self.length = whole_length(model)
        self.size = _size(self.measure, first)
        evidence, why = gathered(first, self.length)
        if why:
            self.notes.append(f"nothing is known of the flexible bodies beforehand: {why}")
        self.bench, richest = self._bench(top, model, evidence)
        base = self._in_plane(top, model, richest)
        q = self.bench.reference.q
        self.whole = Bodies(top.scene).richest
        base, evidence = self._in_parts(base, evidence)
        still = rigid(base.scene, model, q, self.length)
        base = self._changed(base, "rigid", still, _RIGID * asked.error, AS_CHEAP)
        self.bodies = Bodies(base.scene)
        self.base = base.name
        search = Search(
            self.bodies, self.bench, evidence, self.enough, self.in_measure,
            lambda: self.budget.left(_SEARCH) > 0,
        )  # fmt: skip
        for name in (RICHEST, base.name):
            search.made[name] = self.bodies.richest
        choices, best = search.run() if self.bodies.richest else ({}, base)
        if search.out_of_time:
            self.notes.append("time ended before every smaller model was tried: give more --budget")
        self.told.setdefault(best.name, self.told[base.name])
        enough = max(_NEEDLESS * asked.error, _HARDLY * best.error)
        best = self._changed(best, "without", needless(best.scene), enough, math.inf)
        best = self._lumped(best, enough)
        search.made.setdefault(best.name, choices)
        chosen = self._chosen(best, choices, search)
        choices = search.made.get(chosen.tried.name, choices)
        return self._told(choices, evidence, chosen, search)

    # --- what is known beforehand ---------------------------------------------------------------

    def _least(self, scene: Scene) -> Result | None:
        """The run in which all bodies respond one way, or none deform; None where there is none."""
        self.tell("one-way, before anything else")
        times = np.linspace(0.0, self.asked.t_end, self.asked.samples)
        runs = Runs(self.asked.t_end, times, self.budget)
        setting = Setting(AUTO, "one-way", first_rtol(self.asked.error))
        try:
            model = self.compile(at_level(scene, "one-way"))
            return runs.simulate(model, setting, _FIRST * self.budget.left())[0]
        except (OutOfTime, MstmmError, ArithmeticError, np.linalg.LinAlgError):
            return None

    @property
    def in_measure(self) -> float:
        """What turns a displacement in m into the unit of errors."""
        if isinstance(self.measure.inner, Places):
            return 1.0 / self.length
        return 1.0 if self.measure.unit == "m" else self.size / self.length

    @property
    def enough(self) -> float:
        """The error against the reference that suffices for a model."""
        return _ENOUGH * self._beside_unseen

    @property
    def _beside_unseen(self) -> float:
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

    # --- reference ------------------------------------------------------------------------------

    def _bench(
        self, top: Variant, model: Model, evidence: Mapping[str, Evidence]
    ) -> tuple[Bench, Tried]:
        """The bench with its reference, over the whole run or a window."""
        asked = self.asked
        rtol = first_rtol(self.part)
        span = probe(model, asked.t_end, asked.samples, self.budget, self.measure, rtol)
        if not span.whole:
            rise = max((one.rise(span.t_end) for one in evidence.values()), default=1.0)
            span = replace(span, rise=min(rise, _RISE))
        bench = Bench(span, asked.samples, self.budget, self.measure, self.compile, self.tell)
        richest = bench.refer_to(top.scene, model, RICHEST, asked.error, self.part)
        self.state(f"models are compared over {span}; the reference itself errs by about "
                   f"{richest.error:.1e}")  # fmt: skip
        return bench, richest

    def _in_plane(self, top: Variant, model: Model, richest: Tried) -> Tried:
        """The richest scene in its plane where that is the same motion."""
        flat = planar(top, model, self.bench.reference.q)
        if flat is None:
            return richest
        found = self.bench.tried("planar", flat.scene)
        if found.error > max(_SAME * self.asked.error, 3 * self.bench.floor):
            return richest
        self.told[found.name] = tuple(
            f'hinge "{old.name}": {new.type} instead of {old.type}, for the motion stays in a plane'
            for old, new in zip(top.scene.hinge, flat.scene.hinge, strict=True)
            if old != new
        )
        return found

    def _in_parts(
        self, base: Tried, evidence: dict[str, Evidence]
    ) -> tuple[Tried, dict[str, Evidence]]:
        """The richest scene with beams split that one frame cannot follow, and its evidence.

        They are halved until the next halving changes little; the finest one is the reference.
        """
        steep = [beam.name for beam in base.scene.beam if self._steep(evidence.get(beam.name))]
        names = [one.name for one in base.scene.beam if one.name in steep and not unfit(one)]
        if not names:
            return base, evidence
        asked, found = self.asked.error, Split(base.scene, {}, {})
        try:
            run = self.bench.finer(base.scene, {}, base.name)
            for count in (2, 4, 8):
                parts = in_parts(base.scene, names, count)
                finer = self.bench.finer(parts.scene, parts.names, f"beams in {count} parts")
                apart = math.inf if finer.numbers is None else self.bench.apart(run, finer)
                if apart <= _PARTS * asked or not math.isfinite(apart):
                    break
                found, run = parts, finer
        except MstmmError as problem:
            self.notes.append(f"beams could not be split: {problem}")
            return base, evidence
        if not math.isfinite(apart):
            self.notes.append(f"beams could not be split into {count} parts: {finer.failure}")
        if found.scene is base.scene:
            self.split_error = apart if math.isfinite(apart) else None
            return base, evidence
        self.unseen = apart / _FALLS
        if apart > _PARTS * asked:
            self.notes.append(
                f"beams in {count} parts still differ by {apart:.1e} from those in {count // 2}: "
                f"what is left of that, about {self.unseen:.1e}, counts with the error"
            )
        return self._of_parts(base, found, finer if apart <= _PARTS * asked else run)

    def _of_parts(
        self, base: Tried, found: Split, reference: Trial
    ) -> tuple[Tried, dict[str, Evidence]]:
        """The scene in parts as the richest one, beside a reference with as many parts or more."""
        told = self.told[base.name]
        self.parts = found.parts
        self.whole = {**Bodies(found.scene).richest, **self.whole}
        single = self.bench.apart(self.bench.reference, reference)
        self.bench.refer_again(reference, found.names)
        tried = self.bench.tried("beams in parts", found.scene)
        wholes: dict[str, list[str]] = {}
        for part, of in found.parts.items():
            wholes.setdefault(of, []).append(part)
        self.told[tried.name] = (*told, *(
            f'beam "{of}": {len(parts)} welded beams ({", ".join(parts)}) with frames of their '
            f"own, for with one frame it errs by {single:.1e}"
            for of, parts in wholes.items()
        ))  # fmt: skip
        evidence, why = gathered(self._least(found.scene), self.length)
        if why:
            self.notes.append(f"nothing is known of the parts of beams beforehand: {why}")
        return tried, evidence

    def _steep(self, known: Evidence | None) -> bool:
        """Whether one floating frame may be too little for a body."""
        if known is None:
            return False
        return known.frame_error * self.in_measure > self.asked.error or known.slope > SLOPE

    def _changed(
        self, base: Tried, word: str, changes: list[Change], enough: float, times: float
    ) -> Tried:
        """The model with as many of these changes as it bears within an error that is enough and
        so many times the time: all at once, or one after the other."""
        likely = [one for one in changes if one.expected * self.in_measure <= _UNLIKELY * enough]
        kept: list[Change] = []
        best = base
        tries = [likely, *([one] for one in likely if len(likely) > 1)] if likely else []
        for more in tries:
            if not self.budget.left(_SEARCH) or len(kept) == len(likely):
                break
            names = ", ".join(one.name for one in (*kept, *more))
            scene = applied(base.scene, [*kept, *more])
            found = self.bench.tried(f"{base.name}; {word}: {names}", scene)
            if found.error <= enough and found.cpu_s <= times * best.cpu_s:
                kept, best = [*kept, *more], found
        self.told[best.name] = (*self.told[base.name], *map(str, kept))
        return best

    def _lumped(self, base: Tried, enough: float) -> Tried:
        """The model with welded rigid bodies as one."""
        found = merged(base.scene)
        if found is None:
            return base
        name = f"{base.name}; welded bodies as one"
        names = composed(self.bench.names, found.names)
        tried = self.bench.tried(name, found.scene, names)
        if tried.error > enough:
            return base
        self.told[name] = (*self.told[base.name], *found.words)
        return tried

    # --- what was found -------------------------------------------------------------------------

    def _chosen(self, best: Tried, choices: Choices, search: Search) -> Chosen:
        """The cheapest setting of the model found, or of another one that nearly is as cheap; a
        model that leaves more of the error to the integration may be cheaper in the end."""
        asked = self._beside_unseen
        if best.error > _ROOMY * asked and choices != self.bodies.richest:
            search.tried(search.richer(choices))
        others = sorted(
            (
                one
                for one in self.bench.all
                if search.made.get(one.name, choices) != choices
                and self._may_be_cheapest(one, best)
            ),
            key=lambda one: one.cpu_s,
        )
        finalists = [best, *others][:_FINALISTS]
        seconds = max(_SETTINGS * self.asked.budget, self.budget.left())
        asked, growth = _WITH_SETTING * asked, self.bench.span.growth
        try:
            return cheapest(
                finalists, self.bench, asked / growth, self.asked.of, self.asked.rounds, seconds
            )
        except NumericalFailure:  # then as all models were run
            setting = Setting(AUTO, best.name, self.bench.rtol)
            return Chosen(best, Point(setting, best.error / growth, best.cpu_s, 1))

    def _may_be_cheapest(self, one: Tried, best: Tried) -> bool:
        times = _NEARLY if one.error > _ROOMY * self.asked.error else _ROOMIER
        return one.error <= self.enough and one.cpu_s <= times * best.cpu_s

    def _told(
        self, choices: Mapping[str, Choice], evidence: Mapping[str, Evidence], chosen: Chosen,
        search: Search,
    ) -> Advice:  # fmt: skip
        asked, bench = self.asked, self.bench
        bodies = tuple(
            self._body(name, choice, evidence.get(name), search) for name, choice in choices.items()
        )
        model_saving, setting_saving = self._savings(chosen)
        hinges = self.told.get(chosen.tried.name, self.told[self.base])
        if not bodies:
            self.notes.append("there is nothing to reduce in the bodies: none of them deforms")
        growth = bench.span.growth
        error = chosen.point.error
        assert error is not None and chosen.point.cpu_s is not None
        return Advice(
            asked.error, self.measure.name, self.measure.unit, self.measure.scaling, asked.t_end,
            str(bench.span), bench.span.whole, max(bench.floor, self.unseen), bodies, hinges,
            chosen.point.setting, error * growth + self.unseen, chosen.point.cpu_s, model_saving,
            setting_saving, chosen.tried.scene,
            dict(self.measure.names_in(chosen.tried.running)), dict(self.parts),
            tuple(self.notes),
            tuple(
                TriedModel(
                    one.name, one.error if math.isfinite(one.error) else None, one.cpu_s, one.why
                )
                for one in bench.all
                if math.isfinite(one.cpu_s)
            ),
        )  # fmt: skip

    def _body(
        self, name: str, choice: Choice, known: Evidence | None, search: Search
    ) -> BodyAdvice:
        """What is said of one body; its choice is tried alone beside the richest of all others."""
        most = self.bodies.richest
        as_in_most = choice == most.get(name, choice)
        error, saving = (self.bench.floor, 1.0) if as_in_most else (None, None)
        if not as_in_most and self.budget.left():
            alone = search.tried({**most, name: choice})
            if math.isfinite(alone.error):
                whole_model = search.tried(most)
                error, saving = alone.error, whole_model.cpu_s / alone.cpu_s
        split = None
        if known is not None and self._steep(known) and name not in self.parts:
            split = self.split_error or known.frame_error * self.in_measure
        richest = most.get(name, choice) if name in self.parts else self.whole[name]
        why = reason(choice, richest, known, self.in_measure, self.asked.error)
        if split is not None and known is not None:
            why += f"; it bends by a slope of {known.slope:.2g}, so that one floating frame "
            why += (
                f"was seen to err by {split:.1e}, which is little beside what is asked"
                if self.split_error is not None
                else f"may err by {split:.1e}: split it into welded beams"
            )
        return BodyAdvice(name, self._given(name), choice, error, saving, why, known, split)

    def _straightened(self) -> Choices:
        """Bodies that do not bend at all in the plane of the motion."""
        return {name: Choice(RIGID) for name in self.whole if name not in self.bodies.richest}

    def _given(self, name: str) -> Choice:
        bodies: tuple[Beam | Elastic, ...] = (*self.scene.beam, *self.scene.elastic)
        of = self.parts.get(name, name)
        written = next(body for body in bodies if body.name == of)
        return given(written, self.whole[of])

    def _savings(self, chosen: Chosen) -> tuple[float | None, float | None]:
        """Time of the scene as given over that of the advised one, by the same tolerance; of the
        default method and tolerance over the advised ones."""
        setting, tried, rounds = chosen.point.setting, chosen.tried, self.asked.rounds
        rtol = RTOL if setting.fixed else setting.value
        alike = Setting(AUTO, tried.name, rtol)
        as_given = self.bench.tried(AS_GIVEN, self.scene, {})
        found: list[float | None] = [None, None]
        pairs = (
            (as_given, alike, alike), (tried, Setting(METHOD, tried.name, RTOL), setting),
        )  # fmt: skip
        for k, (other, theirs, ours) in enumerate(pairs):
            if other.model is not None:
                times = compared(other, theirs, tried, ours, self.bench, rounds)
                found[k] = None if times is None else times[0] / times[1]
        return found[0], found[1]


def _size(measure: Measure, result: Result | None) -> float:
    """How far what is compared goes in a run; 1 where that is not known."""
    if result is None or not result.success:
        return 1.0
    numbers = measure.read(result)
    measure.scale_by(numbers)
    start = np.broadcast_to(numbers[:1], numbers.shape)
    far = float(measure.apart(numbers, start).max(initial=0.0))
    return far if np.isfinite(far) and far > 0 else 1.0
