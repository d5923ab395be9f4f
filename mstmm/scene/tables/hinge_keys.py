"""Keys of a hinge and its initial values; `hinge_rules` resolves and checks them."""

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
    """Initial values of a hinge: q (quaternions w, x, y, z) and u, one entry per coordinate."""

    q: Annotated[Numbers | None, rules.numbers("one number per coordinate")] = None
    u: Annotated[Numbers | None, rules.numbers("one number per speed")] = None


class Rated(Table):
    """Rating of a joint: range, largest effort and speed; without effect on the motion."""

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
    """Keys of a hinge, before and after `HingeTable` resolves their defaults."""

    type: Annotated[
        str, texts.name("a hinge type", ", ".join(builtin_hinges()) + " or a user-defined type")
    ]
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
        """Facts of the built-in type, None for a user-defined type."""
        return builtin_hinges().get(self.type)

    @cached_property
    def facts(self) -> HingeFacts | None:
        """Facts of the type: coordinates, speeds, keys.

        None for a user-defined type until `Scene.check_types` provides its definition.
        """
        return self.builtin

    @property
    def is_weld(self) -> bool:
        """Whether the type of the hinge is a weld."""
        return self.facts is not None and self.facts.welds

    @property
    def rotation(self) -> Matrix:
        """Rotation matrix at q = 0 from axes of the outboard end to axes of the inboard end."""
        return from_orientation(self.orientation)

    @property
    def unit_axis(self) -> Vector:
        """Unit axis; for planar hinges the unit normal."""
        x, y, z = unit(self.axis)
        return (x, y, z)

    @property
    def unit_axis2(self) -> Vector | None:
        """Second unit axis; for planar hinges made perpendicular to the normal."""
        if self.axis2 is None:
            return None
        if self.facts is not None and self.facts.frame == "plane":
            return reject(self.axis2, self.axis)
        x, y, z = unit(self.axis2)
        return (x, y, z)

    def misplaced(self) -> list[tuple[Location, str]]:
        """Problems of the ends of the hinge; none for a table without ends."""
        return []

    @property
    def lets_go(self) -> bool:
        """Whether the hinge has a release condition."""
        return False

    @property
    def holds(self) -> bool:
        """Whether initial values of q are kept exactly when loops are assembled."""
        return False
