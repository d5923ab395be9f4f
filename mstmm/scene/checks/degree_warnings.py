"""Warnings about angles that look like degrees where radians are expected."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from ...risk import Risk

if TYPE_CHECKING:
    from ..tables.hinge import HingeTable
    from ..tables.scene_tables import SceneTables


def degree_warnings(scene: SceneTables) -> Iterator[Risk]:
    """Warnings about angles above one turn, which are usually meant in degrees."""
    for hinge in scene.hinge:
        yield from _hinge_warnings(f'hinge "{hinge.name}"', hinge)
    for chain in scene.chain:
        for k, table in enumerate(chain.hinge):
            yield from _hinge_warnings(f'hinge {k + 1} of chain "{chain.name}"', table)
        yield from _angle_warnings(f'chain "{chain.name}": orientation', chain.orientation or ())
    for bushing in scene.bushing:
        yield from _angle_warnings(f'bushing "{bushing.name}": orientation', bushing.orientation)
        yield from _angle_warnings(f'bushing "{bushing.name}": rest', bushing.rest.orientation)
    for body in scene.body:
        yield from _end_warnings(body.name, body.ends)
    for beam in scene.beam:
        yield from _end_warnings(beam.name, beam.ends)
    for elastic in scene.elastic:
        yield from _end_warnings(elastic.name, elastic.ends)


def _end_warnings(owner: str, ends: Mapping[str, Any]) -> Iterator[Risk]:
    for name, end in ends.items():
        yield from _angle_warnings(f'"{owner}.{name}": orientation', end.orientation)


def _hinge_warnings(name: str, hinge: HingeTable) -> Iterator[Risk]:
    yield from _angle_warnings(f"{name}: orientation", hinge.orientation)
    facts = hinge.facts
    if facts is None or facts.quaternion is not None:
        return
    start = () if hinge.initial is None else hinge.initial.q or ()
    for k, coordinate in enumerate(facts.coordinates):
        if coordinate.unit != "rad":
            continue
        yield from _angle_warnings(f"{name}: initial q", start, k)
        yield from _angle_warnings(f"{name}: rest", hinge.law.rest, k)
        for limits in hinge.law.limits[k : k + 1]:
            yield from _angle_warnings(f"{name}: lower limit", (limits.lower or 0.0,))
            yield from _angle_warnings(f"{name}: upper limit", (limits.upper or 0.0,))


def _angle_warnings(what: str, values: tuple[float, ...], at: int | None = None) -> Iterator[Risk]:
    selected = values if at is None else values[at : at + 1]
    for value in selected:
        if abs(value) > 2 * math.pi * (1 + 1e-9):
            yield Risk(
                "degrees", what.partition(": ")[0],
                f"{what}: {value:.6g} rad is {abs(value) / (2 * math.pi):.3g} turns",
                f"if degrees were meant, write {math.radians(value):.6g}", abs(value), 2 * math.pi,
                "rad", invalidates=False, seen_before_run=True,
            )  # fmt: skip
