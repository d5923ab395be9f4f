"""Bodies and hinges that a scene speaks of by what only they have, so that they stay."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import Any

from mstmm.expression.expression import Expression, Name
from mstmm.scene import Scene
from mstmm.scene.checks.expression_names import POINT_QUANTITIES


@dataclass(frozen=True)
class ReferencedParts:
    """What stays.

    Attributes:
        bodies: of which more is asked than where their origins and ends are.
        places: these, and those of which it is asked where they are, too.
        hinges: that are released, or of which something is asked.
    """

    bodies: frozenset[str]
    places: frozenset[str]
    hinges: frozenset[str]


def referenced_parts(scene: Scene, keep: Collection[str] = ()) -> ReferencedParts:
    """What expressions, outputs and events of a scene speak of, and what is to be kept."""
    names = [name for table in scene for name in _names(table) if len(name.parts) > 1]
    ends = {body.name: set(body.ends) for body in scene.skeleton.body}
    asked = {name.owner for name in names if not _a_place(name, ends)} | {*keep}
    released = {event.hinge for event in scene.event if event.hinge is not None}
    return ReferencedParts(
        frozenset(asked),
        frozenset(asked | {name.owner for name in names}),
        frozenset(released | asked | {name.hinge for name in names}),
    )


def _a_place(name: Name, ends: dict[str, set[str]]) -> bool:
    """Whether it is a coordinate of a body's origin or of one of its ends, or its rate."""
    return (
        name.quantity in POINT_QUANTITIES
        and name.owner in ends
        and (len(name.parts) == 2 or (len(name.parts) == 3 and name.parts[1] in ends[name.owner]))
    )


def _names(value: Any) -> Iterator[Name]:
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
