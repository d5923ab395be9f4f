"""Closed-loop analysis of a model: initial assembly, rank of the rows, and description."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import LoopClosureError, MstmmError, NumericalFailure, SceneError

from ...packing.coordinate_layout import start_values
from ...packing.records.loop_records import LoopRecords
from ...packing.scene_packing import packed_system
from ...packing.system_variants import (
    LOCKING_GAP_FRACTION,
    characteristic_length,
    with_coupling_values,
    with_row_choice,
    without_rows,
)
from ..looped_engine import LoopedEngine
from .acceleration_refinement import count_refinements, mass_ratio_text
from .assembly import Assembly, RotorAssembly
from .branches import Branch, BranchSearch, RequestedCoordinates
from .constraint_rank import Rank, find_rank, outboard_axes
from .loop_calls import REDUNDANT_PIVOT, LoopCalls
from .near_parallel_axes import MIN_COUNTING_ANGLE, find_skewed_axis, find_skewed_axis_by_gap
from .redundant_drives import shared_drives_text

#: Names of the rows of a hinge that closes a loop, by direction.
_DIRECTION_NAMES = ("x", "y", "z", "mx", "my", "mz")
#: Names of the row of a coupling of coordinates, and of one of speeds.
_COUPLING_ROWS = ("expression", "speeds")
#: Names of the rows of constraints by kind and direction; "hinge": a point on a curve.
_CONSTRAINT_ROWS = {
    "distance": ("length",), "plane": ("normal",), "rolling": ("x", "y", "normal"),
    "hinge": ("", "across1", "across2"),
}  # fmt: skip
#: Largest position gap of a row that is redundant up to a misfit, relative to the scene length.
_MAX_MISFIT = 1e-2
#: Misfit of redundant rows that counts as rounding, relative to one that locks.
NEGLIGIBLE_MISFIT = 1e-3
#: Ratio of the strain to that of the start above which a pose is near a singular one.
_SINGULAR_STRAIN_RATIO = 10.0
#: Longest step (rad, m) along a branch.
_MAX_BRANCH_STEP = 0.1
#: Maximum number of hinges named in a message.
_MAX_NAMES = 8


@dataclass(frozen=True)
class LoopAnalysis:
    """Closed-loop analysis of a scene: cut hinges, rows, rank, redundancy and mobility.

    Attributes:
        cut_hinges: hinges that close loops; the choice within a loop affects only the computing
            time.
        constraint_rows: (hinge, direction) of every row, in the order in which they are closed: "x"
            to "mz" for the outboard axis of the hinge nearest to its direction, "u1", ... for its
            own speeds; or (constraint, direction): "length", "normal", "x" and "y" of rolling,
            "across1" and "across2" of a curve.
        rank: number of independent rows.
        generic_rank: rank in closed states nearby; greater than `rank` in a singular pose.
        redundant_rows: redundant rows; the loads along them are indeterminate.
        redundant_in_this_pose: rows of `redundant_rows` that are redundant only in this pose.
        indeterminate_reactions: indeterminate loads by name: components of hinge loads, "fx" to
            "mz" along and about the outboard axes, and directions of the loads of constraints and
            couplings. Rigid bodies do not determine them: results show one of many distributions.
        redundancy_gap: largest position gap (m, rad) at the start of rows that are redundant up to
            a misfit, with the row; 0 and two empty strings if there is none.
        mobility: number of degrees of freedom.
        flexible_mobility: number of these that are rates of the shapes of flexible bodies: all of
            them unless some are needed to satisfy rows.
        max_open_rows: largest number of rows that are open across one hinge at a time.
    """

    cut_hinges: tuple[str, ...] = ()
    constraint_rows: tuple[tuple[str, str], ...] = ()
    rank: int = 0
    generic_rank: int = 0
    redundant_rows: tuple[tuple[str, str], ...] = ()
    redundant_in_this_pose: tuple[tuple[str, str], ...] = ()
    mobility: int = 0
    max_open_rows: int = 0
    indeterminate_reactions: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    redundancy_gap: tuple[float, str, str] = (0.0, "", "")
    flexible_mobility: int = 0
    find_branches: Callable[[], tuple[Branch, ...]] = field(
        default=tuple, repr=False, compare=False
    )
    speed_choice: Callable[[], tuple[str, ...]] = field(default=tuple, repr=False, compare=False)

    @property
    def singular(self) -> bool:
        """True if the start is a singular configuration, with lower rank than states nearby."""
        return self.generic_rank > self.rank

    @property
    def summary(self) -> str:
        """Summary of rows, rank and mobility."""
        shapes_text = (
            f" ({self.flexible_mobility} of shape functions)" if self.flexible_mobility else ""
        )
        count = len(self.constraint_rows)
        return f"{self.rank} of {count} rows independent, mobility {self.mobility}{shapes_text}"

    def redundant_text(self, most: int) -> str:
        """Text of `redundant_rows` for messages, with at most `most` names."""
        row_names = ", ".join(f"{word} of {name}" for name, word in self.redundant_rows[:most])
        return row_names + (" ..." if len(self.redundant_rows) > most else "")

    @property
    def indeterminate_text(self) -> str:
        """Text of `indeterminate_reactions` for messages, with the first names only."""
        names_by_components: dict[tuple[str, ...], list[str]] = {}
        for name, components in self.indeterminate_reactions.items():
            names_by_components.setdefault(components, []).append(name)
        return "; ".join(
            f"{' '.join(components)} of "
            f"{', '.join(names[:_MAX_NAMES])}{' ...' if names[_MAX_NAMES:] else ''}"
            for components, names in list(names_by_components.items())[:_MAX_NAMES]
        )

    @property
    def branches(self) -> tuple[Branch, ...]:
        """Assembly branches found that keep the coordinates of hinges with `hold`.

        The first is nearest to the start and is that of the model.
        """
        return self.find_branches()

    @property
    def independent_speeds(self) -> tuple[str, ...]:
        """Names of the independent speeds; their number is the mobility.

        They determine all others; mass matrices and linear models of the mechanism refer to them.
        """
        return self.speed_choice()


class LoopStart:
    """Initial state of a scene with closed loops, and their analysis.

    `engine` is the engine for all further use, without the rows that are always redundant.
    """

    def __init__(self, engine: LoopedEngine, free_speeds: int) -> None:
        packed, self.engine = engine.packed, engine
        self._full_engine = engine  #: with all rows
        self._found_branches: tuple[Branch, ...] = ()
        hinges = [hinge for hinge in packed.user_scene.hinge if not hinge.is_weld]
        held_hinges = [hinge.name for hinge in hinges if hinge.hold]
        #: Hinges with initial speeds that are kept.
        self.fast_hinges = [
            hinge.name for hinge in hinges
            if hinge.drive is None and hinge.initial is not None and any(hinge.initial.u or ())
        ]  # fmt: skip
        q, u = start_values(packed.scene, packed.layout, packed.flexible)
        calls = LoopCalls(engine, q)
        q, u = calls.driven_state(q, u)
        length = characteristic_length(packed.system)
        try:
            near_q = self._assembly(q, held_hinges).positions(q, _MAX_MISFIT * length)
        except LoopClosureError as error:
            extra_text = self._excess_hold_text(q, held_hinges, free_speeds)
            raise LoopClosureError(f"{error}{extra_text}", error.gap, error.pose) from None
        near_q = self._nearest(q, near_q, held_hinges, _MAX_MISFIT * length)
        try:
            self._set_start(near_q, u, held_hinges, free_speeds, calls)
        except LoopClosureError:  # the gap is not a misfit: it closes farther away
            near_q = self._assembly(near_q, held_hinges).positions(
                near_q, _MAX_MISFIT * length, rough=False
            )
            self.engine = engine
            self._set_start(near_q, u, held_hinges, free_speeds, calls)
        if self._full_engine is not self.engine:
            self.engine.packed.find_loop_cause = partial(
                _open_loop_cause, self._full_engine, self.start[0]
            )

    def _set_start(
        self, near: Array, u: Array, holds: Collection[str], free_speeds: int, calls: LoopCalls
    ) -> None:
        """Find the rank of the rows at `near` (nq,), which is closed up to misfits; start there.

        `calls` are those of all rows.  Raises LoopClosureError if independent rows do not close,
        SceneError if the mechanism cannot move.
        """
        locking_gap = LOCKING_GAP_FRACTION * characteristic_length(self.engine.packed.system)
        self._fix_coupling_values(near)
        self._full_engine = self.engine
        self.loops, redundant_names = self._analyse(near, free_speeds)
        self._check_mobility()
        self.start = self._assembly(near, holds).positions(near), u
        try:
            self.start = self.assemble(near, u, holds, self.fast_hinges)
        except SceneError:
            self._check_redundancy_gaps(calls, redundant_names, locking_gap)
            raise
        self.engine.packed.model.loops_singular = int(self.loops.singular)
        self.engine.packed.model.refines = count_refinements(
            self.engine, *self.start, self.loops.mobility
        )
        self._check_redundancy_gaps(calls, redundant_names, locking_gap)

    def _nearest(self, q: Array, near: Array, holds: Collection[str], much: float) -> Array:
        """State `near`, reached from the start q (nq,), or a state on a nearer branch."""
        self._requested = RequestedCoordinates(self.engine.packed, q, holds)
        search = BranchSearch(self._assembly(q, holds), self._requested, near, much)
        if search.is_near():
            return near
        nearest_q = search.nearest_state()
        self._found_branches = search.branches
        return nearest_q

    @property
    def branches(self) -> tuple[Branch, ...]:
        """Assembly branches found, the nearest to the start first.

        If the start was closed, the search happens at the first access.
        """
        if not self._found_branches:
            held_hinges = self._requested.kept_hinges
            search = BranchSearch(
                self._assembly(self.start[0], held_hinges), self._requested, self.start[0]
            )
            self._found_branches = search.branches
        return self._found_branches

    def assemble_nearest(
        self, q: Array, u: Array, holds: Collection[str], fast: Collection[str], t: float
    ) -> tuple[Array, Array]:
        """Assemble like `assemble`, on the branch nearest to q of those found."""
        assembly = self._assembly(q, holds, t)
        near_q = assembly.positions(q)
        search = BranchSearch(
            assembly, RequestedCoordinates(self.engine.packed, q, holds, stated=False), near_q
        )
        near_q = near_q if search.is_near() else search.nearest_state()
        return near_q, self._assembly(near_q, fast, t).speeds(near_q, u)

    def follow_branch(self, q: Array, to: Array, holds: Collection[str], t: float = 0.0) -> Array:
        """Move the coordinates of `holds` from a closed q (nq,) to those of `to` on one branch.

        Small steps keep the state on its branch; drives and couplings have their values at t (s).
        Raises LoopClosureError if the branch ends before.
        """
        layout, is_kept = self.engine.packed.layout, np.zeros(len(q), bool)
        driven = {hinge.name for hinge in self.engine.packed.user_scene.hinge if hinge.drive}
        for name in {*holds, *driven}:
            is_kept[layout.hinges[name].q_slice] = True
        change = np.where(is_kept, to - q, 0.0)
        steps = max(1, math.ceil(float(np.abs(change).max(initial=0.0)) / _MAX_BRANCH_STEP))
        for k in range(1, steps + 1):
            next_q = np.where(is_kept, to - change * (1.0 - k / steps), q)
            q = self._assembly(next_q, {*holds, *driven}, t).positions(next_q)
        return q

    def assemble(
        self, q: Array, u: Array, holds: Collection[str], fast: Collection[str], t: float = 0.0
    ) -> tuple[Array, Array]:
        """Nearest (q, u) that satisfies all constraints at t (s).

        The coordinates of `holds` and the speeds of `fast` are kept.  Raises SceneError if there is
        no such state.
        """
        q = self._assembly(q, holds, t).positions(q)
        return q, self._assembly(q, fast, t).speeds(q, u)

    def _assembly(self, q: Array, hinges: Collection[str], t: float = 0.0) -> Assembly:
        return RotorAssembly(self.engine, q, hinges, self._shared_drives_note, t)

    def _shared_drives_note(self, q: Array) -> str:
        """Message part about drives of the same degree of freedom near q, or ""."""
        return shared_drives_text(self._full_engine, q)

    def _fix_coupling_values(self, q: Array) -> None:
        """Set the value of couplings without one to that at q."""
        packed = self.engine.packed
        if any(coupling.constant is None for coupling in packed.system.couplings):
            values = LoopCalls(self.engine, q).values()
            self.engine = LoopedEngine(
                packed_system(with_coupling_values(packed.system, values.tolist()), packed)
            )

    def _analyse(
        self, q: Array, free_speeds: int
    ) -> tuple[LoopAnalysis, dict[int, tuple[str, str]]]:
        """Analyse the loops near q; also return the rows that are always redundant, by index."""
        rank, calls = find_rank(self.engine, q), LoopCalls(self.engine, q)
        packed, records = self.engine.packed, calls.records
        names, load_names = self._names(calls), dict(rank.open.loads)
        for name, word in (names[row] for row in sorted(rank.open.rows)):
            if name not in packed.layout.hinges:
                load_names[name] = (*load_names.get(name, ()), word)
        self._check_not_stuck(rank, names)
        imposed_rows = [row for row in range(calls.count) if not records.is_rotor_row(row)]
        independent_count = len(imposed_rows) - len(rank.redundant_here)
        couplings = {
            record.coupling.name for record in records.couplings if record.row in rank.removed_rows
        }
        removed_rows = {
            (record.frame, direction)
            for record in records.closures
            for direction, row in record.rows.items() if row in rank.removed_rows
        }  # fmt: skip
        chosen_counts = _independent_counts(records, rank)
        remaining_system = with_row_choice(
            without_rows(packed.system, removed_rows, couplings), chosen_counts
        )
        mobility = free_speeds - self._cut_hinge_speed_count() - independent_count
        modal_speed_count = sum(slots.nu for slots in packed.layout.modal.values())
        if packed.releases:
            # Rows redundant now may be needed after a release: decide at every evaluation.
            for row in rank.removed_rows:
                records.set_pivot_floor(row, REDUNDANT_PIVOT * float(calls.mobility[row]))
        elif rank.always_redundant:
            self.engine = LoopedEngine(packed_system(remaining_system, packed))
            calls = LoopCalls(self.engine, q)
            records = calls.records
        rounding_rows = calls.set_pivot_reference(rank.states)
        packed = self.engine.packed
        packed.model.loops_strain = _SINGULAR_STRAIN_RATIO * min(
            map(calls.max_rounding_ratio, rank.states)
        )
        rounding_names = [
            name for row, name in enumerate(self._names(calls)) if row in rounding_rows
        ]
        redundant_names = {names[row] for row in rank.redundant_here}
        self._check_rounding([name for name in rounding_names if name not in redundant_names])
        analysis = LoopAnalysis(
            tuple(cut.hinge for cut in packed.expanded.cuts if cut.constraint is None),
            tuple(names), independent_count, len(imposed_rows) - rank.min_redundant_count,
            tuple(names[row] for row in sorted(rank.redundant_here)),
            tuple(names[row] for row in sorted(rank.redundant_here - rank.always_redundant)),
            mobility, records.width, load_names, flexible_mobility=min(mobility, modal_speed_count),
        )  # fmt: skip
        return analysis, {row: names[row] for row in sorted(rank.always_redundant)}

    def _check_not_stuck(self, rank: Rank, names: Sequence[tuple[str, str]]) -> None:
        """Raise SceneError if the loops close in an isolated configuration only."""
        if not rank.is_stuck or self._has_prescribed_motion:
            return
        remedy = (
            "give these flexible bodies axial shapes, or let one of their ends slide"
            if self.engine.packed.flexible
            else "change a length or the position of a hinge slightly, so that they close in other "
            "configurations too"
        )
        closing = _closing_elements_text(names[row][0] for row in sorted(rank.redundant_here))
        raise SceneError(
            f"scene: {closing} in an isolated configuration, stretched out or folded in line; "
            f"{find_skewed_axis(self.engine.packed, MIN_COUNTING_ANGLE) or remedy}"
        )

    def _excess_hold_text(self, q: Array, holds: Sequence[str], free_speeds: int) -> str:
        """Message part if `holds` fix more coordinates than the mobility near q, else ""."""
        count = sum(self.engine.packed.layout.hinges[name].nu for name in holds)
        try:
            near_q = Assembly(self.engine, q).positions(q)
            self._fix_coupling_values(near_q)
            mobility = self._analyse(near_q, free_speeds)[0].mobility
        except MstmmError:  # it does not close without fixed coordinates either
            return ""
        if count <= mobility:
            return ""
        freedom_text = "1 degree of freedom" if mobility == 1 else f"{mobility} degrees of freedom"
        return (
            f"; hold fixes {count} coordinate{'s' * (count > 1)}, the mechanism has {freedom_text}"
        )

    def _check_mobility(self) -> None:
        """Raise SceneError if the mechanism has no mobility and no prescribed motion."""
        if self.loops.mobility > 0 or self._has_prescribed_motion:
            return
        remedy = find_skewed_axis(self.engine.packed, MIN_COUNTING_ANGLE)
        remedy = remedy or "use a hinge with more coordinates, or replace a hinge by a [[spring]]"
        raise SceneError(
            "scene: no degrees of freedom (a structure), "
            f"{_closing_elements_text(name for name, _ in self.loops.constraint_rows)}; {remedy}"
        )

    def _check_rounding(self, rows: Sequence[tuple[str, str]]) -> None:
        """Raise NumericalFailure for independent rows lost to rounding because of the masses."""
        if rows:
            name, direction = rows[0]
            raise NumericalFailure(
                f'direction {direction} of the loop closed by "{name}" is lost to rounding: '
                f"{mass_ratio_text(self.engine)}"
            )

    @property
    def _has_prescribed_motion(self) -> bool:
        """True if drives, time-dependent couplings or releases may move the mechanism."""
        packed = self.engine.packed
        is_driven = any(coupling.is_time_dependent for coupling in packed.user_scene.coupling)
        return is_driven or bool(packed.system.driven or packed.releases)

    def _check_redundancy_gaps(
        self, calls: LoopCalls, repeating: Mapping[int, tuple[str, str]], much: float
    ) -> None:
        """Raise SceneError if a redundant row has a gap that the other rows do not close."""
        q, u = self.start
        gaps = np.abs(calls.correction(calls.position_level, q, np.zeros(len(u)))[1])
        velocity_errors = np.abs(calls.correction(calls.velocity_level, q, u)[1])
        coupling_rows = [coupling.row for coupling in calls.records.couplings]
        gaps[coupling_rows] = np.maximum(gaps, velocity_errors)[coupling_rows]
        worst_row = max(repeating, key=lambda row: float(gaps[row]), default=None)
        if worst_row is not None and gaps[worst_row] > much * NEGLIGIBLE_MISFIT:
            self.loops = replace(
                self.loops, redundancy_gap=(float(gaps[worst_row]), *repeating[worst_row])
            )
        for row, (closing, direction) in repeating.items():
            if gaps[row] > much:
                if direction in _COUPLING_ROWS:
                    raise SceneError(
                        f'scene: coupling "{closing}" contradicts other constraints by '
                        f"{gaps[row]:.3g} at the start; omit it, or correct its expression"
                    )
                raise SceneError(
                    f"scene: direction {direction} of {calls.closing_label(row)} is redundant, "
                    f"violated by {gaps[row]:.3g}: "
                    f"{self._shared_drives_note(q) or self._locking_gap_text(float(gaps[row]))}"
                )

    def _locking_gap_text(self, gap: float) -> str:
        """Message part about a gap (m, rad) that no motion closes, with a remedy."""
        remedy = find_skewed_axis_by_gap(self.engine.packed, gap)
        remedy = (
            remedy or "make axes parallel and points coincide, or use a ball or cylindrical hinge"
        )
        return f"as a rigid mechanism it would lock; {remedy}"

    def _cut_hinge_speed_count(self) -> int:
        """Number of free speeds of cut hinges, already counted in the tree."""
        system = self.engine.packed.system
        frames = [system.body(closure.frame) for closure in system.closures]
        return sum(frame.nu - sum(frame.imposed) for frame in frames)

    def _names(self, calls: LoopCalls) -> list[tuple[str, str]]:
        """Names (hinge, direction) of every row."""
        names, system = [("", "")] * calls.count, self.engine.packed.system
        for closure in calls.records.closures:
            hinge, _, table = calls.engine.hinge_name(closure.frame).partition("/")
            if table:
                for direction, row in closure.rows.items():
                    names[row] = (hinge, _CONSTRAINT_ROWS[closure.kind][direction])
                continue
            speeds = system.body(closure.frame).nu
            constrained_directions = [direction for direction in range(6) if direction >= speeds]
            axes = outboard_axes(calls, closure.frame)
            W = calls.closure_matrix(closure, "W")[constrained_directions].reshape(-1, 2, 3) @ axes
            direction_names = dict(
                zip(
                    constrained_directions,
                    _distinct_directions(np.abs(W.reshape(-1, 6))),
                    strict=True,
                )
            )
            for direction, row in closure.rows.items():
                names[row] = (hinge, direction_names.get(direction, f"u{direction + 1}"))
        for coupling in calls.records.couplings:
            names[coupling.row] = (
                coupling.coupling.name, _COUPLING_ROWS[coupling.coupling.of_speeds]
            )  # fmt: skip
        return names


def _independent_counts(records: LoopRecords, rank: Rank) -> dict[int, int]:
    """Number of independent rows of closures with interchangeable rows, by frame index."""
    rows_by_frame = {closure.frame: {*closure.rows.values()} for closure in records.closures}
    interchangeable_rows = rank.always_redundant - rank.removed_rows
    return {
        frame: len(rows - rank.always_redundant) - sum(map(records.is_rotor_row, rows))
        for frame, rows in rows_by_frame.items() if rows & interchangeable_rows
    }  # fmt: skip


def _open_loop_cause(engine: LoopedEngine, q: Array) -> str:
    """Cause of loops that close at the start q (nq,) but not later, with a remedy.

    Empty if neither drives nor hinge axes are the cause.
    """
    return shared_drives_text(engine, q) or find_skewed_axis(engine.packed, MIN_COUNTING_ANGLE)


def _closing_elements_text(closing: Iterable[str]) -> str:
    """Phrase that names the first of the elements that close loops."""
    names = [f'"{name}"' for name in dict.fromkeys(closing)]
    return (
        f"loops close at {', '.join(names[:_MAX_NAMES])}{' ...' if len(names) > _MAX_NAMES else ''}"
    )


def _distinct_directions(sizes: Array) -> list[str]:
    """Distinct names of n directions (n, 6), assigned in descending order of components."""
    direction_names, remaining = [""] * len(sizes), sizes.copy()
    for _ in direction_names:
        row, column = np.unravel_index(remaining.argmax(), remaining.shape)
        direction_names[row] = _DIRECTION_NAMES[column]
        remaining[row], remaining[:, column] = -1.0, -1.0
    return direction_names
