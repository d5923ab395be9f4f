"""Loss of digits in the sweep at the start: heavy bodies outboard of light ones."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from mstmm.array_validation import Array
from mstmm.risk import Risk

from ..integrate.settings import Settings
from ..packing.coordinate_layout import start_values
from ..result.conditioning import MAX_PIVOT_LOSS, pivot_loss
from .driven_path import driven_states

if TYPE_CHECKING:
    from mstmm.scene import Scene

    from ..engine.compiled_scene import CompiledScene

#: Largest ratio of the loss to the ratio of masses, or of moments of inertia.
_MAX_LOSS_PER_RATIO = 1e3

#: Largest number of bodies that are checked; more would take longer than typical runs.
_MAX_BODIES = 2000


def applies_to(model: CompiledScene) -> bool:
    """Whether mass ratios are so large that digits may be lost."""
    if (
        model.packed_scene.qr
        or model.packed_scene.system.has_loops
        or len(model.scene.bodies) > _MAX_BODIES
    ):
        return False
    return _MAX_LOSS_PER_RATIO * _max_mass_ratio(model.scene) >= MAX_PIVOT_LOSS


def mass_ratio_risks(
    model: CompiledScene, settings: Settings, q: Array, u: Array
) -> Iterator[Risk]:
    """Risk of the largest loss of digits in the sweep at the start."""
    loss = pivot_loss(model, driven_states(model, settings, q, u, [settings.t_start]))
    if loss is not None and loss.risk is not None:
        yield replace(loss.risk, seen_before_run=True)


def accurate_sweep(model: CompiledScene) -> str:
    """Cheapest accurate sweep at the start: "riccati", "refined" or "qr".

    The model must have been compiled with "riccati".
    """
    if not applies_to(model):
        return "riccati"
    packed, settings = model.packed_scene, Settings(0.0)
    q, u = start_values(packed.scene, packed.layout, packed.flexible)
    loss = pivot_loss(model, driven_states(model, settings, q, u, [settings.t_start]))
    return "riccati" if loss is None or loss.risk is None else loss.sweep


def _max_mass_ratio(scene: Scene) -> float:
    """Largest ratio of two masses or of two moments of inertia."""
    tables = [*scene.body, *(table for chain in scene.chain for table in chain.body)]
    masses = [table.mass for table in tables]
    masses += [beam.mass for beam in scene.beam]
    return max(_max_ratio(masses), _max_ratio(x for table in tables for x in table.inertia[:3]))


def _max_ratio(values: Iterable[float]) -> float:
    positive = [value for value in values if value > 0]
    return max(positive) / min(positive) if positive else 1.0
