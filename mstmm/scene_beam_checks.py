"""What the keys of one beam say to each other: sections, shapes, ends, start values."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from . import scene_rules as rules
from .scene_rules import Location

if TYPE_CHECKING:
    from .scene_beam import Beam

Problem = tuple[Location, str]

#: Most shapes in one direction: beyond, neighbouring shapes and their integrals cannot be told
#: apart well enough for a mass matrix in double precision.
MAX_SHAPES = 60
SHAPES = rules.whole(0, 10**6)


def problems(beam: Beam) -> Iterator[Problem]:
    """Everything in which the keys of a beam do not fit each other."""
    return iter(())
