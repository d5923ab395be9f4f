"""Hinges that begin where their coordinates fail, or that a drive takes there."""

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
    """Whether coordinates of a hinge fail anywhere."""
    return may_be_singular(model)


def coordinate_singularity_risks(
    model: CompiledScene, settings: Settings, q: Array, u: Array
) -> Iterator[Risk]:
    """The nearest of them, at the start and where drives go."""
    moved = driven_states(model, settings, q, u, drive_times(model, settings))
    found = singular_distance(model, moved)
    if found is not None and found.risk is not None:
        yield replace(found.risk, before=True)
