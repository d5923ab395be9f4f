"""Digits that the sweep loses at the start: heavy bodies behind light ones."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from mstmm.array_validation import Array
from mstmm.risk import Risk

from ..integrate.settings import Settings
from ..packing.initial_state import start_values
from ..result.conditioning import MAX_PIVOT_LOSS, pivot_loss
from .driven_path import driven_states

if TYPE_CHECKING:
    from mstmm.scene import Scene

    from ..engine.compiled_scene import CompiledScene

#: The loss is at most so many times the ratio of masses, or of moments of inertia.
_WORST = 1e3

#: Bodies up to which it is looked at: more take longer than many a run.
_MOST = 2000


def applies_to(model: CompiledScene) -> bool:
    """Whether masses are so unlike that digits may be lost."""
    if model.packed.qr or model.packed.system.closes:
        return False
    return len(model.scene.bodies) <= _MOST and _WORST * _unlike(model.scene) >= MAX_PIVOT_LOSS


def mass_ratio_risks(
    model: CompiledScene, settings: Settings, q: Array, u: Array
) -> Iterator[Risk]:
    """The worst loss of the start's sweep."""
    found = pivot_loss(model, driven_states(model, settings, q, u, [settings.t_start]))
    if found is not None and found.risk is not None:
        yield replace(found.risk, before=True)


def accurate_sweep(model: CompiledScene) -> str:
    """Of a model made with "riccati" the cheapest sweep by which its start keeps its digits:
    "riccati", "refined" or "qr"."""
    if not applies_to(model):
        return "riccati"
    packed, settings = model.packed, Settings(0.0)
    q, u = start_values(packed.scene, packed.layout, packed.flexible)
    found = pivot_loss(model, driven_states(model, settings, q, u, [settings.t_start]))
    return "riccati" if found is None or found.risk is None else found.sweep


def _unlike(scene: Scene) -> float:
    """The largest ratio of two masses, and of two moments of inertia."""
    tables = [*scene.body, *(table for chain in scene.chain for table in chain.body)]
    masses = [table.mass for table in tables]
    masses += [beam.mass for beam in scene.beam]
    return max(_ratio(masses), _ratio(x for table in tables for x in table.inertia[:3]))


def _ratio(values: Iterable[float]) -> float:
    there = [value for value in values if value > 0]
    return max(there) / min(there) if there else 1.0
