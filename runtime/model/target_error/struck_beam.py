"""Detection of a beam on one hinge that vibrates from its start.

Its motion is vibration about a slowly varying one, which an exponential method integrates with few
steps.  With more hinges the vibrations change with their angles; without excitation the beam does
not vibrate.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene

#: Largest number of speeds, and of those that do not belong to shapes.
_MAX_SPEEDS, _MAX_RIGID_SPEEDS = 6, 1

#: Acceleration of a shape, relative to the largest one, that counts as excitation.
_MIN_SHARE = 1e-3


def starts_vibrating(model: CompiledScene, t: float, q: Array, u: Array) -> bool:
    """Whether a scene is a vibrating beam on one hinge at q (nq,), u (nu,) and t (s).

    Raises NumericalFailure if the start cannot be evaluated.
    """
    engine = model.looped
    shapes = np.zeros(engine.nu, bool)
    for body in model.coordinate_layout.modal.values():
        shapes[body.u_slice] = True
    if not shapes.any() or engine.nu > _MAX_SPEEDS or np.count_nonzero(~shapes) > _MAX_RIGID_SPEEDS:
        return False
    state = q[None].copy(), u[None].copy(), engine.start_memory()[None]
    accelerations = np.abs(engine.accelerations(t, *state)[1][0])
    return bool(u[shapes].any() or accelerations[shapes].max() > _MIN_SHARE * accelerations.max())
