"""Warnings about angles that look like degrees where radians are expected."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from ...risk import Risk

if TYPE_CHECKING:
    from ..tables.all import SceneTables
    from ..tables.hinge import HingeTable


def notes(scene: SceneTables) -> Iterator[Risk]:
    """Warnings about angles above one turn, which are usually meant in degrees."""
    for hinge in scene.hinge:
        yield from _of_hinge(f'hinge "{hinge.name}"', hinge)
    for chain in scene.chain:
        for k, table in enumerate(chain.hinge):
            yield from _of_hinge(f'hinge {k + 1} of chain "{chain.name}"', table)
        yield from _of_angles(f'chain "{chain.name}": orientation', chain.orientation or ())
    for bushing in scene.bushing:
        yield from _of_angles(f'bushing "{bushing.name}": orientation', bushing.orientation)
        yield from _of_angles(f'bushing "{bushing.name}": rest', bushing.rest.orientation)
    for body in scene.body:
        yield from _of_ends(body.name, body.ends)
    for beam in scene.beam:
        yield from _of_ends(beam.name, beam.ends)
    for elastic in scene.elastic:
        yield from _of_ends(elastic.name, elastic.ends)


def _of_ends(owner: str, ends: Mapping[str, Any]) -> Iterator[Risk]:
    for name, end in ends.items():
        yield from _of_angles(f'"{owner}.{name}": orientation', end.orientation)


def _of_hinge(name: str, hinge: HingeTable) -> Iterator[Risk]:
    yield from _of_angles(f"{name}: orientation", hinge.orientation)
    kind = hinge.facts
    if kind is None or kind.quaternion is not None:
        return
    start = () if hinge.initial is None else hinge.initial.q or ()
    for k, coordinate in enumerate(kind.coordinates):
        if coordinate.unit != "rad":
            continue
        yield from _of_angles(f"{name}: initial q", start, k)
        yield from _of_angles(f"{name}: rest", hinge.law.rest, k)
        for limits in hinge.law.limits[k : k + 1]:
            yield from _of_angles(f"{name}: lower limit", (limits.lower or 0.0,))
            yield from _of_angles(f"{name}: upper limit", (limits.upper or 0.0,))


def _of_angles(what: str, values: tuple[float, ...], at: int | None = None) -> Iterator[Risk]:
    chosen = values if at is None else values[at : at + 1]
    for value in chosen:
        if abs(value) > 2 * math.pi * (1 + 1e-9):
            yield Risk(
                "degrees", what.partition(": ")[0],
                f"{what}: {value:.6g} rad is {abs(value) / (2 * math.pi):.3g} turns",
                f"if degrees were meant, write {math.radians(value):.6g}", abs(value), 2 * math.pi,
                "rad", doubt=False, before=True,
            )  # fmt: skip
