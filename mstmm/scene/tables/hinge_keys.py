"""Keys of a hinge and its initial values; `hinge_rules` resolves and checks them."""

from __future__ import annotations

from functools import cached_property
from typing import Annotated

from pydantic import Field, model_validator

from ...expression.expression import Expression
from ...ir.hinge_properties import HingeProperties, builtin_hinges
from ...numerics.rotations import Matrix, Vector, from_orientation, unit_rejection, unit_vector
from ..validators import names_and_text as texts
from ..validators import rotations_and_inertia
from ..validators import scalars_and_vectors as rules
from ..validators.scalars_and_vectors import Location, Numbers, Orientation, Table
from .law import Law


class Initial(Table):
    """Initial values of a hinge: q (quaternions w, x, y, z) and u, one entry per coordinate."""

    q: Annotated[Numbers | None, rules.numbers_rule("one number per coordinate")] = None
    u: Annotated[Numbers | None, rules.numbers_rule("one number per speed")] = None


class HingeRating(Table):
    """Rating of a joint: range, largest effort and speed; without effect on the motion."""

    lower: Annotated[float | None, rules.number_rule("m or rad")] = None
    upper: Annotated[float | None, rules.number_rule("m or rad")] = None
    effort: Annotated[float | None, rules.number_rule("N or N m", minimum=0)] = None
    velocity: Annotated[float | None, rules.number_rule("m/s or rad/s", minimum=0)] = None

    @model_validator(mode="after")
    def _check(self) -> HingeRating:
        if self.lower is not None and self.upper is not None and self.lower >= self.upper:
            hint = "; swap them" if self.lower > self.upper else ""
            message = f"lower ({self.lower:g}) must be below upper ({self.upper:g}){hint}"
            raise rules.problem(message, "lower")
        return self


class HingeKeys(Table):
    """Keys of a hinge, before and after `HingeTable` resolves their defaults."""

    type: Annotated[
        str,
        texts.name_rule("a hinge type", ", ".join(builtin_hinges()) + " or a user-defined type"),
    ]
    orientation: Annotated[Orientation, rotations_and_inertia.orientation_rule()] = (0.0, 0.0, 0.0)
    axis: Annotated[Vector, rules.direction_rule()] = (0.0, 0.0, 1.0)
    axis2: Annotated[Vector | None, rules.direction_rule()] = None
    normal: Annotated[Vector | None, rules.direction_rule()] = None
    lead: Annotated[float | None, rules.number_rule("m per turn")] = None
    initial: Initial | None = None
    law: Law = Law()
    drive: Annotated[
        tuple[Expression | None, ...] | None,
        texts.expressions_rule(
            'an expression of t, or a list with one per coordinate ("free" where none)', free=True
        ),
    ] = None
    parameters: Annotated[dict[str, float], texts.parameters_rule()] = Field(default_factory=dict)

    @property
    def builtin(self) -> HingeProperties | None:
        """Facts of the built-in type, None for a user-defined type."""
        return builtin_hinges().get(self.type)

    @cached_property
    def facts(self) -> HingeProperties | None:
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
        x, y, z = unit_vector(self.axis)
        return (x, y, z)

    @property
    def unit_axis2(self) -> Vector | None:
        """Second unit axis; for planar hinges made perpendicular to the normal."""
        if self.axis2 is None:
            return None
        if self.facts is not None and self.facts.frame == "plane":
            return unit_rejection(self.axis2, self.axis)
        x, y, z = unit_vector(self.axis2)
        return (x, y, z)

    def end_problems(self) -> list[tuple[Location, str]]:
        """Problems of the ends of the hinge; none for a table without ends."""
        return []

    @property
    def is_released(self) -> bool:
        """Whether the hinge has a release condition."""
        return False

    @property
    def keeps_initial_values(self) -> bool:
        """Whether initial values of q are kept exactly when loops are assembled."""
        return False
