"""Whether a scene is a beam on one hinge that begins to vibrate from its start.

Its motion is then vibration about one that changes little: an exponential method follows it by few
steps.  With more hinges the vibrations themselves change with their angles, and a beam that nothing
shakes does not vibrate at all.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array

if TYPE_CHECKING:
    from ...engine.compiled_scene import CompiledScene

#: Most speeds, and most of them that are none of a shape.
_SPEEDS, _RIGID = 6, 1

#: The part of the largest acceleration that counts.
_PART = 1e-3


def starts_vibrating(model: CompiledScene, t: float, q: Array, u: Array) -> bool:
    """Whether it is one, at a start (nq,), (nu,).

    Raises NumericalFailure where that cannot be evaluated.
    """
    engine = model.looped
    shapes = np.zeros(engine.nu, bool)
    for body in model.layout.modal.values():
        shapes[body.u_slice] = True
    if not shapes.any() or engine.nu > _SPEEDS or np.count_nonzero(~shapes) > _RIGID:
        return False
    state = q[None].copy(), u[None].copy(), engine.start_memory()[None]
    found = np.abs(engine.accelerations(t, *state)[1][0])
    return bool(u[shapes].any() or found[shapes].max() > _PART * found.max())
