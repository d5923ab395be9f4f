"""Several stages on one page, of which one is looked at at a time: modes, rows of a batch."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

from .stage import Bent, Line, Solid, Stage

Part = tuple[str, Stage]
T = TypeVar("T")


def together(title: str, parts: Sequence[Part]) -> Stage:
    """Stages over the same moments as one; what belongs to each carries its name in front."""
    first = parts[0][1]
    notes = dict.fromkeys(note for _, stage in parts for note in stage.notes)
    return replace(
        first, title=title, notes=tuple(notes), choices=tuple(name for name, _ in parts),
        poses=dict(_owned((name, stage.poses) for name, stage in parts)),
        told=dict(_owned((name, stage.told) for name, stage in parts)),
        solids=tuple(_solid(name, one) for name, stage in parts for one in stage.solids),
        bent=tuple(_named(name, one) for name, stage in parts for one in stage.bent),
        lines=tuple(_named(name, one) for name, stage in parts for one in stage.lines),
    )  # fmt: skip


def _owned(parts: Iterator[tuple[str, Mapping[str, T]]]) -> Iterator[tuple[str, T]]:
    for name, owned in parts:
        for owner, one in owned.items():
            yield f"{name}/{owner}", one


def _solid(name: str, one: Solid) -> Solid:
    return replace(one, owner=f"{name}/{one.owner}")


Moving = TypeVar("Moving", Bent, Line)


def _named(name: str, one: Moving) -> Moving:
    return replace(one, name=f"{name}/{one.name}")
