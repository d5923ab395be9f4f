"""Hinge laws -> which law kernel acts on which speeds, with what numbers."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import NamedTuple

from mstmm.expression.expression import Expression, number
from mstmm.ir.hinge_properties import builtin_hinges
from mstmm.scene import Hinge, LawEntry, Scene
from mstmm.scene.checks.topology import BodyRow, Topology
from mstmm.scene.tables.hinge_frames import twist_axes

from .coordinate_layout import HingeSlots, Layout
from .expression_tapes import Values
from .system import LawNumbers, LawRun, Numbers, Places

_NOTHING = number(0)

#: Bounds that no coordinate reaches, for a stop on one side only.
_FAR = 1e300


class Draft(NamedTuple):
    """A law of `member` in the pattern, whose places are not known yet, with one effort a speed."""

    member: int
    kernel: str
    coordinate: int
    speed: int
    p: Numbers
    efforts: list[Expression]
    axes: Numbers = ()


def law_runs(
    scene: Scene, topology: Topology, layout: Layout, values: Values, memory: int
) -> Iterator[LawRun]:
    """The laws of every run that has some; those that remember turns do so from `memory` on.

    Of a chain the laws of one period of its pattern are made.
    """
    for run in topology.runs:
        chained = run.body >= len(scene.body)
        period = scene.chain[scene.bodies.member(run.body)[0]].period if chained else 1
        period = min(period, run.count)
        pattern = [draft for k in range(period) for draft in _member(scene, layout, run, k)]
        if pattern:
            made = _repeated(scene, values, run, period, pattern, memory)
            memory = made.next_twist
            yield made


def _member(scene: Scene, layout: Layout, run: BodyRow, k: int) -> list[Draft]:
    """Laws of the hinge of member k."""
    hinge, slots = scene.hinges[run.hinge + k], layout.slots(run.hinge + k)
    if slots.nu == 0 or hinge.is_weld:
        return []
    if slots.quaternion is None or not _is_known(hinge):
        return _coordinates(hinge, slots, k)
    return _rotational(hinge, slots, k)


def _repeated(
    scene: Scene, values: Values, run: BodyRow, period: int, pattern: list[Draft], twist: int
) -> LawRun:
    """A pattern repeated along a run, with the places of its efforts and turns."""
    repeats, rest = divmod(run.count, period)
    count = repeats * len(pattern) + sum(draft.member < rest for draft in pattern)
    common = ("t", *scene.channels)
    own = [any(_reads_its_own(effort, common) for effort in draft.efforts) for draft in pattern]
    places: list[list[Places]] = [[] for _ in pattern]
    for row in range(count if any(own) else len(pattern)):
        repeat, which = divmod(row, len(pattern))
        if repeat == 0 or own[which]:
            draft = pattern[which]
            hinge = scene.hinges[run.hinge + repeat * period + draft.member]
            places[which].append(tuple(values.place(effort, hinge) for effort in draft.efforts))
    laws, turns = [], 0
    for draft, found in zip(pattern, places, strict=True):
        member, kernel, coordinate, speed, p, efforts, axes = draft
        turn, n = turns if axes else -1, len(efforts)
        turns += bool(axes)
        laws.append(LawNumbers(member, kernel, coordinate, speed, n, turn, p, axes, tuple(found)))
    return LawRun(run.place, count, period, tuple(laws), twist)


def _reads_its_own(effort: Expression, common: Collection[str]) -> bool:
    """True where an expression has a name that means something else in every hinge."""
    return any(len(name.parts) == 1 and name.text not in common for name in effort.names)


def _acts(entry: LawEntry) -> bool:
    return bool(entry.stiffness or entry.damping or not entry.effort.is_zero)


def _coordinates(hinge: Hinge, slots: HingeSlots, member: int) -> list[Draft]:
    """One law per coordinate on which something acts."""
    made = []
    for k in range(slots.nu):
        entry = hinge.law.entry(k)
        full = entry.friction.acts or entry.limits.yields
        if not (_acts(entry) or full):
            continue
        p = (entry.stiffness, entry.rest, entry.damping, *(_full(entry) if full else ()))
        made.append(Draft(member, "full" if full else "linear", k, k, p, [entry.effort]))
    return made


def _full(entry: LawEntry) -> Numbers:
    friction, limits = entry.friction, entry.limits
    return (
        friction.coulomb, friction.static, friction.stribeck_velocity,
        friction.regularisation_velocity,
        -_FAR if limits.lower is None or not limits.yields else limits.lower,
        _FAR if limits.upper is None or not limits.yields else limits.upper,
        limits.stiffness, limits.damping,
    )  # fmt: skip


def _is_known(hinge: Hinge) -> bool:
    """Whether the law's kernels know where its rotation stands in q and u."""
    return hinge.facts is not None and hinge.facts.runs_as in builtin_hinges()


def _rotational(hinge: Hinge, slots: HingeSlots, member: int) -> list[Draft]:
    """Law of a hinge with a quaternion: springs from a potential, dampers, efforts; friction."""
    entries = [hinge.law.entry(k) for k in range(slots.nu)]
    made = []
    if any(_acts(entry) for entry in entries):
        translations, rotations = entries[:-3], entries[-3:]
        p = [getattr(e, key) for key in ("stiffness", "rest", "damping") for e in translations]
        p += [e.stiffness for e in rotations] + [0.0] + [e.damping for e in rotations]
        axes = tuple(x for row in twist_axes(hinge) for x in row)
        kernel, efforts = "six" if translations else "rotation", [e.effort for e in entries]
        made.append(Draft(member, kernel, 0, 0, tuple(p), efforts, axes))
    for k, entry in enumerate(entries):
        if entry.friction.acts:
            numbers = (0.0, 0.0, 0.0, *_full(entry))
            made.append(Draft(member, "full", 0, k, numbers, [_NOTHING]))
    return made
