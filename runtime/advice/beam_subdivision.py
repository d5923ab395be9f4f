"""Beams in parts where one floating frame cannot follow them; the finest ones are the reference."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from mstmm.errors import MstmmError
from mstmm.scene import Scene
from mstmm.scene.tables.beam import Beam

from ..chart.model_levels import with_tables
from .beam_splitting import SplitScene, divisible, unfit
from .beam_splitting import in_parts as cut
from .body_model_levels import Bodies
from .error_predictors import ErrorPrediction
from .trial_models import TrialResult

if TYPE_CHECKING:
    from ..chart.trial_run import Trial
    from .advice_state import AdviceState

#: Beams are split until the next halving changes less than this part of what is asked; what the
#: finer ones err by themselves is so many times less.
_PARTS, _FALLS = 0.5, 4.0

#: Numbers of parts that are tried.
_COUNTS = (2, 4, 8, 16)

#: What has to change of a beam before it can be split may change this part of what is asked.
_ALIKE = 0.3


def in_parts(
    work: AdviceState, base: TrialResult, evidence: dict[str, ErrorPrediction]
) -> tuple[TrialResult, dict[str, ErrorPrediction]]:
    """The richest scene with beams split that one frame cannot follow, and its evidence.

    They are halved until the next halving changes little; the finest one is the reference.
    """
    steep = {one.name for one in base.scene.beam if work.steep(evidence.get(one.name))}
    steep -= {one.name for one in base.scene.beam if unfit(one)}
    if not steep:
        return base, evidence
    try:
        whole, run, told = _divisible(work, base, steep, evidence)
        found, finer, apart = _halved(work, whole, run, steep)
    except MstmmError as problem:
        work.notes.append(f"beams could not be split: {problem}")
        return base, evidence
    if found.scene is whole:
        work.split_error = apart if math.isfinite(apart) else None
        work.unseen = 0.0
        return base, evidence
    left = apart / _FALLS
    work.unseen += left
    if apart > _PARTS * work.asked.error:
        work.notes.append(
            f"the last halving of beams still changed {apart:.1e}: what is left of that, about "
            f"{left:.1e}, counts with the error"
        )
    return _of_parts(work, base, found, finer, told)


def _divisible(
    work: AdviceState, base: TrialResult, steep: set[str], evidence: Mapping[str, ErrorPrediction]
) -> tuple[Scene, Trial, tuple[str, ...]]:
    """The scene whose beams can be split, its run, and what was changed for that in words; those
    that would do something else then are no longer among the steep ones."""
    scene, said = _with_divisible(base.scene, steep, evidence)
    if not said:
        return scene, work.bench.finer(scene, work.bench.names, base.name), ()
    run = work.bench.finer(scene, work.bench.names, "beams that can be split")
    apart = math.inf if run.numbers is None else work.bench.apart(work.bench.reference, run)
    if apart <= _ALIKE * work.asked.error:
        work.unseen = apart
        words = (f'beam "{name}": {what}, which changes {apart:.1e}' for name, what in said.items())
        return scene, run, tuple(words)
    work.notes += [
        f'beam "{name}" stays whole: {what}, as it needs to be split, changes {apart:.1e}'
        for name, what in said.items()
    ]
    steep -= {*said}
    return base.scene, work.bench.finer(base.scene, work.bench.names, base.name), ()


def _with_divisible(
    scene: Scene, steep: set[str], evidence: Mapping[str, ErrorPrediction]
) -> tuple[Scene, dict[str, str]]:
    said = {}

    def changed(beam: Beam) -> Beam:
        if beam.name not in steep:
            return beam
        made, what = divisible(beam, evidence[beam.name].frequency)
        if what:
            said[beam.name] = what
        return made

    beams = tuple(map(changed, scene.beam))
    return with_tables(scene, beam=beams) if said else scene, said


def _halved(
    work: AdviceState, whole: Scene, run: Trial, names: set[str]
) -> tuple[SplitScene, Trial, float]:
    """The scene with beams in enough parts, the finest run, and what the last halving changed."""
    found, apart = SplitScene(whole, {}, {}), math.inf
    for count in _COUNTS if names else ():
        parts = cut(whole, names, count)
        finer = work.bench.finer(parts.scene, parts.names, f"beams in {count} parts")
        if finer.numbers is None:
            work.notes.append(f"beams could not be run in {count} parts: {finer.failure}")
            break
        apart = work.bench.apart(run, finer)
        if apart <= _PARTS * work.asked.error:
            return found, finer, apart
        found, run = parts, finer
    return found, run, apart


def _of_parts(
    work: AdviceState, base: TrialResult, found: SplitScene, reference: Trial, told: tuple[str, ...]
) -> tuple[TrialResult, dict[str, ErrorPrediction]]:
    """The scene in parts as the richest one, beside a reference with as many parts or more."""
    work.parts = found.parts
    work.whole = {**Bodies(found.scene).richest, **work.whole}
    single = work.bench.apart(work.bench.reference, reference)
    work.bench.refer_again(reference, found.names)
    tried = work.bench.tried("beams in parts", found.scene)
    wholes: dict[str, list[str]] = {}
    for part, of in found.parts.items():
        wholes.setdefault(of, []).append(part)
    work.told[tried.name] = (*work.told[base.name], *told, *(
        f'beam "{of}": {len(parts)} welded beams ({", ".join(parts)}) with frames of their '
        f"own, for with one frame it errs by {single:.1e}" + _other_names(of, found.names)
        for of, parts in wholes.items()
    ))  # fmt: skip
    evidence, why = work.known(work.least(found.scene), tried.running)
    if why:
        work.notes.append(f"nothing is known of the parts of beams beforehand: {why}")
    return tried, evidence


def _other_names(of: str, names: Mapping[str, str]) -> str:
    """Ends of a beam that are those of a part now: their former names are ends of another one."""
    own = [f"{old} is {new}" for old, new in names.items() if old.startswith(f"{of}.")]
    return f"; {', '.join(own)} now" if own else ""
