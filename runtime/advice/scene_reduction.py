"""Reduce a scene apart from the levels of its bodies: plane, hinges, springs, welded bodies.

Each change is compared with the reference in a run before it is used.
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

#: Fraction of the budget after which the search for smaller models ends.
SEARCH = 0.6

#: Largest error of a planar scene, as a fraction of the target error: its motion must be the same.
_PLANAR_ERROR = 0.01

#: Changes with an estimated error above this many times the allowed one are not tried.
_MAX_ESTIMATE = 5.0


def reduce_to_plane(
    state: AdviceState, top: Variant, model: Model, richest: TrialResult
) -> TrialResult:
    """The planar form of the richest scene, if its motion is the same; else the scene."""
    if not state.runner.span.is_whole_run:
        return richest
    planar = planar_level(top, model, state.runner.reference.q)
    if planar is None:
        return richest
    tried = state.runner.run_trial("planar", planar.scene)
    if tried.error > max(_PLANAR_ERROR * state.request.error, 3 * state.runner.floor):
        return richest
    hinges = [
        f'hinge "{old.name}": {new.type} instead of {old.type}, because the motion is planar'
        for old, new in zip(top.scene.hinge, planar.scene.hinge, strict=True)
        if old != new
    ]
    state.change_texts[tried.name] = (*hinges, _measured_text("planar scene", tried, richest))
    return tried


def reduce_by_halves(
    state: AdviceState,
    base: TrialResult,
    word: str,
    changes: list[Change],
    max_error: float,
    cheap: bool,
) -> TrialResult:
    """Apply as many changes as the allowed error permits; with `cheap` none that adds CPU time.

    All changes are tried together, then by halves, down to the parts of single changes.  `word`
    describes the changes in names of models.
    """
    if not state.runner.span.is_whole_run:
        return base
    names = state.measure.names_of(base.compiled_model)
    kept: list[Change] = []
    best, chain_sentences = base, tuple[str, ...]()
    limit = _MAX_ESTIMATE * max_error
    waiting = [
        [
            change
            for change in changes
            if change.expected_displacement * state.error_per_metre <= limit
        ]
    ]
    sentences = state.change_texts[base.name]
    while waiting and state.budget.remaining(SEARCH):
        group = waiting.pop()
        if not group:
            continue
        changed = apply_changes(base.scene, [*kept, *group])
        changed_names = ", ".join(change.name for change in (*kept, *group))
        name = f"{base.name}; {word}: {changed_names}"
        tried = state.runner.run_trial(name, changed.scene, compose_names(names, changed.names))
        if tried.error <= max_error and (not cheap or state.runner.is_as_cheap(tried, best)):
            kept, best, chain_sentences = [*kept, *group], tried, changed.descriptions
        elif len(group) > 1:
            half = len(group) // 2
            waiting += [group[half:], group[:half]]
        else:
            waiting.append(list(group[0].parts))
    state.skipped += [f"{word} {change.name}" for group in waiting for change in group]
    if kept:
        single = [_single_change_text(state, base, word, change, names) for change in kept]
        if len(kept) > 1:
            single.append(_measured_text(f"with these {len(kept)} changes", best, base))
        state.change_texts[best.name] = (*sentences, *single, *chain_sentences)
    return best


def _single_change_text(
    state: AdviceState, base: TrialResult, word: str, change: Change, names: Mapping[str, str]
) -> str:
    """Description of a change, with its effect alone if there is time for a run."""
    if not state.budget.remaining(SEARCH):
        return str(change)
    changed = apply_changes(base.scene, [change])
    tried = state.runner.run_trial(
        f"{base.name}; {word}: {change.name}", changed.scene, compose_names(names, changed.names)
    )
    return _measured_text(f"{change}; this change alone", tried, base)


def _measured_text(description: str, tried: TrialResult, before: TrialResult) -> str:
    """Error of a model, and its CPU time relative to the model before a change."""
    if not math.isfinite(tried.error):
        return f"{description}: fails ({tried.reason})"
    ratio = tried.cpu_s / before.cpu_s
    return f"{description}: error {tried.error:.1e}, {ratio:.2f} of the time before"


def merge_welded(state: AdviceState, base: TrialResult, max_error: float) -> TrialResult:
    """Merge welded rigid bodies, and those welded to the ground, within the allowed error.

    If the compared quantities are not available then, their bodies and hinges are kept.
    """
    names_now = state.measure.names_of(base.compiled_model)
    compared = {split_reference(rename_reference(name, names_now))[0] for name in state.request.of}
    for keep in [set(), compared] if compared else [set()]:
        merged = merge_welds(base.scene, keep)
        if merged is None:
            return base
        name = f"{base.name}; welded bodies merged" + (", except compared ones" if keep else "")
        names = compose_names(names_now, merged.names)
        still = dict(merged.fixed_points)
        still |= {old: still[new] for old, new in names_now.items() if new in still}
        tried = state.runner.run_trial(name, merged.scene, names, still)
        if tried.error <= max_error:
            effect = _measured_text("with welded bodies merged", tried, base)
            state.change_texts[name] = (
                *state.change_texts[base.name],
                *merged.descriptions,
                effect,
            )
            return tried
    return base
