"""Unknowns of loads and constraints that couple distant bodies, in independent groups.

The elimination of a tangent along the tree does not contain them.  Unknowns are changes of loads
and efforts, then accelerations and multipliers of closing hinges.  The unknowns of one group move
the same part of the scene: a branch on the ground, or one hinge that closes a loop.  If no load and
no row depends on two groups, one pass solves the tree for one unknown of each group.  The number of
passes then does not grow with the number of independent loops, and the remaining matrix is banded
(E. Cuthill, J. McKee, Proc. 24th ACM National Conference (1969) 157-172; A. R. Curtis, M. J. D.
Powell, J. K. Reid, J. Inst. Math. Appl. 13 (1974) 117-119).  With couplings there is one group.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.array_validation import Integers

from ..packing.load_coupling import GROUND
from ..packing.system import System

if TYPE_CHECKING:
    from .looped_engine import LoopedEngine


@dataclass(frozen=True)
class OffTreeCoupling:
    """Unknown loads outside the tree, and the band matrix that relates them.

    The unknowns are 6 loads for each of `bodies`, then `efforts` (index in the workspace, speed)
    and `rows` (frame, direction, speed, row).  Unknowns that act on the same part of the tree form
    a group.

    Attributes:
        members: unknowns of each group.
        readers: for each group, the unknowns that depend on the motion of its part of the tree.
        moved_speeds: for each group, the speeds of its part of the tree.
        passes: for each pass over the tree, the unknowns whose matrix columns it computes.
        ranks: (count,) positions of the unknowns in the matrix.
        lower_bandwidth, upper_bandwidth: diagonals below and above the main one.
    """

    bodies: Sequence[int]
    efforts: Sequence[tuple[int, int]]
    rows: Sequence[tuple[int, int, int, int]]
    members: Sequence[Sequence[int]]
    readers: Sequence[Sequence[int]]
    moved_speeds: Sequence[Sequence[int]]
    passes: Sequence[Sequence[int]]
    ranks: Integers
    lower_bandwidth: int
    upper_bandwidth: int

    @property
    def count(self) -> int:
        """Number of unknowns."""
        return 6 * len(self.bodies) + len(self.efforts) + len(self.rows)

    @property
    def width(self) -> int:
        """Row length of the factored band matrix, including fill-in by row exchanges."""
        return min(self.count, 2 * self.lower_bandwidth + self.upper_bandwidth + 1)

    def c_record(self, engine: LoopedEngine) -> list[Any]:
        """C record of the unknowns, followed by the memory to which it points."""
        ffi, blocks = engine.ffi, engine.packed.written.blocks
        record = ffi.new("mstmm_couplings *")
        kept_objects = [record]
        groups = np.empty(self.count, dtype=np.int64)
        for number, members in enumerate(self.members):
            groups[list(members)] = number
        first = engine.lib.MSTMM_BLOCK_E
        loads = [blocks[body] + first + k for body in self.bodies for k in range(6)]
        pass_units = [[loads[k] for k in unknowns if k < len(loads)] for unknowns in self.passes]
        arrays: dict[str, tuple[str, Sequence[Any]]] = {
            "bodies": ("int[]", self.bodies),
            "efforts": ("int64_t[]", [tree_index for tree_index, _ in self.efforts]),
            "speeds": ("int[]", [speed for _, speed in self.efforts]),
            "rows": ("mstmm_coupled_row[]", self.rows),
            "group": ("int[]", groups.tolist()), "rank": ("int[]", self.ranks.tolist()),
            "unit": ("int64_t[]", [index for group_list in pass_units for index in group_list]),
            "first_unit": ("int[]", _list_starts(pass_units)),
        }  # fmt: skip
        for name, lists in (
            ("reader", self.readers),
            ("moved", self.moved_speeds),
            ("seed", self.passes),
        ):
            arrays[name] = "int[]", [entry for group_list in lists for entry in group_list]
            arrays[f"first_{name}"] = "int[]", _list_starts(lists)
        for name, (kind, numbers) in arrays.items():
            array = ffi.new(kind, list(numbers) or 1)
            kept_objects.append(array)
            setattr(record, name, array)
        for name in ("bodies", "efforts", "rows", "passes"):
            setattr(record, f"n_{name}", len(getattr(self, name)))
        record.below, record.above = self.lower_bandwidth, self.upper_bandwidth
        return kept_objects


def _list_starts(lists: Sequence[Sequence[int]]) -> list[int]:
    return [0, *np.cumsum([len(entries) for entries in lists]).tolist()]


def off_tree_coupling(engine: LoopedEngine) -> OffTreeCoupling:
    """Find the unknowns outside the tree of a packed scene."""
    packed = engine.packed
    reach, loops = packed.written.load_dependence, packed.written.loops
    efforts, rows = list(_effort_unknowns(engine)), _loop_unknowns(engine)
    unknowns = list(reach.coupled_bodies), efforts, rows
    if (loops and loops.couplings) or not (reach.coupled_bodies or efforts):
        return single_group(*unknowns, engine.nu)
    branches = _branch_of_bodies(packed.system)
    ends_by_frame = {
        closure.frame: (closure.inboard, closure.outboard)
        for closure in (loops.closures if loops else ())
    }
    group_of_place = dict(enumerate(branches)) | {frame: frame for frame in ends_by_frame}
    speeds = _speeds_by_group(packed.system, group_of_place)
    group_of_speed = {speed: name for name, own_speeds in speeds.items() for speed in own_speeds}
    groups_of_body = {
        body: {group_of_place[watched_body] for watched_body in watched_bodies}
        for body, watched_bodies in zip(reach.coupled_bodies, reach.load_sources, strict=True)
    }
    groups_of_frame = dict[int, set[int]]()
    for frame, ends in ends_by_frame.items():
        moving_ends = [body for body in ends if body != GROUND]
        groups_of_frame[frame] = {frame} | {branches[body] for body in moving_ends}
        for body in moving_ends:
            groups_of_body[body].add(frame)
    moved_groups = [branches[body] for body in reach.coupled_bodies for _ in range(6)]
    moved_groups += [group_of_speed[speed] for _, speed in efforts]
    moved_groups += [frame for frame, _, _, _ in rows]
    dependencies = [groups_of_body[body] for body in reach.coupled_bodies for _ in range(6)]
    dependencies += [
        {group_of_place[body] for body in heard_bodies} for heard_bodies in reach.effort_sources
    ]
    dependencies += [groups_of_frame[frame] for frame, _, _, _ in rows]
    return _independent_groups(
        unknowns, moved_groups, [closure - {GROUND} for closure in dependencies], speeds
    )


def single_group(bodies: Sequence[int], efforts: Any, rows: Any, nu: int) -> OffTreeCoupling:
    """Put all unknowns in one group, with one pass for each and a full matrix."""
    count = 6 * len(bodies) + len(efforts) + len(rows)
    all_unknowns, last_index = [range(count)], max(count - 1, 0)
    passes, ranks = [[k] for k in range(count)], np.arange(count)
    groups = all_unknowns, all_unknowns, [range(nu)], passes, ranks, last_index, last_index
    return OffTreeCoupling(bodies, efforts, rows, *groups)


def _independent_groups(
    unknowns: tuple[Any, Any, Any],
    moving: Sequence[int],
    feeling: Sequence[set[int]],
    speeds: dict[int, list[int]],
) -> OffTreeCoupling:
    """Order unknowns for a narrow band matrix, and gather those that one pass can compute.

    `moving` is the part of the tree (a body index) that each unknown moves, `feeling` the parts on
    whose motion it depends; `speeds` are the speeds of each part.
    """
    groups = _order_groups(sorted(set(moving)), {frozenset(dependency) for dependency in feeling})
    members = {name: list[int]() for name in groups}
    readers = {name: list[int]() for name in groups}
    for k, (name, felt_groups) in enumerate(zip(moving, feeling, strict=True)):
        members[name].append(k)
        for other_group in felt_groups & members.keys():
            readers[other_group].append(k)
    ranks = np.empty(len(moving), dtype=np.int64)
    ranks[[k for name in groups for k in members[name]]] = np.arange(len(moving))
    lower_bandwidth = upper_bandwidth = 0
    for name in groups:
        own_ranks, reader_ranks = ranks[members[name]], ranks[readers[name]]
        if len(reader_ranks):
            lower_bandwidth = max(lower_bandwidth, int(reader_ranks.max() - own_ranks.min()))
            upper_bandwidth = max(upper_bandwidth, int(own_ranks.max() - reader_ranks.min()))
    return OffTreeCoupling(
        *unknowns, list(members.values()), list(readers.values()),
        [speeds.get(name, []) for name in groups], _find_passes(members, readers, feeling),
        ranks, lower_bandwidth, upper_bandwidth,
    )  # fmt: skip


def _order_groups(names: list[int], together: set[frozenset[int]]) -> list[int]:
    """Order groups to reduce the bandwidth: those that share a dependent unknown are adjacent."""
    neighbours = {name: {name} for name in names}
    for felt_groups in together:
        for name in felt_groups & neighbours.keys():
            neighbours[name] |= felt_groups & neighbours.keys()
    ordered, placed = list[int](), set[int]()
    for name in names:
        if name in placed:
            continue
        end_group = _breadth_first(_breadth_first(name, neighbours)[-1], neighbours)[-1]
        ordered += _breadth_first(end_group, neighbours)
        placed.update(ordered[len(placed) :])
    return ordered


def _breadth_first(start: int, near: Mapping[int, set[int]]) -> list[int]:
    """Groups connected with `start` in breadth-first order, fewest neighbours first."""
    ordered, visited = [start], {start}
    for name in ordered:
        ordered += sorted(
            near[name] - visited, key=lambda neighbour: (len(near[neighbour]), neighbour)
        )
        visited |= near[name]
    return ordered


def _find_passes(
    members: dict[int, list[int]], readers: dict[int, list[int]], feeling: Sequence[set[int]]
) -> list[list[int]]:
    """Passes of unknowns that can be solved together because nothing depends on two of them."""
    passes, passes_of_group = list[list[int]](), {name: set[int]() for name in members}
    for name, own_members in members.items():
        dependent_groups = set[int]().union(*(feeling[k] for k in readers[name])) & members.keys()
        used_passes = set[int]().union(
            *(passes_of_group[other_group] for other_group in dependent_groups)
        )
        pass_index = 0
        for k in own_members:
            while pass_index in used_passes:
                pass_index += 1
            if pass_index == len(passes):
                passes.append([])
            passes[pass_index].append(k)
            passes_of_group[name].add(pass_index)
            pass_index += 1
    return [sorted(unknowns) for unknowns in passes]


def _branch_of_bodies(system: System) -> list[int]:
    """First movable body on the path from the ground to each body, or `GROUND`."""
    branches = list[int]()
    is_immobile = system.rows(
        lambda body: not body.nu and body.modal is None and body.section is None
    )
    for tree_index, parent in enumerate(system.parents.tolist()):
        is_parent_fixed = parent == GROUND or branches[parent] == GROUND
        first_movable = GROUND if is_immobile[tree_index] else tree_index
        branches.append(first_movable if is_parent_fixed else branches[parent])
    return branches


def _speeds_by_group(system: System, group: Mapping[int, int]) -> dict[int, list[int]]:
    """Speeds by group; every body belongs to one group."""
    speeds_found, first = dict[int, list[int]](), system.first_indices["u"].tolist()
    speed_counts = system.rows(lambda body: body.nu).tolist()
    is_flexible = system.rows(lambda body: body.modal is not None)
    for tree_index, name in group.items():
        own_speeds = speeds_found.setdefault(name, [])
        own_speeds += range(first[tree_index], first[tree_index] + speed_counts[tree_index])
        if is_flexible[tree_index] and (modal := system.body(tree_index).modal):
            own_speeds += range(modal.u, modal.u + modal.n)
    return speeds_found


def _effort_unknowns(engine: LoopedEngine) -> Iterator[tuple[int, int]]:
    """Efforts of state-dependent expressions, and of couplings on hinges of the tree.

    Yields (index in the workspace, speed).
    """
    packed, lib, model = engine.packed, engine.lib, engine.packed.model
    values = packed.scratch + engine.nq + engine.nu
    for value, speed in packed.written.load_dependence.efforts:
        yield values + value, speed
    first, loops = packed.system.first_indices["u"], packed.written.loops
    frames = {coupling.frame for coupling in packed.system.closures}
    coupled_places = (
        {tree_index for coupling in loops.couplings for tree_index in coupling.columns}
        if loops
        else set()
    )
    for tree_index in sorted(coupled_places - frames):
        body = model.bodies[tree_index]
        first_effort = body.block + lib.MSTMM_BLOCK_FIXED + lib.MSTMM_SPEED_TAU * body.nu
        for k in range(body.nu):
            yield int(first_effort) + k, int(first[tree_index]) + k


def _loop_unknowns(engine: LoopedEngine) -> list[tuple[int, int, int, int]]:
    """Unknowns (frame, direction, speed, row) of closing hinges and couplings.

    Accelerations of their speeds have row -1, multipliers of their rows speed -1; the frame of a
    coupling is -1.
    """
    packed, loops = engine.packed, engine.packed.written.loops
    unknowns = list[tuple[int, int, int, int]]()
    if loops is None:
        return unknowns
    first = packed.system.first_indices["u"]
    for closure in loops.closures:
        speeds = range(packed.system.body(closure.frame).nu)
        unknowns += [(closure.frame, k, int(first[closure.frame]) + k, -1) for k in speeds]
        unknowns += [(closure.frame, direction, -1, row) for direction, row in closure.rows.items()]
    unknowns += [(-1, 0, -1, closure.row) for closure in (() if loops is None else loops.couplings)]
    return unknowns
