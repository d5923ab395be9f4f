"""All tables of a scene; `Scene` resolves their defaults and checks them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Annotated, Any, Self

from pydantic import Field

from ...numerics.piecewise_polynomial import PiecewisePolynomial, constant
from ...numerics.rotations import Vector
from ..validators import names_and_text as texts
from ..validators import scalars_and_vectors as rules
from ..validators.scalars_and_vectors import Table
from .beam import Beam
from .body import Body
from .body_hinge_lookup import Bodies, Hinges
from .bushing import Bushing
from .chain import Chain
from .closures import Constraint, Coupling
from .constants import constants_rule as named_numbers
from .elastic import Elastic
from .external.controller import Controller
from .external.external_names import Names
from .external.geometry import Shape
from .external.inputs import Input, Output, Signal
from .hinge import Hinge
from .loads import Event, Load, Spring, stop_events
from .rigid_equivalent import massless_body


def _check_version(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value != 1:
        raise rules.problem(f"expected 1, the only version, found {rules.describe_value(value)}")
    return value


class SceneTables(Table):
    """Tables of a scene, with access to bodies and hinges by number and by name."""

    schema_version: Annotated[int, rules.Rule("1", _check_version, {"const": 1})] = 1
    gravity: Annotated[Vector, rules.vector_rule("m/s^2, such as [0, -9.81, 0]")]
    allow_unphysical_inertia: Annotated[bool, texts.flag_rule()] = False
    constants: Annotated[dict[str, float], named_numbers()] = Field(default_factory=dict)
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
        return {
            name: controller_table.name
            for controller_table in self.controller
            for name in controller_table.outputs
        }

    def with_inputs(self, values: Mapping[str, float | str]) -> Self:
        """Copy of the scene with other input values: numbers, or names of signals of the scene.

        Nothing is validated: the values must be permitted, and no drive may depend on the inputs.
        """
        inputs = tuple(
            input_table.model_copy(update={"value": values[input_table.name], "rates": None})
            if input_table.name in values else input_table
            for input_table in self.input
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
