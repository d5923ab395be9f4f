"""Tables [[load]], [[event]] and [[spring]], and the events of hard stops of hinges."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

from pydantic import Field

from ...expression.expression import Expression, number, parse
from ..validators import names_and_text as texts
from ..validators import scalars_and_vectors as rules
from ..validators.names_and_text import check_two_ends
from ..validators.scalars_and_vectors import (
    Position,
    Table,
    describe_value,
    problem,
    split_reference,
    unexpected,
)
from .chain import Hinges
from .hinge import Hinge
from .law import SpringLaw

#: The only value of `at` of a load.
MASS_CENTER = "center_of_mass"
_ZERO_VECTOR = (number(0), number(0), number(0))


class Load(Table):
    """Force (N) and moment (N m) on an end of a body; three expressions each.

    With `at` = "center_of_mass" the force acts at the mass centre of the rigid body named in `on`.

    A beam can have a `force_per_length` (N/m) instead, constant over `span`, from one x to another
    in m (None: the whole length).  `axes` is "inertial", "body" or the name of another body.  The
    "body" axes of a beam are those of the loaded section, or of the floating frame for
    `force_per_length`.
    """

    name: Annotated[str, texts.name_rule("the load's name")] = ""
    on: Annotated[str, texts.end_rule(ground=False)]
    at: Annotated[str | None, texts.choice_rule(MASS_CENTER)] = None
    force: Annotated[
        tuple[Expression, Expression, Expression],
        texts.expressions_rule("three numbers or expressions in N", 3),
    ] = _ZERO_VECTOR
    moment: Annotated[
        tuple[Expression, Expression, Expression],
        texts.expressions_rule("three numbers or expressions in N m", 3),
    ] = _ZERO_VECTOR
    force_per_length: Annotated[
        tuple[Expression, Expression, Expression] | None,
        texts.expressions_rule("three numbers or expressions in N/m", 3),
    ] = None
    span: Annotated[
        tuple[float, float] | None, rules.numbers_rule("[from, to] along the beam in m", 2, of="m")
    ] = None
    axes: Annotated[str, texts.body_rule('"inertial", "body" or the name of a body')] = "inertial"

    def _check(self) -> None:
        if self.at is not None:
            self._check_mass_center()
        if self.force_per_length is None:
            if self.span is not None:
                raise problem("only force_per_length acts on a span; leave it out", "span")
            return
        for key in ("force", "moment"):
            if not all(entry.is_zero for entry in getattr(self, key)):
                raise problem(
                    f"{key} acts at a point, force_per_length along a beam; write two loads", key
                )
        if split_reference(self.on)[1]:
            raise problem(
                "expected the name of a beam without an end for force_per_length, found "
                f"{describe_value(self.on)}; write {describe_value(split_reference(self.on)[0])}, "
                f"and span for a part of it",
                "on",
            )
        if self.span is not None and not 0 <= self.span[0] < self.span[1]:
            raise unexpected("[from, to] in m with 0 <= from < to", self.span, "span")

    def _check_mass_center(self) -> None:
        """Reject a load at the mass centre with an end or a force per length.  Raises Refused."""
        body, end = split_reference(self.on)
        if end:
            raise problem(
                f'"{MASS_CENTER}" needs a body without an end, found on = '
                f"{describe_value(self.on)}; write on = {describe_value(body)}, or leave `at` out",
                "at",
            )
        if self.force_per_length is not None:
            raise problem("force_per_length acts along a beam; leave `at` out", "at")


class Event(Table):
    """Event at which a comparison becomes true: stop, release of a hinge, or bounce.

    A bounce reverses the rate of the difference in `when`, multiplied by `restitution` (above 0, at
    most 1).  Closed loops remain closed.
    """

    name: Annotated[str, texts.name_rule("the event's name")] = ""
    when: Annotated[Expression, texts.condition_rule('a comparison such as "rod1.x < 0.1"')]
    do: Annotated[str, texts.choice_rule("stop", "release", "bounce")]
    hinge: Annotated[str | None, texts.name_rule("the hinge to release")] = None
    restitution: Annotated[float | None, rules.number_rule(above=0.0)] = None

    def _check(self) -> None:
        if (self.do == "bounce") != (self.restitution is not None):
            raise problem(
                'missing; do = "bounce" needs a number above 0, at most 1' if self.do == "bounce"
                else 'only do = "bounce" has a restitution; leave it out', "restitution",
            )  # fmt: skip
        if self.restitution is not None and self.restitution > 1:
            raise unexpected("at most 1 (no loss)", self.restitution, "restitution")
        if self.do == "release" and self.hinge is None:
            raise problem('missing; do = "release" needs the name of a hinge', "hinge")
        if self.do != "release" and self.hinge is not None:
            raise problem('only do = "release" has a hinge; leave it out', "hinge")


def stop_events(hinges: Hinges) -> tuple[Event, ...]:
    """Events of all hard stops in the order of the hinges.

    Their names are such as `knee.upper` or `planar.lower[1]`.
    """
    return tuple(
        stop
        for number in _hinges_with_hard_stops(hinges)
        for stop in _stop_events_of_hinge(hinges.name(number), hinges[number])
    )


def _hinges_with_hard_stops(hinges: Hinges) -> Iterator[int]:
    """Indices of the hinges that have hard stops."""
    for k, hinge in enumerate(hinges.tables):
        if any(limits.restitution for limits in hinge.law.limits):
            yield k
    for chain, first_number in zip(hinges.chains, hinges.starts, strict=False):
        for k, pattern in enumerate(chain.hinge):
            if any(limits.restitution for limits in pattern.law.limits):
                yield from range(first_number + k, first_number + chain.count, len(chain.hinge))


def _stop_events_of_hinge(name: str, hinge: Hinge) -> Iterator[Event]:
    count = len(hinge.law.limits) if hinge.facts is None else len(hinge.facts.speeds)
    for k in range(count):
        limits = hinge.law.entry(k).limits
        for key, comparison in (("lower", "<"), ("upper", ">")):
            limit = getattr(limits, key)
            if limits.restitution is not None and limit is not None:
                yield Event.model_construct(
                    name=f"{name}.{key}" + (f"[{k}]" if count > 1 else ""),
                    when=parse(f"{name}.q[{k}] {comparison} {limit!r}"), do="bounce", hinge=None,
                    restitution=limits.restitution,
                )  # fmt: skip


class Spring(Table):
    """Spring, damper and actuator between two ends, or a user-defined force element.

    `position` (m) is the position of an end on the ground.
    """

    name: Annotated[str, texts.name_rule("the spring's name")] = ""
    type: Annotated[str, texts.name_rule("a force element type")] = "spring"
    from_: texts.Reference = Field(alias="from")
    to: texts.Reference
    position: Position = (0.0, 0.0, 0.0)
    law: SpringLaw = SpringLaw()
    parameters: texts.Parameters = Field(default_factory=dict)

    def _check(self) -> None:
        check_two_ends(self, "a spring", ", so it has no effect")
        if self.type == "spring" and self.parameters:
            raise problem(
                "a spring has no parameters; set type to your user-defined type", "parameters"
            )
        if self.type != "spring" and self.law != SpringLaw():
            raise problem('law belongs to type "spring"; use parameters', "law")
