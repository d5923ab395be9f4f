"""Loads and drives that are faster than the shapes that were kept of a flexible body."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import Array
from mstmm.risk import Risk

from ..breaks.pace import TURN
from ..result.flexible.energy import modal_mass

if TYPE_CHECKING:
    from ..engine.compiled import Compiled
    from ..flexible.modal_body import ModalBody
    from ..integrate.settings import Settings

#: Frequency of a load over that of the last shape from which on it is told.
_FASTER = 1.5


def concerns(model: Compiled) -> bool:
    """Whether there are any."""
    return bool(model.flexible)


def too_few(model: Compiled, settings: Settings, _: Array, __: Array) -> Iterator[Risk]:
    """Bodies whose last bending shape is slower than the fastest expression of time.  Advice: the
    load may be small, or act on another body; the run tells what the shapes missed."""
    known = model.packed.time_map(settings.t_start, settings.t_end)
    shortest = float(known.longest.min(initial=np.inf))
    for name, body in model.flexible.items() if np.isfinite(shortest) else ():
        last = _last(body)
        ratio = TURN / shortest / last if last > 0 else 0.0
        if ratio > _FASTER:
            yield Risk(
                "shapes", f'"{name}"',
                f"{known.narrowest} changes at up to {TURN / shortest:.3g} rad/s, faster than the "
                f'last shape of "{name}" ({last:.3g} rad/s), which cannot follow',
                "take more modes", ratio, _FASTER, doubt=False, before=True,
            )  # fmt: skip


def squares(body: ModalBody) -> Array:
    """(n,) squared angular frequency of each shape by itself, the frame at rest, 1/s2; 0 where it
    has no mass."""
    mass = modal_mass(body).diagonal()
    return np.divide(np.diag(body.K), mass, out=np.zeros(body.n), where=mass > 0)


def _last(body: ModalBody) -> float:
    """Angular frequency of the last bending shape, of a body without any of the last one, rad/s."""
    bent = [k for k, name in enumerate(body.modes) if name.startswith(("y", "z"))]
    return float(np.sqrt(np.max(squares(body)[bent or slice(None)], initial=0.0)))
