"""Conditioning: pivots of the sweep and singular angles, before and after a run.

The sweep passes S - S H D^-1 H^T S inwards: the inertia S outboard of the hinge without the part
along its motion, D = H^T S H + J_rotor. Where the next pivot D is small compared with the
subtracted part (a heavy tip outboard of light links), digits are lost. The loss follows from the
rounding of every S, propagated inwards in the same way as S: the relative error of the
accelerations is about 1e-16 times the propagated rounding in D over D.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array
from mstmm.risk import Risk

from ...integrate.settings import Settings
from ...packing.coordinate_layout import start_values
from ..certificate_data import MAX_CHECKED_BODIES, MAX_PIVOT_LOSS, PivotLoss, SingularDistance
from ..flexible.modal_pivots import ModalPivots
from .check import MeasuringCheck, RunStart, risks_of

if TYPE_CHECKING:
    from mstmm.scene import Scene

    from ...engine.compiled_scene import CompiledScene
    from ...run.trajectory import Trajectory
    from ..result_record import Record


#: Largest ratio of the loss to the ratio of masses, or of moments of inertia, and largest number of
#: bodies that are checked before a run; more would take longer than typical runs.
_MAX_LOSS_PER_RATIO, _MAX_BODIES = 1e3, 2000

#: Maximum number of samples at which the pivots are checked.
MAX_PIVOT_SAMPLES = 12

#: Limit of bodies times samples of this check; at least one sample is checked.
_MAX_BODY_SAMPLES = 20_000

_UPPER_TRIANGLE = np.triu_indices(6)


# --- pivots ---------------------------------------------------------------------------------------


class PivotLossCheck(MeasuringCheck[PivotLoss | None]):
    """Loss of digits in the sweep: heavy bodies outboard of light ones."""

    def before(self, start: RunStart) -> Iterator[Risk]:
        """Risk of the largest loss at the start, where masses differ very much."""
        if _may_lose_digits(start.model):
            yield from risks_of(pivot_loss(start.model, start.state), before=True)

    def measure(self, result: Record) -> PivotLoss | None:
        """Largest loss over samples of the run."""
        return pivot_loss(result.model, result.trajectory)

    def after(self, result: Record) -> Iterator[Risk]:
        """Risk of the largest loss, unless its pivot vanishes at a coordinate singularity."""
        loss, singular = self.measured(result), SINGULARITY.measured(result)
        if not (loss and singular and singular.risk and loss.hinge == singular.hinge):
            yield from risks_of(loss)


def accurate_sweep(model: CompiledScene) -> str:
    """Cheapest accurate sweep at the start: "riccati", "refined" or "qr".

    The model must have been compiled with "riccati".
    """
    if not _may_lose_digits(model):
        return "riccati"
    packed = model.packed_scene
    q, u = start_values(packed.scene, packed.layout, packed.flexible)
    loss = pivot_loss(model, RunStart(model, Settings(0.0), q, u).state)
    return "riccati" if loss is None or loss.risk is None else loss.sweep


def _may_lose_digits(model: CompiledScene) -> bool:
    """Whether mass ratios are so large that digits may be lost."""
    packed = model.packed_scene
    if packed.qr or packed.system.has_loops or len(model.scene.bodies) > _MAX_BODIES:
        return False
    return _MAX_LOSS_PER_RATIO * _max_mass_ratio(model.scene) >= MAX_PIVOT_LOSS


def _max_mass_ratio(scene: Scene) -> float:
    """Largest ratio of two masses or of two moments of inertia."""
    tables = [*scene.body, *(table for chain in scene.chain for table in chain.body)]
    masses = [*(table.mass for table in tables), *(beam.mass for beam in scene.beam)]
    return max(_max_ratio(masses), _max_ratio(x for table in tables for x in table.inertia[:3]))


def _max_ratio(values: Iterable[float]) -> float:
    positive = [value for value in values if value > 0]
    return max(positive) / min(positive) if positive else 1.0


def pivot_loss(model: CompiledScene, run: Trajectory) -> PivotLoss | None:
    """Largest pivot loss over samples spread over the run.

    None if nothing moves freely, for scenes of more than `MAX_CHECKED_BODIES` bodies, and for least
    squares, which form no such difference.
    """
    packed = model.packed_scene
    if not len(run.t) or not model.nu or len(model.scene.bodies) > MAX_CHECKED_BODIES:
        return None
    if packed.qr or packed.system.has_loops:
        return None
    refines = int(packed.model.refines)
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


class SingularityCheck(MeasuringCheck[SingularDistance | None]):
    """Hinges whose coordinates are singular (gimbal lock)."""

    def before(self, start: RunStart) -> Iterator[Risk]:
        """Risk of the hinge nearest to a singularity, at the start and along drives."""
        if any(_singular_hinges(start.model)):
            yield from risks_of(singular_distance(start.model, start.drive_path), before=True)

    def measure(self, result: Record) -> SingularDistance | None:
        """Smallest distance over the samples of the run."""
        return singular_distance(result.model, result.trajectory)

    def after(self, result: Record) -> Iterator[Risk]:
        """Risk of the hinge nearest to a singularity."""
        yield from risks_of(self.measured(result))


def _singular_hinges(model: CompiledScene) -> Iterator[tuple[range, Any]]:
    """Numbers of the hinges that share numbers and type, and their kernel `singularity`."""
    for group in model.coordinate_layout.groups:
        period = len(group.hinges)
        for first in range(group.first, group.first + min(group.count, period)):
            kernel = _singularity_kernel(model, first)
            if kernel is not None:
                yield range(first, group.first + group.count, period), kernel


def singular_distance(model: CompiledScene, run: Trajectory) -> SingularDistance | None:
    """Smallest measure over all samples and hinges that have one; None without such hinges.

    A change of sign between two samples counts as zero: the coordinates failed in between.
    """
    distances: list[SingularDistance] = []
    for numbers, kernel in _singular_hinges(model):
        for number in numbers:
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


PIVOT_LOSS, SINGULARITY = PivotLossCheck(), SingularityCheck()
