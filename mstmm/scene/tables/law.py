"""Tables of a law: efforts on the coordinates of a hinge, or along a spring."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

from pydantic import BaseModel

from ...expression.expression import Expression, number
from ..validators import names_and_text as texts
from ..validators import scalars_and_vectors as rules
from ..validators.scalars_and_vectors import Numbers, Table


class Friction(Table):
    """Regularised Coulomb and Stribeck friction; efforts in N or N m, velocities m/s or rad/s.

    All zero means no friction.  `static` 0 means equal to `coulomb`.
    """

    coulomb: Annotated[float, rules.number_rule("N or N m", minimum=0)] = 0.0
    static: Annotated[float, rules.number_rule("N or N m", minimum=0)] = 0.0
    stribeck_velocity: Annotated[float, rules.number_rule("m/s or rad/s", above=0)] = 0.01
    regularisation_velocity: Annotated[float, rules.number_rule("m/s or rad/s", above=0)] = 0.001

    @property
    def acts(self) -> bool:
        """Whether there is any friction."""
        return self.static > 0

    def _check(self) -> None:
        if self.static == 0:
            vars(self)["static"] = self.coulomb
        if self.static < self.coulomb:
            raise rules.problem(
                f"static friction {self.static:g} is below coulomb friction {self.coulomb:g}; "
                "leave it out, or increase it", "static",
            )  # fmt: skip


class Limits(Table):
    """Stops of a coordinate, below `lower` and above `upper`.

    They are one-sided springs and dampers, or hard stops with a coefficient of `restitution`, the
    ratio of separation speed to approach speed.
    """

    lower: Annotated[float | None, rules.number_rule("m or rad")] = None
    upper: Annotated[float | None, rules.number_rule("m or rad")] = None
    stiffness: Annotated[float, rules.number_rule("N/m or N m/rad", minimum=0)] = 0.0
    damping: Annotated[float, rules.number_rule("N s/m or N m s/rad", minimum=0)] = 0.0
    restitution: Annotated[float | None, rules.number_rule(above=0.0)] = None

    @property
    def acts(self) -> bool:
        """Whether there is a stop."""
        return self.lower is not None or self.upper is not None

    @property
    def is_compliant(self) -> bool:
        """Whether there is a stop with a spring and a damper."""
        return self.acts and self.restitution is None

    def _check(self) -> None:
        check_range(self)
        if not self.acts and (self.stiffness > 0 or self.damping > 0 or self.restitution):
            raise rules.problem("limits need lower, upper or both", "lower")
        if self.restitution is not None and self.restitution > 1:
            raise rules.unexpected("at most 1 (no loss)", self.restitution, "restitution")
        if self.restitution is not None and (self.stiffness > 0 or self.damping > 0):
            raise rules.problem(
                "expected restitution or stiffness for a stop, found both; give one", "restitution"
            )
        if self.is_compliant and self.stiffness == 0:
            raise rules.problem(
                "a stop needs a stiffness above 0 (N/m or N m/rad) or a restitution; "
                "write for example stiffness = 1e5", "stiffness",
            )  # fmt: skip


def check_range(table: Any) -> None:
    """Reject a key `lower` that is not below `upper`.  Raises ValidationProblems."""
    lower, upper = table.lower, table.upper
    if lower is not None and upper is not None and lower >= upper:
        hint = "; swap them" if lower > upper else ""
        raise rules.problem(f"lower ({lower:g}) must be below upper ({upper:g}){hint}", "lower")


class LawEntry(NamedTuple):
    """Law of one coordinate."""

    stiffness: float
    rest: float
    damping: float
    effort: Expression
    inertia: float
    friction: Friction
    limits: Limits


def _widen_to_list(value: Any) -> Any:
    return [value] if isinstance(value, (dict, BaseModel)) else value


def _per_coordinate_rule(one: str, minimum: float | None = None) -> rules.Rule:
    bound = "" if minimum is None else f", {minimum:g} or more"
    expected = f"{one}{bound}, or a list, one per coordinate"
    return rules.numbers_rule(expected, minimum=minimum, of=one.removeprefix("a number in "))


_TABLES_RULE = rules.Shorthand(
    "a table, or a list of tables, one per coordinate", _widen_to_list, {"type": "object"}
)


_NO_EFFORT, _NO_FRICTION, _NO_LIMITS = number(0), Friction(), Limits()


class Law(Table):
    """Law of a hinge: one entry per speed.

    effort > 0 pushes the outboard body along +u; `inertia` is reflected rotor inertia.  In a file
    one number may be given for all coordinates.
    """

    stiffness: Annotated[
        Numbers, _per_coordinate_rule("a number in N/m or N m/rad", minimum=0)
    ] = ()
    rest: Annotated[Numbers, _per_coordinate_rule("a number in m or rad")] = ()
    damping: Annotated[
        Numbers, _per_coordinate_rule("a number in N s/m or N m s/rad", minimum=0)
    ] = ()
    effort: Annotated[
        tuple[Expression, ...],
        texts.expressions_rule("a number or expression in N or N m, or a list, one per coordinate"),
    ] = ()
    inertia: Annotated[Numbers, _per_coordinate_rule("a number in kg or kg m^2", minimum=0)] = ()
    friction: Annotated[tuple[Friction, ...], _TABLES_RULE] = ()
    limits: Annotated[tuple[Limits, ...], _TABLES_RULE] = ()

    def entries(self) -> tuple[LawEntry, ...]:
        """Laws of all coordinates; at least one, which has no effect if nothing is given."""
        count = max(1, *(len(getattr(self, key)) for key in type(self).model_fields))
        return tuple(self.entry(k) for k in range(count))

    def entry(self, k: int) -> LawEntry:
        """Law of coordinate k; a list with one entry applies to all, an empty one has no effect."""

        def pick(values: tuple[Any, ...], default: Any) -> Any:
            if not values:
                return default
            return values[k] if len(values) > 1 else values[0]

        return LawEntry(
            pick(self.stiffness, 0.0), pick(self.rest, 0.0), pick(self.damping, 0.0),
            pick(self.effort, _NO_EFFORT), pick(self.inertia, 0.0),
            pick(self.friction, _NO_FRICTION), pick(self.limits, _NO_LIMITS),
        )  # fmt: skip


class SpringLaw(Table):
    """Law of a spring: tension = stiffness (length - rest) + damping rate - effort.

    effort > 0 pushes the two ends apart; in it `q` is the length (m), `u` its rate (m/s).
    """

    stiffness: Annotated[float, rules.number_rule("N/m", minimum=0)] = 0.0
    rest: Annotated[float, rules.number_rule("m", minimum=0)] = 0.0
    damping: Annotated[float, rules.number_rule("N s/m", minimum=0)] = 0.0
    effort: Annotated[Expression, texts.expression_rule("a number or expression in N")] = number(0)
