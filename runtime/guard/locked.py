"""Hinges that begin where their coordinates fail, or that a drive takes there."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from mstmm.arrays import Array
from mstmm.risk import Risk

from ..result.conditioning import singular_distance
from .path import states, times

if TYPE_CHECKING:
    from ..engine.compiled import Compiled
    from ..integrate.settings import Settings


def concerns(model: Compiled) -> bool:
    """Whether coordinates of a hinge fail anywhere."""
    kinds = {slots.type for group in model.layout.groups for slots in group.hinges}
    known = model.packed.elements
    return any("singularity" in known["hinge", kind].functions for kind in kinds)


def near_lock(model: Compiled, settings: Settings, q: Array, u: Array) -> Iterator[Risk]:
    """The nearest of them, at the start and where drives go."""
    moved = states(model, settings, q, u, times(model, settings))
    found = singular_distance(model, moved)
    if found is not None and found.risk is not None:
        yield replace(found.risk, before=True)
