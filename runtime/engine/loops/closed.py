"""The closed loops of a model: assembled, their rows judged, and told of."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from mstmm.arrays import Array
from mstmm.errors import MstmmError, NumericalFailure, OpenLoop, SceneError

from ...pack.loops.variants import LOCKED, choosing, keeping, length_of, without
from ...pack.pack import packed_system
from ...pack.records.loops import LoopRecords
from ...pack.start import start_values
from ..engine import Engine
from .assembly import Assembly
from .branches import Branch, Search, Wishes
from .calls import REPEATED, LoopCalls
from .drives import sharing
from .parallel import COUNTING, skewed, skewed_by_gap
from .rank import Rank, rank_at
from .refinement import refinements, unlike_masses
from .rotor_assembly import RotorAssembly
from .stress import outboard_axes

#: Directions of a hinge that closes a loop, as its rows are called.
_DIRECTIONS = ("x", "y", "z", "mx", "my", "mz")
#: The row of a coupling of coordinates, and of one of speeds.
_COUPLED = ("expression", "speeds")
#: And of constraints, by whose directions their rows are; "hinge": of a point on a curve.
_OF_CONSTRAINTS = {
    "distance": ("length",), "plane": ("normal",), "rolling": ("x", "y", "normal"),
    "hinge": ("", "across1", "across2"),
}  # fmt: skip
#: Gaps at which it may still be that rows repeat others but for a misfit, in parts of the length of
#: the scene.
_NEARLY = 1e-2
#: Misfits of rows that repeat others that are rounding, in parts of those that lock.
_SILENT = 1e-3
#: A pose is near a singular one where the strain is this many times that of the start.
_STRAINED = 10.0
#: Longest step (rad, m) by which a branch is followed.
_LED = 0.1
#: So many hinges are named.
_NAMED = 8


@dataclass(frozen=True)
class Loops:
    """What closes in a scene.

    Attributes:
        cut: hinges that close loops; which of a loop's hinges does changes nothing but the work.
        rows: (hinge, direction) of every row, in the order in which they are closed: "x" to "mz"
            for the outboard axis of the hinge along or about which it lies, or nearly so, "u1",
            ... for its own speeds; or (constraint, direction): "length", "normal", "x" and "y"
            where it rolls, "across1" and "across2" of a curve.
        rank: how many rows say something of their own.
        nearby: how many do in closed states nearby; more than `rank` in a singular pose.
        redundant: rows that repeat others, so that the loads along them are not determined.
        momentary: those of them that do so in this pose alone.
        not_unique: components of the loads of hinges, "fx" to "mz" along and about their outboard
            axes, and directions of the loads of constraints and couplings, by name: rigid bodies
            do not determine them, results show one of many shares.
        misfit: the largest gap (m, rad) that rows which repeat others leave at the start, for they
            do so nearly alone, with the row; 0 and two empty words where there is none.
        mobility: speeds that are left free.
        shapes: how many of these are rates of the shapes of flexible bodies, as many as there are
            unless rows that nothing else can meet take some.
        width: most rows that are open across one hinge at a time.
    """

    cut: tuple[str, ...] = ()
    rows: tuple[tuple[str, str], ...] = ()
    rank: int = 0
    nearby: int = 0
    redundant: tuple[tuple[str, str], ...] = ()
    momentary: tuple[tuple[str, str], ...] = ()
    mobility: int = 0
    width: int = 0
    not_unique: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    misfit: tuple[float, str, str] = (0.0, "", "")
    shapes: int = 0
    found_by: Callable[[], tuple[Branch, ...]] = field(default=tuple, repr=False, compare=False)
    decided_by: Callable[[], tuple[str, ...]] = field(default=tuple, repr=False, compare=False)

    @property
    def singular(self) -> bool:
        """Whether the start is a singular pose, where fewer rows count than nearby."""
        return self.nearby > self.rank

    @property
    def counted(self) -> str:
        """Rows, their rank and what is left free, in words."""
        bent = f", of them {self.shapes} of shapes" if self.shapes else ""
        speeds = "1 speed" if self.mobility == 1 else f"{self.mobility} speeds"
        return f"{self.rank} of {len(self.rows)} rows count, {speeds} left{bent}"

    def repeated(self, most: int) -> str:
        """`redundant` in words, so many of them by name."""
        told = ", ".join(f"{word} of {name}" for name, word in self.redundant[:most])
        return told + (" ..." if len(self.redundant) > most else "")

    @property
    def open_loads(self) -> str:
        """`not_unique` in words, the first hinges by name."""
        alike: dict[tuple[str, ...], list[str]] = {}
        for name, words in self.not_unique.items():
            alike.setdefault(words, []).append(name)
        return "; ".join(
            f"{' '.join(words)} of {', '.join(names[:_NAMED])}{' ...' if names[_NAMED:] else ''}"
            for words, names in list(alike.items())[:_NAMED]
        )

    @property
    def branches(self) -> tuple[Branch, ...]:
        """The ways in which the loops can close with what `hold` keeps, as far as they are found:
        the nearest to the start, where the model begins, then the others."""
        return self.found_by()

    @property
    def independent(self) -> tuple[str, ...]:
        """Names of speeds that decide all others, as many as the mobility: those over which mass
        matrices and linear models of the mechanism stand."""
        return self.decided_by()


class Closed:
    """The start of a scene with its loops closed, and what is known of them.

    `engine` is the one to go on with, in which rows that always repeat others are left out.
    """

    def __init__(self, engine: Engine, free_speeds: int) -> None:
        packed, self.engine = engine.packed, engine
        self._whole = engine  #: with all rows there are
        self._found: tuple[Branch, ...] = ()
        hinges = [hinge for hinge in packed.described.hinge if not hinge.is_weld]
        holds = [hinge.name for hinge in hinges if hinge.hold]
        #: Hinges whose start speeds are kept.
        self.fast = [
            hinge.name for hinge in hinges
            if hinge.drive is None and hinge.initial is not None and any(hinge.initial.u or ())
        ]  # fmt: skip
        q, u = start_values(packed.scene, packed.layout, packed.flexible)
        calls = LoopCalls(engine, q)
        q, u = calls.driven(q, u)
        length = length_of(packed.system)
        try:
            near = self._assembly(q, holds).positions(q, _NEARLY * length)
        except OpenLoop as error:
            more = self._too_many(q, holds, free_speeds)
            raise OpenLoop(f"{error}{more}", error.gap, error.pose) from None
        near = self._nearest(q, near, holds, _NEARLY * length)
        try:
            self._begin(near, u, holds, free_speeds, calls)
        except OpenLoop:  # what is left open there is no misfit: it closes farther away
            near = self._assembly(near, holds).positions(near, _NEARLY * length, rough=False)
            self.engine = engine
            self._begin(near, u, holds, free_speeds, calls)
        if self._whole is not self.engine:
            self.engine.packed.behind = partial(_behind, self._whole, self.start[0])

    def _begin(
        self, near: Array, u: Array, holds: Collection[str], free_speeds: int, calls: LoopCalls
    ) -> None:
        """Judge the rows near a state (nq,) that is closed but for misfits, and begin there;
        `calls` are those of all rows.

        Raises OpenLoop where those that count do not close, SceneError for what cannot move.
        """
        locks = LOCKED * length_of(self.engine.packed.system)
        self._keep(near)
        self._whole = self.engine
        self.loops, repeating = self._judged(near, free_speeds)
        self._refuse_structure()
        self.start = self._assembly(near, holds).positions(near), u
        try:
            self.start = self.assembled(near, u, holds, self.fast)
        except SceneError:
            self._refuse_locked(calls, repeating, locks)
            raise
        self.engine.packed.model.loops_singular = int(self.loops.singular)
        self.engine.packed.model.refines = refinements(
            self.engine, *self.start, self.loops.mobility
        )
        self._refuse_locked(calls, repeating, locks)

    def _nearest(self, q: Array, near: Array, holds: Collection[str], much: float) -> Array:
        """`near`, where steps from the start q (nq,) lead, or a state on a nearer branch."""
        self._wishes = Wishes(self.engine.packed, q, holds)
        search = Search(self._assembly(q, holds), self._wishes, near, much)
        if search.is_near():
            return near
        found = search.nearest()
        self._found = search.found
        return found

    @property
    def branches(self) -> tuple[Branch, ...]:
        """Branches on which the loops close, as far as they were found, the nearest to the start
        first; looked for when they are asked for first, where the start was closed."""
        if not self._found:
            holds = self._wishes.kept
            search = Search(self._assembly(self.start[0], holds), self._wishes, self.start[0])
            self._found = search.found
        return self._found

    def nearest(
        self, q: Array, u: Array, holds: Collection[str], fast: Collection[str], t: float
    ) -> tuple[Array, Array]:
        """As `assembled`, on the branch that is nearest to q of those that are found."""
        assembly = self._assembly(q, holds, t)
        near = assembly.positions(q)
        search = Search(assembly, Wishes(self.engine.packed, q, holds, stated=False), near)
        near = near if search.is_near() else search.nearest()
        return near, self._assembly(near, fast, t).speeds(near, u)

    def led(self, q: Array, to: Array, holds: Collection[str], t: float = 0.0) -> Array:
        """A closed q (nq,) with the coordinates of `holds` led to those of `to` by small steps, so
        that it stays on its branch; what drives and couplings ask is that at t (s).

        Raises OpenLoop where the branch ends before.
        """
        layout, kept = self.engine.packed.layout, np.zeros(len(q), bool)
        driven = {hinge.name for hinge in self.engine.packed.described.hinge if hinge.drive}
        for name in {*holds, *driven}:
            kept[layout.hinges[name].q_slice] = True
        way = np.where(kept, to - q, 0.0)
        steps = max(1, math.ceil(float(np.abs(way).max(initial=0.0)) / _LED))
        for k in range(1, steps + 1):
            onward = np.where(kept, to - way * (1.0 - k / steps), q)
            q = self._assembly(onward, {*holds, *driven}, t).positions(onward)
        return q

    def assembled(
        self, q: Array, u: Array, holds: Collection[str], fast: Collection[str], t: float = 0.0
    ) -> tuple[Array, Array]:
        """The nearest (q, u) with loops closed at t (s); positions of `holds` and speeds of `fast`
        stay.

        Raises SceneError where there is none.
        """
        q = self._assembly(q, holds, t).positions(q)
        return q, self._assembly(q, fast, t).speeds(q, u)

    def _assembly(self, q: Array, hinges: Collection[str], t: float = 0.0) -> Assembly:
        return RotorAssembly(self.engine, q, hinges, self._sharing, t)

    def _sharing(self, q: Array) -> str:
        """Drives that move the same freedom near q, in words."""
        return sharing(self._whole, q)

    def _keep(self, q: Array) -> None:
        """Couplings without a value keep what they have at q."""
        packed = self.engine.packed
        if any(one.kept is None for one in packed.system.couplings):
            values = LoopCalls(self.engine, q).values()
            self.engine = Engine(packed_system(keeping(packed.system, values.tolist()), packed))

    def _judged(self, q: Array, free_speeds: int) -> tuple[Loops, dict[int, tuple[str, str]]]:
        """What closes near q, and the rows that always repeat others."""
        rank, calls = rank_at(self.engine, q), LoopCalls(self.engine, q)
        packed, records = self.engine.packed, calls.records
        names, loads = self._names(calls), dict(rank.open.loads)
        for name, word in (names[row] for row in sorted(rank.open.rows)):
            if name not in packed.layout.hinges:
                loads[name] = (*loads.get(name, ()), word)
        if rank.stuck and not self._is_led:
            way = "give what bends there axial shapes too, or let an end of it slide"
            if not packed.flexible:
                way = "change a length or the place of a hinge a little, so that they close in"
                way += " more than this pose"
            raise SceneError(
                f"scene: {_ending(names[row][0] for row in sorted(rank.here))} in a pose that no "
                f"motion leaves, stretched out or folded in line; {skewed(packed, COUNTING) or way}"
            )
        met = [row for row in range(calls.count) if not records.yields(row)]
        rows = len(met) - len(rank.here)
        couplings = {one.coupling.name for one in records.couplings if one.row in rank.going}
        repeated = {
            (one.frame, direction)
            for one in records.closures
            for direction, row in one.rows.items() if row in rank.going
        }  # fmt: skip
        counts = _chosen(records, rank)
        left = choosing(without(packed.system, repeated, couplings), counts)
        mobility = free_speeds - self._shared() - rows
        bent = sum(slots.nu for slots in packed.layout.modal.values())
        if packed.releases:
            # What repeats others now may be needed once these let go: by every evaluation.
            for row in rank.going:
                records.judge(row, REPEATED * float(calls.mobility[row]))
        elif rank.always:
            self.engine = Engine(packed_system(left, packed))
            calls = LoopCalls(self.engine, q)
            records = calls.records
        silent, here = calls.judge_by(rank.states), {names[row] for row in rank.here}
        packed = self.engine.packed
        packed.model.loops_strain = _STRAINED * min(map(calls.strain, rank.states))
        drowned = [name for row, name in enumerate(self._names(calls)) if row in silent]
        self._refuse_drowned([name for name in drowned if name not in here])
        told = Loops(
            tuple(cut.hinge for cut in packed.expanded.cuts if cut.constraint is None),
            tuple(names), rows, len(met) - rank.nearby,
            tuple(names[row] for row in sorted(rank.here)),
            tuple(names[row] for row in sorted(rank.here - rank.always)),
            mobility, records.width, loads, shapes=min(mobility, bent),
        )  # fmt: skip
        return told, {row: names[row] for row in sorted(rank.always)}

    def _too_many(self, q: Array, holds: Sequence[str], free_speeds: int) -> str:
        """What ends a message where more is held than is free near q, by the rank there."""
        count = sum(self.engine.packed.layout.hinges[name].nu for name in holds)
        try:
            near = Assembly(self.engine, q).positions(q)
            self._keep(near)
            mobility = self._judged(near, free_speeds)[0].mobility
        except MstmmError:  # it does not close without holds either
            return ""
        if count <= mobility:
            return ""
        ways = "1 freedom" if mobility == 1 else f"{mobility} freedoms"
        return f"; hold keeps {count} coordinate{'s' * (count > 1)}, the mechanism has {ways}"

    def _refuse_structure(self) -> None:
        """SceneError where nothing can move, and nothing that goes by time moves it."""
        if self.loops.mobility > 0 or self._is_led:
            return
        way = skewed(self.engine.packed, COUNTING)
        way = way or "take a hinge with more coordinates, or a [[spring]] in place of one of them"
        raise SceneError(
            f"scene: no freedom is left, and {_ending(name for name, _ in self.loops.rows)}: a "
            f"structure; {way}"
        )

    def _refuse_drowned(self, rows: Sequence[tuple[str, str]]) -> None:
        """NumericalFailure for rows that geometry tells from others, but no sweep with these
        masses."""
        if rows:
            name, direction = rows[0]
            raise NumericalFailure(
                f'direction {direction} of what "{name}" closes drowns in rounding: '
                f"{unlike_masses(self.engine)}"
            )

    @property
    def _is_led(self) -> bool:
        """Whether drives, couplings that go by time or releases may move what nothing else does."""
        packed = self.engine.packed
        led = any(one.goes_by_time for one in packed.described.coupling)
        return led or bool(packed.system.driven or packed.releases)

    def _refuse_locked(
        self, calls: LoopCalls, repeating: Mapping[int, tuple[str, str]], much: float
    ) -> None:
        """SceneError where a row that repeats others leaves a gap that they do not close."""
        q, u = self.start
        missing = np.abs(calls.correction(calls.gap, q, np.zeros(len(u)))[1])
        slips = np.abs(calls.correction(calls.slip, q, u)[1])
        of_couplings = [one.row for one in calls.records.couplings]
        missing[of_couplings] = np.maximum(missing, slips)[of_couplings]
        worst = max(repeating, key=lambda row: float(missing[row]), default=None)
        if worst is not None and missing[worst] > much * _SILENT:
            self.loops = replace(self.loops, misfit=(float(missing[worst]), *repeating[worst]))
        for row, (closing, direction) in repeating.items():
            if missing[row] > much:
                if direction in _COUPLED:
                    raise SceneError(
                        f'scene: coupling "{closing}" contradicts what others ask, by '
                        f"{missing[row]:.3g} at the start; leave it out, or correct what it equals"
                    )
                raise SceneError(
                    f"scene: direction {direction} of {calls.closing(row)} repeats what others "
                    f"do, but for a gap of {missing[row]:.3g}: "
                    f"{self._sharing(q) or self._locking(float(missing[row]))}"
                )

    def _locking(self, gap: float) -> str:
        """Why a gap (m, rad) that nothing closes is none of a mechanism, and what to do."""
        way = skewed_by_gap(self.engine.packed, gap)
        way = way or "make axes parallel and points meet, or use a ball or cylindrical hinge"
        return f"as a rigid mechanism it would lock; {way}"

    def _shared(self) -> int:
        """Speeds of cut hinges that nobody imposes: the tree has them already."""
        system = self.engine.packed.system
        frames = [system.body(one.frame) for one in system.closures]
        return sum(frame.nu - sum(frame.imposed) for frame in frames)

    def _names(self, calls: LoopCalls) -> list[tuple[str, str]]:
        """(hinge, direction) of every row."""
        names, system = [("", "")] * calls.count, self.engine.packed.system
        for one in calls.records.closures:
            hinge, _, table = calls.engine.hinge_name(one.frame).partition("/")
            if table:
                for direction, row in one.rows.items():
                    names[row] = (hinge, _OF_CONSTRAINTS[one.kind][direction])
                continue
            speeds = system.body(one.frame).nu
            held = [direction for direction in range(6) if direction >= speeds]
            axes = outboard_axes(calls, one.frame)
            W = calls.numbers_of(one, "W")[held].reshape(-1, 2, 3) @ axes
            words = dict(zip(held, _words(np.abs(W.reshape(-1, 6))), strict=True))
            for direction, row in one.rows.items():
                names[row] = (hinge, words.get(direction, f"u{direction + 1}"))
        for coupling in calls.records.couplings:
            names[coupling.row] = (
                coupling.coupling.name, _COUPLED[coupling.coupling.of_speeds]
            )  # fmt: skip
        return names


def _chosen(records: LoopRecords, rank: Rank) -> dict[int, int]:
    """How many rows count of closures of which some stand in for others, by the place of the
    frame."""
    own = {one.frame: {*one.rows.values()} for one in records.closures}
    standing = rank.always - rank.going
    return {
        frame: len(rows - rank.always) - sum(map(records.yields, rows))
        for frame, rows in own.items() if rows & standing
    }  # fmt: skip


def _behind(engine: Engine, q: Array) -> str:
    """What is behind loops that close at the start q (nq,) but not later, and what to do; empty
    where neither drives nor axes are."""
    return sharing(engine, q) or skewed(engine.packed, COUNTING)


def _ending(closing: Iterable[str]) -> str:
    """Loops by what closes them, the first by name."""
    names = [f'"{name}"' for name in dict.fromkeys(closing)]
    return f"loops close at {', '.join(names[:_NAMED])}{' ...' if len(names) > _NAMED else ''}"


def _words(sizes: Array) -> list[str]:
    """A word for each of n directions (n, 6), none twice: the largest components choose first."""
    words, left = [""] * len(sizes), sizes.copy()
    for _ in words:
        row, column = np.unravel_index(left.argmax(), left.shape)
        words[row] = _DIRECTIONS[column]
        left[row], left[:, column] = -1.0, -1.0
    return words
