"""Rows of closed loops in the order in which a sweep closes them, and what it keeps of them.

Bodies are places in the tree here, -1 the ground.  A row is open on the way from either end to the
body where they meet; there it is closed, before that body's own inboard hinge is passed.  Rows that
pass a hinge together share an entry of L from then on, and closing one couples all that it shared
entries with.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import combinations_with_replacement

GROUND = -1


@dataclass(frozen=True, slots=True)
class Ends:
    """`count` rows between the bodies `inboard` and `outboard`."""

    inboard: int
    outboard: int
    count: int


@dataclass(frozen=True, slots=True)
class Row:
    """Row `number` of group `group`; `others` are the rows still open with which it is coupled."""

    group: int
    body: int
    others: tuple[int, ...]


@dataclass
class RowPlan:
    """`rows` as they close, `first` the first row of each group, `pending` by body the rows that
    pass its inboard hinge, `pairs` all that share an entry of L."""

    rows: list[Row] = field(default_factory=list)
    first: dict[int, int] = field(default_factory=dict)
    pending: dict[int, list[int]] = field(default_factory=dict)
    pairs: list[tuple[int, int]] = field(default_factory=list)

    def closing(self, body: int) -> range:
        """Rows that close on a body; they stand side by side."""
        found = [number for number, row in enumerate(self.rows) if row.body == body]
        return range(found[0], found[-1] + 1) if found else range(0)


def meeting(parents: Sequence[int], one: int, other: int) -> int:
    """The lowest common ancestor; parents have lower places than their children."""
    while one != other:
        if one > other:
            one = parents[one]
        else:
            other = parents[other]
    return one


def planned(parents: Sequence[int], groups: Sequence[Ends]) -> RowPlan:
    """The plan for groups that close in their order where several close on one body."""
    meets = [meeting(parents, ends.inboard, ends.outboard) for ends in groups]
    order = sorted(range(len(groups)), key=lambda group: -meets[group])
    plan = RowPlan()
    numbered = 0
    for group in order:
        plan.first[group] = numbered
        numbered += groups[group].count
    for group in order:
        own = range(plan.first[group], plan.first[group] + groups[group].count)
        for body in _ways(parents, groups[group], meets[group]):
            plan.pending.setdefault(body, []).extend(own)
    coupled: list[set[int]] = [set() for _ in range(numbered)]
    closing: dict[int, list[int]] = {}
    for group in order:
        closing.setdefault(meets[group], []).append(group)
    for body in sorted({*closing, *plan.pending}, reverse=True):
        for group in closing.get(body, ()):
            for number in range(plan.first[group], plan.first[group] + groups[group].count):
                others = tuple(sorted(coupled[number]))
                plan.rows.append(Row(group, body, others))
                for other in others:
                    coupled[other].update(others)
                    coupled[other] -= {number, other}
        together = plan.pending.get(body, [])
        together.sort()
        for number in together:
            coupled[number].update(together)
            coupled[number].discard(number)
    plan.pairs = sorted(_pairs(plan))
    return plan


def _ways(parents: Sequence[int], ends: Ends, meet: int) -> Iterator[int]:
    for end in (ends.inboard, ends.outboard):
        while end != meet:
            yield end
            end = parents[end]


def _pairs(plan: RowPlan) -> set[tuple[int, int]]:
    """Pairs of different rows that some hinge or closing couples."""
    found = set[tuple[int, int]]()
    for together in plan.pending.values():
        found.update(combinations_with_replacement(together, 2))
    for number, row in enumerate(plan.rows):
        found.update((number, other) for other in row.others)
        found.update(combinations_with_replacement(row.others, 2))
    return {pair for pair in found if pair[0] != pair[1]}
