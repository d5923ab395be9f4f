"""Frames that follow a steady motion in which bodies turn on and on.

Increments and speeds of ball and free hinges are in the axes of their outboard body.  Beside a coin
that rolls these axes go round, and with them the coefficients of its linear equations.  In a frame
from which the axes turn by w the speeds u of a steady motion stand still, du/dt = -w x u in the
axes of the body; that tells w, but for its part along all speeds.  A body that turns about one
direction on the spot keeps its own axes.
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

#: Directions in which speeds say less than this part of their size about w.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class Frames:
    """Hinge -> (3,) rad/s w of its outboard body's axes beside the frame of its increments, in
    these axes, where it is not zero; `generator` (nu, nu) is w x of all speeds."""

    rates: Mapping[str, Array]
    generator: Array

    def twice(self) -> Array:
        """(2 nu, 2 nu): of increments and speeds alike."""
        return np.asarray(block_diag(self.generator, self.generator))

    def rotation(self, dt: float) -> Array:
        """(nu, nu): axes of bodies after dt (s) -> frames."""
        return np.asarray(expm(dt * self.generator))


def frames_at(model: CompiledScene, state: State) -> Frames:
    """The frames in which the speeds of a state change least."""
    rates, generator = dict[str, Array](), np.zeros((model.nu, model.nu))
    for slots in _turning(model):
        parts = [slice(k, k + 3) for k in range(slots.u, slots.u + slots.nu, 3)]
        speeds = np.vstack([cross_matrix(state.u[part]) for part in parts])
        changes = np.concatenate([state.a[part] for part in parts])
        rate = np.linalg.lstsq(speeds, changes, rcond=_ROUNDING)[0]  # u x w = du/dt
        if np.abs(rate).max() > _ROUNDING * np.abs(state.u[slots.u_slice]).max(initial=0.0):
            rates[slots.name] = rate
            for part in parts:
                generator[part, part] = cross_matrix(rate)
    return Frames(rates, generator)


def turns_in_space(model: CompiledScene, state: State, frames: Frames) -> bool:
    """Whether a frame of a ball or free hinge turns beside the inboard body."""
    for slots in _turning(model):
        speeds = state.u[slots.u + slots.nu - 3 : slots.u + slots.nu]
        left = np.abs(speeds - frames.rates.get(slots.name, 0.0)).max()
        if left > _ROUNDING * np.abs(state.u[slots.u_slice]).max():
            return True
    return False


def _turning(model: CompiledScene) -> Iterator[HingeSlots]:
    """Hinges with quaternions whose speeds are in the axes of their outboard bodies, turns last."""
    for slots in model.layout.hinges.values():
        if slots.quaternion is not None and slots.steady and slots.nu in (3, 6):
            yield slots


def cross_matrix(v: Array) -> Array:
    """(3, 3) of v x."""
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
