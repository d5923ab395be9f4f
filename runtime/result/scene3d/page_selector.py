"""Several scenes on one page, shown one at a time: modes, rows of a batch."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

from .scene_graph import DeformingSurface, Line, SceneGraph, Solid

Part = tuple[str, SceneGraph]
T = TypeVar("T")


def combine_stages(title: str, parts: Sequence[Part]) -> SceneGraph:
    """Combine scenes over the same frame times; names of objects are prefixed by their part."""
    first = parts[0][1]
    notes = dict.fromkeys(note for _, stage in parts for note in stage.notes)
    return replace(
        first,
        title=title,
        notes=tuple(notes),
        choices=tuple(name for name, _ in parts),
        poses=dict(_with_prefix((name, stage.poses) for name, stage in parts)),
        labels=dict(_with_prefix((name, stage.labels) for name, stage in parts)),
        solids=tuple(
            _solid_with_prefix(name, item) for name, stage in parts for item in stage.solids
        ),
        deforming_surfaces=tuple(
            _named_with_prefix(name, item)
            for name, stage in parts
            for item in stage.deforming_surfaces
        ),
        lines=tuple(
            _named_with_prefix(name, item) for name, stage in parts for item in stage.lines
        ),
    )


NamedObject = TypeVar("NamedObject", DeformingSurface, Line)


def _with_prefix(parts: Iterator[tuple[str, Mapping[str, T]]]) -> Iterator[tuple[str, T]]:
    for name, values_by_owner in parts:
        for owner, value in values_by_owner.items():
            yield f"{name}/{owner}", value


def _solid_with_prefix(name: str, solid: Solid) -> Solid:
    return replace(solid, owner=f"{name}/{solid.owner}")


def _named_with_prefix(name: str, named_object: NamedObject) -> NamedObject:
    return replace(named_object, name=f"{name}/{named_object.name}")
