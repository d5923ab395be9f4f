"""From a model to its advice: evidence, reference, search, setting, and what each choice does."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from mstmm.errors import NumericalFailure

from ..chart.chart_points import Point, Setting
from ..chart.error_measure import scene_length_with_ends, select_measure
from ..chart.model_levels import Variant, model_levels
from ..chart.time_budget import Budget
from ..integrate.steppers import AUTO
from .advice import Advice
from .advice_state import RICHEST, AdviceState, size_of
from .advice_summary import build_advice
from .beam_subdivision import in_parts
from .body_model_levels import Bodies
from .error_predictors import ErrorPrediction, predict_errors
from .full_run_settings import whole_run_tolerance
from .hinge_reduction import needless, rigid
from .measure_renaming import Renaming
from .method_selection import SelectedSetting, cheapest
from .request import Request
from .scene_reduction import SEARCH, in_plane, merge_welded, reduce_by_halves
from .search import Choices, ModelSearch
from .trial_models import Compile, Tell, TrialResult, TrialRunner, first_rtol, probe

if TYPE_CHECKING:
    from ..model.model import Model

#: With the integration a model may err by this part of what is asked; the rest is for what lies
#: between the samples.
_WITH_SETTING = 0.95

#: Methods may take this part of the budget.
_SETTINGS = 0.3

#: Models whose settings are tried: the one found, and others that suffice and took no longer than
#: so many times its time; than so many where they err by less than this part of what is asked.
_FINALISTS, _NEARLY, _ROOMIER, _ROOMY = 3, 1.5, 4.0, 0.3

#: Hinges may be made rigid up to this part of what is asked; springs left out up to one, or to so
#: many times the error that there is.
_RIGID, _NEEDLESS, _HARDLY = 0.5, 0.1, 1.1

#: Most by which errors of a window are multiplied for what deflects more after it.
_RISE = 100.0


def make_advice(
    model: Model, asked: Request, compile: Compile, tell: Tell, state: Tell,
    budget: Budget | None = None,
) -> Advice:  # fmt: skip
    """The advice for a model; `compile` makes models of its other levels.

    `state` hears what is compared, `tell` every run.  Raises SceneError for an unknown quantity,
    NumericalFailure where the scene cannot be run or no error of this size be judged.
    """
    work = AdviceState(model.scene, asked, budget or Budget(asked.budget), compile, tell)
    top = model_levels(work.scene)[-1]
    richest = compile(top.scene)
    start = richest.simulate(0.0, method="dop853")
    work.measure = Renaming(select_measure(richest, start, asked.of, True))
    work.length = scene_length_with_ends(richest)
    first = work.least(work.scene)
    work.size = size_of(work.measure, first)
    work.bench, base = _bench(work, top, richest, predict_errors(first, work.length)[0], state)
    evidence, why = work.known(first, richest)
    if why:
        work.notes.append(f"nothing is known of the flexible bodies beforehand: {why}")
    base = in_plane(work, top, richest, base)
    q = work.bench.reference.q
    work.whole = Bodies(top.scene).richest
    base, evidence = in_parts(work, base, evidence)
    still = rigid(base.scene, richest, q, work.length)
    base = reduce_by_halves(work, base, "rigid", still, _RIGID * asked.error, cheap=True)
    work.bench.names = work.measure.names_in(base.running)
    return _reduced(work, base, evidence)


def _bench(
    work: AdviceState,
    top: Variant,
    model: Model,
    evidence: Mapping[str, ErrorPrediction],
    state: Tell,
) -> tuple[TrialRunner, TrialResult]:
    """The bench with its reference, over the whole run or a window."""
    asked = work.asked
    rtol = first_rtol(work.part)
    span = probe(model, asked.t_end, asked.samples, work.budget, work.measure, rtol)
    if not span.whole:
        rise = max((one.rise(span.t_end) for one in evidence.values()), default=1.0)
        span = replace(span, rise=min(rise, _RISE))
    bench = TrialRunner(span, asked.samples, work.budget, work.measure, work.compile, work.tell)
    richest = bench.refer_to(top.scene, model, RICHEST, asked.error, work.part)
    state(f"models are compared over {span}; the reference itself errs by about "
               f"{richest.error:.1e}")  # fmt: skip
    if not span.whole:
        work.notes.append(
            "what moves after the window was not seen: planes, hinges, springs and dampers stay "
            "as they are; give more --budget to have them looked at"
        )
    return bench, richest


def _reduced(
    work: AdviceState, base: TrialResult, evidence: Mapping[str, ErrorPrediction]
) -> Advice:
    """The advice for a scene whose plane, beams and hinges are settled."""
    work.bodies = Bodies(base.scene)
    search = ModelSearch(
        work.bodies, work.bench, evidence, work.enough, work.in_measure,
        lambda: work.budget.left(SEARCH) > 0,
    )  # fmt: skip
    for name in (RICHEST, base.name):
        search.made[name] = work.bodies.richest
    choices, best = search.run() if work.bodies.richest else ({}, base)
    work.skipped += [f"less of body {name}" for name in search.skipped]
    work.told.setdefault(best.name, work.told[base.name])
    enough = max(_NEEDLESS * work.asked.error, _HARDLY * best.error)
    best = reduce_by_halves(work, best, "without", needless(best.scene), enough, cheap=False)
    best = merge_welded(work, best, enough)
    search.made.setdefault(best.name, choices)
    chosen = _chosen(work, best, choices, search)
    choices = search.made.get(chosen.tried.name, choices)
    return build_advice(work, choices, evidence, chosen, search, base.name)


def _chosen(
    work: AdviceState, best: TrialResult, choices: Choices, search: ModelSearch
) -> SelectedSetting:
    """The cheapest setting of the model found, or of another one that nearly is as cheap; a
    model that leaves more of the error to the integration may be cheaper in the end."""
    asked = work.beside_unseen
    if best.error > _ROOMY * asked and choices != work.bodies.richest:
        search.tried(search.richer(choices))
    others = sorted(
        (
            one
            for one in work.bench.all
            if search.made.get(one.name, choices) != choices and _may_be_cheapest(work, one, best)
        ),
        key=lambda one: one.cpu_s,
    )
    if not work.bench.span.whole:
        beyond = whole_run_tolerance(best, work, _WITH_SETTING * asked - best.error)
        if beyond is not None:
            return beyond
        work.notes.append(
            "method and tolerance were judged in the window, too: what they err after it is guessed"
        )
    finalists = [best, *others][:_FINALISTS]
    seconds = max(_SETTINGS * work.asked.budget, work.budget.left())
    asked, growth = _WITH_SETTING * asked, work.bench.span.growth
    try:
        return cheapest(
            finalists, work.bench, asked / growth, work.asked.of, work.asked.rounds, seconds
        )
    except NumericalFailure:  # then as all models were run
        setting = Setting(AUTO, best.name, work.bench.rtol)
        return SelectedSetting(best, Point(setting, best.error / growth, best.cpu_s, 1))


def _may_be_cheapest(work: AdviceState, one: TrialResult, best: TrialResult) -> bool:
    times = _NEARLY if one.error > _ROOMY * work.asked.error else _ROOMIER
    return one.error <= work.enough and one.cpu_s <= times * best.cpu_s
