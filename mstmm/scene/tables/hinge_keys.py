"""The keys of a hinge and its start values; what they say to each other is settled elsewhere."""

from __future__ import annotations

from functools import cached_property
from typing import Annotated

from pydantic import Field, model_validator

from ...expression.expression import Expression
from ...ir.facts import HingeFacts, builtin_hinges
from ...numbers.rotations import Matrix, Vector, from_orientation, reject, unit
from ..rules import text as texts
from ..rules import turns
from ..rules import values as rules
from ..rules.values import Location, Numbers, Orientation, Table
from .law import Law


class Initial(Table):
    """Start values of a hinge: q (quaternions w, x, y, z) and u, one entry per coordinate."""

    q: Annotated[Numbers | None, rules.numbers("one number per coordinate")] = None
    u: Annotated[Numbers | None, rules.numbers("one number per speed")] = None


class Rated(Table):
    """What a joint is built for: its range, its largest effort and speed.  Nothing acts by it."""

    lower: Annotated[float | None, rules.number("m or rad")] = None
    upper: Annotated[float | None, rules.number("m or rad")] = None
    effort: Annotated[float | None, rules.number("N or N m", minimum=0)] = None
    velocity: Annotated[float | None, rules.number("m/s or rad/s", minimum=0)] = None

    @model_validator(mode="after")
    def _check(self) -> Rated:
        if self.lower is not None and self.upper is not None and self.lower >= self.upper:
            hint = "; swap them" if self.lower > self.upper else ""
            what = f"lower ({self.lower:g}) must be below upper ({self.upper:g}){hint}"
            raise rules.refuse(what, "lower")
        return self


class HingeKeys(Table):
    """The keys of a hinge, as they are written and as `HingeTable` leaves them."""

    type: Annotated[str, texts.name("a hinge type", ", ".join(builtin_hinges()) + " or your own")]
    orientation: Annotated[Orientation, turns.orientation()] = (0.0, 0.0, 0.0)
    axis: Annotated[Vector, rules.direction()] = (0.0, 0.0, 1.0)
    axis2: Annotated[Vector | None, rules.direction()] = None
    normal: Annotated[Vector | None, rules.direction()] = None
    lead: Annotated[float | None, rules.number("m per turn")] = None
    initial: Initial | None = None
    law: Law = Law()
    drive: Annotated[
        tuple[Expression | None, ...] | None,
        texts.expressions(
            'an expression of t, or a list with one per coordinate ("free" where none)', free=True
        ),
    ] = None
    parameters: Annotated[dict[str, float], texts.parameters()] = Field(default_factory=dict)

    @property
    def builtin(self) -> HingeFacts | None:
        """Facts of the built-in type, None for a user's type."""
        return builtin_hinges().get(self.type)

    @cached_property
    def facts(self) -> HingeFacts | None:
        """What the type leaves free; of a user's type None until its definition is known
        (`Scene.check_types`)."""
        return self.builtin

    @property
    def is_weld(self) -> bool:
        """Both ends are one, by its type."""
        return self.facts is not None and self.facts.welds

    @property
    def rotation(self) -> Matrix:
        """Rotation matrix at q = 0: axes of the outboard end -> axes of the inboard end."""
        return from_orientation(self.orientation)

    @property
    def unit_axis(self) -> Vector:
        """The axis (planar: the normal) with length 1."""
        x, y, z = unit(self.axis)
        return (x, y, z)

    @property
    def unit_axis2(self) -> Vector | None:
        """The second axis with length 1; planar: made perpendicular to the normal."""
        if self.axis2 is None:
            return None
        if self.facts is not None and self.facts.frame == "plane":
            return reject(self.axis2, self.axis)
        x, y, z = unit(self.axis2)
        return (x, y, z)

    def misplaced(self) -> list[tuple[Location, str]]:
        """What is wrong with the ends it joins; a table without ends has none to be wrong."""
        return []

    @property
    def lets_go(self) -> bool:
        """True when it is released by itself."""
        return False

    @property
    def holds(self) -> bool:
        """True when its start values are kept exactly, whatever loops ask for."""
        return False
