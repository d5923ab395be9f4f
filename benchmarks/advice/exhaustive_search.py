"""The cheapest model that meets an error, found by trying all: levels and shapes of every body,
each by several methods over their tolerances."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

import mstmm
from mstmm.runtime.advice.beam_splitting import make_splittable, split_beams
from mstmm.runtime.advice.body_model_levels import (
    LINEAR,
    ONE_WAY,
    RIGID,
    STIFFENED,
    Bodies,
    BodyModel,
)
from mstmm.runtime.advice.measure_renaming import Renaming
from mstmm.runtime.chart.error_measure import PositionMeasure
from mstmm.runtime.chart.method_families import PROMISING
from mstmm.runtime.chart.model_levels import Variant, model_levels, with_tables
from mstmm.runtime.chart.planar_model import planar_level
from mstmm.runtime.result.flexible.modal_energy import modal_frequencies
from mstmm.runtime.result.one_way.result import OneWayResult

#: Samples at which errors are looked at: others than an advice looks at.
SAMPLES = 241

#: Tolerances of runs, with a hundredth of each as the absolute one; of those that show what a model
#: errs by itself, and of the two of the reference.
TOLERANCES = tuple(10.0**-k for k in range(2, 9))
ATOL_PART, _OWN, _TRUTH = 0.01, 1e-7, (("rodas5p", 1e-9), ("dop853", 1e-10), ("auto", 1e-9))

#: Parts of a beam in the truth of one that is split.
_PARTS = 16

#: Steps after which a run is given up; models that are tried of one scene.
_MOST_STEPS, _MOST_MODELS = 200_000, 81

#: A method is followed no further where it costs so many times the cheapest run that errs by less,
#: nor a model where its own run costs so many times that of the cheapest one.
_HOPELESS, _SLOW = 6.0, 12.0


@dataclass(frozen=True)
class Truth:
    """What the richest model does, and how far two methods are apart."""

    numbers: np.ndarray
    error: float
    measure: Renaming
    base: mstmm.Scene


@dataclass(frozen=True)
class Single:
    """A run of a model: its error and processor time of the call, s."""

    model: str
    method: str
    rtol: float
    error: float
    cpu_s: float

    def __str__(self) -> str:
        return f"{self.model}, {self.method} {self.rtol:.0e}"


def timed(
    model: mstmm.Model, t_end: float, method: str, **options: Any
) -> tuple[mstmm.Result, float] | None:
    """A run and the processor time of the call, with the elastic response where there is one; None
    where it does not reach the end."""
    times = np.linspace(0.0, t_end, SAMPLES)
    limited = mstmm.methods.Method(method, max_steps=_MOST_STEPS)
    begin = time.process_time()
    try:
        result = model.simulate(t_end, limited, output_times=times, **options)
        if isinstance(result, OneWayResult) and result.success:
            _ = result.cost
    except mstmm.MstmmError:
        return None
    spent = time.process_time() - begin
    return (result, spent) if result.success else None


def single(model: mstmm.Model, t_end: float, method: str, rtol: float) -> Any:
    """One run by a method at a tolerance."""
    return timed(model, t_end, method=method, rtol=rtol, atol=ATOL_PART * rtol)


def truth(scene: mstmm.Scene, t_end: float) -> Truth | None:
    """The richest model by two methods that agree best; None where no two reach the end."""
    top = model_levels(scene)[-1]
    model = mstmm.compile(top.scene, engine="looped")
    measure = Renaming(PositionMeasure(model, model.simulate(0.0)))
    found = _agreed(model, measure, t_end)
    if found is None:
        return None
    error, numbers, q = found
    flat = planar_level(Variant("richest", top.scene), model, q)
    return Truth(numbers, error, measure, top.scene if flat is None else flat.scene)


def truth_in_parts(known: Truth, wholes: set[str], t_end: float) -> Truth | None:
    """The same with beams that one frame cannot follow in sixteen welded parts each."""
    parts = split_beams(_divisible(known.base, wholes), wholes, _PARTS)
    model = mstmm.compile(parts.scene, engine="looped")
    known.measure.register(model, parts.names)
    found = _agreed(model, known.measure, t_end)
    return None if found is None else Truth(found[1], found[0], known.measure, known.base)


def _divisible(scene: mstmm.Scene, wholes: set[str]) -> mstmm.Scene:
    """The scene whose beams have nothing that belongs to shapes of the whole."""
    bodies = mstmm.compile(scene, engine="looped").flexible_bodies
    beams = (
        make_splittable(beam, float(modal_frequencies(bodies[beam.name])[0]))[0]
        if beam.name in wholes
        else beam
        for beam in scene.beam
    )
    return with_tables(scene, beam=tuple(beams))


def _agreed(
    model: mstmm.Model, measure: Renaming, t_end: float
) -> tuple[float, np.ndarray, np.ndarray] | None:
    """How far the two runs are apart that agree best, and numbers and coordinates of one."""
    runs = [found[0] for name, rtol in _TRUTH if (found := single(model, t_end, name, rtol))]
    numbers = [measure.read(run) for run in runs]
    pairs = [
        (float(measure.distance(a, b).max()), i)
        for i, a in enumerate(numbers)
        for b in numbers[i + 1 :]
    ]
    if not pairs:
        return None
    error, i = min(pairs)
    return error, numbers[i], runs[i].q


def models(base: mstmm.Scene) -> Iterator[tuple[str, mstmm.Scene]]:
    """Every level and number of shapes of every body; of many bodies all alike."""
    bodies = Bodies(base)
    each = {name: list(_choices(richest)) for name, richest in bodies.richest.items()}
    if np.prod([len(one) for one in each.values()]) <= _MOST_MODELS:
        picked = [dict(zip(each, some, strict=True)) for some in product(*each.values())]
    else:
        most = max(len(one) for one in each.values())
        picked = [{name: one[min(i, len(one) - 1)] for name, one in each.items()}
                  for i in range(most)]  # fmt: skip
        picked += [
            {name: one[-1] if name != other else one[i] for name, one in each.items()}
            for other in each for i in range(len(each[other]))
        ]  # fmt: skip
    for choices in picked:
        yield "; ".join(f"{k}: {v}" for k, v in choices.items()), bodies.scene_of(choices)


def _choices(richest: BodyModel) -> Iterator[BodyModel]:
    yield BodyModel(RIGID)
    yield BodyModel(ONE_WAY, richest.shapes)
    for n in range(1, max(count for _, count in richest.shapes) + 1):
        kept = tuple((word, min(n, count)) for word, count in richest.shapes)
        yield BodyModel(LINEAR, kept)
        yield BodyModel(STIFFENED, kept)


def singles(known: Truth, t_end: float, loosest: float, tightest: float) -> list[Single]:
    """Runs of every model that errs by less than `loosest` by itself, by every method, from loose
    to tight."""
    own: list[tuple[float, str, mstmm.Model, float]] = []
    for name, scene in models(known.base):
        try:
            model = mstmm.compile(scene, engine="looped")
        except mstmm.MstmmError:
            continue
        found = single(model, t_end, "auto", _OWN)
        if found is not None and (error := _error(known, found[0])) <= loosest:
            own.append((found[1], name, model, error))
    made: list[Single] = []
    for cost, name, model, error in sorted(own, key=lambda one: one[0]):
        rivals = [c for c, _, _, e in own if e <= error]
        if cost <= _SLOW * min(rivals):
            made += _curves(known, name, model, t_end, max(tightest, error), made)
    return made


def _curves(
    known: Truth, name: str, model: mstmm.Model, t_end: float, least: float, made: list[Single]
) -> list[Single]:
    found: list[Single] = []
    for method in PROMISING:
        for rtol in TOLERANCES:
            run = single(model, t_end, method, rtol)
            if run is None:
                break
            error = _error(known, run[0])
            found.append(Single(name, method, rtol, error, run[1]))
            better = [x.cpu_s for x in (*made, *found) if x.error <= max(error, least)]
            if error <= 1.1 * least or (better and run[1] > _HOPELESS * min(better)):
                break
    return found


def _error(known: Truth, result: mstmm.Result) -> float:
    return float(known.measure.distance(known.measure.read(result), known.numbers).max())


def cheapest(made: list[Single], asked: float, sure: bool) -> Single | None:
    """The cheapest run that errs by no more; `sure`: as do all tighter ones of its curve."""
    good = [one for one in made if one.error <= asked]
    if sure:
        good = [
            one for one in good
            if all(
                x.error <= asked for x in made
                if (x.model, x.method) == (one.model, one.method) and x.rtol <= one.rtol
            )
        ]  # fmt: skip
    return min(good, key=lambda one: one.cpu_s, default=None)
