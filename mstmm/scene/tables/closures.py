"""Tables [[constraint]] and [[coupling]]: loop closures other than hinges."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from ...expression.expression import Expression, Name
from ...numerics.rotations import Vector, unit_vector
from ..validators import names_and_text as texts
from ..validators import scalars_and_vectors as rules
from ..validators.names_and_text import check_two_ends
from ..validators.scalars_and_vectors import GROUND, Position, Table, problem, split_reference

DISTANCE, PLANE, CURVE, ROLLING = "distance", "point-on-plane", "point-on-curve", "rolling"
#: Required and optional keys of each type, besides the common ones.
_KEYS_BY_TYPE = {
    DISTANCE: (("length",), ()), PLANE: (("normal",), ("offset",)),
    CURVE: (("curve",), ("start",)), ROLLING: (("normal", "radius"), ("offset", "axis")),
}  # fmt: skip
_KEY_DESCRIPTIONS = {
    "length": "a number in m, more than 0", "radius": "a number in m, more than 0",
    "normal": 'three numbers, the normal in the axes of the end "{}", such as [0, 1, 0]',
    "curve": "three expressions of s, a point in m in the axes of the end \"{}\", such as "
    '["cos(s)", "sin(s)", "0.1*s"]',
}  # fmt: skip


class Constraint(Table):
    """Constraint between the points of two ends.

    "distance": `to` keeps the distance `length` (m, more than 0) from `from`.  "point-on-plane":
    `to` remains in a plane with the `normal`, in the axes of the end `from`, at `offset` (m) along
    the normal.  "point-on-curve": `to` remains on the `curve`, three expressions of a parameter s
    in m, relative to `from` and in its axes; s starts near `start`.  "rolling": a disc of `radius`
    (m) rolls without slip on top of such a plane, with its centre at `to` and its `axis` in the
    axes of that end.  Without an axis it is a ball.  `position` (m) is the position of an end on
    the ground.
    """

    name: Annotated[str, texts.name_rule("the constraint's name")] = ""
    type: Annotated[str, texts.choice_rule(*_KEYS_BY_TYPE)]
    from_: texts.Reference = Field(alias="from")
    to: texts.Reference
    position: Position = (0.0, 0.0, 0.0)
    length: Annotated[float | None, rules.number_rule("m", above=0)] = None
    normal: Annotated[Vector | None, rules.direction_rule()] = None
    offset: Annotated[float | None, rules.number_rule("m")] = None
    curve: Annotated[
        tuple[Expression, Expression, Expression] | None,
        texts.expressions_rule("three expressions of s", 3),
    ] = None
    start: Annotated[float | None, rules.number_rule("of s")] = None
    radius: Annotated[float | None, rules.number_rule("m", above=0)] = None
    axis: Annotated[Vector | None, rules.direction_rule()] = None

    def _check(self) -> None:
        check_two_ends(self, "a constraint")
        required_keys, optional_keys = _KEYS_BY_TYPE[self.type]
        for key in _TYPE_KEYS:
            if getattr(self, key) is not None and key not in (*required_keys, *optional_keys):
                raise problem(f'a "{self.type}" has no {key}; leave it out', key)
        for key in required_keys:
            if getattr(self, key) is None:
                raise problem(f"missing; expected {_KEY_DESCRIPTIONS[key].format(self.from_)}", key)
        if self.type == ROLLING and split_reference(self.to)[0] == GROUND:
            raise problem("expected a body, found the ground; swap from and to", "to")

    @property
    def unit_normal(self) -> Vector | None:
        """Unit normal in the axes of the end `from`, or None."""
        return None if self.normal is None else _unit_vector(self.normal)

    @property
    def unit_axis(self) -> Vector:
        """Unit axis of a disc in the axes of the end `to`; zero for a ball."""
        return (0.0, 0.0, 0.0) if self.axis is None else _unit_vector(self.axis)

    @property
    def rows(self) -> int:
        """Number of constraint rows."""
        return {CURVE: 2, ROLLING: 3}.get(self.type, 1)


_TYPE_KEYS = tuple(
    dict.fromkeys(key for pair in _KEYS_BY_TYPE.values() for keys in pair for key in keys)
)


def _unit_vector(vector: Vector) -> Vector:
    x, y, z = unit_vector(vector)
    return (x, y, z)


class Coupling(Table):
    """Coupling of hinge coordinates by one row: gears, racks, screws, differentials.

    `expression` of the coordinates has the value `equals`, or keeps its initial value if `equals`
    is left out.  `speeds`, linear in speeds of hinges, has the value `equals`, or 0.  `equals` is a
    number or an expression of t.
    """

    name: Annotated[str, texts.name_rule("the coupling's name")] = ""
    expression: Annotated[
        Expression | None,
        texts.formula_rule('an expression of coordinates such as "sun.q - 3*carrier.q"'),
    ] = None
    speeds: Annotated[
        Expression | None,
        texts.formula_rule('an expression of speeds such as "0.3*wheel.u - cart.u"'),
    ] = None
    equals: Annotated[
        Expression | None, texts.expression_rule("a number or an expression of t")
    ] = None

    def _check(self) -> None:
        if self.expression is None and self.speeds is None:
            raise problem("missing; give expression or speeds", "expression")
        if self.expression is not None and self.speeds is not None:
            raise problem(
                "expected expression or speeds, found both; define two couplings", "speeds"
            )

    @property
    def key(self) -> str:
        """Key that gives the row: "expression" or "speeds"."""
        return "speeds" if self.expression is None else "expression"

    @property
    def row(self) -> Expression:
        """Expression of the row, in coordinates or in speeds."""
        row: Expression = getattr(self, self.key)
        return row

    @property
    def is_time_dependent(self) -> bool:
        """Whether it prescribes motion, as a drive does."""
        equals = self.equals
        return (
            equals is not None and not equals.is_zero
            if self.speeds
            else bool(equals and equals.names)
        )

    @property
    def names(self) -> tuple[Name, ...]:
        """Names in the row: the coupled coordinates or speeds."""
        return self.row.names
