"""Hinges that may be made rigid, and springs that may be omitted, by their motion in a run."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from mstmm.array_validation import Array
from mstmm.expression.expression import number
from mstmm.ir.hinge_properties import builtin_hinges
from mstmm.numerics.rotations import product, rotation_about, to_quaternion
from mstmm.scene import Chain, Hinge, Scene, split_reference
from mstmm.scene.tables.hinge import HingeTable
from mstmm.scene.tables.law import Law

from ..model_levels import Variant, planar_level, with_tables
from ..tuning import REDUCTION as TUNING
from .advice_state import AdviceState
from .scene_edits import (
    ExpandedScene,
    chain_members,
    compose_names,
    expand_chains,
    expandable_chains,
    rename_reference,
)
from .trial_models import TrialResult
from .weld_merging import merge_welds

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene
    from ..simulation import SimulatedScene


T = TypeVar("T", bound=HingeTable)

#: Coordinates below this fraction of the scene length count as zero.
_ZERO_TOLERANCE = 1e-9

#: Keys of a hinge law that are omitted together.
_PASSIVE = ("stiffness", "rest", "damping", "friction")


@dataclass(frozen=True)
class Change:
    """Possible change of a hinge, chain or spring of a scene.

    Attributes:
        element: kind and name of the changed element.
        description: description of the change, with numbers.
        expected_displacement: estimated displacement of the attached bodies, m; 0 if unknown.
        name: name of the changed element; of a member of a chain, its name in the expanded chain.
        replacement: new hinge or chain, None for an omitted spring.
        parts: smaller changes to try if the error of this one is too large.
    """

    element: str
    description: str
    expected_displacement: float
    name: str
    replacement: Hinge | Chain | None = None
    parts: tuple[Change, ...] = ()

    def __str__(self) -> str:
        return f"{self.element}: {self.description}"


def apply_changes(scene: Scene, changes: Sequence[Change]) -> ExpandedScene:
    """The scene with these changes; chains with changed members are expanded."""
    new_hinges = {c.name: c.replacement for c in changes if isinstance(c.replacement, Hinge)}
    new_chains = {c.name: c.replacement for c in changes if isinstance(c.replacement, Chain)}
    omitted_springs = {change.name for change in changes if change.replacement is None}
    changed = with_tables(
        scene,
        chain=tuple(new_chains.get(chain.name, chain) for chain in scene.chain),
        spring=tuple(spring for spring in scene.spring if spring.name not in omitted_springs),
    )
    changed_chains = [
        chain
        for chain in expandable_chains(changed)
        if any(member.new_hinge in new_hinges for member in chain_members(changed, chain))
    ]
    expanded = expand_chains(changed, changed_chains)
    hinges = tuple(new_hinges.get(hinge.name, hinge) for hinge in expanded.scene.hinge)
    return replace(expanded, scene=with_tables(expanded.scene, hinge=hinges))


def _hinges(scene: Scene) -> Iterator[tuple[str, Hinge]]:
    """All hinges with their names in the scene; those of chains as in the expanded chain."""
    yield from ((hinge.name, hinge) for hinge in scene.hinge)
    chains = expandable_chains(scene)
    expanded_hinges = expand_chains(scene, chains).scene.hinge[len(scene.hinge) :]
    by_name = {hinge.name: hinge for hinge in expanded_hinges}
    for chain in chains:
        for member in chain_members(scene, chain):
            yield member.hinge, by_name[member.new_hinge]


# --- rigid hinges -------------------------------------------------------------------------------


def rigid_hinge_changes(scene: Scene, model: CompiledScene, q: Array, reach: float) -> list[Change]:
    """Changes that make a hinge rigid, by increasing motion of the hinge in a run of `model`.

    q (n, nq) are the coordinates of the run; `reach` (m) is the displacement of the outboard bodies
    per rad of rotation.
    """
    changes: list[Change] = []
    released = {event.hinge for event in scene.event}
    for name, hinge in _hinges(scene):
        simulated = model.scene.hinges.by_name.get(name)
        properties = hinge.builtin
        if properties is None or properties.welds:
            continue
        if simulated is None or simulated.type != hinge.type:
            continue
        if hinge.drive is not None or hinge.is_released or name in released:
            continue
        hinge_q = q[:, model.coordinate_layout.hinges[name].q_slice]
        change = None
        if properties.quaternion is not None:
            change = _rigid_at_reference_position(hinge, hinge_q, reach)
        elif properties.straight:
            change = _rigid_at_mean_position(hinge, hinge_q, reach)
        if change is not None:
            changes.append(replace(change, element=f'hinge "{name}"'))
    return sorted(changes, key=lambda change: change.expected_displacement)


def _rigid_at_mean_position(hinge: Hinge, hinge_q: Array, reach: float) -> Change:
    """Make a hinge without quaternion rigid at the middle of the range of its coordinates."""
    properties = hinge.builtin
    assert properties is not None
    low, high = hinge_q.min(axis=0), hinge_q.max(axis=0)
    middle, half_range = (low + high) / 2, (high - low) / 2
    lever_arms = [
        reach if coordinate.unit == "rad" else 1.0 for coordinate in properties.coordinates
    ]
    expected = float(np.max(half_range * lever_arms, initial=0.0))
    position = ", ".join(
        f"{coordinate.name} {value:.3g} {coordinate.unit}"
        for coordinate, value in zip(properties.coordinates, middle, strict=True)
    )
    words = f"rigid at {position}, largest motion {np.max(half_range, initial=0.0):.1e}"
    if properties.in_place and not np.any(np.abs(middle) * lever_arms > _ZERO_TOLERANCE * reach):
        rigid = _weld_hinge(hinge, to_quaternion(hinge.rotation))
    elif properties.axial and properties.turns and not properties.slides:
        rotation = product(hinge.rotation, rotation_about(hinge.unit_axis, float(middle[0])))
        rigid = _weld_hinge(hinge, to_quaternion(rotation))
    else:
        drive = tuple(number(float(value)) for value in middle)
        rigid = hinge.model_copy(update={"drive": drive, "initial": None, "law": _zero_law(hinge)})
    return Change(f'hinge "{hinge.name}"', words, expected, hinge.name, rigid)


def _rigid_at_reference_position(hinge: Hinge, hinge_q: Array, reach: float) -> Change | None:
    """Make a hinge with a quaternion rigid where its two ends coincide; None if not possible."""
    properties = hinge.builtin
    assert properties is not None
    if properties.quaternion is None or len(properties.slides) not in (0, 3):
        return None
    if properties.frame != "own":
        return None
    vector = hinge_q[:, properties.quaternion + 1 : properties.quaternion + 4]
    angle = 2 * float(np.arcsin(np.clip(np.linalg.norm(vector, axis=1), 0, 1)).max(initial=0.0))
    distances = np.linalg.norm(hinge_q[:, : properties.quaternion], axis=1)
    distance = float(distances.max(initial=0.0))
    words = f"rigid, largest motion {distance:.1e} m and {angle:.1e} rad"
    rigid = _weld_hinge(hinge, to_quaternion(hinge.rotation))
    return Change(f'hinge "{hinge.name}"', words, distance + reach * angle, hinge.name, rigid)


def _weld_hinge(hinge: Hinge, orientation: Sequence[float]) -> Hinge:
    """Weld that replaces a hinge, with this orientation (quaternion)."""
    weld_type = next(name for name, properties in builtin_hinges().items() if properties.welds)
    return Hinge(
        name=hinge.name, type=weld_type, inboard=hinge.inboard, outboard=hinge.outboard,
        orientation=tuple(orientation), position=hinge.position,
    )  # fmt: skip


# --- omitted springs, dampers and friction ------------------------------------------------------


def omission_changes(scene: Scene) -> list[Change]:
    """Changes that omit springs, dampers and friction of a hinge or chain, or a spring element.

    In a chain they are omitted from all hinges together, or else from single hinges.
    """
    hinges_of_chains = {
        chain.name: [member.hinge for member in chain_members(scene, chain)]
        for chain in expandable_chains(scene)
    }
    chain_hinges = {name for names in hinges_of_chains.values() for name in names}
    change_by_hinge = {}
    for name, hinge in _hinges(scene):
        if _has_passive_law(hinge):
            text = _omission_text(_passive_law_names(hinge.law))
            rest = _remove_passive_law(hinge)
            change_by_hinge[name] = Change(f'hinge "{name}"', text, 0.0, hinge.name, rest)
    changes = [change for name, change in change_by_hinge.items() if name not in chain_hinges]
    for chain in scene.chain:
        if any(map(_has_passive_law, chain.hinge)):
            hinges = [_remove_passive_law(h) if _has_passive_law(h) else h for h in chain.hinge]
            omitted = dict.fromkeys(n for h in chain.hinge for n in _passive_law_names(h.law))
            members = hinges_of_chains.get(chain.name, ())
            changes.append(
                Change(
                    f'chain "{chain.name}"', _omission_text(omitted), 0.0, chain.name,
                    chain.model_copy(update={"hinge": tuple(hinges)}),
                    tuple(change_by_hinge[name] for name in members if name in change_by_hinge),
                )
            )  # fmt: skip
    changes += [
        Change(f'spring "{spring.name}"', "left out, negligible effect", 0.0, spring.name)
        for spring in scene.spring
    ]
    return changes


def _remove_passive_law(hinge: T) -> T:
    """A hinge without springs, dampers and friction."""
    update = {key: getattr(_zero_law(hinge), key) for key in _PASSIVE}
    return hinge.model_copy(update={"law": hinge.law.model_copy(update=update)})


def _omission_text(names: Iterable[str]) -> str:
    return f"without its {' and '.join(names)}, negligible effect"


def _has_passive_law(hinge: HingeTable) -> bool:
    """Whether a built-in hinge that is not prescribed has springs, dampers or friction."""
    return (
        hinge.builtin is not None
        and hinge.drive is None
        and next(_passive_law_names(hinge.law), None) is not None
    )


def _passive_law_names(law: Law) -> Iterator[str]:
    if any(law.stiffness):
        yield "spring"
    if any(law.damping):
        yield "damper"
    if any(friction.acts for friction in law.friction):
        yield "friction"


def _zero_law(hinge: HingeTable) -> Law:
    """A law without any effort, with as many entries as the hinge has speeds."""
    properties = hinge.builtin
    assert properties is not None
    neutral, count = Law().entry(0), len(properties.speeds)
    return Law().model_copy(
        update={key: (getattr(neutral, key),) * count for key in Law.model_fields}
    )


def reduce_to_plane(
    state: AdviceState, top: Variant, model: SimulatedScene, richest: TrialResult
) -> TrialResult:
    """The planar form of the richest scene, if its motion is the same; else the scene."""
    if not state.runner.span.is_whole_run:
        return richest
    planar = planar_level(top, model, state.runner.reference.trajectory.q)
    if planar is None:
        return richest
    tried = state.runner.run_trial("planar", planar.scene)
    if tried.error > max(TUNING.planar_error * state.request.error, 3 * state.runner.floor):
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
    limit = TUNING.max_change_estimate * max_error
    waiting = [
        [
            change
            for change in changes
            if change.expected_displacement * state.error_per_metre <= limit
        ]
    ]
    sentences = state.change_texts[base.name]
    while waiting and state.budget.remaining(TUNING.search_budget):
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
    if not state.budget.remaining(TUNING.search_budget):
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
