"""Conditioning of a run: pivots of the sweep and singular angles.

The sweep passes S - S H D^-1 H^T S inwards: the inertia S outboard of the hinge without the part
along its motion, D = H^T S H + J_rotor. Where the next pivot D is small compared with the
subtracted part (a heavy tip outboard of light links), digits are lost. The loss follows from the
rounding of every S, propagated inwards in the same way as S: the relative error of the
accelerations is about 1e-16 times the propagated rounding in D over D.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.plain_data import stored_as
from mstmm.risk import Risk

from .flexible.modal_pivots import ModalPivots

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..run.trajectory import Trajectory


#: Pivot loss and singularity measure that are reported as risks.
MAX_PIVOT_LOSS, MIN_SINGULAR_MEASURE = 1e8, 1e-4
#: Pivot loss up to which refined accelerations keep their digits.
MAX_REFINED_LOSS = 1e13

#: Singularity measure below which a change of angles within a fixed step (rad) is a risk, and the
#: limit of this change.
NEAR_SINGULAR_MEASURE, MAX_STEP_ANGLE = 0.1, 0.3

#: Maximum number of samples at which the pivots are checked.
MAX_PIVOT_SAMPLES = 12

#: Limit of bodies times samples of this check; at least one sample is checked.
_MAX_BODY_SAMPLES = 20_000

#: Larger scenes are not checked: the check would take longer than the run.
MAX_CHECKED_BODIES = 200_000

_UPPER_TRIANGLE = np.triu_indices(6)


@dataclass(frozen=True)
class PivotLoss:
    """Largest ratio of rounding (in units of 1e-16) to pivot in a run.

    With its hinge, its time (s), and the number of refinements of the accelerations.
    """

    ratio: float
    hinge: str
    time: float
    is_refined: int = field(default=0, metadata=stored_as("refines"))

    @property
    def error(self) -> float:
        """Relative error of the accelerations; each refinement multiplies it by the initial one."""
        return min(1e-16 * self.ratio, 1.0) ** (1 + self.is_refined)

    @property
    def sweep(self) -> str:
        """Name of the sweep that avoids this loss of digits."""
        return "qr" if self.is_refined or self.ratio > MAX_REFINED_LOSS else "refined"

    @property
    def risk(self) -> Risk | None:
        """Finding that digits are lost; None for a loss up to `MAX_PIVOT_LOSS`."""
        if not self.error > 1e-16 * MAX_PIVOT_LOSS:
            return None
        refined = f" after {self.is_refined} refinements" if self.is_refined else ""
        return Risk(
            "pivot-loss", f'hinge "{self.hinge}"',
            f'hinge "{self.hinge}": mass ratio {self.ratio:.0e}, heavy body outboard of light '
            f"ones: relative error of accelerations up to {self.error:.0e}{refined}",
            f'use sweep = "{self.sweep}" (explicit methods); or, if the root is free, make the '
            "heavy body the first one", self.ratio, MAX_PIVOT_LOSS,
        )  # fmt: skip


@dataclass(frozen=True)
class SingularDistance:
    """Smallest singularity measure of a hinge, and its rotation within a fixed step.

    The coordinates fail where the measure vanishes (gimbal: |cos|). The rotation is in rad, 0 for
    adaptive steps.
    """

    measure: float
    hinge: str
    time: float
    rotation_per_step: float = field(default=0.0, metadata=stored_as("turned"))

    @property
    def risk(self) -> Risk | None:
        """Finding on a coordinate singularity or on fixed steps too long near one; else None."""
        approach = (
            f'hinge "{self.hinge}" comes within {self.measure:.0e} of the singularity of its '
            f"coordinates, at about t = {self.time:.4g} s"
        )
        if self.measure < MIN_SINGULAR_MEASURE:
            return Risk(
                "gimbal",
                f'hinge "{self.hinge}"',
                approach,
                "use a ball hinge",
                self.measure,
                MIN_SINGULAR_MEASURE,
            )
        if self.measure < NEAR_SINGULAR_MEASURE and self.rotation_per_step > MAX_STEP_ANGLE:
            return Risk(
                "gimbal", f'hinge "{self.hinge}"',
                f"{approach}, where its angles change by {self.rotation_per_step:.2g} rad per step",
                "use a ball hinge, or an adaptive method",
                self.rotation_per_step, MAX_STEP_ANGLE, "rad",
            )  # fmt: skip
        return None


# --- pivots ---------------------------------------------------------------------------------------


def pivot_loss(model: CompiledScene, run: Trajectory) -> PivotLoss | None:
    """Largest pivot loss over samples spread over the run.

    None if nothing moves freely, for scenes of more than `MAX_CHECKED_BODIES` bodies, and for least
    squares, which form no such difference.
    """
    if (
        not len(run.t)
        or not model.nu
        or len(model.scene.bodies) > MAX_CHECKED_BODIES
        or model.packed_scene.qr
    ):
        return None
    if model.packed_scene.system.has_loops:
        return None
    refines = int(model.packed_scene.model.refines)
    worst, pivots = PivotLoss(0.0, "", 0.0, refines), _PivotRatios(model)
    count = int(np.clip(_MAX_BODY_SAMPLES // len(pivots.parents), 1, MAX_PIVOT_SAMPLES))
    for k in np.unique(np.linspace(0, len(run.t) - 1, count).astype(int)):
        sample = slice(k, k + 1)
        observation = model.looped.observe(
            run.t[sample], run.q[sample], run.u[sample], run.memory[sample], parts=("udot",)
        )
        if observation.failures:
            continue
        try:
            ratios = pivots.ratios(model.looped.workspace_array(), run.memory[k])
        except np.linalg.LinAlgError:  # products overflow or underflow
            continue
        hinge_index = int(ratios.argmax())
        if ratios[hinge_index] > worst.ratio:
            hinge = model.looped.hinge_name(hinge_index)
            worst = PivotLoss(float(ratios[hinge_index]), hinge, float(run.t[k]), refines)
    return worst if worst.hinge else None


class _PivotRatios:
    """Offsets of inertias and motion subspaces of all n bodies in the workspace."""

    def __init__(self, model: CompiledScene) -> None:
        packed, lib = model.packed_scene, model.looped.lib
        system = packed.system
        self.parents = system.parents
        speeds = system.rows(lambda body: body.nu)[:, None]
        blocks = packed.written.blocks[:, None]
        self.inertia = blocks + lib.MSTMM_BLOCK_S + np.arange(21)
        self.rotation_columns = blocks + lib.MSTMM_BLOCK_R + np.arange(9)
        self.shift = blocks + lib.MSTMM_BLOCK_SHIFT + np.arange(3)
        column = np.arange(6)
        self.has_column = column < speeds  # (n, 6): existing columns of H
        first = blocks + lib.MSTMM_BLOCK_FIXED + lib.MSTMM_SPEED_H * speeds
        rows = first[:, :, None] + np.arange(6)[:, None] * speeds[:, :, None]
        self.subspace = rows + np.where(self.has_column, column, 0)[:, None, :]
        self.release = system.rows(lambda body: body.release)
        self.rotor = system.rows(lambda body: _pad_to_six(body.rotor))
        self.is_prescribed = system.rows(lambda body: _pad_to_six(body.imposed)) != 0
        self.modal = ModalPivots(packed, lib)

    def ratios(self, numbers: Array, memory: Array) -> Array:
        """Largest ratio (n,) of each hinge in the state of the workspace `numbers`.

        Every body adds diag |S| to E, the rounding of its S in units of 1e-16, and passes on X^T
        P^T E P X, P = 1 - H D^-1 H^T S. The ratio is H^T E H / pivot of D.
        """
        S = np.zeros((len(self.parents), 6, 6))
        S[:, _UPPER_TRIANGLE[0], _UPPER_TRIANGLE[1]] = numbers[self.inertia]
        S = S + np.triu(S, 1).transpose(0, 2, 1)
        free = self.has_column & ~(self.is_prescribed & ~self._is_released(memory)[:, None])
        H = np.where(free[:, None, :], numbers[self.subspace], 0.0)
        D = H.transpose(0, 2, 1) @ S @ H + (self.rotor * free + ~free)[:, :, None] * np.eye(6)
        inverse = np.linalg.inv(D)
        projection = np.eye(6) - H @ inverse @ H.transpose(0, 2, 1) @ S
        rotation = numbers[self.rotation_columns].reshape(-1, 3, 3)
        motion = _carried_motion(rotation, numbers[self.shift])
        E = np.abs(np.diagonal(S, axis1=1, axis2=2))[:, :, None] * np.eye(6)
        self.modal.add_modal_response(numbers, S, motion, self.parents, E)
        transfer = projection @ motion
        for i in range(len(self.parents) - 1, -1, -1):
            parent = self.parents[i]
            if parent >= 0:
                E[parent] += transfer[i].T @ E[i] @ transfer[i]
        rounding = np.sum(H * (E @ H), axis=1)
        pivots = 1.0 / np.diagonal(inverse, axis1=1, axis2=2)
        ratios = np.where(free, rounding / np.maximum(np.abs(pivots), 1e-300), 0.0)
        return np.asarray(ratios.max(axis=1))

    def _is_released(self, memory: Array) -> NDArray[np.bool_]:
        padded_memory = np.append(memory, 0.0)
        return np.asarray(padded_memory[self.release] != 0.0) & (self.release >= 0)


def _pad_to_six(numbers: Sequence[float]) -> list[float]:
    """Values per speed, padded with zeros to six."""
    return [*numbers, *[0.0] * (6 - len(numbers))]


def _carried_motion(turn: Array, shift: Array) -> Array:
    """Transfer matrices (n, 6, 6) of twists from the parent to P, with the hinge locked.

    The twist of P is in its own axes.
    """
    transposed = turn.transpose(0, 2, 1)
    motion = np.zeros((len(turn), 6, 6))
    motion[:, :3, :3] = motion[:, 3:, 3:] = transposed
    motion[:, :3, 3:] = transposed @ np.cross(np.eye(3), shift[:, None, :]).transpose(0, 2, 1)
    return motion


# --- singular coordinates -------------------------------------------------------------------------


def may_be_singular(model: CompiledScene) -> bool:
    """Whether any hinge has a coordinate singularity."""
    return any(
        _singularity_kernel(model, group.first + k) is not None
        for group in model.coordinate_layout.groups
        for k in range(min(group.count, len(group.hinges)))
    )


def singular_distance(model: CompiledScene, run: Trajectory) -> SingularDistance | None:
    """Smallest measure over all samples and hinges that have one; None without such hinges.

    A change of sign between two samples counts as zero: the coordinates failed in between.
    """
    distances: list[SingularDistance] = []
    for group in model.coordinate_layout.groups:
        for k in range(min(group.count, len(group.hinges))):
            kernel = _singularity_kernel(model, group.first + k)
            if kernel is None:
                continue
            for number in range(group.first + k, group.first + group.count, len(group.hinges)):
                measures = _singularity_measures(model, run, number, kernel)
                if len(measures):
                    distances.append(_smallest_distance(model, run, number, measures))
    return min(distances, key=lambda candidate: candidate.measure, default=None)


def _smallest_distance(
    model: CompiledScene, run: Trajectory, number: int, measures: Array
) -> SingularDistance:
    k = int(np.abs(measures).argmin())
    changes = np.flatnonzero(measures[1:] * measures[:-1] < 0)
    value, time = float(abs(measures[k])), float(run.t[k])
    if len(changes):
        k, value = int(changes[0]), 0.0
        part = measures[k] / (measures[k] - measures[k + 1])
        time = float(run.t[k] + part * (run.t[k + 1] - run.t[k]))
    speeds = np.abs(run.u[:, model.coordinate_layout.slots(number).u_slice])
    angle_per_step = (run.settings.step or 0.0) * float(np.nanmax(speeds, initial=0.0))
    name = model.packed_scene.scene.hinges.name(number)
    return SingularDistance(value, name, time, angle_per_step)


def _singularity_kernel(model: CompiledScene, number: int) -> Any:
    """Kernel `singularity` of a hinge's type, None if it has none."""
    packed = model.packed_scene
    if not packed.layout.slots(number).nq:
        return None
    body = packed.system.body(packed.topology.position_of_hinge(number))
    kernel = packed.elements[body.hinge].functions.get("singularity")
    if kernel is None:
        return None
    return packed.ffi.cast("int (*)(const double *, const double *, double *)", kernel)


def _singularity_measures(model: CompiledScene, run: Trajectory, number: int, call: Any) -> Array:
    """Singularity measure of one hinge at every sample."""
    packed = model.packed_scene
    ffi, slots = packed.ffi, packed.layout.slots(number)
    p = packed.system.body(packed.topology.position_of_hinge(number)).hinge_p or (0.0,)
    coordinates = np.ascontiguousarray(run.q[:, slots.q_slice])
    measures, pointer = np.full(len(coordinates), np.nan), ffi.new("double *")
    for k, row in enumerate(coordinates):
        if call(list(p), ffi.from_buffer("double[]", row), pointer) == 0:
            measures[k] = pointer[0]
    return measures[np.isfinite(measures)]
