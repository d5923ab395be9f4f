"""Straight lines of welded beams, which bend as one beam."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from ...numerics.rotations import Matrix, rotate
from ..validators.scalars_and_vectors import split_reference

if TYPE_CHECKING:
    from ..tables.beam import Beam
    from ..tables.hinge import Hinge
    from ..tables.scene_tables import SceneTables

ROOT = "root"

#: Least cosine of the angle between the axes of two beams in line.
_MIN_AXIS_COSINE = 0.999


class BeamLine(NamedTuple):
    """Straight line of welded beams: name of its first beam, and length in m."""

    first: str
    length: float


def beam_lines(scene: SceneTables) -> dict[str, BeamLine]:
    """Straight line of welded beams of each beam; a single beam forms a line.

    Two beams are in line where a fixed hinge connects their extreme ends and their axes agree.
    """
    beams = {beam.name: beam for beam in scene.beam}
    previous_beams = {name: name for name in beams}

    def first_beam(name: str) -> str:
        while previous_beams[name] != name:
            previous_beams[name] = previous_beams[previous_beams[name]]
            name = previous_beams[name]
        return name

    released = {event.hinge for event in scene.event if event.hinge is not None}
    for hinge in scene.hinge:
        if hinge.is_weld and not hinge.is_released and hinge.name not in released:
            pair = _aligned_beams(hinge, beams)
            if pair is not None:
                previous_beams[first_beam(pair[1])] = first_beam(pair[0])
    lengths: dict[str, float] = {}
    for name, beam in beams.items():
        lengths[first_beam(name)] = lengths.get(first_beam(name), 0.0) + beam.length
    return {name: BeamLine(first_beam(name), lengths[first_beam(name)]) for name in beams}


def _aligned_beams(hinge: Hinge, beams: dict[str, Beam]) -> tuple[str, str] | None:
    """Beams that a fixed hinge joins in a straight line, (inboard, outboard); None for others."""
    (inboard_beam, inboard_end), (outboard_beam, outboard_end) = (
        split_reference(hinge.inboard),
        split_reference(hinge.outboard),
    )
    if inboard_beam not in beams or outboard_beam not in beams:
        return None
    end_sides = (
        _end_side(beams[inboard_beam], inboard_end),
        _end_side(beams[outboard_beam], outboard_end),
    )
    if 0 in end_sides:
        return None
    outboard_axes = tuple(zip(*_end_rotation(beams[outboard_beam], outboard_end), strict=True))
    outboard_direction = [
        row[0] for row in outboard_axes
    ]  # the axis of the outer beam, in the axes of its end
    direction = rotate(
        _end_rotation(beams[inboard_beam], inboard_end), rotate(hinge.rotation, outboard_direction)
    )
    sign = -1.0 if end_sides[0] == end_sides[1] else 1.0  # axes are opposite where two tips meet
    return (inboard_beam, outboard_beam) if sign * direction[0] > _MIN_AXIS_COSINE else None


def _end_rotation(beam: Beam, end: str) -> Matrix:
    return beam.ends[end or ROOT].rotation


def _end_side(beam: Beam, end: str) -> int:
    """Location of an end: -1 at x = 0, 1 at the tip, 0 between."""
    x = beam.end_x(end)
    tolerance = 1e-9 * beam.length
    return -1 if x <= tolerance else 1 if x >= beam.length - tolerance else 0
