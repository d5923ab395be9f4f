"""Closed loops of a model: assembly at the start, rank of the rows, and their description."""

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

#: Names of the rows of a hinge that closes a loop, by direction.
_DIRECTIONS = ("x", "y", "z", "mx", "my", "mz")
#: Names of the row of a coupling of coordinates, and of one of speeds.
_COUPLED = ("expression", "speeds")
#: Names of the rows of constraints by kind and direction; "hinge": a point on a curve.
_OF_CONSTRAINTS = {
    "distance": ("length",), "plane": ("normal",), "rolling": ("x", "y", "normal"),
    "hinge": ("", "across1", "across2"),
}  # fmt: skip
#: Largest position gap of a row that may still be redundant up to a misfit, relative to the length
#: of the scene.
_NEARLY = 1e-2
#: Misfits of redundant rows that are rounding, relative to those that lock.
_SILENT = 1e-3
#: A pose is near a singular one if the strain is this many times that of the start.
_STRAINED = 10.0
#: Longest step (rad, m) along a branch.
_LED = 0.1
#: Maximum number of hinges named in a message.
_NAMED = 8


@dataclass(frozen=True)
class Loops:
    """Closed-loop analysis of a scene: cut hinges, rows, rank, redundancy and mobility.

    Attributes:
        cut: hinges that close loops; the choice of a loop's hinge affects only the computing time.
        rows: (hinge, direction) of every row, in the order in which they are closed: "x" to "mz"
            for the outboard axis of the hinge nearest to its direction, "u1", ... for its own
            speeds; or (constraint, direction): "length", "normal", "x" and "y" of rolling,
            "across1" and "across2" of a curve.
        rank: number of independent rows.
        nearby: that number in closed states nearby; greater than `rank` in a singular pose.
        redundant: redundant rows, so that the loads along them are not determined.
        momentary: those of them that are redundant only in this pose.
        not_unique: components of the loads of hinges, "fx" to "mz" along and about their outboard
            axes, and directions of the loads of constraints and couplings, by name, that rigid
            bodies do not determine: results show one of many distributions.
        misfit: the largest position gap (m, rad) at the start of rows that are redundant up to a
            misfit, with the row; 0 and two empty strings if there is none.
        mobility: number of free speeds.
        shapes: number of these that are rates of the shapes of flexible bodies: all of them unless
            some are needed to satisfy rows.
        width: largest number of rows that are open across one hinge at a time.
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
        """True if the start is a singular pose, with fewer independent rows than nearby."""
        return self.nearby > self.rank

    @property
    def counted(self) -> str:
        """Summary of rows, rank and mobility."""
        bent = f", of them {self.shapes} of shapes" if self.shapes else ""
        speeds = "1 speed" if self.mobility == 1 else f"{self.mobility} speeds"
        return f"{self.rank} of {len(self.rows)} rows count, {speeds} left{bent}"

    def repeated(self, most: int) -> str:
        """List of `redundant` for messages, with at most `most` names."""
        told = ", ".join(f"{word} of {name}" for name, word in self.redundant[:most])
        return told + (" ..." if len(self.redundant) > most else "")

    @property
    def open_loads(self) -> str:
        """List of `not_unique` for messages, with the first names."""
        alike: dict[tuple[str, ...], list[str]] = {}
        for name, words in self.not_unique.items():
            alike.setdefault(words, []).append(name)
        return "; ".join(
            f"{' '.join(words)} of {', '.join(names[:_NAMED])}{' ...' if names[_NAMED:] else ''}"
            for words, names in list(alike.items())[:_NAMED]
        )

    @property
    def branches(self) -> tuple[Branch, ...]:
        """Branches on which the loops close with coordinates of `hold` kept, as far as found.

        The first is nearest to the start and is that of the model.
        """
        return self.found_by()

    @property
    def independent(self) -> tuple[str, ...]:
        """Names of the independent speeds, as many as the mobility.

        They determine all others; mass matrices and linear models of the mechanism refer to them.
        """
        return self.decided_by()


class Closed:
    """Start of a scene with closed loops, and their analysis.

    `engine` is the engine to use from then on, without the rows that are always redundant.
    """

    def __init__(self, engine: Engine, free_speeds: int) -> None:
        packed, self.engine = engine.packed, engine
        self._whole = engine  #: with all rows
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
        except OpenLoop:  # the gap there is no misfit: it closes farther away
            near = self._assembly(near, holds).positions(near, _NEARLY * length, rough=False)
            self.engine = engine
            self._begin(near, u, holds, free_speeds, calls)
        if self._whole is not self.engine:
            self.engine.packed.behind = partial(_behind, self._whole, self.start[0])

    def _begin(
        self, near: Array, u: Array, holds: Collection[str], free_speeds: int, calls: LoopCalls
    ) -> None:
        """Find the rank of the rows near a state (nq,) that is closed up to misfits; start there.

        `calls` are those of all rows.  Raises OpenLoop if independent rows do not close, SceneError
        if the mechanism cannot move.
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
        """Return `near`, to which steps from the start q (nq,) lead, or a nearer branch's state."""
        self._wishes = Wishes(self.engine.packed, q, holds)
        search = Search(self._assembly(q, holds), self._wishes, near, much)
        if search.is_near():
            return near
        found = search.nearest()
        self._found = search.found
        return found

    @property
    def branches(self) -> tuple[Branch, ...]:
        """Branches on which the loops close, as far as found, the nearest to the start first.

        If the start was closed, the search happens at the first access.
        """
        if not self._found:
            holds = self._wishes.kept
            search = Search(self._assembly(self.start[0], holds), self._wishes, self.start[0])
            self._found = search.found
        return self._found

    def nearest(
        self, q: Array, u: Array, holds: Collection[str], fast: Collection[str], t: float
    ) -> tuple[Array, Array]:
        """Assemble as `assembled`, on that of the branches found that is nearest to q."""
        assembly = self._assembly(q, holds, t)
        near = assembly.positions(q)
        search = Search(assembly, Wishes(self.engine.packed, q, holds, stated=False), near)
        near = near if search.is_near() else search.nearest()
        return near, self._assembly(near, fast, t).speeds(near, u)

    def led(self, q: Array, to: Array, holds: Collection[str], t: float = 0.0) -> Array:
        """Move the coordinates of `holds` from a closed q (nq,) to those of `to` on one branch.

        The steps are small, so that the state stays on its branch; drives and couplings have their
        values at t (s).  Raises OpenLoop if the branch ends before.
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
        """Nearest (q, u) that satisfies all constraints at t (s).

        The coordinates of `holds` and the speeds of `fast` are kept.  Raises SceneError if there is
        none.
        """
        q = self._assembly(q, holds, t).positions(q)
        return q, self._assembly(q, fast, t).speeds(q, u)

    def _assembly(self, q: Array, hinges: Collection[str], t: float = 0.0) -> Assembly:
        return RotorAssembly(self.engine, q, hinges, self._sharing, t)

    def _sharing(self, q: Array) -> str:
        """End of a message about drives of the same degree of freedom near q, or ""."""
        return sharing(self._whole, q)

    def _keep(self, q: Array) -> None:
        """Give couplings without a value the one that they have at q."""
        packed = self.engine.packed
        if any(one.kept is None for one in packed.system.couplings):
            values = LoopCalls(self.engine, q).values()
            self.engine = Engine(packed_system(keeping(packed.system, values.tolist()), packed))

    def _judged(self, q: Array, free_speeds: int) -> tuple[Loops, dict[int, tuple[str, str]]]:
        """Analyse the loops near q; also the rows that are always redundant, by index."""
        rank, calls = rank_at(self.engine, q), LoopCalls(self.engine, q)
        packed, records = self.engine.packed, calls.records
        names, loads = self._names(calls), dict(rank.open.loads)
        for name, word in (names[row] for row in sorted(rank.open.rows)):
            if name not in packed.layout.hinges:
                loads[name] = (*loads.get(name, ()), word)
        if rank.stuck and not self._is_led:
            way = "give the flexible bodies there axial shapes too, or let one of their ends slide"
            if not packed.flexible:
                way = "change a length or the place of a hinge slightly, so that they close in"
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
            # Rows redundant now may be needed after a release: every evaluation decides.
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
        """End of a message if more coordinates are held than are free near q, else ""."""
        count = sum(self.engine.packed.layout.hinges[name].nu for name in holds)
        try:
            near = Assembly(self.engine, q).positions(q)
            self._keep(near)
            mobility = self._judged(near, free_speeds)[0].mobility
        except MstmmError:  # it does not close without held coordinates either
            return ""
        if count <= mobility:
            return ""
        ways = "1 degree of freedom" if mobility == 1 else f"{mobility} degrees of freedom"
        return f"; hold keeps {count} coordinate{'s' * (count > 1)}, the mechanism has {ways}"

    def _refuse_structure(self) -> None:
        """Raise SceneError if no motion is free and none is prescribed over time."""
        if self.loops.mobility > 0 or self._is_led:
            return
        way = skewed(self.engine.packed, COUNTING)
        way = way or "use a hinge with more coordinates, or replace a hinge by a [[spring]]"
        raise SceneError(
            f"scene: no degree of freedom is left, and "
            f"{_ending(name for name, _ in self.loops.rows)}: a structure; {way}"
        )

    def _refuse_drowned(self, rows: Sequence[tuple[str, str]]) -> None:
        """Raise NumericalFailure for independent rows that the masses hide in rounding."""
        if rows:
            name, direction = rows[0]
            raise NumericalFailure(
                f'direction {direction} of the loop closed by "{name}" is lost to rounding: '
                f"{unlike_masses(self.engine)}"
            )

    @property
    def _is_led(self) -> bool:
        """True if drives, couplings that depend on time, or releases may move the mechanism."""
        packed = self.engine.packed
        led = any(one.goes_by_time for one in packed.described.coupling)
        return led or bool(packed.system.driven or packed.releases)

    def _refuse_locked(
        self, calls: LoopCalls, repeating: Mapping[int, tuple[str, str]], much: float
    ) -> None:
        """Raise SceneError if a redundant row leaves a gap that the others do not close."""
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
                        f'scene: coupling "{closing}" contradicts other constraints by '
                        f"{missing[row]:.3g} at the start; omit it, or correct its expression"
                    )
                raise SceneError(
                    f"scene: direction {direction} of {calls.closing(row)} is redundant, violated "
                    f"by {missing[row]:.3g}: "
                    f"{self._sharing(q) or self._locking(float(missing[row]))}"
                )

    def _locking(self, gap: float) -> str:
        """End of a message about a gap (m, rad) that no motion closes, with a remedy."""
        way = skewed_by_gap(self.engine.packed, gap)
        way = way or "make axes parallel and points meet, or use a ball or cylindrical hinge"
        return f"as a rigid mechanism it would lock; {way}"

    def _shared(self) -> int:
        """Number of free speeds of cut hinges, which the tree counts already."""
        system = self.engine.packed.system
        frames = [system.body(one.frame) for one in system.closures]
        return sum(frame.nu - sum(frame.imposed) for frame in frames)

    def _names(self, calls: LoopCalls) -> list[tuple[str, str]]:
        """Names (hinge, direction) of every row."""
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
    """Number of independent rows of closures with interchangeable rows, by place of the frame."""
    own = {one.frame: {*one.rows.values()} for one in records.closures}
    standing = rank.always - rank.going
    return {
        frame: len(rows - rank.always) - sum(map(records.yields, rows))
        for frame, rows in own.items() if rows & standing
    }  # fmt: skip


def _behind(engine: Engine, q: Array) -> str:
    """Cause of loops that close at the start q (nq,) but not later, with a remedy.

    Empty if neither drives nor axes are the cause.
    """
    return sharing(engine, q) or skewed(engine.packed, COUNTING)


def _ending(closing: Iterable[str]) -> str:
    """Phrase that names the elements that close loops, the first ones only."""
    names = [f'"{name}"' for name in dict.fromkeys(closing)]
    return f"loops close at {', '.join(names[:_NAMED])}{' ...' if len(names) > _NAMED else ''}"


def _words(sizes: Array) -> list[str]:
    """Distinct names of n directions (n, 6); the largest components choose first."""
    words, left = [""] * len(sizes), sizes.copy()
    for _ in words:
        row, column = np.unravel_index(left.argmax(), left.shape)
        words[row] = _DIRECTIONS[column]
        left[row], left[:, column] = -1.0, -1.0
    return words
