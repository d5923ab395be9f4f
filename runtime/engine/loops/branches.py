"""Assembly branches of closed loops, and the search for the nearest one.

Steps from a start lead to one branch, usually but not always the nearest.  The search therefore
also starts from bodies placed by all initial states given for hinges, cut or not, and from random
positions.  On each branch it moves to the state nearest to the requested one; the nearest branch is
used.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import MstmmError
from mstmm.ir.hinge_properties import default_coordinates
from mstmm.scene import Hinge, Scene

from ...packing.packed_scene import PackedScene
from ...packing.scene_packing import pack
from ...packing.system_variants import characteristic_length
from ..looped_engine import LoopedEngine
from .assembly import Assembly

#: Maximum number of random starts, of their speeds in total, and of speeds per start; maximum
#: number of hinges of a scene with bodies placed by their initial states.
_MAX_STARTS, _MAX_TOTAL_SPEEDS, _MAX_SPEEDS, _MAX_PLACED_HINGES = 12, 240, 60, 300
#: Maximum number of steps on a branch, longest step, and negligible step (rad, m).
_MAX_STEPS, _MAX_STEP, _NEGLIGIBLE_STEP = 40, 0.5, 1e-4
#: Squared norm of speeds that counts as zero.
_NEGLIGIBLE_SQUARE = 1e-30
#: Largest distance (rad, m) between settled states that count as the same branch.
_MAX_BRANCH_DISTANCE = 1e-2
#: Distance (rad, lengths) below which a start counts as nearest; smallest significant difference.
_NEAREST_DISTANCE, _MIN_IMPROVEMENT = 1e-3, 1e-6


@dataclass(frozen=True)
class Branch:
    """Assembly branch of closed loops.

    Attributes:
        distance: distance from the requested initial coordinates: root of the sum of squares of
            angles in rad and of lengths relative to the mean distance of hinges.
        q: (nq,) state on the branch that is nearest to the start.
        pose: the same by hinge name.
    """

    distance: float
    q: Array = field(repr=False, compare=False)
    pose: Mapping[str, tuple[float, ...]]


class RequestedCoordinates:
    """Requested coordinates `q` (nq,); those of hinges in `kept` are always satisfied.

    With `stated` only initial states given in the scene count.  If several hinges carry one body,
    coordinates of the others that are zero are free, as are those without an initial state.
    """

    def __init__(
        self, packed: PackedScene, q: Array, kept: Collection[str], stated: bool = True
    ) -> None:
        self.packed, self.q, self._length = packed, q, characteristic_length(packed.system)
        self.kept_hinges = tuple(kept)
        counting_hinges = (
            _hinges_with_initial_state(packed.user_scene) if stated else packed.user_scene.hinge
        )
        #: Indices in q of requested angles, lengths and quaternions.
        self.angles, self.lengths, self._quaternions = list[int](), list[int](), list[int]()
        #: Indices in q of all angles, requested or not.
        self.angle_indices = list[int]()
        driven_hinges = {hinge.name for hinge in packed.user_scene.hinge if hinge.drive is not None}
        names = {counted_hinge.name for counted_hinge in counting_hinges} - {*kept} - driven_hinges
        for hinge in packed.user_scene.hinge:
            self._sort(hinge, hinge.name in names)

    def _sort(self, hinge: Hinge, counts: bool) -> None:
        slots, facts = self.packed.layout.hinges[hinge.name], hinge.facts
        if slots.quaternion is not None:
            self._quaternions += [slots.q + slots.quaternion] * counts
        elif facts is not None and slots.rates_are_speeds:
            for k in range(slots.nq):
                is_sliding = k in facts.slides
                self.angle_indices += [slots.q + k] * (not is_sliding)
                (self.lengths if is_sliding else self.angles).extend([slots.q + k] * counts)

    def deviation_of(self, q: Array) -> Array:
        """Deviation (nq,) of q from the requested coordinates; angles wrapped to half a turn."""
        deviation = np.zeros(len(q))
        deviation[self.lengths] = (q - self.q)[self.lengths]
        deviation[self.angles] = _wrap_angles((q - self.q)[self.angles])
        return deviation

    def distance(self, q: Array) -> float:
        """Distance of q from the requested coordinates; see `Branch`."""
        deviation = self.deviation_of(q)
        squares = float(np.sum(deviation[self.angles] ** 2))
        squares += float(np.sum((deviation[self.lengths] / self._length) ** 2))
        for first in self._quaternions:
            cosine = abs(float(q[first : first + 4] @ self.q[first : first + 4]))
            squares += (2.0 * math.acos(min(1.0, cosine))) ** 2
        return math.sqrt(squares)

    def unwrap_to_requested(self, q: Array) -> Array:
        """Shift the angles of q by whole turns, next to the requested ones."""
        shifted = q.copy()
        shifted[self.angle_indices] = (self.q + _wrap_angles(q - self.q))[self.angle_indices]
        return shifted

    def change_toward(self, q: Array) -> Array:
        """Change (nu,) along the speeds from q to the requested coordinates."""
        deviation = self.deviation_of(q)
        layout = self.packed.layout
        change = np.zeros(self.packed.layout.nu)
        for hinge in self.packed.user_scene.hinge:
            slots = layout.hinges[hinge.name]
            if slots.nq == slots.nu:
                change[slots.u_slice] = -deviation[slots.q_slice]
        return change

    def random_change(self, draw: np.random.Generator) -> Array:
        """Random change (nu,) along the speeds: up to half a turn or the scene length."""
        change, layout = np.zeros(self.packed.layout.nu), self.packed.layout
        for hinge in self.packed.user_scene.hinge:
            slots, facts = layout.hinges[hinge.name], hinge.facts
            sliding_speeds = {*range(slots.nu)} if facts is None else {*facts.slides}
            for k in range(slots.nu):
                bound = self._length if k in sliding_speeds else math.pi
                change[slots.u + k] = draw.uniform(-bound, bound)
        return change


class BranchSearch:
    """Search for branches near `wishes` on which `assembly` closes loops to gaps of `much`.

    The branch of `first` (nq,), reached from the start, precedes others at the same distance.
    """

    def __init__(
        self, assembly: Assembly, wishes: RequestedCoordinates, first: Array, much: float = 0.0
    ) -> None:
        self._assembly, self._requested, self._first, self._max_gap = assembly, wishes, first, much

    def is_near(self) -> bool:
        """True if `first` is at the requested coordinates, so that no branch is nearer."""
        return self._requested.distance(self._first) < _NEAREST_DISTANCE

    def nearest_state(self) -> Array:
        """State (nq,) on the nearest branch: `first` unless another branch is nearer."""
        if len(self.branches) < 2:
            return self._first
        nearest_branch = self.branches[0]
        first_distance = self._requested.distance(self._nearest_to_request)
        if nearest_branch.distance < first_distance - _MIN_IMPROVEMENT:
            return self._requested.unwrap_to_requested(nearest_branch.q)
        return self._first

    @cached_property
    def branches(self) -> tuple[Branch, ...]:
        """Branches found, the nearest first."""
        starts = (
            self._assembly.closed_state_near(start, self._max_gap) for start in self._start_states()
        )
        closed_states = [closed for closed in starts if closed is not None]
        requested = self._requested
        states = [self._nearest_to_request if closed_states else self._first]
        for closed in closed_states:
            nearest_state = self._descend_branch(closed)
            if all(
                self._distance(nearest_state, known_state) > _MAX_BRANCH_DISTANCE
                for known_state in states
            ):
                states.append(nearest_state)
        ranked = sorted(states, key=lambda q: round(requested.distance(q) / _MIN_IMPROVEMENT))
        return tuple(
            Branch(requested.distance(q), q, self._assembly.coordinates_by_name(q))
            for q in map(requested.unwrap_to_requested, ranked)
        )

    def _start_states(self) -> Iterator[Array]:
        requested, engine = self._requested, self._assembly.calls.engine
        placed_q = _start_from_placed_bodies(
            engine.packed, requested.q, self._assembly.fixed_hinges, self._max_gap
        )
        if placed_q is not None:
            yield placed_q
        random_generator = np.random.default_rng(0)
        start_count = (
            min(_MAX_STARTS, _MAX_TOTAL_SPEEDS // max(1, engine.nu))
            if engine.nu <= _MAX_SPEEDS
            else 0
        )
        for _ in range(start_count):
            change = requested.random_change(random_generator) * self._assembly.free_speed_mask
            yield self._assembly.calls.move(requested.q, change)

    @cached_property
    def _nearest_to_request(self) -> Array:
        return self._descend_branch(self._first)

    def _descend_branch(self, q: Array) -> Array:
        """Move q on its branch to the state nearest to the requested coordinates."""
        calls, distance = self._assembly.calls, self._requested.distance(q)
        for _ in range(_MAX_STEPS):
            try:
                requested_speeds = self._assembly.free_speed_mask * self._requested.change_toward(q)
                speeds = (
                    requested_speeds
                    + self._assembly.free_speed_mask
                    * calls.correction(calls.velocity_level, q, requested_speeds)[0]
                )
                speeds *= float(requested_speeds @ speeds) / max(
                    float(speeds @ speeds), _NEGLIGIBLE_SQUARE
                )
                length = float(np.abs(speeds).max(initial=0.0))
                if length < _NEGLIGIBLE_STEP:
                    break
                ahead_q = calls.move(q, speeds * min(1.0, _MAX_STEP / length))
                closed_q = self._assembly.closed_state_near(ahead_q, self._max_gap)
            except MstmmError:
                break
            if (
                closed_q is None
                or not self._requested.distance(closed_q) < distance - _MIN_IMPROVEMENT
            ):
                break
            q, distance = closed_q, self._requested.distance(closed_q)
        return q

    def _distance(self, first_q: Array, second_q: Array) -> float:
        difference = first_q - second_q
        difference[self._requested.angle_indices] = _wrap_angles(
            difference[self._requested.angle_indices]
        )
        return float(np.abs(difference).max(initial=0.0))


def _wrap_angles(angles: Array) -> Array:
    return np.asarray((angles + math.pi) % (2.0 * math.pi) - math.pi)


def _hinges_with_initial_state(scene: Scene) -> list[Hinge]:
    """Hinges whose initial states are requested coordinates."""
    determining_hinges = {
        body: _determining_hinge(hinges) for body, hinges in _hinges_by_outboard_body(scene).items()
    }
    stated_hinges = [hinge for hinge in scene.hinge if _has_initial_q(hinge)]
    return [
        hinge
        for hinge in stated_hinges
        if _has_nondefault_q(hinge) or determining_hinges[hinge.outboard_body] is hinge
    ]


def _hinges_by_outboard_body(scene: Scene) -> dict[str, list[Hinge]]:
    """Hinges by their outboard body."""
    hinges_by_body: dict[str, list[Hinge]] = {}
    for hinge in scene.hinge:
        hinges_by_body.setdefault(hinge.outboard_body, []).append(hinge)
    return hinges_by_body


def _determining_hinge(hinges: list[Hinge]) -> Hinge:
    """Hinge that determines the initial state of a body, out of all its inboard hinges."""
    return next((hinge for hinge in hinges if _has_nondefault_q(hinge)), hinges[0])


def _has_initial_q(hinge: Hinge) -> bool:
    return "initial" in hinge.model_fields_set and bool(hinge.initial and hinge.initial.q)


def _has_nondefault_q(hinge: Hinge) -> bool:
    """True if a hinge has an initial q that differs from the default."""
    if hinge.initial is None or not hinge.initial.q or hinge.facts is None:
        return False
    default_q = default_coordinates(len(hinge.initial.q), hinge.facts.quaternion)
    return _has_initial_q(hinge) and not np.array_equal(hinge.initial.q, default_q)


def _start_from_placed_bodies(
    packed: PackedScene, q: Array, kept: Collection[str], much: float
) -> Array | None:
    """Closed start (nq,) with every body placed by the hinge that determines its initial state.

    None if the tree is the same, if the loops do not close from there, and for large scenes.
    """
    scene = packed.user_scene
    if len(scene.hinge) > _MAX_PLACED_HINGES or scene.beam or scene.elastic or packed.releases:
        return None
    cut_hinges = {
        hinge.name
        for hinges in _hinges_by_outboard_body(scene).values()
        for hinge in hinges if hinge is not _determining_hinge(hinges)
    }  # fmt: skip
    if cut_hinges == {
        cut_record.hinge for cut_record in packed.expanded.cuts if cut_record.constraint is None
    }:
        return None
    hinges = tuple(
        hinge.model_copy(update={"cut": hinge.name in cut_hinges}) for hinge in scene.hinge
    )
    fields = {name: getattr(scene, name) for name in type(scene).model_fields} | {"hinge": hinges}
    try:
        repacked = pack(
            Scene.model_construct(**fields), packed.elements.known, simplify=packed.simplify
        )
        start_q = _convert_q(q, packed, repacked)
        closed_q = Assembly(LoopedEngine(repacked), start_q, kept).closed_state_near(start_q, much)
    except MstmmError:  # the determining hinges form a cycle
        return None
    return None if closed_q is None else _convert_q(closed_q, repacked, packed)


def _convert_q(q: Array, packed: PackedScene, target: PackedScene) -> Array:
    """Convert q (nq,) of a scene to that of the same scene with other cut hinges."""
    converted = np.zeros(target.layout.nq)
    for hinge in packed.user_scene.hinge:
        converted[target.layout.hinges[hinge.name].q_slice] = q[
            packed.layout.hinges[hinge.name].q_slice
        ]
    return converted
