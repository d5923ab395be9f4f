"""Spin of linear flexible bodies, which lack geometric stiffness, at the start or by drives.

In the axes of a linear beam, spin reduces the stiffness, while the neglected foreshortening would
increase it by more.  For a clamped beam in the plane of its spin the relative reduction is about
(spin / first frequency)^2 (Kane, Ryan, Banerjee, Journal of Guidance, Control, and Dynamics 10,
1987).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from mstmm.array_validation import Array
from mstmm.risk import Risk

from ..result.flexible.body_motions import FlexibleBodies
from ..result.flexible.modal_energy import modal_frequencies
from ..result.flexible.range_estimators import has_second_order_terms, transverse_spin
from ..result.flexible.risks import MAX_LOAD_RATIO
from ..result.observations import Observations
from .driven_path import drive_times, driven_states

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..integrate.settings import Settings


def has_linear_bodies(model: CompiledScene) -> bool:
    """Whether there are linear flexible bodies."""
    return bool(_linear_bodies(model))


def _linear_bodies(model: CompiledScene) -> list[str]:
    return [
        name for name, body in model.flexible_bodies.items() if not has_second_order_terms(body)
    ]


def spin_stiffening_risks(
    model: CompiledScene, settings: Settings, q: Array, u: Array
) -> Iterator[Risk]:
    """Linear bodies whose stiffness changes too much by a spin that is known before the run."""
    states = driven_states(model, settings, q, u, drive_times(model, settings))
    bodies = FlexibleBodies(model, Observations(model, states))
    for name in _linear_bodies(model):
        first = float(modal_frequencies(model.flexible_bodies[name])[0])
        spin = transverse_spin(bodies.motion(name))
        ratio = spin / first if first > 0 else 0.0
        if ratio**2 > MAX_LOAD_RATIO:
            yield Risk(
                "stiffening", f'"{name}"',
                f'"{name}" has no geometric stiffening and will spin at {ratio:.2g} times its '
                f"first frequency: stiffness error about {min(ratio**2, 9.99):.0%}",
                "leave stiffening on", ratio, MAX_LOAD_RATIO**0.5, seen_before_run=True,
            )  # fmt: skip
