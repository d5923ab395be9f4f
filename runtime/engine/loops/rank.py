"""Rank of constraint rows: redundant rows of closed loops, and singular configurations.

The rank is determined once, at a state in which the loops are closed, and in a metric of the
hinges.  With true masses a heavy coupler makes independent rows look like rounding.  With any
masses of bodies, parts attached to the hinges of a loop, as the rest of a long mast, do so too.
The pivot of a row that is redundant up to a misfit is proportional to the square of the misfit.
A row that is redundant here but not in closed states nearby indicates a singular pose.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from itertools import product

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import NumericalFailure

from ...pack.loops.variants import LOCKED, by_hinges, geometric, length_of
from ...pack.pack import packed_system, unmerged
from ..engine import Engine
from .calls import REPEATED, LoopCalls
from .stress import Open, not_unique

#: Closed states nearby: number, distance (rad, m), and the factor by which the coordinates of cut
#: hinges, which only follow, may exceed it.
_NEIGHBOURS, _AWAY, _FOLLOWING = 3, 3e-2, 10.0
#: Over this distance (rad, m) a row that is redundant up to a misfit leaves no gap that locks.
_FAR = 0.3
#: A closed state nearer than this fraction of the requested distance is the pose itself.
_BACK = 0.1
#: Around a singular pose: maximum number of trials; distance (rad, m) over which, and relative
#: deviation up to which, speeds without velocity errors must lead on from a state; its accuracy
#: (rad, m).
_TRIES, _ON, _ASIDE, _SETTLED = 16, 3e-3, 0.2, 1e-8
#: A row that is redundant here is redundant there too if its pivot is at most so many times larger,
#: or at most rounding, relative to the mobility.
_RAISED, _ROUNDING = 1e2, 1e-12
#: Maximum number of steps to such a state, gap (m, rad) that counts as closed, initial compliance
#: of rows, and compliance relative to the remaining gap.
_STEPS, _CLOSED, _GIVE, _SHARE = 200, 1e-9, 1e-6, 1e-2


@dataclass(frozen=True)
class Rank:
    """Redundant rows of closed loops at a state.

    Attributes:
        here: rows that are redundant at the state.
        always: those of them that are redundant in closed states nearby too.
        going: those of these that are removed; the others may replace another row of their hinge
            that becomes redundant in a pose farther away.
        states: the examined states (nq,), the given one first.
        open: the loads that redundant rows leave undetermined.
        nearby: smallest number of redundant rows in any of the states.
        stuck: motions that close the loops to first order all lead back to the pose, as with links
            stretched out in line.
    """

    here: frozenset[int]
    always: frozenset[int]
    going: frozenset[int]
    states: tuple[Array, ...]
    open: Open
    nearby: int
    stuck: bool = False


def rank_at(engine: Engine, q: Array) -> Rank:
    """Find the redundant rows at a closed state q (nq,) and around it."""
    calls = judging(engine, q)
    level = REPEATED * calls.mobility
    here = _repeating(calls, q, level)
    if not here:
        return Rank(here, here, here, (q,), Open(), 0)
    raised = _RAISED * np.abs(calls.pivots()) + _ROUNDING * calls.mobility
    level[list(here)] = np.minimum(level, raised)[list(here)]
    states, stuck = _around(calls, q, here, level)
    apart = LOCKED * length_of(engine.packed.system)
    stuck = stuck and not _goes_on(calls, q, here, apart)
    there = [_repeating(calls, state, level) for state in states]
    always, nearby = here.intersection(*there), min(map(len, (here, *there)))
    going = always.difference(*(_stand_ins(calls, state, always) for state in (q, *states[:1])))
    loads = not_unique(calls, q, here - always) if always else Open()
    return Rank(here, always, going, (q, *states), loads, nearby, stuck)


def _around(
    calls: LoopCalls, q: Array, here: frozenset[int], level: Array
) -> tuple[list[Array], bool]:
    """Closed states nearby, and whether all motions to such states lead back.

    Around a singular pose only states are used, if any, from which a motion leads on: others are
    closed by rounding, or motions branch there.
    """
    draw, ways, states = np.random.default_rng(0), list[float](), list[Array]()

    def found(settled: float) -> Array | None:
        near = _neighbour(calls, q, draw.uniform(-1.0, 1.0, calls.engine.nu), settled)
        ways.extend([] if near is None else [_way(calls, near - q)])
        return near

    states = [near for _ in range(_NEIGHBOURS) if (near := found(np.inf)) is not None]
    away = bool(ways) and min(ways) >= _BACK * _AWAY
    if away and all(_repeating(calls, near, level) == here for near in states):
        return states, False
    smooth = list[Array]()
    for _ in range(_TRIES):
        near = found(_SETTLED)
        if near is None or ways[-1] < _BACK * _AWAY:
            continue
        if _leads_on(calls, near, draw.uniform(-1.0, 1.0, calls.engine.nu), level):
            smooth.append(near)
        if len(smooth) == _NEIGHBOURS:
            break
    return smooth or states, max(ways, default=_AWAY) < _BACK * _AWAY


def _way(calls: LoopCalls, change: Array) -> float:
    """Largest change of q (nq,), without the coordinates of cut hinges, which follow."""
    own, packed = change.copy(), calls.engine.packed
    for cut in packed.expanded.cuts:
        if cut.constraint is None:
            own[packed.layout.hinges[cut.hinge].q_slice] = 0.0
    return float(np.abs(own).max(initial=0.0))


def judging(engine: Engine, q: Array) -> LoopCalls:
    """Loop calls of a scene in the metric of its hinges, with mobilities of equal bodies.

    Bodies that were merged for simplification are separate in it, with their welds.
    """
    packed = unmerged(engine.packed)
    mobility = LoopCalls(Engine(packed_system(geometric(packed.system), packed)), q).mobility
    slides = {
        packed.hinge_position[hinge.name]: hinge.facts.slides
        for hinge in packed.described.hinge if hinge.facts is not None
    }  # fmt: skip
    return LoopCalls(Engine(packed_system(by_hinges(packed.system, slides), packed)), q, mobility)


def _stand_ins(calls: LoopCalls, q: Array, left_out: frozenset[int]) -> frozenset[int]:
    """Redundant rows that become independent if another row of their hinge is omitted.

    They are kept, and the rows to use are chosen during the motion.  All hinges are tried at the
    same time: the first omitted row of each instead of its first kept row, and so on.
    """
    hinges = [set(one.rows.values()) for one in calls.records.closures]
    sides = [(sorted(rows & left_out), sorted(rows - left_out)) for rows in hinges]
    found: set[int] = set()
    for out, kept in product(range(6), range(6)):
        pairs = [(o[out], k[kept]) for o, k in sides if out < len(o) and kept < len(k)]
        if pairs:
            level = REPEATED * calls.mobility
            level[list(left_out | {k for _, k in pairs})] = np.inf
            level[[o for o, _ in pairs]] = REPEATED * calls.mobility[[o for o, _ in pairs]]
            found |= {o for o, _ in pairs} - _repeating(calls, q, level)
    return frozenset(found)


def _repeating(calls: LoopCalls, q: Array, level: Array) -> frozenset[int]:
    """Rows whose pivots are below their level if the preceding rows are satisfied."""
    for row, floor in enumerate(level.tolist()):
        calls.records.judge(row, floor)
    calls.correction(calls.slip, q, np.zeros(calls.engine.nu))
    return frozenset(np.flatnonzero(calls.inverses() == 0.0).tolist())


def _neighbour(calls: LoopCalls, q: Array, speeds: Array, settled: float) -> Array | None:
    """Closed state in the direction of speeds without velocity errors, to `settled` (rad, m).

    None if these speeds lead to none.
    """
    try:
        ahead = _ahead(calls, q, speeds, _AWAY, np.zeros(calls.count))
        return None if ahead is None else _closed(calls, ahead, settled)
    except NumericalFailure:
        return None


def _goes_on(calls: LoopCalls, q: Array, left: frozenset[int], apart: float) -> bool:
    """True if the rows `left` are redundant up to a misfit.

    A motion without them must lead far away in both directions, and leave gaps of these rows of at
    most `apart` (m, rad).
    """
    level = np.zeros(calls.count)
    level[list(left)] = np.inf
    speeds = np.random.default_rng(0).uniform(-1.0, 1.0, calls.engine.nu)
    try:
        for way in (_FAR, -_FAR):
            ahead = _ahead(calls, q, np.sign(way) * speeds, abs(way), level)
            near = None if ahead is None else _closed(calls, ahead, _SETTLED, left)
            if near is None or _way(calls, near - q) < _BACK * _FAR:
                return False
            gaps = np.abs(calls.correction(calls.gap, near, np.zeros(calls.engine.nu))[1])
            if gaps[list(left)].max() > apart:
                return False
    except NumericalFailure:
        return False
    return True


def _leads_on(calls: LoopCalls, q: Array, speeds: Array, level: Array) -> bool:
    """True if speeds without velocity errors lead to closed states.

    Rows with pivots below `level` are ignored.  False where motions branch.
    """
    try:
        ahead = _ahead(calls, q, speeds, _ON, level)
        near = None if ahead is None else _closed(calls, ahead, _SETTLED)
    except NumericalFailure:
        return False
    if near is None or ahead is None:
        return False
    return _way(calls, near - ahead) < _ASIDE * _way(calls, ahead - q)


def _ahead(calls: LoopCalls, q: Array, speeds: Array, way: float, level: Array) -> Array | None:
    """Move q (nq,) by `way` (rad, m) along speeds projected on the rows with pivots above `level`.

    None if no such speeds remain.
    """
    for row, floor in enumerate(level.tolist()):
        calls.records.judge(row, floor)
    tangent = speeds + calls.correction(calls.slip, q, speeds)[0]
    length = float(np.abs(tangent).max(initial=0.0))
    if not length > 1e-9:
        return None
    near = calls.moved(q, tangent * (way / length))
    farther = min(way / max(_way(calls, near - q), _CLOSED), _FOLLOWING)
    return calls.moved(q, tangent * (farther * way / length)) if farther > 1.0 else near


def _closed(
    calls: LoopCalls, near: Array, settled: float, left: Collection[int] = ()
) -> Array | None:
    """Closed state (nq,) near a given one, to `settled` (rad, m), or None.

    It satisfies all rows except those in `left`, redundant rows too.
    """
    still, give = np.zeros(calls.engine.nu), _GIVE
    for row in range(calls.count):
        calls.records.judge(row, np.inf if row in left else 0.0)
    for _ in range(_STEPS):
        change, missing = calls.correction(calls.gap, near, still, give)
        missing[list(left)] = 0.0
        rest = float(np.abs(missing).max(initial=0.0))
        if rest < _CLOSED and float(np.abs(change).max(initial=0.0)) < settled:
            return near
        near, give = calls.moved(near, change), min(_GIVE, _SHARE * rest)
    return None
