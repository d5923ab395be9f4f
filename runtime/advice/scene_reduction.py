"""What is changed of a scene around the choices for its bodies: its plane, hinges, welded bodies;
each change is run beside the reference before it counts.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

from mstmm.scene import split_reference

from ..chart.model_levels import Variant
from ..chart.planar_model import planar_level
from .advice_state import AdviceState
from .hinge_reduction import Change, apply_changes
from .measure_renaming import compose_names, rename_reference
from .scene_edits.weld_merging import merge_welds
from .trial_models import TrialResult

if TYPE_CHECKING:
    from ..model.model import Model

#: The search for smaller models ends when this part of the budget is spent.
SEARCH = 0.6

#: A planar scene is the same motion: it may err by this part of what is asked.
_SAME = 0.01

#: What is expected to err by so many times what suffices is not tried.
_UNLIKELY = 5.0


def in_plane(work: AdviceState, top: Variant, model: Model, richest: TrialResult) -> TrialResult:
    """The richest scene in its plane where that is the same motion."""
    flat = planar_level(top, model, work.bench.reference.q) if work.bench.span.whole else None
    if flat is None:
        return richest
    found = work.bench.tried("planar", flat.scene)
    if found.error > max(_SAME * work.asked.error, 3 * work.bench.floor):
        return richest
    hinges = [
        f'hinge "{old.name}": {new.type} instead of {old.type}, for the motion stays in a plane'
        for old, new in zip(top.scene.hinge, flat.scene.hinge, strict=True)
        if old != new
    ]
    work.told[found.name] = (*hinges, _measured("in its plane the scene", found, richest))
    return found


def reduce_by_halves(
    work: AdviceState,
    base: TrialResult,
    word: str,
    changes: list[Change],
    enough: float,
    cheap: bool,
) -> TrialResult:
    """The model with as many of these changes as it bears within an error that is enough, and
    within the time of the one before if they are to be `cheap`: all at once, else each half of
    them, down to parts of one."""
    if not work.bench.span.whole:
        return base
    names = work.measure.names_in(base.running)
    kept: list[Change] = []
    best, words = base, tuple[str, ...]()
    waiting = [[one for one in changes if one.expected * work.in_measure <= _UNLIKELY * enough]]
    told = work.told[base.name]
    while waiting and work.budget.left(SEARCH):
        more = waiting.pop()
        if not more:
            continue
        made = apply_changes(base.scene, [*kept, *more])
        name = f"{base.name}; {word}: {', '.join(one.name for one in (*kept, *more))}"
        found = work.bench.tried(name, made.scene, compose_names(names, made.names))
        if found.error <= enough and (not cheap or work.bench.as_cheap(found, best)):
            kept, best, words = [*kept, *more], found, made.words
        elif len(more) > 1:
            half = len(more) // 2
            waiting += [more[half:], more[:half]]
        else:
            waiting.append(list(more[0].parts))
    work.skipped += [f"{word} {one.name}" for more in waiting for one in more]
    if kept:
        alone = [_alone(work, base, word, one, names) for one in kept]
        if len(kept) > 1:
            alone.append(_measured(f"with these {len(kept)} changes the scene", best, base))
        work.told[best.name] = (*told, *alone, *words)
    return best


def _alone(
    work: AdviceState, base: TrialResult, word: str, change: Change, names: Mapping[str, str]
) -> str:
    """What one change is, and what it does alone where there is time to see it."""
    if not work.budget.left(SEARCH):
        return str(change)
    made = apply_changes(base.scene, [change])
    found = work.bench.tried(
        f"{base.name}; {word}: {change.name}", made.scene, compose_names(names, made.names)
    )
    return _measured(f"{change}; with that alone the scene", found, base)


def _measured(words: str, found: TrialResult, before: TrialResult) -> str:
    """The error of a model beside the richest, and its time beside that of the one before."""
    if not math.isfinite(found.error):
        return f"{words} does not run ({found.why})"
    part = found.cpu_s / before.cpu_s
    return f"{words} errs by {found.error:.1e} and takes {part:.2f} of the time before"


def merge_welded(work: AdviceState, base: TrialResult, enough: float) -> TrialResult:
    """The model with welded rigid bodies as one, and with the ground; where what is asked of is
    gone then, with the bodies and hinges of that as they are."""
    names_now = work.measure.names_in(base.running)
    asked = {split_reference(rename_reference(name, names_now))[0] for name in work.asked.of}
    for keep in [set(), asked] if asked else [set()]:
        found = merge_welds(base.scene, keep)
        if found is None:
            return base
        name = f"{base.name}; welded bodies as one" + (", but what is asked of" if keep else "")
        names = compose_names(names_now, found.names)
        still = dict(found.still)
        still |= {old: still[new] for old, new in names_now.items() if new in still}
        tried = work.bench.tried(name, found.scene, names, still)
        if tried.error <= enough:
            one = _measured("with welded bodies as one the scene", tried, base)
            work.told[name] = (*work.told[base.name], *found.words, one)
            return tried
    return base
