"""All tables of a scene; `Scene` resolves their defaults and checks them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Annotated, Any, Self

from pydantic import Field

from ...numbers.pieces import Pieces, steady
from ...numbers.rotations import Vector
from ..rules import text as texts
from ..rules import values as rules
from ..rules.values import Table
from .beam import Beam
from .body import Body
from .bushing import Bushing
from .chain import Chain
from .closures import Constraint, Coupling
from .constants import constants as named_numbers
from .elastic import Elastic
from .hinge import Hinge
from .loads import Event, Load, Spring, stops_of
from .members import Bodies, Hinges
from .outside.controller import Controller
from .outside.inputs import Input, Output, Signal
from .outside.names import Names
from .outside.shape import Shape
from .rigid import bare


def _version(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value != 1:
        raise rules.refuse(f"expected 1, the only version, found {rules.found(value)}")
    return value


class SceneTables(Table):
    """Tables of a scene, with access to bodies and hinges by number and by name."""

    schema_version: Annotated[int, rules.Rule("1", _version, {"const": 1})] = 1
    gravity: Annotated[Vector, rules.vector("m/s^2, such as [0, -9.81, 0]")]
    allow_unphysical_inertia: Annotated[bool, texts.flag()] = False
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
    def channels(self) -> dict[str, Pieces]:
        """Inputs, then signals, as piecewise polynomials of time by name."""
        signals = {signal.name: signal.pieces for signal in self.signal}
        inputs = {
            one.name: signals.get(one.value, steady(0.0)) if isinstance(one.value, str)
            else steady(one.value, *(one.rates or ()))
            for one in self.input
        }  # fmt: skip
        return inputs | signals

    @cached_property
    def events(self) -> tuple[Event, ...]:
        """All events: `event`, then the hard stops of hinges."""
        return (*self.event, *stops_of(self.hinges))

    def happening(self, number: int) -> str:
        """Name in messages of the event at index `number` of `events`."""
        what = "event" if number < len(self.event) else "stop"
        return f'{what} "{self.events[number].name}"'

    @property
    def forces(self) -> tuple[Spring | Bushing, ...]:
        """Force elements between two ends: springs, then bushings."""
        return (*self.spring, *self.bushing)

    @property
    def controlled(self) -> dict[str, str]:
        """Names of controllers by the inputs that they set."""
        return {name: one.name for one in self.controller for name in one.outputs}

    def with_inputs(self, values: Mapping[str, float | str]) -> Self:
        """Copy of the scene with other input values: numbers, or names of signals of the scene.

        Nothing is validated: the values must be permitted, and no drive may depend on the inputs.
        """
        inputs = tuple(
            one.model_copy(update={"value": values[one.name], "rates": None})
            if one.name in values else one
            for one in self.input
        )  # fmt: skip
        found = self.model_copy(update={"input": inputs})
        for known in ("channels", "_skeleton"):
            found.__dict__.pop(known, None)
        return found

    @property
    def skeleton(self) -> SceneTables:
        """Scene with flexible bodies replaced by massless bodies with the same ends, after `body`.

        Names and the tree are checked on it.
        """
        return self._skeleton if self.beam or self.elastic else self

    @cached_property
    def _skeleton(self) -> SceneTables:
        bodies = (*self.body, *map(bare, self.beam), *map(bare, self.elastic))
        fields = {key: getattr(self, key) for key in type(self).model_fields}
        return type(self).model_construct(**{**fields, "body": bodies, "beam": (), "elastic": ()})
