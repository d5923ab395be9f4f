"""The generated kernels of flexible bodies, evaluated for all samples of a run at once."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import Array
from mstmm.ir import KernelIR
from mstmm.stored import kernel_from_json

from ...vectorized import evaluate
from ..records import moments_of

if TYPE_CHECKING:
    from .observe import Motion


#: Numbers of one batch of samples, about 30 MB an array.
_BATCH = 2**22


@cache
def kernel(name: str) -> KernelIR:
    """A kernel of the element "modal" by its name."""
    text = files("mstmm.generated").joinpath("sweep_modal.json").read_text(encoding="utf-8")
    return kernel_from_json(text, name)


def momentum(motion: Motion) -> tuple[Array, Array, Array]:
    """Linear momentum in kg*m/s, moment of momentum about the frame's origin in kg*m2/s and first
    moment of the mass in kg*m, (n, 3) each, frame axes; by the kernel `momentum`."""
    body, parts = motion.body, []
    rows = max(1, _BATCH // max(1, body.n**2 * 8))
    for first in range(0, len(motion.t), rows):
        some = slice(first, first + rows)
        given = {
            **moments_of(body), "eta": motion.eta[some], "etad": motion.etad[some],
            "v": motion.frame_velocity[some], "w": motion.frame_spin[some],
        }  # fmt: skip
        found = evaluate(kernel("momentum"), given, body.n)
        parts.append(np.concatenate([found["h"], found["S"]], axis=1))
    whole = np.concatenate(parts) if parts else np.zeros((0, 27))
    inertia = _inertia(whole[:, 6:])
    moment = np.stack([inertia[:, 5, 1], inertia[:, 3, 2], inertia[:, 4, 0]], axis=1)
    return whole[:, :3], whole[:, 3:6], moment


def _inertia(upper: Array) -> Array:
    """(n, 6, 6) symmetric matrices from their upper triangles (n, 21), row by row."""
    full = np.zeros((len(upper), 6, 6))
    full[:, *np.triu_indices(6)] = upper
    return full + np.swapaxes(np.triu(full, 1), 1, 2)
