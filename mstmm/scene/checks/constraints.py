"""Constraints among each other."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ..rules.messages import Problem
from ..tables.closures import DISTANCE

if TYPE_CHECKING:
    from ..tables.all import SceneTables
    from ..tables.closures import Constraint


def repeated(scene: SceneTables) -> Iterator[Problem]:
    """Constraints between the same points for the second time."""
    seen: dict[tuple[object, ...], int] = {}
    for i, constraint in enumerate(scene.constraint):
        first = seen.setdefault(_same(constraint), i)
        if first != i:
            yield ("constraint", i), f"constraint number {first + 1} says the same; leave one out"


def _same(one: Constraint) -> tuple[object, ...]:
    """What two constraints have in common that ask for the same, or contradict each other."""
    ends = (one.from_, one.to)
    kept = tuple(sorted(ends)) if one.type == DISTANCE else ends
    return one.type, kept, one.position, one.unit_normal
