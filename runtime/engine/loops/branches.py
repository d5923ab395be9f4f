"""The ways in which loops can close: branches, and which of them is nearest to what is asked.

Steps from a start lead to one branch, mostly but not always the nearest.  So others are looked
for, from bodies placed by the starts of all hinges that state one, cut or not, and from drawn
places; each is led along its motions to where it is nearest, and the nearest is taken.
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

#: Drawn starts at most, how many speeds they have in sum, the most of one, and most hinges that are
#: placed anew.
_TRIES, _IN_SUM, _SPEEDS, _PLACED = 12, 240, 60, 300
#: Steps along the motions at most, the longest (rad, m), and one that is none.
_STEPS, _LONGEST, _STILL = 40, 0.5, 1e-4
#: A square of speeds that is none.
_NONE = 1e-30
#: States that are one branch are apart by no more (rad, m).
_APART = 1e-2
#: A start that is off by no more (rad, lengths) is nearest; and so much nearer counts.
_NEAR, _NEARER = 1e-3, 1e-6


@dataclass(frozen=True)
class Branch:
    """A way in which the loops close.

    Attributes:
        distance: by how much the hinges with a start that counts are off from it: root of the sum
            of squares, of angles in rad, of lengths in parts of the mean distance of hinges.
        q: (nq,) the state on it that is nearest to the start.
        pose: the same by the names of hinges.
    """

    distance: float
    q: Array = field(repr=False, compare=False)
    pose: Mapping[str, tuple[float, ...]]


class Wishes:
    """Coordinates `q` (nq,) that are asked for; those of hinges in `kept` are met anyway.

    Where `stated`, the starts count that the scene states: of several hinges that hold one body
    those of the others are free where they are zero, as what nobody states is.
    """

    def __init__(
        self, packed: Packed, q: Array, kept: Collection[str], stated: bool = True
    ) -> None:
        self.packed, self.q, self._length = packed, q, length_of(packed.system)
        self.kept = tuple(kept)
        counting = _stating(packed.described) if stated else packed.described.hinge
        #: Places of coordinates that count, those of them that are angles, and of quaternions.
        self.angles, self.lengths, self._fours = list[int](), list[int](), list[int]()
        #: Places of angles in q, of hinges that count or not.
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
        """(nq,) q less what is asked for, of coordinates that count; angles by the shorter way."""
        found = np.zeros(len(q))
        found[self.lengths] = (q - self.q)[self.lengths]
        found[self.angles] = _wrapped((q - self.q)[self.angles])
        return found

    def distance(self, q: Array) -> float:
        """See `Branch`."""
        off = self.off(q)
        squares = float(np.sum(off[self.angles] ** 2))
        squares += float(np.sum((off[self.lengths] / self._length) ** 2))
        for place in self._fours:
            along = abs(float(q[place : place + 4] @ self.q[place : place + 4]))
            squares += (2.0 * math.acos(min(1.0, along))) ** 2
        return math.sqrt(squares)

    def nearest_turn(self, q: Array) -> Array:
        """q with angles by whole turns as near as can be to those asked for."""
        found = q.copy()
        found[self.turning] = (self.q + _wrapped(q - self.q))[self.turning]
        return found

    def toward(self, q: Array) -> Array:
        """(nu,) change along the speeds from q to what is asked for."""
        off, layout, found = self.off(q), self.packed.layout, np.zeros(self.packed.layout.nu)
        for hinge in self.packed.described.hinge:
            slots = layout.hinges[hinge.name]
            if slots.nq == slots.nu:
                found[slots.u_slice] = -off[slots.q_slice]
        return found

    def drawn(self, draw: np.random.Generator) -> Array:
        """(nu,) a change along the speeds by anything: half a turn, the length of the scene."""
        found, layout = np.zeros(self.packed.layout.nu), self.packed.layout
        for hinge in self.packed.described.hinge:
            slots, facts = layout.hinges[hinge.name], hinge.facts
            slides = {*range(slots.nu)} if facts is None else {*facts.slides}
            for k in range(slots.nu):
                most = self._length if k in slides else math.pi
                found[slots.u + k] = draw.uniform(-most, most)
        return found


class Search:
    """Branches near `wishes`, of loops that `assembly` closes but for gaps of up to `much`; that of
    `first` (nq,), where steps from the start lead, comes first where others are as near."""

    def __init__(self, assembly: Assembly, wishes: Wishes, first: Array, much: float = 0.0) -> None:
        self._assembly, self._wishes, self._first, self._much = assembly, wishes, first, much

    def is_near(self) -> bool:
        """Whether `first` is where the wishes are: no other branch is nearer."""
        return self._wishes.distance(self._first) < _NEAR

    def nearest(self) -> Array:
        """(nq,) `first`, or a state on a branch that is nearer."""
        if len(self.found) < 2:
            return self._first
        best, far = self.found[0], self._wishes.distance(self._settled_first)
        if best.distance < far - _NEARER:
            return self._wishes.nearest_turn(best.q)
        return self._first

    @cached_property
    def found(self) -> tuple[Branch, ...]:
        """All branches that were found, the nearest first."""
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
        """q led along the motions to where it is nearest to the wishes."""
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
    """The hinges whose starts count."""
    keepers = {body: _keeper(hinges) for body, hinges in _holding(scene).items()}
    stated = [hinge for hinge in scene.hinge if _is_stated(hinge)]
    return [hinge for hinge in stated if _is_moved(hinge) or keepers[hinge.outboard_body] is hinge]


def _holding(scene: Scene) -> dict[str, list[Hinge]]:
    """Hinges by the body that they hold."""
    found: dict[str, list[Hinge]] = {}
    for hinge in scene.hinge:
        found.setdefault(hinge.outboard_body, []).append(hinge)
    return found


def _keeper(hinges: list[Hinge]) -> Hinge:
    """Of the hinges that hold one body that which says where it begins."""
    return next((hinge for hinge in hinges if _is_moved(hinge)), hinges[0])


def _is_stated(hinge: Hinge) -> bool:
    return "initial" in hinge.model_fields_set and bool(hinge.initial and hinge.initial.q)


def _is_moved(hinge: Hinge) -> bool:
    """Whether a hinge begins elsewhere than where it begins unless told."""
    if hinge.initial is None or not hinge.initial.q or hinge.facts is None:
        return False
    usual = start_of(len(hinge.initial.q), hinge.facts.quaternion)
    return _is_stated(hinge) and not np.array_equal(hinge.initial.q, usual)


def _placed(packed: Packed, q: Array, kept: Collection[str], much: float) -> Array | None:
    """(nq,) the start with every body where the hinge that states most puts it, loops closed from
    there; None where that is the tree there is, where it closes nothing, and for large scenes."""
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
    except MstmmError:  # bodies hold each other in a circle
        return None
    return None if closed is None else _by_names(closed, other, packed)


def _by_names(q: Array, packed: Packed, other: Packed) -> Array:
    """q (nq,) of a scene as that of the same one with other cuts."""
    found = np.zeros(other.layout.nq)
    for hinge in packed.described.hinge:
        found[other.layout.hinges[hinge.name].q_slice] = q[packed.layout.hinges[hinge.name].q_slice]
    return found
