"""Loads and drives that are faster than the shape functions of a flexible body."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.risk import Risk

from ..discontinuities.step_limits import MAX_STEP_ANGLE
from ..result.flexible.modal_energy import modal_mass

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..flexible.modal_body import ModalBody
    from ..integrate.settings import Settings

#: Largest accepted ratio of the frequency of a load to that of the last shape.
_MAX_RATIO = 1.5


def applies_to(model: CompiledScene) -> bool:
    """Whether there are flexible bodies."""
    return bool(model.flexible_bodies)


def excitation_bandwidth_risks(
    model: CompiledScene, settings: Settings, _: Array, __: Array
) -> Iterator[Risk]:
    """Bodies whose last bending shape is slower than the fastest expression of time.

    This is information only: the load may be small, or act on another body.  The result of the run
    estimates the truncation error of the shapes.
    """
    time_map = model.packed_scene.time_map(settings.t_start, settings.t_end)
    shortest = float(time_map.longest.min(initial=np.inf))
    for name, body in model.flexible_bodies.items() if np.isfinite(shortest) else ():
        last = _last_bending_frequency(body)
        ratio = MAX_STEP_ANGLE / shortest / last if last > 0 else 0.0
        if ratio > _MAX_RATIO:
            yield Risk(
                "shapes", f'"{name}"',
                f"{time_map.narrowest} changes at up to {MAX_STEP_ANGLE / shortest:.3g} rad/s, "
                f'faster than the last shape of "{name}" ({last:.3g} rad/s) can respond',
                "use more modes", ratio, _MAX_RATIO, invalidates=False, seen_before_run=True,
            )  # fmt: skip


def squared_frequencies(body: ModalBody) -> Array:
    """Squared angular frequencies (n,) of the single shapes in a fixed frame, rad^2/s^2.

    They are 0 for shapes without mass.
    """
    mass = modal_mass(body).diagonal()
    return np.divide(np.diag(body.K), mass, out=np.zeros(body.n), where=mass > 0)


def _last_bending_frequency(body: ModalBody) -> float:
    """Highest angular frequency of the bending shapes, or of all shapes without any, rad/s."""
    bending = [k for k, name in enumerate(body.modes) if name.startswith(("y", "z"))]
    return float(np.sqrt(np.max(squared_frequencies(body)[bending or slice(None)], initial=0.0)))
