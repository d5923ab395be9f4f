"""Which rows of closed loops say what others say already.

Decided once, at a state in which the loops are closed, and in a metric of the hinges: with true
masses a heavy coupler makes honest rows look like rounding, and with any masses of bodies what
hangs on the hinges of a loop does, as the rest of a long mast.  The level of a row that repeats
others but for a misfit is the square of the misfit.  A row that repeats others here but not in
closed states nearby is no repetition but a singular pose.
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

#: Closed states nearby: how many, how far (rad, m), and how much farther the own coordinates of cut
#: hinges may go, which only follow.
_NEIGHBOURS, _AWAY, _FOLLOWING = 3, 3e-2, 10.0
#: Over this way (rad, m) what repeats others but for a misfit leaves no gap that locks.
_FAR = 0.3
#: A closed state that is nearer than this part of the way asked for is the pose itself.
_BACK = 0.1
#: Around a singular pose so many are looked for at most.  One counts from which speeds without
#: slips lead on, over this way (rad, m) and but for this part of it, and that is known to so much.
_TRIES, _ON, _ASIDE, _SETTLED = 16, 3e-3, 0.2, 1e-8
#: A row that repeats others here does so there too where its pivot is not this many times larger,
#: or not larger than rounding, in parts of the mobility.
_RAISED, _ROUNDING = 1e2, 1e-12
#: Most steps to such a state, the gap (m, rad) that is none, the compliance of rows at first, and
#: by the gap that is left.
_STEPS, _CLOSED, _GIVE, _SHARE = 200, 1e-9, 1e-6, 1e-2


@dataclass(frozen=True)
class Rank:
    """Rows that repeat others here, those of them that do so in closed states nearby too, and those
    of these that go: the others take the place of another row of their hinge where that one says
    less, at a pose farther away.  `states` are those that were looked at, this one first,
    `open` the loads that rows which always repeat others leave open, and
    `nearby` is how few repeat others in any of the states.  `stuck`: motions that close the loops
    to first order lead back to the pose from wherever they go, as of links stretched out in line.
    """

    here: frozenset[int]
    always: frozenset[int]
    going: frozenset[int]
    states: tuple[Array, ...]
    open: Open
    nearby: int
    stuck: bool = False


def rank_at(engine: Engine, q: Array) -> Rank:
    """Rows that repeat others at a closed state q (nq,) and around it."""
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
    """Closed states nearby, and whether all ways to such states lead back; around a singular pose
    those alone through which a motion goes, where there are some: others are closed by rounding,
    or where motions branch."""
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
    """The largest change of q (nq,), own coordinates of cut hinges left out, which follow."""
    own, packed = change.copy(), calls.engine.packed
    for cut in packed.expanded.cuts:
        if cut.constraint is None:
            own[packed.layout.hinges[cut.hinge].q_slice] = 0.0
    return float(np.abs(own).max(initial=0.0))


def judging(engine: Engine, q: Array) -> LoopCalls:
    """Of the scene in the metric of its hinges, with the mobilities of bodies all alike; of all
    hinges, those too that weld bodies packed as one."""
    packed = unmerged(engine.packed)
    mobility = LoopCalls(Engine(packed_system(geometric(packed.system), packed)), q).mobility
    slides = {
        packed.hinge_position[hinge.name]: hinge.facts.slides
        for hinge in packed.described.hinge if hinge.facts is not None
    }  # fmt: skip
    return LoopCalls(Engine(packed_system(by_hinges(packed.system, slides), packed)), q, mobility)


def _stand_ins(calls: LoopCalls, q: Array, left_out: frozenset[int]) -> frozenset[int]:
    """Rows that say something once another row of their hinge is left out in their place: they
    stay, and which of them count is chosen along the way.

    Tried for all hinges at a time: what each leaves out first for what it keeps first, and so on.
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
    """Rows whose pivots are below their level, those before them taken as met."""
    for row, floor in enumerate(level.tolist()):
        calls.records.judge(row, floor)
    calls.correction(calls.slip, q, np.zeros(calls.engine.nu))
    return frozenset(np.flatnonzero(calls.inverses() == 0.0).tolist())


def _neighbour(calls: LoopCalls, q: Array, speeds: Array, settled: float) -> Array | None:
    """A closed state on the way that speeds without any slips lead, known to `settled` (rad, m);
    None where they lead nowhere."""
    try:
        ahead = _ahead(calls, q, speeds, _AWAY, np.zeros(calls.count))
        return None if ahead is None else _closed(calls, ahead, settled)
    except NumericalFailure:
        return None


def _goes_on(calls: LoopCalls, q: Array, left: frozenset[int], apart: float) -> bool:
    """Whether a motion without the rows that are `left` out leads away, over a long way and to both
    sides, and leaves no gap of these that locks (m, rad): they repeat others but for a misfit."""
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
    """Whether speeds without slips, but for rows of small pivots, lead to closed states, as they do
    where motions do not branch."""
    try:
        ahead = _ahead(calls, q, speeds, _ON, level)
        near = None if ahead is None else _closed(calls, ahead, _SETTLED)
    except NumericalFailure:
        return False
    if near is None or ahead is None:
        return False
    return _way(calls, near - ahead) < _ASIDE * _way(calls, ahead - q)


def _ahead(calls: LoopCalls, q: Array, speeds: Array, way: float, level: Array) -> Array | None:
    """q (nq,) moved by so much (rad, m) along speeds without slips in the rows whose pivots are
    above their level; None where there are none."""
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
    """The closed state (nq,) near another one, known to `settled` (rad, m); None: there is none.

    All rows but those that are `left` out are met, those that repeat others here as well.
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
