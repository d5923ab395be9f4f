"""Linear flexible bodies that will be spun: by their start, and by drives over the whole run.

In the axes of a linear beam spin takes of its stiffness what shortening would more than give back;
of a clamped one in the plane of its spin about (spin / first frequency)^2 (Kane, Ryan, Banerjee,
Journal of Guidance, Control, and Dynamics 10, 1987).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from mstmm.arrays import Array
from mstmm.risk import Risk

from ..result.flexible.bodies import FlexibleBodies
from ..result.flexible.energy import frequencies
from ..result.flexible.estimators import cross_spin, is_stiffened
from ..result.flexible.risks import GAMMA
from ..result.observed import Observed
from .path import states, times

if TYPE_CHECKING:
    from ..engine.compiled import Compiled
    from ..integrate.settings import Settings


def concerns(model: Compiled) -> bool:
    """Whether there are any."""
    return bool(_linear(model))


def _linear(model: Compiled) -> list[str]:
    return [name for name, body in model.flexible.items() if not is_stiffened(body)]


def linear_bodies(model: Compiled, settings: Settings, q: Array, u: Array) -> Iterator[Risk]:
    """Those whose stiffness a spin that is known before the run changes by more than GAMMA."""
    moved = states(model, settings, q, u, times(model, settings))
    bodies = FlexibleBodies(model, Observed(model, moved))
    for name in _linear(model):
        first = float(frequencies(model.flexible[name])[0])
        spin = cross_spin(bodies.motion(name))
        ratio = spin / first if first > 0 else 0.0
        if ratio**2 > GAMMA:
            yield Risk(
                "stiffening", f'"{name}"',
                f'"{name}" has no geometric stiffening and will spin at {ratio:.2g} times its '
                f"first frequency: its stiffness errs by about {min(ratio**2, 9.99):.0%}",
                "leave stiffening on", ratio, GAMMA**0.5, before=True,
            )  # fmt: skip
