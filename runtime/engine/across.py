"""Unknowns of loads and constraints that couple distant bodies, and which of them are independent.

The elimination of a tangent along the tree does not contain them.  Unknowns are changes of loads
and efforts, then accelerations and multipliers of closing hinges.  Those of one `group` move the
same part of the scene: a branch on the ground, or one hinge that closes a loop.  If no load and no
row depends on two groups at once, the tree is solved for one unknown of each in the same pass.  The
number of passes then does not grow with the number of independent loops, and the remaining matrix
is banded (E. Cuthill, J. McKee, Proc. 24th ACM National Conference (1969) 157-172; A. R. Curtis,
M. J. D. Powell, J. K. Reid, J. Inst. Math. Appl. 13 (1974) 117-119).  With couplings there is one
group.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.arrays import Integers

from ..pack.reach import GROUND
from ..pack.system import System

if TYPE_CHECKING:
    from .engine import Engine


@dataclass(frozen=True)
class Across:
    """Unknowns outside the tree, their groups and passes.

    The unknowns are 6 of each of `bodies`, then `efforts` (index in the workspace, speed) and
    `rows` (frame, direction, speed, row).  By group: the `members`, the `readers` (unknowns that
    depend on the group), and the speeds that are `moved`; `passes` are the unknowns solved
    together.  `ranks` (count,) are the positions of the unknowns in the matrix, which has `below`
    and `above` diagonals below and above the main one.
    """

    bodies: Sequence[int]
    efforts: Sequence[tuple[int, int]]
    rows: Sequence[tuple[int, int, int, int]]
    members: Sequence[Sequence[int]]
    readers: Sequence[Sequence[int]]
    moved: Sequence[Sequence[int]]
    passes: Sequence[Sequence[int]]
    ranks: Integers
    below: int
    above: int

    @property
    def count(self) -> int:
        """Number of unknowns."""
        return 6 * len(self.bodies) + len(self.efforts) + len(self.rows)

    @property
    def width(self) -> int:
        """Numbers in a row of the factored matrix, including the fill by row exchanges."""
        return min(self.count, 2 * self.below + self.above + 1)

    def written(self, engine: Engine) -> list[Any]:
        """C record of the unknowns, followed by the memory that it refers to."""
        ffi, blocks = engine.ffi, engine.packed.written.blocks
        record = ffi.new("mstmm_couplings *")
        kept = [record]
        groups = np.empty(self.count, dtype=np.int64)
        for number, members in enumerate(self.members):
            groups[list(members)] = number
        first = engine.lib.MSTMM_BLOCK_E
        loads = [blocks[body] + first + k for body in self.bodies for k in range(6)]
        units = [[loads[k] for k in one if k < len(loads)] for one in self.passes]
        arrays: dict[str, tuple[str, Sequence[Any]]] = {
            "bodies": ("int[]", self.bodies),
            "efforts": ("int64_t[]", [place for place, _ in self.efforts]),
            "speeds": ("int[]", [speed for _, speed in self.efforts]),
            "rows": ("mstmm_coupled_row[]", self.rows),
            "group": ("int[]", groups.tolist()), "rank": ("int[]", self.ranks.tolist()),
            "unit": ("int64_t[]", [place for one in units for place in one]),
            "first_unit": ("int[]", _firsts(units)),
        }  # fmt: skip
        for name, lists in (("reader", self.readers), ("moved", self.moved), ("seed", self.passes)):
            arrays[name] = "int[]", [entry for one in lists for entry in one]
            arrays[f"first_{name}"] = "int[]", _firsts(lists)
        for name, (kind, numbers) in arrays.items():
            array = ffi.new(kind, list(numbers) or 1)
            kept.append(array)
            setattr(record, name, array)
        for name in ("bodies", "efforts", "rows", "passes"):
            setattr(record, f"n_{name}", len(getattr(self, name)))
        record.below, record.above = self.below, self.above
        return kept


def _firsts(lists: Sequence[Sequence[int]]) -> list[int]:
    return [0, *np.cumsum([len(one) for one in lists]).tolist()]


def across_of(engine: Engine) -> Across:
    """Find the unknowns outside the tree of a packed scene."""
    packed = engine.packed
    reach, loops = packed.written.reach, packed.written.loops
    efforts, rows = list(_efforts(engine)), _rows_of_loops(engine)
    unknowns = list(reach.across), efforts, rows
    if (loops and loops.couplings) or not (reach.across or efforts):
        return at_once(*unknowns, engine.nu)
    branches = _branches(packed.system)
    closures = {one.frame: (one.inboard, one.outboard) for one in (loops.closures if loops else ())}
    group = dict(enumerate(branches)) | {frame: frame for frame in closures}
    speeds = _speeds(packed.system, group)
    of_speed = {speed: name for name, own in speeds.items() for speed in own}
    felt = {body: {group[other] for other in watched}
            for body, watched in zip(reach.across, reach.watched, strict=True)}  # fmt: skip
    by_rows = dict[int, set[int]]()
    for frame, ends in closures.items():
        on = [body for body in ends if body != GROUND]
        by_rows[frame] = {frame} | {branches[body] for body in on}
        for body in on:
            felt[body].add(frame)
    moving = [branches[body] for body in reach.across for _ in range(6)]
    moving += [of_speed[speed] for _, speed in efforts]
    moving += [frame for frame, _, _, _ in rows]
    feeling = [felt[body] for body in reach.across for _ in range(6)]
    feeling += [{group[body] for body in heard} for heard in reach.heard]
    feeling += [by_rows[frame] for frame, _, _, _ in rows]
    return _apart(unknowns, moving, [one - {GROUND} for one in feeling], speeds)


def at_once(bodies: Sequence[int], efforts: Any, rows: Any, nu: int) -> Across:
    """Put all unknowns in one group: each has its own pass, and the matrix is full."""
    count = 6 * len(bodies) + len(efforts) + len(rows)
    alone, last = [range(count)], max(count - 1, 0)
    return Across(bodies, efforts, rows, alone, alone, [range(nu)], [[k] for k in range(count)],
                  np.arange(count), last, last)  # fmt: skip


def _apart(
    unknowns: tuple[Any, Any, Any],
    moving: Sequence[int],
    feeling: Sequence[set[int]],
    speeds: dict[int, list[int]],
) -> Across:
    """Find groups, passes and positions of unknowns.

    `moving` is the group that each unknown moves, `feeling` the groups on which it depends.
    """
    names = _in_order(sorted(set(moving)), {frozenset(one) for one in feeling})
    members, readers = {name: list[int]() for name in names}, {name: list[int]() for name in names}
    for k, (name, felt) in enumerate(zip(moving, feeling, strict=True)):
        members[name].append(k)
        for other in felt & members.keys():
            readers[other].append(k)
    ranks = np.empty(len(moving), dtype=np.int64)
    ranks[[k for name in names for k in members[name]]] = np.arange(len(moving))
    below = above = 0
    for name in names:
        own, reading = ranks[members[name]], ranks[readers[name]]
        if len(reading):
            below = max(below, int(reading.max() - own.min()))
            above = max(above, int(own.max() - reading.min()))
    return Across(
        *unknowns, list(members.values()), list(readers.values()),
        [speeds.get(name, []) for name in names], _passes(members, readers, feeling),
        ranks, below, above,
    )  # fmt: skip


def _in_order(names: list[int], together: set[frozenset[int]]) -> list[int]:
    """Order groups so that those on which the same unknown depends are near each other."""
    near = {name: {name} for name in names}
    for felt in together:
        for name in felt & near.keys():
            near[name] |= felt & near.keys()
    found, placed = list[int](), set[int]()
    for name in names:
        if name in placed:
            continue
        end = _outwards(_outwards(name, near)[-1], near)[-1]
        found += _outwards(end, near)
        placed.update(found[len(placed) :])
    return found


def _outwards(start: int, near: Mapping[int, set[int]]) -> list[int]:
    """Groups connected with one, the nearest first, among these those with few neighbours."""
    found, seen = [start], {start}
    for name in found:
        found += sorted(near[name] - seen, key=lambda other: (len(near[other]), other))
        seen |= near[name]
    return found


def _passes(
    members: dict[int, list[int]], readers: dict[int, list[int]], feeling: Sequence[set[int]]
) -> list[list[int]]:
    """Unknowns that are solved together because nothing depends on two of them."""
    found, taken = list[list[int]](), {name: set[int]() for name in members}
    for name, own in members.items():
        felt_with = set[int]().union(*(feeling[k] for k in readers[name])) & members.keys()
        used, turn = set[int]().union(*(taken[other] for other in felt_with)), 0
        for k in own:
            while turn in used:
                turn += 1
            if turn == len(found):
                found.append([])
            found[turn].append(k)
            taken[name].add(turn)
            turn += 1
    return [sorted(one) for one in found]


def _branches(system: System) -> list[int]:
    """First movable body on the path from the ground to each body, or GROUND."""
    found = list[int]()
    stiff = system.rows(lambda one: not one.nu and one.modal is None and one.section is None)
    for place, parent in enumerate(system.parents.tolist()):
        held = parent == GROUND or found[parent] == GROUND
        found.append(found[parent] if not held else GROUND if stiff[place] else place)
    return found


def _speeds(system: System, group: Mapping[int, int]) -> dict[int, list[int]]:
    """Speeds by group; every body belongs to one."""
    found, first = dict[int, list[int]](), system.places["u"].tolist()
    of_hinges = system.rows(lambda one: one.nu).tolist()
    bent = system.rows(lambda one: one.modal is not None)
    for place, name in group.items():
        own = found.setdefault(name, [])
        own += range(first[place], first[place] + of_hinges[place])
        if bent[place] and (modal := system.body(place).modal):
            own += range(modal.u, modal.u + modal.n)
    return found


def _efforts(engine: Engine) -> Iterator[tuple[int, int]]:
    """Efforts by expressions of the state, and by couplings on hinges of the tree.

    Yields (index in the workspace, speed).
    """
    packed, lib, model = engine.packed, engine.lib, engine.packed.model
    values = packed.scratch + engine.nq + engine.nu
    for value, speed in packed.written.reach.efforts:
        yield values + value, speed
    first, loops = packed.system.places["u"], packed.written.loops
    frames = {one.frame for one in packed.system.closures}
    coupled = {place for one in loops.couplings for place in one.columns} if loops else set()
    for place in sorted(coupled - frames):
        body = model.bodies[place]
        at = body.block + lib.MSTMM_BLOCK_FIXED + lib.MSTMM_SPEED_TAU * body.nu
        for k in range(body.nu):
            yield int(at) + k, int(first[place]) + k


def _rows_of_loops(engine: Engine) -> list[tuple[int, int, int, int]]:
    """Unknowns (frame, direction, speed, row) of closing hinges and couplings.

    These are accelerations of their speeds, with row -1, and multipliers of their rows, with speed
    -1; the frame of a coupling is -1.
    """
    packed, loops = engine.packed, engine.packed.written.loops
    found = list[tuple[int, int, int, int]]()
    if loops is None:
        return found
    first = packed.system.places["u"]
    for one in loops.closures:
        speeds = range(packed.system.body(one.frame).nu)
        found += [(one.frame, k, int(first[one.frame]) + k, -1) for k in speeds]
        found += [(one.frame, direction, -1, row) for direction, row in one.rows.items()]
    found += [(-1, 0, -1, one.row) for one in (() if loops is None else loops.couplings)]
    return found
