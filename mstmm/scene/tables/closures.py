"""[[constraint]] and [[coupling]]: what closes loops besides hinges."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from ...expression.expression import Expression, Name
from ...numbers.rotations import Vector, unit
from ..rules import text as texts
from ..rules import values as rules
from ..rules.values import GROUND, Table, refuse, split

DISTANCE, PLANE, CURVE, ROLLING = "distance", "point-on-plane", "point-on-curve", "rolling"
#: Keys of each type besides the common ones, and which of them it cannot do without.
_KEYS = {
    DISTANCE: (("length",), ()), PLANE: (("normal",), ("offset",)),
    CURVE: (("curve",), ("start",)), ROLLING: (("normal", "radius"), ("offset", "axis")),
}  # fmt: skip
_EXPECTED = {
    "length": "a number in m, more than 0", "radius": "a number in m, more than 0",
    "normal": 'three numbers, the normal in the axes of the end "{}", such as [0, 1, 0]',
    "curve": "three expressions of s, a point in m in the axes of the end \"{}\", such as "
    '["cos(s)", "sin(s)", "0.1*s"]',
}  # fmt: skip


class Constraint(Table):
    """Rows between the points of two ends.

    "distance": `to` stays `length` (m, more than 0) away from `from`.  "point-on-plane": `to` stays
    in the plane through `from` with the `normal`, in the axes of the end `from`, or `offset` (m)
    above it along the normal.  "point-on-curve": `to` stays on the `curve`, three expressions of a
    parameter s in m, from `from` and in its axes; s begins near `start`.  "rolling": a disc of
    `radius` (m) with its centre at `to` and its `axis` in the axes of that end rolls without
    slipping on such a plane, above it; without an axis a ball.  `position` (m) is the place of the
    end that is on the ground.
    """

    name: Annotated[str, texts.name("the constraint's name")] = ""
    type: Annotated[str, texts.choice(*_KEYS)]
    from_: Annotated[str, texts.end()] = Field(alias="from")
    to: Annotated[str, texts.end()]
    position: Annotated[Vector, rules.vector("m")] = (0.0, 0.0, 0.0)
    length: Annotated[float | None, rules.number("m", above=0)] = None
    normal: Annotated[Vector | None, rules.direction()] = None
    offset: Annotated[float | None, rules.number("m")] = None
    curve: Annotated[
        tuple[Expression, Expression, Expression] | None,
        texts.expressions("three expressions of s", 3),
    ] = None
    start: Annotated[float | None, rules.number("of s")] = None
    radius: Annotated[float | None, rules.number("m", above=0)] = None
    axis: Annotated[Vector | None, rules.direction()] = None

    @model_validator(mode="after")
    def _check(self) -> Constraint:
        bodies = (split(self.from_)[0], split(self.to)[0])
        if bodies[0] == bodies[1]:
            raise refuse(f'both ends are on "{bodies[0]}"; join two bodies', "to")
        if GROUND not in bodies and self.position != (0.0, 0.0, 0.0):
            raise refuse(
                "only a constraint on the ground takes a position; give the body an end there",
                "position",
            )
        needed, more = _KEYS[self.type]
        for key in _OWN_KEYS:
            if getattr(self, key) is not None and key not in (*needed, *more):
                raise refuse(f'a "{self.type}" has no {key}; leave it out', key)
        for key in needed:
            if getattr(self, key) is None:
                raise refuse(f"missing; expected {_EXPECTED[key].format(self.from_)}", key)
        if self.type == ROLLING and bodies[1] == GROUND:
            raise refuse("the ground does not roll; swap from and to", "to")
        return self

    @property
    def unit_normal(self) -> Vector | None:
        """The normal with length 1, in the axes of the end `from`."""
        return None if self.normal is None else _unit(self.normal)

    @property
    def unit_axis(self) -> Vector:
        """The axis of a disc with length 1, in the axes of the end `to`; 0 of a ball."""
        return (0.0, 0.0, 0.0) if self.axis is None else _unit(self.axis)

    @property
    def rows(self) -> int:
        """How many rows it has."""
        return {CURVE: 2, ROLLING: 3}.get(self.type, 1)


_OWN_KEYS = tuple(dict.fromkeys(key for pair in _KEYS.values() for keys in pair for key in keys))


def _unit(vector: Vector) -> Vector:
    x, y, z = unit(vector)
    return (x, y, z)


class Coupling(Table):
    """One row between coordinates of hinges: gears, racks, screws, differentials.

    `expression` of the coordinates has the value `equals`, or keeps that of the start where
    `equals` is left out; `speeds`, linear in speeds of hinges, has the value `equals`, or 0.
    `equals` is a number or an expression of t.
    """

    name: Annotated[str, texts.name("the coupling's name")] = ""
    expression: Annotated[
        Expression | None,
        texts.formula('an expression of coordinates such as "sun.q - 3*carrier.q"'),
    ] = None
    speeds: Annotated[
        Expression | None,
        texts.formula('an expression of speeds such as "0.3*wheel.u - cart.u"'),
    ] = None
    equals: Annotated[Expression | None, texts.one_expression("a number or an expression of t")] = (
        None
    )

    @model_validator(mode="after")
    def _check(self) -> Coupling:
        if self.expression is None and self.speeds is None:
            raise refuse("missing; give an expression of coordinates, or speeds", "expression")
        if self.expression is not None and self.speeds is not None:
            raise refuse("a coupling has one row: expression or speeds; write two", "speeds")
        return self

    @property
    def key(self) -> str:
        """The key that has its row: "expression" of coordinates or "speeds"."""
        return "speeds" if self.expression is None else "expression"

    @property
    def row(self) -> Expression:
        """The expression that is kept, of coordinates or of speeds."""
        row: Expression = getattr(self, self.key)
        return row

    @property
    def goes_by_time(self) -> bool:
        """Whether it moves what it couples, as a drive does."""
        by = self.equals
        return by is not None and not by.is_zero if self.speeds else bool(by and by.names)

    @property
    def names(self) -> tuple[Name, ...]:
        """What it couples."""
        return self.row.names
