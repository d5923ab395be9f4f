"""mstmm's methods on a case: reference and points as `mstmm chart` finds them, at the end only."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

import mstmm
from mstmm.runtime.experiments.chart.chart_record import Point, Reference, Skipped
from mstmm.runtime.experiments.chart.method_survey import Survey, method_curve
from mstmm.runtime.experiments.error_measure import select_measure
from mstmm.runtime.experiments.method_families import FAMILIES, PROMISING, all_methods, family
from mstmm.runtime.experiments.reference import compute_reference
from mstmm.runtime.experiments.runs import EARLY, SETTINGS, Budget, Runs
from mstmm.runtime.experiments.trial import Setting

from ..common import measure
from ..stiff.cases import Case

#: Families of external integrators.
EXTERNAL_FAMILIES = FAMILIES[-2:]
#: Engines, in place of the model levels of a chart; the first one runs all scenes.
LOOPED, FUSED = "looped", "fused"
#: Largest number of speeds for the fused engine.
_MAX_FUSED_SPEEDS = 20


@dataclass(frozen=True)
class OwnRuns:
    """Runs of mstmm: models by engine, reference, reference position of the end (3,), m, and all
    settings, timed once."""

    models: dict[str, mstmm.Model]
    reference: Reference
    exact: np.ndarray
    points: list[Point]
    left_out: list[Skipped]

    @property
    def model(self) -> mstmm.Model:
        """Model on the looped engine."""
        return self.models[LOOPED]


def survey_case(
    case: Case, seconds: float, report: Callable[[str], None], methods: Sequence[str] = ()
) -> OwnRuns:
    """A case within so many seconds of the clock, a part of them for the reference, by these
    methods or all of them."""
    scene = mstmm.Scene(**case.scene())
    models = {LOOPED: mstmm.compile(scene, engine=LOOPED)}
    if models[LOOPED].nu <= _MAX_FUSED_SPEEDS:
        models[FUSED] = mstmm.compile(scene, engine=FUSED)
    for entry in models.values():
        _warm_up(entry, case.t_end)
    model = models[LOOPED]
    budget = Budget(seconds)
    runs = Runs(case.t_end, np.array([case.t_end]), budget)
    start = model.simulate(0.0, method="dop853")
    distance = select_measure(model, start, [f"{case.end_names[-1]}.position"], False)
    reference_run = compute_reference(model, LOOPED, distance, runs, _ignore_message)
    reference = Reference(
        reference_run.error,
        reference_run.made_by,
        LOOPED,
        distance.name,
        distance.unit,
        distance.scaling,
    )
    report(
        f"{case.name}: reference good to {reference_run.error:.1e} m "
        f"after {budget.elapsed_time:.0f} s"
    )
    curves = [
        method_curve(name, engine, entry, case.t_end, reference.smallest_resolved_error, None)
        for name in methods or all_methods()
        if family(name) not in EXTERNAL_FAMILIES
        for engine, entry in models.items()
    ]
    survey = Survey(reference_run.trial, distance, runs, _ignore_message)
    survey.run_curves([entry for entry in curves if entry.method in PROMISING], EARLY)
    survey.run_curves([entry for entry in curves if entry.method not in PROMISING], SETTINGS)
    assert reference_run.trial.numbers is not None
    return OwnRuns(
        models, reference, reference_run.trial.numbers[-1], survey.points, survey.skipped
    )


def simulate_call(own: OwnRuns, case: Case, setting: Setting) -> Callable[[], object]:
    """The call of `simulate` that a point of mstmm stands for, one sample at the end."""
    return lambda: own.models[setting.model].simulate(
        case.t_end, output_times=[case.t_end], **setting.options
    )


def shortest_call(runs_of_case: OwnRuns, case: Case) -> float:
    """CPU time of a very short `simulate`, the minimum cost of a call, s."""
    model = runs_of_case.models.get(FUSED, runs_of_case.model)
    t_end = 1e-6 * case.t_end
    return min(
        measure.call_time(lambda: model.simulate(t_end, output_times=[t_end])) for _ in range(5)
    )


def _warm_up(model: mstmm.Model, t_end: float) -> None:
    """Short runs of all kinds of methods, which compile and load what those need."""
    for name in all_methods():
        if family(name) not in EXTERNAL_FAMILIES:
            with suppress(mstmm.MstmmError):
                two_steps = mstmm.methods.Method(name, max_steps=2)
                model.simulate(t_end, two_steps, output_times=[t_end])


def _ignore_message(_: str) -> None:
    """Ignore progress messages."""
