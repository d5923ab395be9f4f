"""The tables of a scene: body, hinge, load, event, spring, and the smaller tables inside them.

Every class is a frozen pydantic model with the names of the file format, refuses unknown keys, and
holds the normalised values: lists of one entry per coordinate, quaternions of unit length, parsed
expressions.  SI units and radians throughout.
"""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, model_validator

from . import scene_hinge, scene_physics
from . import scene_rules as rules
from .expression import Expression, number
from .hinge_types import HINGE_TYPES, HingeType
from .rotations import IDENTITY, Matrix, Vector, from_orientation, reject, unit
from .scene_rules import GROUND, NAME, Shorthand, found, refuse

Numbers = tuple[float, ...]
Orientation = tuple[float, ...]


class Table(BaseModel):
    """Base of all tables: frozen, unknown keys refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)


def split(reference: str) -> tuple[str, str]:
    """("rod1", "tip") of "rod1.tip"; ("rod1", "") of "rod1"."""
    body, _, at = reference.partition(".")
    return body, at


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


class Body(Table):
    """A rigid body, or a body of a user's own type with `parameters`.

    Body axes have their origin at the input end.  `inertia` is about the centre of mass as
    (xx, yy, zz, xy, xz, yz), tensor entries (Jxy = -int xy dm), kg m^2.
    """

    name: Annotated[str, rules.name("the body's name")]
    type: Annotated[str, rules.name("a body type")] = "rigid"
    mass: Annotated[float, rules.number("kg", minimum=0)] = 0.0
    center_of_mass: Annotated[Vector, rules.vector("m")] = (0.0, 0.0, 0.0)
    inertia: Annotated[
        Numbers, rules.numbers("[xx, yy, zz] or [xx, yy, zz, xy, xz, yz] in kg m^2", 3, 6)
    ] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    allow_unphysical_inertia: Annotated[bool, rules.flag()] = False
    ends: Annotated[
        dict[str, End],
        Shorthand(
            "output ends: name -> [x, y, z] in m, or a table with position and orientation",
            _as_ends,
            {"type": "object", "additionalProperties": {"type": "array"}},
        ),
    ] = Field(default_factory=dict)
    parameters: Annotated[dict[str, float], rules.parameters()] = Field(default_factory=dict)

    @property
    def inertia_matrix(self) -> Matrix:
        """The inertia tensor about the centre of mass, body axes, kg m^2."""
        xx, yy, zz, xy, xz, yz = self.inertia
        return ((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))

    def end_position(self, at: str) -> Vector:
        """Position (m) of the end `at` in body axes; "" is the body's own origin."""
        return self.ends[at].position if at else (0.0, 0.0, 0.0)

    def end_rotation(self, at: str) -> Matrix:
        """Rotation matrix of the end `at`: its axes -> body axes."""
        return self.ends[at].rotation if at else IDENTITY

    @model_validator(mode="after")
    def _settle(self) -> Body:
        if len(self.inertia) == 3:
            object.__setattr__(self, "inertia", (*self.inertia, 0.0, 0.0, 0.0))
        if self.type == "rigid" and "mass" not in self.model_fields_set:
            raise refuse("missing; expected a number in kg, 0 or more", "mass")
        if self.type == "rigid" and self.parameters:
            raise refuse(
                "a rigid body has no parameters; give the type of your own body", "parameters"
            )
        scene_physics.refuse_impossible_inertia(self.inertia_matrix)
        return self


# --- hinge ----------------------------------------------------------------------------------------


class Initial(Table):
    """Start values of a hinge: q (quaternions w, x, y, z) and u, one entry per coordinate."""

    q: Annotated[Numbers | None, rules.numbers("one number per coordinate")] = None
    u: Annotated[Numbers | None, rules.numbers("one number per speed")] = None


class Friction(Table):
    """Coulomb and Stribeck friction, regularised; efforts in N or N m, velocities m/s or rad/s.

    All zero means no friction.  `static` 0 means equal to `coulomb`.
    """

    coulomb: Annotated[float, rules.number("N or N m", minimum=0)] = 0.0
    static: Annotated[float, rules.number("N or N m", minimum=0)] = 0.0
    stribeck_velocity: Annotated[float, rules.number("m/s or rad/s", above=0)] = 0.01
    regularisation_velocity: Annotated[float, rules.number("m/s or rad/s", above=0)] = 0.001

    @property
    def acts(self) -> bool:
        """True when there is any friction."""
        return self.static > 0

    @model_validator(mode="after")
    def _settle(self) -> Friction:
        if self.static == 0:
            object.__setattr__(self, "static", self.coulomb)
        if self.static < self.coulomb:
            raise refuse(
                f"static friction {self.static:g} is below coulomb friction {self.coulomb:g}; "
                "leave it out, or make it at least as large", "static",
            )  # fmt: skip
        return self


class Limits(Table):
    """Stops of one coordinate: one-sided springs and dampers below `lower`, above `upper`."""

    lower: Annotated[float | None, rules.number("m or rad")] = None
    upper: Annotated[float | None, rules.number("m or rad")] = None
    stiffness: Annotated[float, rules.number("N/m or N m/rad", minimum=0)] = 0.0
    damping: Annotated[float, rules.number("N s/m or N m s/rad", minimum=0)] = 0.0

    @property
    def acts(self) -> bool:
        """True when there is a stop."""
        return self.lower is not None or self.upper is not None

    @model_validator(mode="after")
    def _check(self) -> Limits:
        if self.lower is not None and self.upper is not None and self.lower >= self.upper:
            raise refuse(
                f"lower ({self.lower:g}) must be below upper ({self.upper:g}); swap them", "lower"
            )
        if self.acts and self.stiffness == 0:
            raise refuse(
                "a stop needs a stiffness above 0 (N/m or N m/rad); "
                "write for example stiffness = 1e5", "stiffness",
            )  # fmt: skip
        if not self.acts and (self.stiffness > 0 or self.damping > 0):
            raise refuse("limits need lower, upper or both", "lower")
        return self


class LawEntry(NamedTuple):
    """The law of one coordinate."""

    stiffness: float
    rest: float
    damping: float
    effort: Expression
    inertia: float
    friction: Friction
    limits: Limits


def _one_or_list(value: Any) -> Any:
    return [value] if isinstance(value, (dict, BaseModel)) else value


_LIST_OF_TABLES = {"type": "array"}


class Law(Table):
    """What acts along the coordinates of a hinge: one entry per speed.

    effort > 0 pushes the outboard body along +u; `inertia` is reflected rotor inertia.  In a file
    one number may stand for all coordinates.
    """

    stiffness: Annotated[Numbers, rules.numbers("a number in N/m or N m/rad, 0 or more, or a list of "
                                          "them, one per coordinate", minimum=0)] = ()  # fmt: skip
    rest: Annotated[Numbers, rules.numbers("a number in m or rad, or a list, one per coordinate")] = ()
    damping: Annotated[Numbers, rules.numbers("a number in N s/m or N m s/rad, 0 or more, or a list of "
                                        "them, one per coordinate", minimum=0)] = ()  # fmt: skip
    effort: Annotated[
        tuple[Expression, ...],
        rules.expressions("a number or expression in N or N m, or a list, one per coordinate"),
    ] = ()
    inertia: Annotated[Numbers, rules.numbers("a number in kg or kg m^2, 0 or more, or a list of them, "
                                        "one per coordinate", minimum=0)] = ()  # fmt: skip
    friction: Annotated[
        tuple[Friction, ...],
        Shorthand("a table, or a list of tables, one per coordinate", _one_or_list,
                  _LIST_OF_TABLES),
    ] = ()  # fmt: skip
    limits: Annotated[
        tuple[Limits, ...],
        Shorthand("a table, or a list of tables, one per coordinate", _one_or_list,
                  _LIST_OF_TABLES),
    ] = ()  # fmt: skip

    def entry(self, k: int) -> LawEntry:
        """The law of coordinate k; a list with one entry is shared by all."""

        def pick(values: tuple[Any, ...], default: Any) -> Any:
            if not values:
                return default
            return values[k] if len(values) > 1 else values[0]

        return LawEntry(
            pick(self.stiffness, 0.0), pick(self.rest, 0.0), pick(self.damping, 0.0),
            pick(self.effort, number(0)), pick(self.inertia, 0.0),
            pick(self.friction, Friction()), pick(self.limits, Limits()),
        )  # fmt: skip


class Hinge(Table):
    """A hinge between an inboard end (or the ground) and an outboard body.

    `axis` and `axis2` are in the axes of the outboard end at q = 0; planar: the normal and the
    direction of x.  `drive` has one entry per coordinate, None where the coordinate is free; it is
    None for a hinge without drive.  For built-in types `initial` is filled in (None when every
    coordinate is driven) and `law` has one entry per speed.
    """

    name: Annotated[str, rules.name("the hinge's name")]
    type: Annotated[str, rules.name("a hinge type")]
    inboard: Annotated[str, rules.end()]
    outboard: Annotated[str, rules.end()]
    position: Annotated[Vector, rules.vector("m")] = (0.0, 0.0, 0.0)
    orientation: Annotated[Orientation, rules.orientation()] = (0.0, 0.0, 0.0)
    axis: Annotated[Vector, rules.direction()] = (0.0, 0.0, 1.0)
    axis2: Annotated[Vector | None, rules.direction()] = None
    normal: Annotated[Vector | None, rules.direction()] = None
    lead: Annotated[float | None, rules.number("m per turn")] = None
    initial: Initial | None = None
    law: Law = Law()
    drive: Annotated[
        tuple[Expression | None, ...] | None,
        rules.expressions('an expression of t, or a list with one per coordinate ("free" where none)',
                    free=True),
    ] = None  # fmt: skip
    release: Annotated[
        Expression | None, rules.condition('a time in s or a comparison such as "t >= 1"', time=True)
    ] = None
    parameters: Annotated[dict[str, float], rules.parameters()] = Field(default_factory=dict)

    @property
    def builtin(self) -> HingeType | None:
        """The built-in type, None for a user's type."""
        return HINGE_TYPES.get(self.type)

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

    @model_validator(mode="after")
    def _settle(self) -> Hinge:
        for key, value in scene_hinge.settled(self).items():
            object.__setattr__(self, key, value)
        return self


# --- load, event, spring --------------------------------------------------------------------------

_ZERO = (number(0), number(0), number(0))


class Load(Table):
    """A force (N) and a moment (N m) on an end of a body; three expressions each.

    `axes` is "inertial", "body" (the loaded body's own) or the name of another body.
    """

    name: Annotated[str, rules.name("the load's name")] = ""
    on: Annotated[str, rules.end(ground=False)]
    force: Annotated[
        tuple[Expression, Expression, Expression],
        rules.expressions("three numbers or expressions in N", 3),
    ] = _ZERO
    moment: Annotated[
        tuple[Expression, Expression, Expression],
        rules.expressions("three numbers or expressions in N m", 3),
    ] = _ZERO
    axes: Annotated[str, rules.name('"inertial", "body" or the name of a body')] = "inertial"


class Event(Table):
    """Something that happens when a comparison begins to hold: stop, or release a hinge."""

    name: Annotated[str, rules.name("the event's name")] = ""
    when: Annotated[Expression, rules.condition('a comparison such as "rod1.x < 0.1"')]
    do: Annotated[str, rules.choice("stop", "release")]
    hinge: Annotated[str | None, rules.name("the hinge to release")] = None

    @model_validator(mode="after")
    def _check(self) -> Event:
        if self.do == "release" and self.hinge is None:
            raise refuse('missing; do = "release" needs the name of a hinge', "hinge")
        if self.do == "stop" and self.hinge is not None:
            raise refuse('only do = "release" takes a hinge; leave it out', "hinge")
        return self


class SpringLaw(Table):
    """Law of a spring: tension = stiffness (length - rest) + damping rate - effort.

    effort > 0 pushes the two ends apart; in it `q` is the length (m), `u` its rate (m/s).
    """

    stiffness: Annotated[float, rules.number("N/m", minimum=0)] = 0.0
    rest: Annotated[float, rules.number("m", minimum=0)] = 0.0
    damping: Annotated[float, rules.number("N s/m", minimum=0)] = 0.0
    effort: Annotated[
        Expression,
        rules.one_expression("a number or expression in N"),
    ] = number(0)


class Spring(Table):
    """A spring, damper and actuator between two ends, or a force element of a user's own type.

    `position` (m) is the place of the end that is on the ground.
    """

    name: Annotated[str, rules.name("the spring's name")] = ""
    type: Annotated[str, rules.name("a force element type")] = "spring"
    from_: Annotated[str, rules.end()] = Field(alias="from")
    to: Annotated[str, rules.end()]
    position: Annotated[Vector, rules.vector("m")] = (0.0, 0.0, 0.0)
    law: SpringLaw = SpringLaw()
    parameters: Annotated[dict[str, float], rules.parameters()] = Field(default_factory=dict)

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
