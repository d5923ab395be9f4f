"""Table [[body]]: a rigid body or a body of a user-defined type, with its ends."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any

from pydantic import Field

from ...numerics.rotations import IDENTITY, Matrix, Vector, from_orientation
from ..validators import names_and_text as texts
from ..validators import scalars_and_vectors as rules
from ..validators.rotations_and_inertia import Orientation, inertia_rule, without_rounding
from ..validators.scalars_and_vectors import MAX_ENTRY, Numbers, Position, Problem, Table


class End(Table):
    """Output end of a body: position (m) and orientation in body axes."""

    position: Position
    orientation: Orientation = (0.0, 0.0, 0.0)

    @property
    def rotation(self) -> Matrix:
        """Rotation matrix from axes of the end to body axes."""
        return from_orientation(self.orientation)


def widen_end(value: Any) -> Any:
    """Expand a position to the table of an end with the axes of the body."""
    return {"position": value} if isinstance(value, (list, tuple)) else value


_ENDS = texts.ends_rule(
    "output ends: name -> [x, y, z] in m, or a table with position and orientation",
    "a table such as { tip = [1, 0, 0] }",
    {"additionalProperties": {"type": "array"}},
    widen_end,
)


class BodyTable(Table):
    """Properties of a body without its name: rigid, or of a user-defined type with `parameters`.

    Body axes have their origin at the input end.  `inertia` is about the centre of mass as
    (xx, yy, zz, xy, xz, yz), tensor entries (Jxy = -int xy dm), kg m^2.
    """

    type: Annotated[str, texts.name_rule("a body type")] = "rigid"
    mass: Annotated[float, rules.number_rule("kg", minimum=0)] = 0.0
    center_of_mass: Position = (0.0, 0.0, 0.0)
    inertia: Annotated[Numbers, inertia_rule()] = (0.0,) * 6
    allow_unphysical_inertia: texts.Flag = False
    ends: Annotated[dict[str, End], _ENDS] = Field(default_factory=dict)
    parameters: texts.Parameters = Field(default_factory=dict)

    @property
    def inertia_matrix(self) -> Matrix:
        """Inertia tensor (kg m^2) about the centre of mass in body axes.

        Moments that are negative by rounding are zero.
        """
        xx, yy, zz, xy, xz, yz = self.inertia
        return without_rounding(((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)), self.mass)

    def end_position(self, at: str) -> Vector:
        """Position (m) of the end `at` in body axes; "" is the origin of the body."""
        return self.ends[at].position if at else (0.0, 0.0, 0.0)

    def end_rotation(self, at: str) -> Matrix:
        """Rotation matrix from axes of the end `at` to body axes."""
        return self.ends[at].rotation if at else IDENTITY

    def _check(self) -> None:
        if len(self.inertia) == 3:
            vars(self)["inertia"] = (*self.inertia, 0.0, 0.0, 0.0)

    def _problems(self) -> Iterator[Problem]:
        if self.type == "rigid" and "mass" not in self.model_fields_set:
            yield ("mass",), "missing; expected a number in kg, 0 or more"
        if self.type == "rigid" and self.parameters:
            remedy = "set type to your user-defined type"
            yield ("parameters",), f"a rigid body has no parameters; {remedy}"
        moment = float(self.mass) * sum(float(x) ** 2 for x in self.center_of_mass)
        if not max(float(self.mass), moment, *(abs(float(x)) for x in self.inertia)) <= MAX_ENTRY:
            limit = f"at most {MAX_ENTRY:g} kg and kg m^2, above which products overflow"
            quantities = "mass, mass times the square of center_of_mass, and inertia"
            yield ("mass",), f"expected {quantities}: {limit}"


class Body(BodyTable):
    """Body of a scene: rigid, or of a user-defined type."""

    name: Annotated[str, texts.name_rule("the body's name")]
