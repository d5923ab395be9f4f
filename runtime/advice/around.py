"""What is changed of a scene around the choices for its bodies: its plane, beams in parts, hinges,
welded bodies; each change is run beside the reference before it counts.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from mstmm.errors import MstmmError
from mstmm.scene import split

from ..chart.models import Variant
from ..chart.planar import planar
from .choice import Bodies
from .evidence import Evidence, gathered
from .hinges import Change, applied
from .merging import merged
from .renaming import composed, renamed
from .splitting import Split, unfit
from .splitting import in_parts as cut
from .trials import Tried
from .work import Work

if TYPE_CHECKING:
    from ..chart.trial import Trial
    from ..model.model import Model

#: The search for smaller models ends when this part of the budget is spent.
SEARCH = 0.6

#: A planar scene is the same motion: it may err by this part of what is asked.
_SAME = 0.01

#: Beams are split until the next halving changes less than this part of what is asked; what the
#: finer ones err by themselves is so many times less.
_PARTS, _FALLS = 0.5, 4.0

#: What is expected to err by so many times what suffices is not tried.
_UNLIKELY = 5.0


def in_plane(work: Work, top: Variant, model: Model, richest: Tried) -> Tried:
    """The richest scene in its plane where that is the same motion."""
    flat = planar(top, model, work.bench.reference.q) if work.bench.span.whole else None
    if flat is None:
        return richest
    found = work.bench.tried("planar", flat.scene)
    if found.error > max(_SAME * work.asked.error, 3 * work.bench.floor):
        return richest
    work.told[found.name] = tuple(
        f'hinge "{old.name}": {new.type} instead of {old.type}, for the motion stays in a plane'
        for old, new in zip(top.scene.hinge, flat.scene.hinge, strict=True)
        if old != new
    )
    return found


def in_parts(
    work: Work, base: Tried, evidence: dict[str, Evidence]
) -> tuple[Tried, dict[str, Evidence]]:
    """The richest scene with beams split that one frame cannot follow, and its evidence.

    They are halved until the next halving changes little; the finest one is the reference.
    """
    steep = [beam.name for beam in base.scene.beam if work.steep(evidence.get(beam.name))]
    names = [one.name for one in base.scene.beam if one.name in steep and not unfit(one)]
    if not names:
        return base, evidence
    asked, found, apart = work.asked.error, Split(base.scene, {}, {}), math.inf
    try:
        run = work.bench.finer(base.scene, {}, base.name)
        for count in (2, 4, 8):
            parts = cut(base.scene, names, count)
            finer = work.bench.finer(parts.scene, parts.names, f"beams in {count} parts")
            if finer.numbers is None:
                work.notes.append(f"beams could not be run in {count} parts: {finer.failure}")
                break
            apart = work.bench.apart(run, finer)
            if apart <= _PARTS * asked:
                break
            found, run = parts, finer
    except MstmmError as problem:
        work.notes.append(f"beams could not be split: {problem}")
        return base, evidence
    if found.scene is base.scene:
        work.split_error = apart if math.isfinite(apart) else None
        return base, evidence
    work.unseen = apart / _FALLS
    if apart > _PARTS * asked:
        work.notes.append(
            f"the last halving of beams still changed {apart:.1e}: what is left of that, about "
            f"{work.unseen:.1e}, counts with the error"
        )
    return _of_parts(work, base, found, finer if apart <= _PARTS * asked else run)


def _other_names(of: str, names: Mapping[str, str]) -> str:
    """Ends of a beam that are those of a part now: their former names are ends of another one."""
    own = [f"{old} is {new}" for old, new in names.items() if old.startswith(f"{of}.")]
    return f"; {', '.join(own)} now" if own else ""


def _of_parts(
    work: Work, base: Tried, found: Split, reference: Trial
) -> tuple[Tried, dict[str, Evidence]]:
    """The scene in parts as the richest one, beside a reference with as many parts or more."""
    told = work.told[base.name]
    work.parts = found.parts
    work.whole = {**Bodies(found.scene).richest, **work.whole}
    single = work.bench.apart(work.bench.reference, reference)
    work.bench.refer_again(reference, found.names)
    tried = work.bench.tried("beams in parts", found.scene)
    wholes: dict[str, list[str]] = {}
    for part, of in found.parts.items():
        wholes.setdefault(of, []).append(part)
    work.told[tried.name] = (*told, *(
        f'beam "{of}": {len(parts)} welded beams ({", ".join(parts)}) with frames of their '
        f"own, for with one frame it errs by {single:.1e}" + _other_names(of, found.names)
        for of, parts in wholes.items()
    ))  # fmt: skip
    evidence, why = gathered(work.least(found.scene), work.length)
    if why:
        work.notes.append(f"nothing is known of the parts of beams beforehand: {why}")
    return tried, evidence


def changed(
    work: Work, base: Tried, word: str, changes: list[Change], enough: float, cheap: bool
) -> Tried:
    """The model with as many of these changes as it bears within an error that is enough, and
    within the time of the one before if they are to be `cheap`: all at once, or one after the
    other."""
    if not work.bench.span.whole:
        return base
    likely = [one for one in changes if one.expected * work.in_measure <= _UNLIKELY * enough]
    kept: list[Change] = []
    best = base
    tries = [likely, *([one] for one in likely if len(likely) > 1)] if likely else []
    for more in tries:
        if not work.budget.left(SEARCH) or len(kept) == len(likely):
            break
        names = ", ".join(one.name for one in (*kept, *more))
        scene = applied(base.scene, [*kept, *more])
        found = work.bench.tried(f"{base.name}; {word}: {names}", scene)
        if found.error <= enough and (not cheap or work.bench.as_cheap(found, best)):
            kept, best = [*kept, *more], found
    work.told[best.name] = (*work.told[base.name], *map(str, kept))
    return best


def lumped(work: Work, base: Tried, enough: float) -> Tried:
    """The model with welded rigid bodies as one, and with the ground; where what is asked of is
    gone then, with the bodies and hinges of that as they are."""
    names_now = work.measure.names_in(base.running)
    asked = {split(renamed(name, names_now))[0] for name in work.asked.of}
    for keep in [set(), asked] if asked else [set()]:
        found = merged(base.scene, keep)
        if found is None:
            return base
        name = f"{base.name}; welded bodies as one" + (", but what is asked of" if keep else "")
        names = composed(names_now, found.names)
        still = dict(found.still)
        still |= {old: still[new] for old, new in names_now.items() if new in still}
        tried = work.bench.tried(name, found.scene, names, still)
        if tried.error <= enough:
            work.told[name] = (*work.told[base.name], *found.words)
            return tried
    return base
