"""Branches on which loops can close, and the search for the one nearest to a requested state.

Steps from a start lead to one branch, usually but not always the nearest.  The search therefore
also starts from bodies placed by the initial states of all hinges that state one, cut or not, and
from random positions.  On each branch it moves to the state nearest to the requested one, and the
nearest branch is used.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import MstmmError
from mstmm.ir.facts import start_of
from mstmm.scene import Hinge, Scene

from ...pack.loops.variants import length_of
from ...pack.pack import pack
from ...pack.packed import Packed
from ..engine import Engine
from .assembly import Assembly

#: Maximum number of random starts, of their speeds in total, and of the speeds of one; maximum
#: number of hinges of a scene whose bodies are placed again.
_TRIES, _IN_SUM, _SPEEDS, _PLACED = 12, 240, 60, 300
#: Maximum number of steps on a branch, the longest step, and one that counts as none (rad, m).
_STEPS, _LONGEST, _STILL = 40, 0.5, 1e-4
#: A squared norm of speeds that counts as zero.
_NONE = 1e-30
#: Largest distance (rad, m) of two states on the same branch.
_APART = 1e-2
#: A start within this distance (rad, lengths) is the nearest; smallest difference that counts.
_NEAR, _NEARER = 1e-3, 1e-6


@dataclass(frozen=True)
class Branch:
    """Branch on which the loops close.

    Attributes:
        distance: distance from the requested initial coordinates: root of the sum of squares, of
            angles in rad, of lengths relative to the mean distance of hinges.
        q: (nq,) state on the branch that is nearest to the start.
        pose: the same by the names of hinges.
    """

    distance: float
    q: Array = field(repr=False, compare=False)
    pose: Mapping[str, tuple[float, ...]]


class Wishes:
    """Requested coordinates `q` (nq,); those of hinges in `kept` are satisfied in any case.

    With `stated` only initial states in the scene count.  If several hinges carry one body, the
    coordinates of the others are free if they are zero, like those without an initial state.
    """

    def __init__(
        self, packed: Packed, q: Array, kept: Collection[str], stated: bool = True
    ) -> None:
        self.packed, self.q, self._length = packed, q, length_of(packed.system)
        self.kept = tuple(kept)
        counting = _stating(packed.described) if stated else packed.described.hinge
        #: Indices in q of requested angles, lengths and quaternions.
        self.angles, self.lengths, self._fours = list[int](), list[int](), list[int]()
        #: Indices in q of all angles, requested or not.
        self.turning = list[int]()
        driven = {hinge.name for hinge in packed.described.hinge if hinge.drive is not None}
        names = {one.name for one in counting} - {*kept} - driven
        for hinge in packed.described.hinge:
            self._sort(hinge, hinge.name in names)

    def _sort(self, hinge: Hinge, counts: bool) -> None:
        slots, facts = self.packed.layout.hinges[hinge.name], hinge.facts
        if slots.quaternion is not None:
            self._fours += [slots.q + slots.quaternion] * counts
        elif facts is not None and slots.straight:
            for k in range(slots.nq):
                slides = k in facts.slides
                self.turning += [slots.q + k] * (not slides)
                (self.lengths if slides else self.angles).extend([slots.q + k] * counts)

    def off(self, q: Array) -> Array:
        """Deviation (nq,) of q from the requested coordinates; angles within half a turn."""
        found = np.zeros(len(q))
        found[self.lengths] = (q - self.q)[self.lengths]
        found[self.angles] = _wrapped((q - self.q)[self.angles])
        return found

    def distance(self, q: Array) -> float:
        """Distance of q from the requested coordinates, see `Branch`."""
        off = self.off(q)
        squares = float(np.sum(off[self.angles] ** 2))
        squares += float(np.sum((off[self.lengths] / self._length) ** 2))
        for place in self._fours:
            along = abs(float(q[place : place + 4] @ self.q[place : place + 4]))
            squares += (2.0 * math.acos(min(1.0, along))) ** 2
        return math.sqrt(squares)

    def nearest_turn(self, q: Array) -> Array:
        """Shift the angles of q by whole turns to be nearest to the requested ones."""
        found = q.copy()
        found[self.turning] = (self.q + _wrapped(q - self.q))[self.turning]
        return found

    def toward(self, q: Array) -> Array:
        """Change (nu,) along the speeds from q to the requested coordinates."""
        off, layout, found = self.off(q), self.packed.layout, np.zeros(self.packed.layout.nu)
        for hinge in self.packed.described.hinge:
            slots = layout.hinges[hinge.name]
            if slots.nq == slots.nu:
                found[slots.u_slice] = -off[slots.q_slice]
        return found

    def drawn(self, draw: np.random.Generator) -> Array:
        """Random change (nu,) along the speeds: up to half a turn, or the length of the scene."""
        found, layout = np.zeros(self.packed.layout.nu), self.packed.layout
        for hinge in self.packed.described.hinge:
            slots, facts = layout.hinges[hinge.name], hinge.facts
            slides = {*range(slots.nu)} if facts is None else {*facts.slides}
            for k in range(slots.nu):
                most = self._length if k in slides else math.pi
                found[slots.u + k] = draw.uniform(-most, most)
        return found


class Search:
    """Search for branches near `wishes` on which `assembly` closes the loops, gaps up to `much`.

    The branch of `first` (nq,), to which steps from the start lead, precedes others that are as
    near.
    """

    def __init__(self, assembly: Assembly, wishes: Wishes, first: Array, much: float = 0.0) -> None:
        self._assembly, self._wishes, self._first, self._much = assembly, wishes, first, much

    def is_near(self) -> bool:
        """True if `first` is at the requested coordinates: no other branch is nearer."""
        return self._wishes.distance(self._first) < _NEAR

    def nearest(self) -> Array:
        """State `first` (nq,), or one on a nearer branch."""
        if len(self.found) < 2:
            return self._first
        best, far = self.found[0], self._wishes.distance(self._settled_first)
        if best.distance < far - _NEARER:
            return self._wishes.nearest_turn(best.q)
        return self._first

    @cached_property
    def found(self) -> tuple[Branch, ...]:
        """All branches found, the nearest first."""
        starts = (self._assembly.nearest_closed(start, self._much) for start in self._starts())
        others = [closed for closed in starts if closed is not None]
        wishes, states = self._wishes, [self._settled_first if others else self._first]
        for closed in others:
            state = self._settled(closed)
            if all(self._apart(state, other) > _APART for other in states):
                states.append(state)
        ranked = sorted(states, key=lambda q: round(wishes.distance(q) / _NEARER))
        return tuple(
            Branch(wishes.distance(q), q, self._assembly.by_names(q))
            for q in map(wishes.nearest_turn, ranked)
        )

    def _starts(self) -> Iterator[Array]:
        wishes, engine = self._wishes, self._assembly.calls.engine
        placed = _placed(engine.packed, wishes.q, self._assembly.held, self._much)
        if placed is not None:
            yield placed
        draw = np.random.default_rng(0)
        tries = min(_TRIES, _IN_SUM // max(1, engine.nu)) if engine.nu <= _SPEEDS else 0
        for _ in range(tries):
            change = wishes.drawn(draw) * self._assembly.free
            yield self._assembly.calls.moved(wishes.q, change)

    @cached_property
    def _settled_first(self) -> Array:
        return self._settled(self._first)

    def _settled(self, q: Array) -> Array:
        """Move q on its branch to the state nearest to the requested coordinates."""
        calls, far = self._assembly.calls, self._wishes.distance(q)
        for _ in range(_STEPS):
            try:
                wanted = self._assembly.free * self._wishes.toward(q)
                speeds = wanted + self._assembly.free * calls.correction(calls.slip, q, wanted)[0]
                speeds *= float(wanted @ speeds) / max(float(speeds @ speeds), _NONE)
                length = float(np.abs(speeds).max(initial=0.0))
                if length < _STILL:
                    break
                ahead = calls.moved(q, speeds * min(1.0, _LONGEST / length))
                closed = self._assembly.nearest_closed(ahead, self._much)
            except MstmmError:
                break
            if closed is None or not self._wishes.distance(closed) < far - _NEARER:
                break
            q, far = closed, self._wishes.distance(closed)
        return q

    def _apart(self, one: Array, other: Array) -> float:
        apart = one - other
        apart[self._wishes.turning] = _wrapped(apart[self._wishes.turning])
        return float(np.abs(apart).max(initial=0.0))


def _wrapped(angles: Array) -> Array:
    return np.asarray((angles + math.pi) % (2.0 * math.pi) - math.pi)


def _stating(scene: Scene) -> list[Hinge]:
    """Hinges whose initial states count."""
    keepers = {body: _keeper(hinges) for body, hinges in _holding(scene).items()}
    stated = [hinge for hinge in scene.hinge if _is_stated(hinge)]
    return [hinge for hinge in stated if _is_moved(hinge) or keepers[hinge.outboard_body] is hinge]


def _holding(scene: Scene) -> dict[str, list[Hinge]]:
    """Hinges by their outboard body."""
    found: dict[str, list[Hinge]] = {}
    for hinge in scene.hinge:
        found.setdefault(hinge.outboard_body, []).append(hinge)
    return found


def _keeper(hinges: list[Hinge]) -> Hinge:
    """Of several hinges with the same outboard body, the one that determines its initial state."""
    return next((hinge for hinge in hinges if _is_moved(hinge)), hinges[0])


def _is_stated(hinge: Hinge) -> bool:
    return "initial" in hinge.model_fields_set and bool(hinge.initial and hinge.initial.q)


def _is_moved(hinge: Hinge) -> bool:
    """True if a hinge states an initial q that differs from the default."""
    if hinge.initial is None or not hinge.initial.q or hinge.facts is None:
        return False
    usual = start_of(len(hinge.initial.q), hinge.facts.quaternion)
    return _is_stated(hinge) and not np.array_equal(hinge.initial.q, usual)


def _placed(packed: Packed, q: Array, kept: Collection[str], much: float) -> Array | None:
    """Closed start (nq,) with every body placed by the hinge that states its initial state.

    None if the tree is the same, if the loops do not close from there, and for large scenes.
    """
    scene = packed.described
    if len(scene.hinge) > _PLACED or scene.beam or scene.elastic or packed.releases:
        return None
    cut = {
        hinge.name
        for hinges in _holding(scene).values()
        for hinge in hinges if hinge is not _keeper(hinges)
    }  # fmt: skip
    if cut == {one.hinge for one in packed.expanded.cuts if one.constraint is None}:
        return None
    hinges = tuple(hinge.model_copy(update={"cut": hinge.name in cut}) for hinge in scene.hinge)
    fields = {name: getattr(scene, name) for name in type(scene).model_fields} | {"hinge": hinges}
    try:
        other = pack(
            Scene.model_construct(**fields), packed.elements.known, simplify=packed.simplify
        )
        start = _by_names(q, packed, other)
        closed = Assembly(Engine(other), start, kept).nearest_closed(start, much)
    except MstmmError:  # the determining hinges form a cycle
        return None
    return None if closed is None else _by_names(closed, other, packed)


def _by_names(q: Array, packed: Packed, other: Packed) -> Array:
    """Convert q (nq,) of a scene to that of the same scene with other cuts."""
    found = np.zeros(other.layout.nq)
    for hinge in packed.described.hinge:
        found[other.layout.hinges[hinge.name].q_slice] = q[packed.layout.hinges[hinge.name].q_slice]
    return found
