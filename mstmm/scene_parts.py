"""The tables of a scene: body, hinge, load, event, spring, and the smaller tables inside them.

Every class is a frozen pydantic model with the names of the file format, refuses unknown keys, and
holds the normalised values: lists of one entry per coordinate, quaternions of unit length, parsed
expressions.  SI units and radians throughout.
"""

from __future__ import annotations

from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from . import scene_hinge, scene_physics
from . import scene_rules as rules
from . import scene_rules_text as texts
from .expression import Expression, number
from .hinge_types import HINGE_TYPES, HingeType
from .rotations import IDENTITY, Matrix, Vector, from_orientation, reject, unit
from .scene_law import Law, SpringLaw
from .scene_rules import GROUND, NAME, Location, Refused, Shorthand, Table, found, refuse, split

Numbers = tuple[float, ...]
Orientation = tuple[float, ...]


# --- body -----------------------------------------------------------------------------------------


class End(Table):
    """An output end of a body: where it is (m) and how its axes lie, in body axes."""

    position: Annotated[Vector, rules.vector("m")]
    orientation: Annotated[Orientation, rules.orientation()] = (0.0, 0.0, 0.0)

    @property
    def rotation(self) -> Matrix:
        """Rotation matrix: axes of the end -> body axes."""
        return from_orientation(self.orientation)


def _as_end(value: Any) -> Any:
    return {"position": value} if isinstance(value, (list, tuple)) else value


def _as_ends(value: Any) -> Any:
    if not isinstance(value, dict):
        raise refuse(f"expected a table such as {{ tip = [1, 0, 0] }}, found {found(value)}")
    for key in value:
        if not isinstance(key, str) or not NAME.fullmatch(key):
            raise refuse(f"expected the name of an end, found {found(key)}")
    return {key: _as_end(v) for key, v in value.items()}


class BodyTable(Table):
    """What a body is, without its name: a rigid body, or one of a user's own type with
    `parameters`.

    Body axes have their origin at the input end.  `inertia` is about the centre of mass as
    (xx, yy, zz, xy, xz, yz), tensor entries (Jxy = -int xy dm), kg m^2.
    """

    type: Annotated[str, texts.name("a body type")] = "rigid"
    mass: Annotated[float, rules.number("kg", minimum=0)] = 0.0
    center_of_mass: Annotated[Vector, rules.vector("m")] = (0.0, 0.0, 0.0)
    inertia: Annotated[
        Numbers,
        rules.numbers("[xx, yy, zz] or [xx, yy, zz, xy, xz, yz] in kg m^2", 3, 6, of="kg m^2"),
    ] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    allow_unphysical_inertia: Annotated[bool, texts.flag()] = False
    ends: Annotated[
        dict[str, End],
        Shorthand(
            "output ends: name -> [x, y, z] in m, or a table with position and orientation",
            _as_ends,
            {"type": "object", "additionalProperties": {"type": "array"}},
        ),
    ] = Field(default_factory=dict)
    parameters: Annotated[dict[str, float], texts.parameters()] = Field(default_factory=dict)

    @property
    def inertia_matrix(self) -> Matrix:
        """The inertia tensor about the centre of mass, body axes, kg m^2, without moments that
        are negative by rounding."""
        xx, yy, zz, xy, xz, yz = self.inertia
        return scene_physics.without_dust(((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)), self.mass)

    def end_position(self, at: str) -> Vector:
        """Position (m) of the end `at` in body axes; "" is the body's own origin."""
        return self.ends[at].position if at else (0.0, 0.0, 0.0)

    def end_rotation(self, at: str) -> Matrix:
        """Rotation matrix of the end `at`: its axes -> body axes."""
        return self.ends[at].rotation if at else IDENTITY

    @model_validator(mode="after")
    def _settle(self) -> Self:
        if len(self.inertia) == 3:
            object.__setattr__(self, "inertia", (*self.inertia, 0.0, 0.0, 0.0))
        problems: list[tuple[Location, str]] = []
        if self.type == "rigid" and "mass" not in self.model_fields_set:
            problems.append((("mass",), "missing; expected a number in kg, 0 or more"))
        if self.type == "rigid" and self.parameters:
            way_out = "give the type of your own body"
            problems.append((("parameters",), f"a rigid body has no parameters; {way_out}"))
        if problems:
            raise Refused(*problems)
        return self


class Body(BodyTable):
    """A body of the scene."""

    name: Annotated[str, texts.name("the body's name")]


# --- hinge ----------------------------------------------------------------------------------------


class Initial(Table):
    """Start values of a hinge: q (quaternions w, x, y, z) and u, one entry per coordinate."""

    q: Annotated[Numbers | None, rules.numbers("one number per coordinate")] = None
    u: Annotated[Numbers | None, rules.numbers("one number per speed")] = None


class HingeTable(Table):
    """What a hinge is, without its name and what it joins.

    `axis` and `axis2` are in the axes of the outboard end at q = 0; planar: the normal and the
    direction of x.  `drive` has one entry per coordinate, None where the coordinate is free; it is
    None for a hinge without drive.  For built-in types `initial` is filled in (None when every
    coordinate is driven) and `law` has one entry per speed.
    """

    type: Annotated[str, texts.name("a hinge type", ", ".join(HINGE_TYPES) + " or your own")]
    orientation: Annotated[Orientation, rules.orientation()] = (0.0, 0.0, 0.0)
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
    def builtin(self) -> HingeType | None:
        """The built-in type, None for a user's type."""
        return HINGE_TYPES.get(self.type)

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
        if self.type == "planar":
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

    @model_validator(mode="after")
    def _settle(self) -> Self:
        for key, value in scene_hinge.settled(self).items():
            object.__setattr__(self, key, value)
        return self


class Hinge(HingeTable):
    """A hinge between an inboard end (or the ground) and an outboard body."""

    name: Annotated[str, texts.name("the hinge's name")]
    inboard: Annotated[str, texts.end()]
    outboard: Annotated[str, texts.end()]
    position: Annotated[Vector, rules.vector("m")] = (0.0, 0.0, 0.0)
    release: Annotated[
        Expression | None,
        texts.condition('a time in s or a comparison such as "t >= 1"', time=True),
    ] = None

    @property
    def inboard_body(self) -> str:
        """Name of the inboard body, or "ground"."""
        return split(self.inboard)[0]

    @property
    def inboard_end(self) -> str:
        """End of the inboard body, "" for its origin or the ground."""
        return split(self.inboard)[1]

    @property
    def outboard_body(self) -> str:
        return split(self.outboard)[0]

    @property
    def outboard_end(self) -> str:
        """End by which the outboard body is held, "" for its origin."""
        return split(self.outboard)[1]

    def misplaced(self) -> list[tuple[Location, str]]:
        """Ends that cannot be joined."""
        return scene_hinge.misplaced(self)

    @property
    def lets_go(self) -> bool:
        """True when it is released by itself."""
        return self.release is not None


# --- load, event, spring --------------------------------------------------------------------------

_ZERO = (number(0), number(0), number(0))


class Load(Table):
    """A force (N) and a moment (N m) on an end of a body; three expressions each.

    On a beam alternatively `force_per_length` (N/m), the same everywhere on `span`, from one x to
    another in m (None: the whole length).  `axes` is "inertial", "body" (the loaded body's own; of
    a beam those of the loaded section, for `force_per_length` those of the floating frame) or the
    name of another body.
    """

    name: Annotated[str, texts.name("the load's name")] = ""
    on: Annotated[str, texts.end(ground=False)]
    force: Annotated[
        tuple[Expression, Expression, Expression],
        texts.expressions("three numbers or expressions in N", 3),
    ] = _ZERO
    moment: Annotated[
        tuple[Expression, Expression, Expression],
        texts.expressions("three numbers or expressions in N m", 3),
    ] = _ZERO
    force_per_length: Annotated[
        tuple[Expression, Expression, Expression] | None,
        texts.expressions("three numbers or expressions in N/m", 3),
    ] = None
    span: Annotated[
        tuple[float, float] | None, rules.numbers("[from, to] along the beam in m", 2, of="m")
    ] = None
    axes: Annotated[str, texts.body('"inertial", "body" or the name of a body')] = "inertial"

    @model_validator(mode="after")
    def _check(self) -> Load:
        if self.force_per_length is None:
            if self.span is not None:
                raise refuse("only force_per_length acts on a span; leave it out", "span")
            return self
        for key in ("force", "moment"):
            if not all(entry.is_zero for entry in getattr(self, key)):
                raise refuse(
                    f"{key} acts on one point, force_per_length on a beam; write two loads", key
                )
        if split(self.on)[1]:
            raise refuse(
                "expected the name of a beam alone for a load per length, found "
                f"{found(self.on)}; write {found(split(self.on)[0])}, and span for a part of it",
                "on",
            )
        if self.span is not None and not 0 <= self.span[0] < self.span[1]:
            raise refuse(
                f"expected [from, to] in m with 0 <= from < to, found {found(self.span)}", "span"
            )
        return self


class Event(Table):
    """Something that happens when a comparison begins to hold: stop, or release a hinge."""

    name: Annotated[str, texts.name("the event's name")] = ""
    when: Annotated[Expression, texts.condition('a comparison such as "rod1.x < 0.1"')]
    do: Annotated[str, texts.choice("stop", "release")]
    hinge: Annotated[str | None, texts.name("the hinge to release")] = None

    @model_validator(mode="after")
    def _check(self) -> Event:
        if self.do == "release" and self.hinge is None:
            raise refuse('missing; do = "release" needs the name of a hinge', "hinge")
        if self.do == "stop" and self.hinge is not None:
            raise refuse('only do = "release" takes a hinge; leave it out', "hinge")
        return self


class Spring(Table):
    """A spring, damper and actuator between two ends, or a force element of a user's own type.

    `position` (m) is the place of the end that is on the ground.
    """

    name: Annotated[str, texts.name("the spring's name")] = ""
    type: Annotated[str, texts.name("a force element type")] = "spring"
    from_: Annotated[str, texts.end()] = Field(alias="from")
    to: Annotated[str, texts.end()]
    position: Annotated[Vector, rules.vector("m")] = (0.0, 0.0, 0.0)
    law: SpringLaw = SpringLaw()
    parameters: Annotated[dict[str, float], texts.parameters()] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _check(self) -> Spring:
        bodies = (split(self.from_)[0], split(self.to)[0])
        if bodies[0] == bodies[1]:
            raise refuse(
                f'both ends are on "{bodies[0]}", so it does nothing; join two bodies', "to"
            )
        if GROUND not in bodies and self.position != (0.0, 0.0, 0.0):
            raise refuse(
                "only a spring on the ground takes a position; give the body an end there",
                "position",
            )
        if self.type == "spring" and self.parameters:
            raise refuse("a spring has no parameters; give the type of your own element",
                         "parameters")  # fmt: skip
        if self.type != "spring" and self.law != SpringLaw():
            raise refuse('law belongs to type "spring"; use parameters', "law")
        return self
