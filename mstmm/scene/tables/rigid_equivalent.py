"""Rigid equivalents of flexible bodies, with the same ends."""

from __future__ import annotations

from .beam import Beam
from .body import Body, End
from .elastic import Elastic


def rigid_body_of_beam(beam: Beam) -> Body:
    """Rigid body of an undeformed beam: mass, mass centre, inertia and ends."""
    mass = first_moment = second_moment = polar_sum = 0.0
    rotary_sums = [0.0, 0.0]
    for beam_section in beam.sections:
        mass_per_length, section_length = (
            beam_section.mass_per_length or 0.0,
            beam_section.to - beam_section.from_,
        )
        mass += mass_per_length * section_length
        first_moment += (
            mass_per_length * section_length * (beam_section.to + beam_section.from_) / 2
        )
        second_moment += (
            mass_per_length
            * section_length
            * (
                beam_section.to * beam_section.to
                + beam_section.to * beam_section.from_
                + beam_section.from_ * beam_section.from_
            )
            / 3
        )
        polar_moment = (beam_section.polar_inertia_per_length or 0.0) * section_length
        polar_sum += polar_moment
        rotary_inertia = beam_section.rotary_inertia
        rotary_sums[0] += (
            polar_moment / 2 if rotary_inertia is None else rotary_inertia[0] * section_length
        )
        rotary_sums[1] += (
            polar_moment / 2 if rotary_inertia is None else rotary_inertia[1] * section_length
        )
    centre = first_moment / mass
    transverse_moment = second_moment - first_moment * centre
    return Body.model_construct(
        name=beam.name,
        type="rigid",
        mass=mass,
        center_of_mass=(centre, 0.0, 0.0),
        inertia=(
            polar_sum,
            transverse_moment + rotary_sums[0],
            transverse_moment + rotary_sums[1],
            0.0,
            0.0,
            0.0,
        ),
        ends=beam.ends,
    )


def massless_body(flexible: Beam | Elastic) -> Body:
    """Massless body with the ends of a flexible body, sufficient for names and the tree."""
    ends = {
        name: End.model_construct(position=end.position or (0.0, 0.0, 0.0),
                                  orientation=end.orientation)
        for name, end in flexible.ends.items()
    }  # fmt: skip
    return Body.model_construct(name=flexible.name, type="rigid", ends=ends)
