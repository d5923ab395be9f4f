"""Observations of the states of a run, computed in batches on first use and cached.

For a run of usual size one batch of the engine evaluates everything; where that exceeds the memory,
each body and each kind of quantity is a separate batch.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from mstmm.argument_validation import require_word
from mstmm.array_validation import Array

from ..engine.looped_engine import OBSERVATION_PARTS, Probe
from ..engine.quantity_registry import BodyReferences

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..packing.coordinate_layout import Layout
    from ..run.trajectory import Trajectory


#: Numbers of one batch, about 130 MB.
_MAX_BATCH_NUMBERS = 2**24

#: Largest number of bodies and ends of a scene that are observed together.
_MAX_JOINT_REFERENCES = 1000


#: Values of cos(pitch) below which yaw and roll coincide, and below which they vary rapidly.
_MIN_COS_PITCH, _MAX_WARNED_COS_PITCH = 1e-7, 0.05


class Observations:
    """Observed arrays over the samples of a trajectory. Rows that cannot be evaluated are nan.

    `failures` holds one sentence for each such row found so far.
    """

    def __init__(self, model: CompiledScene, run: Trajectory) -> None:
        self.engine, self.run, self._model = model.looped, run, model
        self.failures: tuple[str, ...] = ()
        self.references = BodyReferences(model.scene.skeleton)
        self._points: dict[str, Array] = {}
        self._parts: dict[str, Array] = {}

    def points(self, reference: str) -> Array:
        """Motion (n, 24) of "body" or "body.end", see `Observation`."""
        require_word("body", reference, "the name of a body or an end, such as 'rod1.tip'")
        if reference not in self._points:
            canonical_name = self.references.canonical_name(reference)
            self._observe("points", canonical_name)
            self._points[reference] = self._points[canonical_name]
        return self._points[reference]

    def node(self, name: str) -> Array:
        """Motion (n, 24) of a body of the engine's scene or of the user's, as `points`.

        Bodies of the engine's scene are, for example, point masses of a beam, "blade/point 1".
        """
        if name not in self._points:
            self._observe_parts([name], ("points",))
        return self._points[name]

    def fetch(self, references: Sequence[str]) -> None:
        """Observe these bodies and ends in one batch, before they are read one by one."""
        if len(self.references) > _MAX_JOINT_REFERENCES:
            missing = [name for name in references if name not in self._points]
            if missing and len(self.run.t) * 24 * len(missing) <= _MAX_BATCH_NUMBERS:
                self._observe_parts(missing, ("points",))

    def part(self, name: str) -> Array:
        """Array of loads, efforts, udot, sums or rows, see `Observation`."""
        if name not in self._parts:
            self._observe(name, None)
        return self._parts[name]

    def columns(self, name: str, which: Any) -> Array:
        """Columns `which` of loads, efforts or udot; of large arrays only these are kept."""
        return np.concatenate([part[(slice(None), *which)] for part in self._pieces(name)])

    def loads(self, hinge: str, first: int) -> Array:
        """Force (n, 3) (first 0) or moment (3) of a hinge."""
        observations, hinge_index = self, self.engine.packed.hinge_position.get(hinge)
        if hinge_index is None:  # the hinge welds bodies packed as one
            observations = self.unmerged_observations
            hinge_index = observations.engine.packed.hinge_position[hinge]
        return observations.columns("loads", (hinge_index, slice(first, first + 3)))

    @cached_property
    def unmerged_observations(self) -> Observations:
        """Observations by the engine that packs every body separately."""
        result = Observations(self._model, self.run)
        result.engine = self._model.unmerged_engine
        return result

    def largest_loads(self) -> tuple[float, float]:
        """Largest component of force (N) and of moment (N*m) over all hinges."""
        largest = [0.0, 0.0]
        for part in self._pieces("loads"):
            for k in (0, 1):
                numbers = part[:, :, 3 * k : 3 * k + 3]
                numbers = np.abs(numbers[np.isfinite(numbers)])
                largest[k] = max(largest[k], float(np.max(numbers, initial=0.0)))
        return largest[0], largest[1]

    def _pieces(self, name: str) -> Iterator[Array]:
        """A part in pieces over time where all of it would exceed the memory."""
        width = {"loads": 6 * self.engine.packed.topology.count}.get(name, self.engine.nu)
        run, rows = self.run, max(1, _MAX_BATCH_NUMBERS // max(1, width))
        if name in self._parts or len(run.t) <= rows:
            yield self.part(name)
            return
        for first in range(0, len(run.t), rows):
            piece = slice(first, first + rows)
            observation = self.engine.observe(
                run.t[piece], run.q[piece], run.u[piece], run.memory[piece], (), (name,)
            )
            self.failures = self.failures or observation.failures
            yield getattr(observation, name)

    def _observe(self, part: str, reference: str | None) -> None:
        run = self.run
        bodies, nu = self.engine.packed.topology.count, self.engine.nu
        size = len(run.t) * (24 * len(self.references) + 6 * bodies + 2 * nu + 10)
        is_joint = size <= _MAX_BATCH_NUMBERS and len(self.references) <= _MAX_JOINT_REFERENCES
        parts = OBSERVATION_PARTS if is_joint else (part,)
        if not is_joint or (reference is not None and reference not in self.references):
            references = [] if reference is None else [reference]
        else:
            references = list(self.references)
        self._observe_parts(references, parts)

    def _observe_parts(self, names: Sequence[str], parts: Sequence[str]) -> None:
        run = self.run
        probes = [Probe(*self.engine.packed.end(r)) for r in names]
        observation = self.engine.observe(run.t, run.q, run.u, run.memory, probes, parts)
        if "efforts" in parts:
            _clear_modal_efforts(observation.efforts, self.engine.packed.layout)
        for array in (
            observation.points,
            *(getattr(observation, name) for name in OBSERVATION_PARTS),
        ):
            array.flags.writeable = False
        self.failures = self.failures or observation.failures
        for i, name in enumerate(names):
            self._points[name] = observation.points[:, i]
        self._parts |= {name: getattr(observation, name) for name in parts if name != "points"}


def _clear_modal_efforts(efforts: Array, layout: Layout) -> None:
    """Set efforts on modes to zero: laws and drives act on hinges only."""
    for slots in layout.modal.values():
        efforts[:, slots.u_slice] = 0.0


def quaternions(matrices: Array) -> Array:
    """Unit quaternions (n, 4), w, x, y, z, of rotation matrices (n, 9), row by row.

    The largest of the four components is computed first, so that no division is by a small number
    (Shepperd, J. Guidance and Control 1 (1978) 223-224). The sign is continuous over the rows and w
    >= 0 in the first one.
    """
    r = matrices.reshape(-1, 3, 3)
    x, y, z = r[:, 0, 0], r[:, 1, 1], r[:, 2, 2]
    squares = np.stack([1 + x + y + z, 1 + x - y - z, 1 - x + y - z, 1 - x - y + z], axis=1)
    largest = np.argmax(np.nan_to_num(squares), axis=1)
    a, b, c = r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]
    d, e, f = r[:, 0, 1] + r[:, 1, 0], r[:, 0, 2] + r[:, 2, 0], r[:, 1, 2] + r[:, 2, 1]
    w2, x2, y2, z2 = squares.T
    rows = np.stack([
        np.stack([w2, a, b, c], 1), np.stack([a, x2, d, e], 1),
        np.stack([b, d, y2, f], 1), np.stack([c, e, f, z2], 1),
    ], 1)  # fmt: skip
    q = rows[np.arange(len(r)), largest]
    q /= np.sqrt(np.sum(q * q, axis=1, keepdims=True))
    return np.asarray(q * continuous_signs(q)[:, None])


def continuous_signs(q: Array) -> Array:
    """Signs (n,) that make neighbouring quaternions continuous; w >= 0 in the first one."""
    if not len(q):
        return np.ones(0)
    steps = np.where(np.sum(q[1:] * q[:-1], axis=1) < 0, -1.0, 1.0)
    first = -1.0 if q[0, 0] < 0 else 1.0
    return np.asarray(first * np.concatenate([[1.0], np.cumprod(steps)]))


def euler_angles(matrices: Array) -> Array:
    """Euler angles (n, 3), yaw, pitch, roll, of rotation matrices (n, 9), row by row.

    R = Rz(yaw) Ry(pitch) Rx(roll): rotations about z, then the new y, then the newest x.

    Continuous over the rows if neighbours differ by less than half a turn. Where the pitch is
    +-pi/2 only yaw -+ roll is known: the roll stays that of the previous row.
    """
    r = matrices.reshape(-1, 3, 3)
    cos_pitch = np.hypot(r[:, 0, 0], r[:, 1, 0])
    pitch = np.arctan2(-r[:, 2, 0], cos_pitch)
    yaw, roll = np.arctan2(r[:, 1, 0], r[:, 0, 0]), np.arctan2(r[:, 2, 1], r[:, 2, 2])
    for k in np.flatnonzero(cos_pitch < _MIN_COS_PITCH):
        roll[k] = roll[k - 1] if k else 0.0
        yaw_sum = np.arctan2(-r[k, 0, 1], r[k, 1, 1])
        yaw[k] = yaw_sum + roll[k] if pitch[k] > 0 else yaw_sum - roll[k]
    return np.stack([_unwrap(yaw), pitch, _unwrap(roll)], axis=1)


def _unwrap(angles: Array) -> Array:
    """Angles without jumps by full turns, over the rows with known values."""
    is_finite = np.isfinite(angles)
    angles = angles.copy()
    angles[is_finite] = np.unwrap(angles[is_finite])
    return angles


def gimbal_note(angles: Array) -> str:
    """Note where yaw and roll are poorly distinguished; "" otherwise."""
    cos_pitch = np.cos(angles[:, 1])
    near_samples = np.flatnonzero(cos_pitch < _MAX_WARNED_COS_PITCH)
    if not len(near_samples):
        return ""
    worst = int(near_samples[np.argmin(cos_pitch[near_samples])])
    offset_deg = np.degrees(np.arccos(min(1.0, float(np.sin(abs(angles[worst, 1]))))))
    return (
        f"pitch comes within {offset_deg:.2g} deg of 90 deg (sample {worst}): yaw and roll "
        "are ill-conditioned there; use the orientation instead"
    )


def rotation_matrices(q: Array) -> Array:
    """Rotation matrices (n, 9), row by row, of unit quaternions (n, 4), w, x, y, z."""
    w, x, y, z = (q / np.linalg.norm(q, axis=1)[:, None]).T
    rows = [
        1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
        2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
        2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
    ]  # fmt: skip
    return np.stack(rows, axis=1)
