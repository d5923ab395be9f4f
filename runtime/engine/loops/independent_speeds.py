"""Independent speeds of closed loops, and the dependent speeds as functions of them.

Random speeds, each projected on the constraints by one correction, span the motions of a mechanism.
Independent speeds v are chosen that distinguish these motions, preferably the first in the scene.
Then u = N v, where N is the identity in the rows of v, and no constraint has a velocity error.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import NumericalFailure

from ...packing.scene_packing import packed_system
from ...packing.system_variants import without_drives
from ..looped_engine import LoopedEngine
from .constraint_rank import geometric_loop_calls
from .loop_analysis import LoopStart

#: Relative size of motions that counts as rounding, in characteristic scales of the speeds.
_MOTION_ROUNDING = 1e-9
#: A speed is chosen if no other one distinguishes motions better by more than this factor.
_SELECTION_RATIO = 4.0
#: A requested speed is chosen if no other one is better by more than this factor.
_MAX_RATIO = 1e4
#: Position gaps (m, rad) above which loops are open.
_MAX_GAP = 1e-6
#: Condition number above which speeds do not determine the others.
_MAX_CONDITION = 1e8


class IndependentSpeeds:
    """Independent speeds and motions of one packed scene with closed loops.

    `free_indices` are the indices of the speeds that are not prescribed, `sizes` (nu,) the
    characteristic scales of the speeds.
    """

    def __init__(
        self, engine: LoopedEngine, free: Sequence[int], sizes: Array, closed: LoopStart
    ) -> None:
        packed, self._start = engine.packed, closed.start[0]
        undriven_engine = LoopedEngine(packed_system(without_drives(packed.system), packed))
        self._calls = geometric_loop_calls(undriven_engine, self._start)
        self._free, self.sizes = np.array(free, dtype=np.int64), sizes
        self._loops = closed.loops

    @cached_property
    def indices(self) -> tuple[int, ...]:
        """Indices of the independent speeds, chosen at the initial state."""
        return self.select(self._start)

    def select(self, q: Array) -> tuple[int, ...]:
        """Choose the indices of speeds that determine all others at q (nq,).

        These are rows of the matrix of possible motions, each speed in its characteristic scale.
        Each choice is the first in the scene whose row, once the rows chosen before are projected
        out, is at least a quarter as long as the longest.
        """
        scaled_motions = self._motions(q) / self.sizes[:, None]
        return tuple(sorted(select_rows(scaled_motions, self._free.tolist(), _SELECTION_RATIO)[0]))

    def select_fixed_speeds(
        self, q: Array, shapes: Sequence[int], kept: Sequence[int], wished: Sequence[int]
    ) -> tuple[tuple[int, ...], tuple[int, ...]]:
        """Choose speeds that fix a mechanism at q while `shapes` settle.

        Returns the indices of the fixed speeds, and of the shapes that then determine all others.
        The fixed speeds are those in `kept` that can move, and the first speeds that distinguish
        the motions without change of shape, preferably those in `wished`.
        """
        remaining = self._motions(q) / self.sizes[:, None]
        fixed, remaining = select_rows(remaining, kept, _MAX_RATIO)
        _, singular_values, directions = np.linalg.svd(remaining[list(shapes)])
        changing_count = int((singular_values > 1 / _MAX_RATIO).sum())
        other_indices = [k for k in self._free.tolist() if k not in {*shapes, *kept, *wished}]
        further_fixed, _ = select_rows(
            remaining @ directions[changing_count:].T, [*wished, *other_indices], _SELECTION_RATIO
        )
        for index in further_fixed:
            remaining = _motions_without(remaining, index)
        return (*fixed, *further_fixed), tuple(
            sorted(select_rows(remaining, shapes, _SELECTION_RATIO)[0])
        )

    def motion_matrix(self, q: Array, speed_indices: Sequence[int]) -> Array:
        """Matrix N (nu, n) of u = N v for the independent speeds v at the indices `speed_indices`.

        Raises NumericalFailure if these do not determine the others, as at a dead centre, and in
        singular poses.
        """
        motions, indices = self._motions(q), list(speed_indices)
        scaled_rows = motions[indices] / self.sizes[indices, None]
        row_count, motion_count = scaled_rows.shape
        is_branching = self._loops.singular and motion_count == self._loops.mobility
        if (
            row_count == motion_count
            and not is_branching
            and (not motion_count or np.linalg.cond(scaled_rows) < _MAX_CONDITION)
        ):
            return np.asarray(motions @ np.linalg.inv(motions[indices]))
        self._check_closed(q)
        names = ", ".join(self._calls.engine.packed.layout.u_name(k) for k in indices)
        raise NumericalFailure(
            f"the mobility is {motion_count} at this state, but {names or 'no speed'} cannot be "
            "independent speeds: a dead centre or a singular configuration; use a nearby state"
        )

    def _check_closed(self, q: Array) -> None:
        gaps = np.abs(
            self._calls.correction(self._calls.position_level, q, np.zeros(len(self.sizes)))[1]
        )
        row = int(gaps.argmax())
        if gaps[row] > _MAX_GAP:
            raise NumericalFailure(
                f"the loop closed by {self._calls.closing_label(row)} has a position gap of "
                f"{gaps[row]:.3g} at this q; use the q of model.assemble(q)"
            )

    def prescribed_motion(self, q: Array, speed: int) -> Array:
        """All speeds (nu,) for a unit of one prescribed speed, with the other prescribed ones zero.

        nan if the loops do not permit that motion.
        """
        motion = self._project(q, np.eye(1, len(self.sizes), speed)[0])
        errors = self._correction_and_errors(q, motion)[1]
        return (
            motion
            if np.abs(errors).max(initial=0.0) < _MOTION_ROUNDING
            else np.full_like(motion, np.nan)
        )

    def move(self, q: Array, speeds: Array) -> Array:
        """Move q (nq,) by a small step along speeds (nu,); loops close to first order."""
        return self._calls.move(q, speeds)

    @property
    def free_indices(self) -> list[int]:
        """Indices of the speeds that are not prescribed."""
        return list(map(int, self._free))

    @cached_property
    def speed_rows(self) -> frozenset[int]:
        """Rows that constrain only speeds: of rolling discs and of couplings of speeds."""
        records = self._calls.records
        speed_directions = {
            closure.frame: closure.speed_directions
            for closure in self._calls.engine.packed.system.closures
        }
        rows = {
            row for closure in records.closures for direction, row in closure.rows.items()
            if direction in speed_directions[closure.frame]
        }  # fmt: skip
        return frozenset(
            rows | {coupling.row for coupling in records.couplings if coupling.coupling.of_speeds}
        )

    def remove_velocity_errors(self, q: Array, u: Array) -> Array:
        """Nearest speeds to u (nu,) that satisfy all rows; prescribed speeds are unchanged."""
        return np.asarray(u + self._calls.correction(self._calls.velocity_level, q, u)[0])

    def velocity_errors(self, q: Array, u: Array) -> Array:
        """Velocity errors (rows,): J(q) u up to sign."""
        return self._correction_and_errors(q, u)[1]

    def _motions(self, q: Array) -> Array:
        """Basis (nu, n) of the motions at q, orthonormal in characteristic scales."""
        count = min(len(self._free), self._loops.mobility + 1)  # one more to detect a singular pose
        random_generator = np.random.default_rng(0)
        trials = np.zeros((count, len(self.sizes)))
        trials[:, self._free] = random_generator.standard_normal((count, len(self._free)))
        columns = [self._project(q, trial * self.sizes) for trial in trials]
        scaled = np.reshape(columns, trials.shape).T / self.sizes[:, None]
        left_vectors, singular_values, _ = np.linalg.svd(scaled, full_matrices=False)
        is_kept = singular_values > _MOTION_ROUNDING * singular_values.max(initial=1.0)
        return np.asarray(left_vectors[:, is_kept] * self.sizes[:, None])

    def _project(self, q: Array, speeds: Array) -> Array:
        """Speeds (nu,) projected on the constraints."""
        return speeds + self._correction_and_errors(q, speeds)[0]

    def _correction_and_errors(self, q: Array, speeds: Array) -> tuple[Array, Array]:
        """Correction (nu,) of speeds and velocity errors (rows,), without those at rest.

        At rest the velocity errors are those of time-dependent couplings.
        """
        correction, errors = self._calls.correction(self._calls.velocity_level, q, speeds)
        rest_correction, rest_errors = self._calls.correction(
            self._calls.velocity_level, q, np.zeros_like(speeds)
        )
        return correction - rest_correction, errors - rest_errors


def select_rows(
    left: Array, row_indices: Sequence[int], well: float = _SELECTION_RATIO
) -> tuple[list[int], Array]:
    """Choose rows that distinguish motions (nu, n), orthonormal in characteristic scales.

    Each row is the first of `row_indices` that separates the remaining motions at least 1 / `well`
    times as well as any other.  Also returns the motions in which no chosen row moves.
    """
    candidates, selected = list(row_indices), list[int]()
    for _ in range(left.shape[1]):
        row_norms = np.linalg.norm(left[candidates], axis=1)
        if not row_norms.max(initial=0.0) > 1 / _MAX_RATIO:
            break
        selected.append(candidates[int(np.argmax(well * row_norms >= row_norms.max()))])
        left = _motions_without(left, selected[-1])
    return selected, left


def _motions_without(left: Array, row_index: int) -> Array:
    """Motions (nu, n) without the component that changes one speed."""
    direction = left[row_index] / np.linalg.norm(left[row_index])
    return np.asarray(left - np.outer(left @ direction, direction))
