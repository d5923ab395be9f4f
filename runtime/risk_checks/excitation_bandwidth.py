"""Loads and drives that are faster than the shapes that were kept of a flexible body."""

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

#: Frequency of a load over that of the last shape from which on it is told.
_FASTER = 1.5


def applies_to(model: CompiledScene) -> bool:
    """Whether there are any."""
    return bool(model.flexible)


def excitation_bandwidth_risks(
    model: CompiledScene, settings: Settings, _: Array, __: Array
) -> Iterator[Risk]:
    """Bodies whose last bending shape is slower than the fastest expression of time.  Advice: the
    load may be small, or act on another body; the run tells what the shapes missed."""
    known = model.packed.time_map(settings.t_start, settings.t_end)
    shortest = float(known.longest.min(initial=np.inf))
    for name, body in model.flexible.items() if np.isfinite(shortest) else ():
        last = _last(body)
        ratio = MAX_STEP_ANGLE / shortest / last if last > 0 else 0.0
        if ratio > _FASTER:
            yield Risk(
                "shapes",
                f'"{name}"',
                f"{known.narrowest} changes at up to {MAX_STEP_ANGLE / shortest:.3g} rad/s, "
                f"faster than the "
                f'last shape of "{name}" ({last:.3g} rad/s), which cannot follow',
                "take more modes",
                ratio,
                _FASTER,
                doubt=False,
                before=True,
            )


def squared_frequencies(body: ModalBody) -> Array:
    """(n,) squared angular frequency of each shape by itself, the frame at rest, 1/s2; 0 where it
    has no mass."""
    mass = modal_mass(body).diagonal()
    return np.divide(np.diag(body.K), mass, out=np.zeros(body.n), where=mass > 0)


def _last(body: ModalBody) -> float:
    """Angular frequency of the last bending shape, of a body without any of the last one, rad/s."""
    bent = [k for k, name in enumerate(body.modes) if name.startswith(("y", "z"))]
    return float(np.sqrt(np.max(squared_frequencies(body)[bent or slice(None)], initial=0.0)))
