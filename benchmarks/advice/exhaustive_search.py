"""Exhaustive search of the cheapest model that meets an error: levels and shape functions of all
bodies, several methods, all tolerances."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

import mstmm
from mstmm.runtime.experiments.error_measure import PositionMeasure
from mstmm.runtime.experiments.method_families import PROMISING
from mstmm.runtime.experiments.model_levels import Variant, model_levels, planar_level, with_tables
from mstmm.runtime.experiments.model_reduction.beam_splitting import make_splittable, split_beams
from mstmm.runtime.experiments.model_reduction.body_models import (
    LINEAR,
    ONE_WAY,
    RIGID,
    STIFFENED,
    Bodies,
    BodyModel,
)
from mstmm.runtime.experiments.model_reduction.trial_models import Renaming
from mstmm.runtime.result.flexible.momentum import modal_frequencies
from mstmm.runtime.result.one_way.result import OneWayResult

#: Number of times at which errors are compared, different from those of an advice.
SAMPLES = 241

#: Tolerances of runs, with a hundredth of each as the absolute one; of those that show what a model
#: errs by itself, and of the two of the reference.
TOLERANCES = tuple(10.0**-k for k in range(2, 9))
ATOL_PART, _MODEL_ERROR_RTOL, _REFERENCE_METHODS = (
    0.01,
    1e-7,
    (("rodas5p", 1e-9), ("dop853", 1e-10), ("auto", 1e-9)),
)

#: Parts of a split beam in the reference.
_PARTS = 16

#: Steps after which a run is given up; models that are tried of one scene.
_MAX_STEPS, _MAX_MODELS = 200_000, 81

#: A method is followed no further where it costs so many times the cheapest run that errs by less,
#: nor a model where its own run costs so many times that of the cheapest one.
_MAX_COST_RATIO, _MAX_MODEL_COST_RATIO = 6.0, 12.0


@dataclass(frozen=True)
class Reference:
    """Solution of the richest model, and the difference of two methods."""

    numbers: np.ndarray
    error: float
    measure: Renaming
    base: mstmm.Scene


@dataclass(frozen=True)
class Run:
    """A run of a model: its error and CPU time, s."""

    model: str
    method: str
    rtol: float
    error: float
    cpu_s: float

    def __str__(self) -> str:
        return f"{self.model}, {self.method} {self.rtol:.0e}"


def run_timed(
    model: mstmm.Model, t_end: float, method: str, **options: Any
) -> tuple[mstmm.Result, float] | None:
    """A run and its CPU time, with the elastic response if there is one; None if it fails."""
    times = np.linspace(0.0, t_end, SAMPLES)
    method_settings = mstmm.methods.Method(method, max_steps=_MAX_STEPS)
    start_time = time.process_time()
    try:
        result = model.simulate(t_end, method_settings, output_times=times, **options)
        if isinstance(result, OneWayResult) and result.success:
            _ = result.cost
    except mstmm.MstmmError:
        return None
    cpu_s = time.process_time() - start_time
    return (result, cpu_s) if result.success else None


def run_once(model: mstmm.Model, t_end: float, method: str, rtol: float) -> Any:
    """One run by a method at a tolerance."""
    return run_timed(model, t_end, method=method, rtol=rtol, atol=ATOL_PART * rtol)


def compute_reference(scene: mstmm.Scene, t_end: float) -> Reference | None:
    """The richest model by two methods that agree best; None where no two reach the end."""
    richest = model_levels(scene)[-1]
    model = mstmm.compile(richest.scene, engine="looped")
    measure = Renaming(PositionMeasure(model, model.simulate(0.0)))
    agreement = _best_agreement(model, measure, t_end)
    if agreement is None:
        return None
    error, numbers, q = agreement
    planar = planar_level(Variant("richest", richest.scene), model, q)
    return Reference(numbers, error, measure, richest.scene if planar is None else planar.scene)


def reference_in_parts(truth: Reference, beam_names: set[str], t_end: float) -> Reference | None:
    """The same with beams that one frame cannot follow in sixteen welded parts each."""
    split = split_beams(_with_splittable_beams(truth.base, beam_names), beam_names, _PARTS)
    model = mstmm.compile(split.scene, engine="looped")
    truth.measure.register(model, split.names)
    agreement = _best_agreement(model, truth.measure, t_end)
    return (
        None
        if agreement is None
        else Reference(agreement[1], agreement[0], truth.measure, truth.base)
    )


def _with_splittable_beams(scene: mstmm.Scene, beam_names: set[str]) -> mstmm.Scene:
    """The scene whose beams have nothing that belongs to shapes of the whole."""
    bodies = mstmm.compile(scene, engine="looped").flexible_bodies
    beams = (
        make_splittable(beam, float(modal_frequencies(bodies[beam.name])[0]))[0]
        if beam.name in beam_names
        else beam
        for beam in scene.beam
    )
    return with_tables(scene, beam=tuple(beams))


def _best_agreement(
    model: mstmm.Model, measure: Renaming, t_end: float
) -> tuple[float, np.ndarray, np.ndarray] | None:
    """Difference of the two runs that agree best, with numbers and coordinates of one."""
    runs = [
        run_and_time[0]
        for name, rtol in _REFERENCE_METHODS
        if (run_and_time := run_once(model, t_end, name, rtol))
    ]
    numbers = [measure.read(run) for run in runs]
    pairs = [
        (float(measure.distance(first, second).max()), i)
        for i, first in enumerate(numbers)
        for second in numbers[i + 1 :]
    ]
    if not pairs:
        return None
    error, i = min(pairs)
    return error, numbers[i], runs[i].q


def candidate_models(base: mstmm.Scene) -> Iterator[tuple[str, mstmm.Scene]]:
    """Scenes with every level and number of shapes per body; for many bodies all alike."""
    bodies = Bodies(base)
    choices_of_bodies = {
        name: list(_body_choices(richest)) for name, richest in bodies.richest.items()
    }
    if np.prod([len(choices) for choices in choices_of_bodies.values()]) <= _MAX_MODELS:
        choices_of_models = [
            dict(zip(choices_of_bodies, values, strict=True))
            for values in product(*choices_of_bodies.values())
        ]
    else:
        max_count = max(len(choices) for choices in choices_of_bodies.values())
        choices_of_models = [
            {name: choices[min(i, len(choices) - 1)] for name, choices in choices_of_bodies.items()}
            for i in range(max_count)
        ]
        choices_of_models += [
            {
                name: choices[i if name == body else -1]
                for name, choices in choices_of_bodies.items()
            }
            for body, own_choices in choices_of_bodies.items()
            for i in range(len(own_choices))
        ]
    for choices in choices_of_models:
        yield "; ".join(f"{k}: {v}" for k, v in choices.items()), bodies.scene_of(choices)


def _body_choices(richest: BodyModel) -> Iterator[BodyModel]:
    yield BodyModel(RIGID)
    yield BodyModel(ONE_WAY, richest.shapes)
    for n in range(1, max(count for _, count in richest.shapes) + 1):
        shapes = tuple((direction, min(n, count)) for direction, count in richest.shapes)
        yield BodyModel(LINEAR, shapes)
        yield BodyModel(STIFFENED, shapes)


def single_runs(truth: Reference, t_end: float, max_error: float, min_error: float) -> list[Run]:
    """Runs of all models with a model error below `max_error`, by all methods, loose to tight."""
    model_runs: list[tuple[float, str, mstmm.Model, float]] = []
    for name, scene in candidate_models(truth.base):
        try:
            model = mstmm.compile(scene, engine="looped")
        except mstmm.MstmmError:
            continue
        run = run_once(model, t_end, "auto", _MODEL_ERROR_RTOL)
        if run is not None and (error := _error(truth, run[0])) <= max_error:
            model_runs.append((run[1], name, model, error))
    runs: list[Run] = []
    for cost, name, model, error in sorted(model_runs, key=lambda run: run[0]):
        cheaper = [c for c, _, _, e in model_runs if e <= error]
        if cost <= _MAX_MODEL_COST_RATIO * min(cheaper):
            runs += _curves(truth, name, model, t_end, max(min_error, error), runs)
    return runs


def _curves(
    truth: Reference,
    name: str,
    model: mstmm.Model,
    t_end: float,
    model_error: float,
    runs_before: list[Run],
) -> list[Run]:
    runs: list[Run] = []
    for method in PROMISING:
        for rtol in TOLERANCES:
            run = run_once(model, t_end, method, rtol)
            if run is None:
                break
            error = _error(truth, run[0])
            runs.append(Run(name, method, rtol, error, run[1]))
            better = [
                other.cpu_s
                for other in (*runs_before, *runs)
                if other.error <= max(error, model_error)
            ]
            if error <= 1.1 * model_error or (better and run[1] > _MAX_COST_RATIO * min(better)):
                break
    return runs


def _error(truth: Reference, result: mstmm.Result) -> float:
    return float(truth.measure.distance(truth.measure.read(result), truth.numbers).max())


def cheapest(runs: list[Run], target: float, all_tighter: bool) -> Run | None:
    """Cheapest run that meets the target; `all_tighter`: all tighter ones of its curve too."""
    accurate = [run for run in runs if run.error <= target]
    if all_tighter:
        accurate = [
            run for run in accurate
            if all(
                other.error <= target for other in runs
                if (other.model, other.method) == (run.model, run.method) and other.rtol <= run.rtol
            )
        ]  # fmt: skip
    return min(accurate, key=lambda run: run.cpu_s, default=None)
