"""Hinges whose coordinates are singular at the start or along a drive (gimbal lock)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from mstmm.array_validation import Array
from mstmm.risk import Risk

from ..result.conditioning import may_be_singular, singular_distance
from .driven_path import drive_times, driven_states

if TYPE_CHECKING:
    from ..engine.compiled_scene import CompiledScene
    from ..integrate.settings import Settings


def applies_to(model: CompiledScene) -> bool:
    """Whether a hinge has coordinates that may be singular."""
    return may_be_singular(model)


def coordinate_singularity_risks(
    model: CompiledScene, settings: Settings, q: Array, u: Array
) -> Iterator[Risk]:
    """Risk of the hinge nearest to a singularity, at the start and along drives."""
    states = driven_states(model, settings, q, u, drive_times(model, settings))
    distance = singular_distance(model, states)
    if distance is not None and distance.risk is not None:
        yield replace(distance.risk, seen_before_run=True)
