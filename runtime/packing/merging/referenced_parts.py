"""Bodies and hinges that expressions, outputs and events refer to, which must be kept."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Any

from mstmm.expression.expression import Expression, Name
from mstmm.scene import Scene
from mstmm.scene.checks.expression_names import POINT_QUANTITIES


@dataclass(frozen=True)
class ReferencedParts:
    """Names of bodies and hinges that simplifications must keep.

    Attributes:
        bodies: referenced by more than positions and velocities of their origin and ends.
        frames: referenced in any way.
        hinges: released or referenced.
    """

    bodies: frozenset[str]
    frames: frozenset[str]
    hinges: frozenset[str]


def referenced_parts(scene: Scene, keep: Collection[str] = ()) -> ReferencedParts:
    """Parts that the scene refers to, and those named in `keep`."""
    names = [name for table in scene for name in _names(table) if len(name.parts) > 1]
    ends = {body.name: set(body.ends) for body in scene.skeleton.body}
    owners = {name.owner for name in names if not _is_point(name, ends)} | {*keep}
    released = {event.hinge for event in scene.event if event.hinge is not None}
    return ReferencedParts(
        frozenset(owners),
        frozenset(owners | {name.owner for name in names}),
        frozenset(released | owners | {name.hinge for name in names}),
    )


def _is_point(name: Name, ends: dict[str, set[str]]) -> bool:
    """Whether a name is a position or velocity component of a body's origin or end."""
    return (
        name.quantity in POINT_QUANTITIES
        and name.owner in ends
        and (len(name.parts) == 2 or (len(name.parts) == 3 and name.parts[1] in ends[name.owner]))
    )


def _names(value: Any) -> Iterator[Name]:
    """Names in all expressions of a table or container."""
    if isinstance(value, Expression):
        yield from value.names
    elif isinstance(value, (list, tuple)):
        for entry in value:
            yield from _names(entry)
    elif isinstance(value, dict):
        for entry in value.values():
            yield from _names(entry)
    elif hasattr(type(value), "model_fields"):
        for key in type(value).model_fields:
            yield from _names(getattr(value, key))
