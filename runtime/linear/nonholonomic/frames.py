"""Reference frames in which a steady motion with rotating bodies has constant speeds.

Perturbations and speeds of ball and free hinges are in the axes of their outboard body.  For a
rolling coin these axes rotate, so that the coefficients of its linear equations vary.  The body
axes rotate at w relative to a frame in which the speeds u of the steady motion are constant:
du/dt = -w x u in the axes of the body.  This determines w except for a component parallel to all
speeds.  A body that spins about a fixed direction on the spot keeps its own axes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import block_diag, expm

from mstmm.array_validation import Array

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene
    from ...packing.coordinate_layout import HingeSlots
    from ..mck_matrices import State

#: Relative threshold for rates w, and for directions in which the speeds do not determine w.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Frames:
    """Angular velocities of body axes relative to the frames of perturbations and speeds.

    `rates` maps a hinge to w (3,), rad/s, of its outboard body relative to the frame, in body axes;
    hinges with zero w are left out.  `generator` (nu, nu), 1/s, is w x for all speeds.
    """

    rates: Mapping[str, Array]
    generator: Array

    def state_generator(self) -> Array:
        """Generator (2 nu, 2 nu), 1/s, of perturbations and speeds."""
        return np.asarray(block_diag(self.generator, self.generator))

    def rotation(self, dt: float) -> Array:
        """Rotation (nu, nu) from the body axes after dt (s) to the frames."""
        return np.asarray(expm(dt * self.generator))


def frames_at(model: CompiledScene, state: State) -> Frames:
    """Frames in which the speeds of a state have the smallest rates of change."""
    rates, generator = dict[str, Array](), np.zeros((model.nu, model.nu))
    for slots in _quaternion_hinges(model):
        parts = [slice(k, k + 3) for k in range(slots.u, slots.u + slots.nu, 3)]
        speeds = np.vstack([cross_matrix(state.u[part]) for part in parts])
        changes = np.concatenate([state.udot[part] for part in parts])
        rate = np.linalg.lstsq(speeds, changes, rcond=_ROUNDING)[0]  # u x w = du/dt
        if np.abs(rate).max() > _ROUNDING * np.abs(state.u[slots.u_slice]).max(initial=0.0):
            rates[slots.name] = rate
            for part in parts:
                generator[part, part] = cross_matrix(rate)
    return Frames(rates, generator)


def has_rotating_frame(model: CompiledScene, state: State, frames: Frames) -> bool:
    """Whether a frame of a ball or free hinge rotates relative to the inboard body."""
    for slots in _quaternion_hinges(model):
        speeds = state.u[slots.u + slots.nu - 3 : slots.u + slots.nu]
        left = np.abs(speeds - frames.rates.get(slots.name, 0.0)).max()
        if left > _ROUNDING * np.abs(state.u[slots.u_slice]).max():
            return True
    return False


def _quaternion_hinges(model: CompiledScene) -> Iterator[HingeSlots]:
    """Quaternion hinges with speeds in axes of the outboard body, angular speeds last."""
    for slots in model.coordinate_layout.hinges.values():
        if slots.quaternion is not None and slots.constant_subspace and slots.nu in (3, 6):
            yield slots


def cross_matrix(v: Array) -> Array:
    """Cross-product matrix (3, 3) of v (3,)."""
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
