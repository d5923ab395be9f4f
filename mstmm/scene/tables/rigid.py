"""Rigid equivalents of flexible bodies, with the same ends."""

from __future__ import annotations

from .beam import Beam
from .body import Body, End
from .elastic import Elastic


def rigid_beam(beam: Beam) -> Body:
    """Rigid body of an undeformed beam: mass, mass centre, inertia and ends."""
    mass = first = second = polar = 0.0
    about = [0.0, 0.0]
    for s in beam.sections:
        line, long = s.mass_per_length or 0.0, s.to - s.from_
        mass += line * long
        first += line * long * (s.to + s.from_) / 2
        second += line * long * (s.to * s.to + s.to * s.from_ + s.from_ * s.from_) / 3
        spin = (s.polar_inertia_per_length or 0.0) * long
        polar += spin
        own = s.rotary_inertia
        about[0] += spin / 2 if own is None else own[0] * long
        about[1] += spin / 2 if own is None else own[1] * long
    middle = first / mass
    across = second - first * middle
    return Body.model_construct(
        name=beam.name, type="rigid", mass=mass, center_of_mass=(middle, 0.0, 0.0),
        inertia=(polar, across + about[0], across + about[1], 0.0, 0.0, 0.0), ends=beam.ends,
    )  # fmt: skip


def bare(flexible: Beam | Elastic) -> Body:
    """Massless body with the ends of a flexible body, sufficient for names and the tree."""
    ends = {
        name: End.model_construct(position=end.position or (0.0, 0.0, 0.0),
                                  orientation=end.orientation)
        for name, end in flexible.ends.items()
    }  # fmt: skip
    return Body.model_construct(name=flexible.name, type="rigid", ends=ends)
