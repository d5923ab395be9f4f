"""Assembly of closed loops: nearest state that satisfies all constraints.

Positions are iterated with compliant rows (Levenberg, Quart. Appl. Math. 2 (1944) 164-168): with mu
times their mobility on the diagonal of L, a step is the change of least inertia that closes the
gaps as far as mu permits, and it remains bounded far from a closed state.  One correction suffices
for speeds because velocity errors are linear in them.

Steps of least change weighted by body inertia rotate the last links of a long chain most, so that
it folds up; with equal rotors on all hinges it bends as a whole.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from typing import Any

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import LoopClosureError, NumericalFailure, SceneError

from ...packing.scene_packing import packed_system
from ...packing.system_variants import (
    LOCKING_GAP_FRACTION,
    characteristic_length,
    with_rotors,
    with_speeds_prescribed,
    with_stiff_modes,
)
from ..looped_engine import LoopedEngine
from .loop_calls import LoopCalls
from .near_parallel_axes import MIN_COUNTING_ANGLE, find_skewed_axis, find_skewed_axis_by_gap

#: Longest step of a coordinate (rad, m), and maximum number of steps.
_MAX_STEP, _MAX_STEPS = 0.5, 300
#: Compliance of the rows: initial, maximum and minimum.
_INITIAL_COMPLIANCE, _MAX_COMPLIANCE, _MIN_COMPLIANCE = 1e-2, 1e8, 1e-12
#: Path length relative to a gap; gaps that need a longer path to close count as misfits.
_LONG_PATH_RATIO = 50.0
#: Gap (m, rad) that counts as closed for hinge distances up to 1 m, and change (rad, m) at
#: convergence.
_CLOSED_GAP, _NEGLIGIBLE_CHANGE = 1e-10, 1e-9
#: Number of other starts if the first one leaves a loop open, and their distance from it (rad, m).
_MAX_STARTS, _START_DISTANCE = 4, 0.1
#: Maximum number of choices among interchangeable rows.
_MAX_CHOICES = 4
#: Maximum number of hinges named in a message.
_MAX_NAMES = 8
#: Mass centre distance relative to the size of the scene above which its body hardly moves.
_FAR_MASS_RATIO = 1e5
#: Permitted velocity error relative to the largest speed; smallest pivot of an independent row
#: relative to its mobility.
_MAX_VELOCITY_ERROR, _MIN_INDEPENDENT_PIVOT = 1e-8, 1e-15
#: Compliance at which only the coordinates of closing hinges change.
_CUT_ONLY_COMPLIANCE = 1e14


def engine_with_fixed(engine: LoopedEngine, hinges: Collection[str]) -> LoopedEngine:
    """Engine of the same scene with all speeds of some hinges prescribed.

    Flexible bodies retain their stiffness at rest.
    """
    packed = engine.packed
    held_places = {packed.hinge_position[name] for name in hinges}
    if not held_places and not packed.flexible:
        return engine
    held_engine = LoopedEngine(
        packed_system(with_stiff_modes(with_speeds_prescribed(packed.system, held_places)), packed)
    )
    loop_records, own_records = packed.written.loops, held_engine.packed.written.loops
    assert loop_records is not None and own_records is not None
    own_records.copy_pivot_floors(loop_records)
    return held_engine


class Assembly:
    """Assembly of one packed scene at `t` (s) near `q` (nq,), with some hinges fixed.

    `behind` maps q to the cause of loops that do not close near it, for messages, or "".
    """

    def __init__(
        self, engine: LoopedEngine, q: Array, hinges: Collection[str] = (),
        behind: Callable[[Array], str] = lambda q: "", t: float = 0.0,
    ) -> None:  # fmt: skip
        self.fixed_hinges, self._find_cause = tuple(hinges), behind
        self.calls = LoopCalls(engine_with_fixed(engine, hinges), q, t=t)
        if self.calls.engine is not engine:
            self.calls.set_pivot_reference([q])
        self._weights = self._compute_weights()
        #: 1 for speeds that are neither fixed nor driven, else 0.
        self.free_speed_mask = self._free_speeds()

    def positions(self, q: Array, much: float = 0.0, rough: bool = True) -> Array:
        """Close the loops near q (nq,).

        Gaps up to `much` (m, rad) that no change closes may remain; with `rough` also those that
        close only after a long path.  Raises LoopClosureError with the smallest gap, its pose and
        the fixed hinges if there is no such state nearby.
        """
        random_generator, start = np.random.default_rng(0), q
        rough = rough and much > 0.0
        nearest, gaps = self._nearest(start, rough)
        for _ in range(_MAX_STARTS):
            if self._closes(gaps, much):
                return nearest
            # Perturb the start: with all links in line the direction of bending is undetermined.
            change = (
                random_generator.uniform(-_START_DISTANCE, _START_DISTANCE, len(self._zero_speeds))
                * self.free_speed_mask
            )
            trial, trial_gaps = self._nearest(self.calls.move(start, change), rough)
            if self._largest(trial_gaps) < self._largest(gaps):
                nearest, gaps = trial, trial_gaps
        if self._closes(gaps, much):
            return nearest
        gap = self._largest(gaps)
        raise LoopClosureError(
            self._open_loop_message(nearest, gaps), gap, self.coordinates_by_name(nearest)
        )

    def closed_state_near(self, q: Array, much: float = 0.0) -> Array | None:
        """State (nq,) reached from q if its gaps are at most `much`, else None."""
        try:
            nearest_q, gaps = self._nearest(q, much > 0.0)
        except NumericalFailure:
            return None
        return nearest_q if self._closes(gaps, much) else None

    def _nearest(self, q: Array, rough: bool = False) -> tuple[Array, Array]:
        """State of smallest gap reached from q, and the row errors there.

        With `rough`, misfits remain that close only after a long path.
        """
        self.calls.choose(q)
        for _ in range(_MAX_CHOICES):
            q, gaps = self._iterate(q, rough)
            if not self.calls.choose(q):
                break
        return q, gaps

    def _iterate(self, q: Array, rough: bool) -> tuple[Array, Array]:
        """Result of `_nearest` for the current choice of rows."""
        q, compliance, remaining_path = self._adapt_closing_hinges(q), _INITIAL_COMPLIANCE, np.inf
        error = self._squared_gap(q)
        for _ in range(_MAX_STEPS):
            change, gaps = self._correction(q, compliance)
            if self._closes(gaps):
                q = self.calls.move(q, change)
                break
            length = float(np.abs(change).max(initial=0.0))
            if rough and self._largest(gaps) < self._locking_gap:
                remaining_path = (
                    _LONG_PATH_RATIO * self._largest(gaps)
                    if remaining_path == np.inf
                    else remaining_path
                )
                remaining_path -= length
                if remaining_path < 0.0:
                    break
            trial = self._adapt_closing_hinges(
                self.calls.move(q, change * min(1.0, _MAX_STEP / (length or 1.0)))
            )
            trial_error = self._squared_gap(trial)
            if trial_error < error:
                reduction = 3.0 if length < _MAX_STEP else 1.0
                compliance = max(
                    compliance / (10.0 if trial_error < error / 2.0 else reduction), _MIN_COMPLIANCE
                )
                q, error = trial, trial_error
            elif compliance > _MAX_COMPLIANCE or length < _NEGLIGIBLE_CHANGE:
                break
            else:
                compliance *= 10.0
        return q, self._correction_and_errors(
            q, self._zero_speeds, self.calls.position_level, _MAX_COMPLIANCE
        )[1]

    def _correction_and_errors(
        self, q: Array, u: Array, level: int, give: float = 0.0
    ) -> tuple[Array, Array]:
        """Correction and row errors; misfits of rows not chosen at present count as zero."""
        change, errors = self.calls.correction(level, q, u, give)
        max_misfit = self._locking_gap * max(1.0, float(np.abs(u).max(initial=0.0)))
        is_misfit = self.calls.inactive_rows() & (np.abs(errors) <= max_misfit)
        return change, np.where(is_misfit, 0.0, errors)

    def speeds(self, q: Array, u: Array) -> Array:
        """Remove the velocity errors of u (nu,) at the closed q.

        Raises SceneError if the fixed speeds do not permit it.
        """
        self.calls.choose(q)
        u, errors = self._remove_velocity_errors(q, u)
        is_counting = self.calls.inverses() > 0
        if self._largest_error_row(u, errors) is not None and not is_counting.all():
            # Near a singular pose, small pivots above rounding belong to independent rows.
            floors = [self.calls.records.floor(row) for row in range(self.calls.count)]
            for k, mobility in enumerate(self.calls.mobility.tolist()):
                self.calls.records.set_pivot_floor(k, _MIN_INDEPENDENT_PIVOT * mobility)
            u, errors = self._remove_velocity_errors(q, u)
            for k, floor in enumerate(floors):
                self.calls.records.set_pivot_floor(k, floor)
        row = self._largest_error_row(u, errors)
        if row is not None:
            cause = self._find_cause(q) or find_skewed_axis(
                self.calls.engine.packed, MIN_COUNTING_ANGLE
            )
            raise SceneError(
                f"scene: the speeds given for {self._names()} are inconsistent by "
                f"{self._amount(row, errors, '.3g', '/s')} {self._location_text(row)}; "
                f"{cause or 'give fewer or other speeds'}"
            )
        return u

    def _remove_velocity_errors(self, q: Array, u: Array) -> tuple[Array, Array]:
        """Speeds u with corrected velocity errors, and the remaining row errors."""
        change, errors = self._correction_and_errors(q, u, self.calls.velocity_level)
        largest = self._largest(errors)
        while True:  # once, unless heavy outboard bodies cause a loss of digits
            trial = u + self.free_speed_mask * change
            change, trial_errors = self._correction_and_errors(q, trial, self.calls.velocity_level)
            if not self._largest(trial_errors) < largest:
                return u, errors
            u, errors, largest = trial, trial_errors, self._largest(trial_errors)

    def _largest_error_row(self, u: Array, missing: Array) -> int | None:
        """Row with the largest velocity error if it exceeds rounding, else None."""
        max_slip = _MAX_VELOCITY_ERROR * max(1.0, float(np.abs(u).max(initial=0.0)))
        slips = np.abs(missing) / self._sizes
        return int(slips.argmax()) if slips.max(initial=0.0) > max_slip else None

    def _free_speeds(self) -> Array:
        engine, packed = self.calls.engine, self.calls.engine.packed
        driven_speeds = {
            (engine.hinge_name(tree_index), k) for tree_index, k in packed.system.driven
        }
        is_free_speed = np.ones(engine.nu)
        for hinge in packed.user_scene.hinge:
            slots = packed.layout.hinges[hinge.name]
            for k in range(slots.nu):
                is_fixed = (
                    hinge.name in self.fixed_hinges
                    or hinge.is_weld
                    or (hinge.name, k) in driven_speeds
                )
                is_free_speed[slots.u + k] = float(not is_fixed)
        return is_free_speed

    @property
    def _zero_speeds(self) -> Array:
        return np.zeros(self.calls.engine.nu)

    def _correction(self, q: Array, give: float) -> tuple[Array, Array]:
        """Correction of the gaps, and the gaps.

        Fixed coordinates do not change, although their rows comply.
        """
        change, gaps = self._correction_and_errors(
            q, self._zero_speeds, self.calls.position_level, give
        )
        return self.free_speed_mask * change, gaps

    def _adapt_closing_hinges(self, q: Array) -> Array:
        """Adapt the coordinates of closing hinges in q to the body positions."""
        for _ in range(12):
            change, _ = self._correction(q, _CUT_ONLY_COMPLIANCE)
            length = float(np.abs(change).max(initial=0.0))
            if not length > _NEGLIGIBLE_CHANGE:
                break
            q = self.calls.move(q, change * min(1.0, _MAX_STEP / length))
        return q

    def _squared_gap(self, q: Array) -> float:
        gaps = self._correction_and_errors(
            q, self._zero_speeds, self.calls.position_level, _CUT_ONLY_COMPLIANCE
        )[1]
        with np.errstate(over="ignore"):  # squares of requested values may overflow
            return float(np.sum(self._weights * gaps**2))

    def _closes(self, missing: Array, much: float = 0.0) -> bool:
        """True if all gaps are zero relative to the scene size, or at most `much`."""
        return bool(np.all(np.abs(missing) <= np.maximum(much, _CLOSED_GAP * self._sizes)))

    def _largest(self, missing: Array) -> float:
        return float(np.abs(missing).max(initial=0.0))

    def _compute_weights(self) -> Array:
        """Weights (rows,) of the gaps: inverse mean mobility of lengths, angles or couplings.

        With equal weights within a kind the smallest gap depends only on the geometry.
        """
        calls = self.calls
        is_angle = np.zeros(calls.count, bool)
        for closure in calls.records.closures:
            directions = calls.closure_matrix(closure, "W")
            for direction, row in closure.rows.items() if closure.kind == "hinge" else ():
                force, moment = directions[direction, :3], directions[direction, 3:]
                is_angle[row] = moment @ moment > force @ force
        is_coupling = np.zeros(calls.count, bool)
        is_coupling[[closure.row for closure in calls.records.couplings]] = True
        weights, self._is_angle = np.ones(calls.count), is_angle
        length = max(1.0, characteristic_length(calls.engine.packed.system))
        self._sizes = np.where(is_angle | is_coupling, 1.0, length)
        self._locking_gap = LOCKING_GAP_FRACTION * characteristic_length(calls.engine.packed.system)
        for kind in (is_angle, is_coupling, ~(is_angle | is_coupling)):
            if kind.any():
                weights[kind] = 1.0 / calls.mobility[kind].mean()
        for row in range(calls.count):
            calls.records.scale(row, 1.0 / float(weights[row]))
        return weights

    # --- messages ---------------------------------------------------------------------------------

    def _open_loop_message(self, q: Array, missing: Array) -> str:
        row = int(np.abs(missing).argmax())
        held_text = (
            f" with {self._names()} fixed"
            if self.fixed_hinges or self._driven_hinge_names()
            else ""
        )
        return (
            f"scene: {self._subject(row)}: the nearest pose has a gap of "
            f"{self._amount(row, missing, '.7g')}{held_text}; {self._remedy(row, q, missing)}"
        )

    def coordinates_by_name(self, q: Array) -> dict[str, tuple[float, ...]]:
        """Coordinates q by hinge and flexible body name."""
        layout = self.calls.engine.packed.layout
        slots = {**layout.hinges, **layout.modal}
        return {name: tuple(q[slot.q_slice].tolist()) for name, slot in slots.items() if slot.nq}

    def _names(self) -> str:
        """Names of the fixed or driven hinges for messages."""
        names = [f'"{name}"' for name in (*self.fixed_hinges, *self._driven_hinge_names())]
        return ", ".join(names[:_MAX_NAMES]) + (" ..." if names[_MAX_NAMES:] else "")

    def _driven_hinge_names(self) -> list[str]:
        packed = self.calls.engine.packed
        hinges = packed.user_scene.hinge if packed.system.driven else ()
        return [
            hinge.name for hinge in hinges if hinge.drive and hinge.name not in self.fixed_hinges
        ]

    def _location_text(self, row: int) -> str:
        owner = self.calls.closing_label(row)
        return f"in {owner}" if self.calls.coupling_name(row) else f"where {owner} closes a loop"

    def _subject(self, row: int) -> str:
        owner = self.calls.closing_label(row)
        if self.calls.coupling_name(row):
            return f"{owner} cannot be satisfied"
        return f"the loop at {owner} cannot be closed"

    def _far_mass(self) -> str:
        """Message part that names a body with an implausibly distant mass centre, or ""."""
        bodies = self.calls.engine.packed.user_scene.body
        size = max(
            (math.hypot(*end.position) for b in bodies for end in b.ends.values()), default=0
        )
        for body in bodies:
            distance = math.hypot(*body.center_of_mass)
            if size and distance > _FAR_MASS_RATIO * size:
                return (
                    f'the mass centre of body "{body.name}" is {distance:.3g} m from its origin, '
                    f"{distance / size:.0e} times the size of the scene; correct center_of_mass"
                )
        return ""

    def _remedy(self, row: int, q: Array, missing: Array) -> str:
        if self.calls.coupling_name(row):
            return "omit it or another coupling, or correct their expressions"
        cause = (
            self._find_cause(q)
            or self._far_mass()
            or find_skewed_axis_by_gap(self.calls.engine.packed, self._largest(missing))
        )
        if cause:
            return cause
        hold_text = (
            ", fix or drive fewer hinges" if self.fixed_hinges or self._driven_hinge_names() else ""
        )
        return f"correct lengths or axes{hold_text}, or start closer to a closed configuration"

    def _amount(self, row: int, missing: Array, digits: str, per: str = "") -> str:
        amount = f"{abs(missing[row]):{digits}}"
        if self.calls.coupling_name(row):
            return amount
        return f"{amount} {'rad' if self._is_angle[row] else 'm'}{per}"


#: Minimum number of speeds: smaller mechanisms do not fold up.
_MIN_SPEEDS = 20
#: Random change (rad, m) of a pose with all links in line.
_RANDOM_CHANGE = 1e-3


class RotorAssembly(Assembly):
    """Assembly that tries again with rotor inertia."""

    def __init__(
        self, engine: LoopedEngine, q: Array, hinges: Collection[str] = (),
        behind: Callable[[Array], str] = lambda q: "", t: float = 0.0,
    ) -> None:  # fmt: skip
        super().__init__(engine, q, hinges, behind, t)
        self._engine, self._hinges, self._t = engine, hinges, t

    def positions(self, q: Array, *more: Any, **others: Any) -> Array:
        """See `Assembly.positions`."""
        try:
            return super().positions(q, *more, **others)
        except LoopClosureError as error:
            if self._engine.nu < _MIN_SPEEDS:
                raise
            rotor_assembly = Assembly(self._with_rotors(), q, self._hinges, t=self._t)
            try:
                near_q = rotor_assembly.positions(self._perturbed_positions(q), *more, **others)
            except LoopClosureError:
                raise error from None
            return super().positions(near_q, *more, **others)

    def _perturbed_positions(self, q: Array) -> Array:
        """Perturb q: with all links in line the direction of bending is undetermined."""
        change = _RANDOM_CHANGE * np.random.default_rng(0).uniform(-1.0, 1.0, self._engine.nu)
        return self.calls.move(q, change * self.free_speed_mask)

    def _with_rotors(self) -> LoopedEngine:
        """Engine with a rotor on each hinge: total mass times mean hinge distance squared."""
        packed = self._engine.packed
        system, loop_records = packed.system, packed.written.loops
        masses = system.rows(lambda body: body.body_p[0] if len(body.body_p) else 0.0)
        inertia = (float(masses.sum()) or 1.0) * characteristic_length(system) ** 2
        packed_with_rotors = packed_system(
            with_rotors(system, np.full(self._engine.nu, inertia).tolist()), packed
        )
        assert loop_records is not None and packed_with_rotors.written.loops is not None
        packed_with_rotors.written.loops.copy_pivot_floors(loop_records)
        return LoopedEngine(packed_with_rotors)
