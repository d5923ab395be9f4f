"""mstmm's methods on a case: reference and points as `mstmm chart` finds them, at the end alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

import mstmm
from mstmm.runtime.chart.chart_points import Point, Reference, Setting, Skipped
from mstmm.runtime.chart.error_measure import select_measure
from mstmm.runtime.chart.method_families import FAMILIES, PROMISING, all_methods, family
from mstmm.runtime.chart.method_survey import Survey, method_curve
from mstmm.runtime.chart.reference_solution import compute_reference
from mstmm.runtime.chart.time_budget import EARLY, SETTINGS, Budget
from mstmm.runtime.chart.trial_run import Runs

from ..common import measure
from ..stiff.cases import Case

#: Families of integrators of others, which are peers.
OTHERS = FAMILIES[-2:]
#: Engines, which stand where a chart has levels of model; the first one has every scene.
LOOPED, FUSED = "looped", "fused"
#: Up to so many speeds there is code of the scene's own too, compiled before anything is timed.
_MOST_FUSED = 20


@dataclass(frozen=True)
class Own:
    """What is known of a case: models by engine, reference and the watched end's place in it (3,),
    m, and every setting of mstmm's methods, timed once."""

    models: dict[str, mstmm.Model]
    reference: Reference
    exact: np.ndarray
    points: list[Point]
    left_out: list[Skipped]

    @property
    def model(self) -> mstmm.Model:
        """The one that every scene has."""
        return self.models[LOOPED]


def surveyed(
    case: Case, seconds: float, say: Callable[[str], None], methods: Sequence[str] = ()
) -> Own:
    """A case within so many seconds of the clock, a part of them for the reference, by these
    methods or all of them."""
    scene = mstmm.Scene(**case.scene())
    models = {LOOPED: mstmm.compile(scene, engine=LOOPED)}
    if models[LOOPED].nu <= _MOST_FUSED:
        models[FUSED] = mstmm.compile(scene, engine=FUSED)
    for one in models.values():
        _warm(one, case.t_end)
    model = models[LOOPED]
    budget = Budget(seconds)
    runs = Runs(case.t_end, np.array([case.t_end]), budget)
    start = model.simulate(0.0, method="dop853")
    distance = select_measure(model, start, [f"{case.watched[-1]}.position"], False)
    best = compute_reference(model, LOOPED, distance, runs, _quiet)
    reference = Reference(
        best.error, best.made_by, LOOPED, distance.name, distance.unit, distance.scaling
    )
    say(f"{case.name}: reference good to {best.error:.1e} m after {budget.elapsed:.0f} s")
    curves = [
        method_curve(name, engine, one, case.t_end, reference.smallest_resolved_error, None)
        for name in methods or all_methods()
        if family(name) not in OTHERS
        for engine, one in models.items()
    ]
    survey = Survey(best.run, distance, runs, _quiet)
    survey.run_curves([one for one in curves if one.method in PROMISING], EARLY)
    found = survey.run_curves([one for one in curves if one.method not in PROMISING], SETTINGS)
    assert best.run.numbers is not None
    return Own(models, reference, best.run.numbers[-1], found.points, found.skipped)


def call(own: Own, case: Case, setting: Setting) -> Callable[[], object]:
    """The call of `simulate` that a point of mstmm stands for, one sample at the end."""
    return lambda: own.models[setting.model].simulate(
        case.t_end, output_times=[case.t_end], **setting.options
    )


def shortest_call(own: Own, case: Case) -> float:
    """CPU s of a call of `simulate` over next to no time: what every call costs at least."""
    model = own.models.get(FUSED, own.model)
    t_end = 1e-6 * case.t_end
    return min(measure.once(lambda: model.simulate(t_end, output_times=[t_end])) for _ in range(5))


def _warm(model: mstmm.Model, t_end: float) -> None:
    """Short runs of all kinds of methods, which compile and load what those need."""
    for name in all_methods():
        if family(name) not in OTHERS:
            with suppress(mstmm.MstmmError):
                two_steps = mstmm.methods.Method(name, max_steps=2)
                model.simulate(t_end, two_steps, output_times=[t_end])


def _quiet(_: str) -> None:
    """Nobody listens."""
