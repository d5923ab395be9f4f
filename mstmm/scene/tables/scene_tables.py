"""All tables of a scene; `Scene` resolves their defaults and checks them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Annotated, Any, Self

from pydantic import Field

from ...expression.expression import FUNCTIONS
from ...numerics.piecewise_polynomial import PiecewisePolynomial, constant
from ...numerics.rotations import Vector
from ..validators import constant_expressions
from ..validators import names_and_text as texts
from ..validators import scalars_and_vectors as rules
from ..validators.scalars_and_vectors import (
    NAME_DESCRIPTION,
    NAME_PATTERN,
    Location,
    Rule,
    Table,
    ValidationProblems,
    describe_value,
    require_finite,
    to_python,
    unexpected,
)
from .beam import Beam
from .body import Body, End
from .bushing import Bushing
from .chain import Bodies, Chain, Hinges
from .closures import Constraint, Coupling
from .elastic import Elastic
from .hinge import Hinge
from .inputs import Controller, Input, Output, Signal
from .loads import Event, Load, Spring, stop_events
from .names import Names
from .shape import Shape

#: Names with a meaning in expressions, or in the shape functions of beams (x, L).
RESERVED_NAMES = ("t", "q", "u", "x", "L", "pi", "deg", "free", *FUNCTIONS)


def name_problem(name: object) -> str:
    """Message about a name that users cannot define in expressions, or ""."""
    if not isinstance(name, str) or not NAME_PATTERN.fullmatch(name):
        return f"expected a name ({NAME_DESCRIPTION}), found {describe_value(name)}"
    if name in RESERVED_NAMES:
        return f'"{name}" already has a meaning in expressions; choose another name'
    return ""


def evaluate_constants(value: Any) -> dict[str, float]:
    """Evaluate a table of constants: numbers, or expressions of constants above them.

    Raises Refused.
    """
    expected = "a table of named numbers"
    if not isinstance(value, dict):
        raise unexpected(expected, value)
    constants_by_name: dict[str, float] = {}
    problems: list[tuple[Location, str]] = []
    for name, given_value in value.items():
        if problem_ := name_problem(name):
            problems.append(((str(name),), problem_))
            continue
        try:
            with constant_expressions.constants_context(constants_by_name):
                constants_by_name[name] = require_finite(
                    to_python(given_value), "a number, or an expression of constants above", name
                )
        except ValidationProblems as refused:
            problems += refused.problems
    if problems:
        raise ValidationProblems(*problems)
    return constants_by_name


def constants_rule() -> Rule:
    """Rule for the table [constants]."""
    item = {"type": ["number", "string"]}
    schema = {"type": "object", "additionalProperties": item}
    return Rule("a table of named numbers", evaluate_constants, schema)


# --- rigid equivalents of flexible bodies ---------------------------------------------------------


def rigid_body_of_beam(beam: Beam) -> Body:
    """Rigid body of an undeformed beam: mass, mass centre, inertia and ends."""
    mass = first_moment = second_moment = polar_sum = 0.0
    rotary_sums = [0.0, 0.0]
    for section in beam.sections:
        start, end = section.from_, section.to
        mass_per_length, length = section.mass_per_length or 0.0, end - start
        mass += mass_per_length * length
        first_moment += mass_per_length * length * (end + start) / 2
        second_moment += mass_per_length * length * (end * end + end * start + start * start) / 3
        polar_moment = (section.polar_inertia_per_length or 0.0) * length
        polar_sum += polar_moment
        for k in range(2):
            rotary = section.rotary_inertia
            rotary_sums[k] += polar_moment / 2 if rotary is None else rotary[k] * length
    centre = first_moment / mass
    transverse = second_moment - first_moment * centre
    moments = (polar_sum, transverse + rotary_sums[0], transverse + rotary_sums[1])
    return Body.model_construct(
        name=beam.name, type="rigid", mass=mass, center_of_mass=(centre, 0.0, 0.0),
        inertia=(*moments, 0.0, 0.0, 0.0), ends=beam.ends,
    )  # fmt: skip


def massless_body(flexible: Beam | Elastic) -> Body:
    """Massless body with the ends of a flexible body, sufficient for names and the tree."""
    ends = {
        name: End.model_construct(position=end.position or (0.0, 0.0, 0.0),
                                  orientation=end.orientation)
        for name, end in flexible.ends.items()
    }  # fmt: skip
    return Body.model_construct(name=flexible.name, type="rigid", ends=ends)


# --- scene ----------------------------------------------------------------------------------------


def _check_version(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value != 1:
        raise unexpected("1, the only version", value)
    return value


class SceneTables(Table):
    """Tables of a scene, with access to bodies and hinges by number and by name."""

    schema_version: Annotated[int, rules.Rule("1", _check_version, {"const": 1})] = 1
    gravity: Annotated[Vector, rules.vector_rule("m/s^2, such as [0, -9.81, 0]")]
    allow_unphysical_inertia: texts.Flag = False
    constants: Annotated[dict[str, float], constants_rule()] = Field(default_factory=dict)
    input: tuple[Input, ...] = ()
    signal: tuple[Signal, ...] = ()
    output: tuple[Output, ...] = ()
    controller: tuple[Controller, ...] = ()
    body: tuple[Body, ...] = ()
    hinge: tuple[Hinge, ...] = ()
    chain: tuple[Chain, ...] = ()
    beam: tuple[Beam, ...] = ()
    elastic: tuple[Elastic, ...] = ()
    load: tuple[Load, ...] = ()
    event: tuple[Event, ...] = ()
    spring: tuple[Spring, ...] = ()
    bushing: tuple[Bushing, ...] = ()
    constraint: tuple[Constraint, ...] = ()
    coupling: tuple[Coupling, ...] = ()
    shape: tuple[Shape, ...] = ()
    names: Names = Names()

    @cached_property
    def bodies(self) -> Bodies:
        """All bodies: `body`, then the members of the chains, which are created on access."""
        return Bodies(self.body, self.chain)

    @cached_property
    def hinges(self) -> Hinges:
        """All hinges: `hinge`, then the members of the chains, which are created on access."""
        return Hinges(self.hinge, self.chain)

    @cached_property
    def channels(self) -> dict[str, PiecewisePolynomial]:
        """Inputs, then signals, as piecewise polynomials of time by name."""
        signals = {signal.name: signal.pieces for signal in self.signal}
        inputs = {
            input_table.name: signals.get(input_table.value, constant(0.0))
            if isinstance(input_table.value, str)
            else constant(input_table.value, *(input_table.rates or ()))
            for input_table in self.input
        }
        return inputs | signals

    @cached_property
    def events(self) -> tuple[Event, ...]:
        """All events: `event`, then the hard stops of hinges."""
        return (*self.event, *stop_events(self.hinges))

    def event_label(self, number: int) -> str:
        """Name in messages of the event at index `number` of `events`."""
        event_kind = "event" if number < len(self.event) else "stop"
        return f'{event_kind} "{self.events[number].name}"'

    @property
    def forces(self) -> tuple[Spring | Bushing, ...]:
        """Force elements between two ends: springs, then bushings."""
        return (*self.spring, *self.bushing)

    @property
    def controllers_by_input(self) -> dict[str, str]:
        """Names of controllers by the inputs that they set."""
        return {name: element.name for element in self.controller for name in element.outputs}

    def with_inputs(self, values: Mapping[str, float | str]) -> Self:
        """Copy of the scene with other input values: numbers, or names of signals of the scene.

        Nothing is validated: the values must be permitted, and no drive may depend on the inputs.
        """
        inputs = tuple(
            one.model_copy(update={"value": values[one.name], "rates": None})
            if one.name in values else one
            for one in self.input
        )  # fmt: skip
        copy = self.model_copy(update={"input": inputs})
        for cached_name in ("channels", "_skeleton"):
            copy.__dict__.pop(cached_name, None)
        return copy

    @property
    def skeleton(self) -> SceneTables:
        """Scene with flexible bodies replaced by massless bodies with the same ends, after `body`.

        Names and the tree are checked on it.
        """
        return self._skeleton if self.beam or self.elastic else self

    @cached_property
    def _skeleton(self) -> SceneTables:
        bodies = (*self.body, *map(massless_body, self.beam), *map(massless_body, self.elastic))
        fields = {key: getattr(self, key) for key in type(self).model_fields}
        return type(self).model_construct(**{**fields, "body": bodies, "beam": (), "elastic": ()})
