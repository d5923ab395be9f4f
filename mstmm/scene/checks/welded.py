"""Straight lines of welded beams, which bend as one beam."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from ...numbers.rotations import Matrix, apply
from ..rules.values import split

if TYPE_CHECKING:
    from ..tables.all import SceneTables
    from ..tables.beam import Beam
    from ..tables.hinge import Hinge

ROOT = "root"

#: Least cosine of the angle between the axes of two beams in line.
_STRAIGHT = 0.999


class Line(NamedTuple):
    """Straight line of welded beams: name of its first beam, and length in m."""

    first: str
    length: float


def lines(scene: SceneTables) -> dict[str, Line]:
    """Straight line of welded beams of each beam; a single beam forms a line.

    Two beams are in line where a fixed hinge connects their extreme ends and their axes agree.
    """
    beams = {beam.name: beam for beam in scene.beam}
    before = {name: name for name in beams}

    def first(name: str) -> str:
        while before[name] != name:
            before[name] = before[before[name]]
            name = before[name]
        return name

    released = {event.hinge for event in scene.event if event.hinge is not None}
    for hinge in scene.hinge:
        if hinge.is_weld and not hinge.lets_go and hinge.name not in released:
            pair = _in_line(hinge, beams)
            if pair is not None:
                before[first(pair[1])] = first(pair[0])
    total: dict[str, float] = {}
    for name, beam in beams.items():
        total[first(name)] = total.get(first(name), 0.0) + beam.length
    return {name: Line(first(name), total[first(name)]) for name in beams}


def _in_line(hinge: Hinge, beams: dict[str, Beam]) -> tuple[str, str] | None:
    """Beams that a fixed hinge joins in a straight line, (inboard, outboard); None for others."""
    (inner, at), (outer, end) = split(hinge.inboard), split(hinge.outboard)
    if inner not in beams or outer not in beams:
        return None
    places = (_extreme(beams[inner], at), _extreme(beams[outer], end))
    if 0 in places:
        return None
    back = tuple(zip(*_rotation(beams[outer], end), strict=True))
    held = [row[0] for row in back]  # the axis of the outer beam, in the axes of its end
    direction = apply(_rotation(beams[inner], at), apply(hinge.rotation, held))
    goes_on = -1.0 if places[0] == places[1] else 1.0  # axes are opposite where two tips meet
    return (inner, outer) if goes_on * direction[0] > _STRAIGHT else None


def _rotation(beam: Beam, end: str) -> Matrix:
    return beam.ends[end or ROOT].rotation


def _extreme(beam: Beam, end: str) -> int:
    """Location of an end: -1 at x = 0, 1 at the tip, 0 between."""
    x = beam.end_x(end)
    slack = 1e-9 * beam.length
    return -1 if x <= slack else 1 if x >= beam.length - slack else 0
