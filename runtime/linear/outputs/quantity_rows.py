"""Linearised quantities: hinge coordinates and rates, motion of ends, springs, scene inputs.

Each is a sum of rows times powers of s.  By duality the displacement of a point along n for a unit
of each coordinate equals the generalised efforts of a unit force along n at the point.  Likewise
rotations of bodies follow from unit moments, and elongations of springs from unit spring efforts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.expression.expression import Name
from mstmm.scene.tables.law import SpringLaw
from mstmm.scene.validators.validation_messages import did_you_mean

from ...engine.looped_engine import Probe
from ...engine.quantity_registry import (
    BODY_QUANTITIES,
    POINT_COLUMNS,
    BodyReferences,
    acceleration_name,
    rate_unit,
)
from ...packing.coordinate_layout import HingeSlots
from ...result.sources.springs import SPRING_QUANTITIES, length_and_rate
from ..input_channels import Channel
from .output_rows import LinearQuantity, Part, formula, scale_parts

if TYPE_CHECKING:
    from ..linear_equations import LinearEquations

#: Quantities of ends: dual load, and power of s by which they follow from the position.
_KINDS = {
    "position": ("force", 0), "velocity": ("force", 1), "acceleration": ("force", 2),
    "angular_velocity": ("moment", 1), "angular_acceleration": ("moment", 2),
}  # fmt: skip


class QuantityLookup:
    """Lookup of quantities of one linear model by name."""

    def __init__(self, linear: LinearEquations) -> None:
        self._linear, self._state = linear, linear.state
        self._model, self._layout = linear.model, linear.model.coordinate_layout
        self._ends = BodyReferences(linear.model.scene.skeleton)
        self._springs = {spring.name: k for k, spring in enumerate(linear.model.scene.spring)}

    def read(self, name: Name) -> LinearQuantity:
        """Quantity of a name in an expression; the time t is constant."""
        if name.text == "t":
            return LinearQuantity("t", "s", (), lambda: self._state.t)
        return self.get(name.text)

    def get(self, name: str) -> LinearQuantity:
        """Quantity of a name.

        Raises SceneError with the closest known name if linear models have no such quantity.
        """
        quantity = self.find(name)
        if quantity is None:
            coordinates = self._linear.coordinate_names or ("shoulder.angle",)
            outputs = (output.name for output in self._model.scene.output)
            raise SceneError(
                f'"{name}": expected a coordinate such as "{coordinates[0]}", its rate, a motion '
                'of a body or end such as "boom.tip.position.x" or "boom.tip.vx", a quantity '
                "of a spring, or an output of the scene"
                f"{did_you_mean(name, (*outputs, *self.known_names()))}"
            )
        return quantity

    def find(self, name: str) -> LinearQuantity | None:
        """Quantity of a name; None if linear models have no such quantity.

        Raises SceneError for quantities that are not available about a moving state.
        """
        owner, _, last = name.rpartition(".")
        if name in self._model.scene.channels:
            return self._input(name)
        if owner in self._layout.hinges:
            quantity = self._hinge_quantity(self._layout.hinges[owner], last)
            if quantity is not None:
                return quantity
        if owner in self._springs and last in SPRING_QUANTITIES:
            return self._spring_quantity(self._springs[owner], last)
        return self._end_quantity(name, owner, last)

    def known_names(self) -> Iterator[str]:
        """Known names, coordinates first."""
        yield from self._linear.coordinate_names
        yield from self._model.scene.channels
        yield from (f"{spring}.{kind}" for spring in self._springs for kind in SPRING_QUANTITIES)
        for slots in self._layout.hinges.values():
            yield from (f"{slots.name}.{name}" for name in slots.u_names)
            yield from (f"{slots.name}.{acceleration_name(name)}" for name in slots.u_names)
        for end in self._ends:
            for kind in _KINDS:
                yield from (f"{end}.{kind}.{axis}" for axis in BODY_QUANTITIES[kind].labels)

    # --- inputs -----------------------------------------------------------------------------------

    def _input(self, name: str) -> LinearQuantity:
        scene, t = self._model.scene, self._state.t
        inputs = {scene_input.name: scene_input.unit for scene_input in scene.input}
        unit = (inputs | {signal.name: signal.unit for signal in scene.signal})[name]
        through = ((name, 1.0),) if name in inputs else ()
        return LinearQuantity(name, unit, (), lambda: scene.channels[name].value(t), through)

    # --- hinges -----------------------------------------------------------------------------------

    def _hinge_quantity(self, slots: HingeSlots, last: str) -> LinearQuantity | None:
        """Coordinate, rate or acceleration of a hinge, by name or index; None if unknown."""
        state = self._state
        for k, speed in enumerate(slots.u_names):
            row, speed_index = ((slots.u + k, 1.0),), slots.u + k
            if last == f"{speed}_increment" and not slots.rates_are_speeds:
                unit = slots.u_units[k].removesuffix("/s")
                return LinearQuantity(f"{slots.name}.{last}", unit, (Part(0, row),), lambda: 0.0)
            if last in _aliases(speed, "u", k, slots.nu):
                unit, parts = slots.u_units[k], (Part(1, row),)
                return LinearQuantity(
                    f"{slots.name}.{speed}", unit, parts, _entry(state.u, speed_index)
                )
            rate = acceleration_name(speed)
            if last in _aliases(rate, "udot", k, slots.nu):
                unit, parts = rate_unit(slots.u_units[k]), (Part(2, row),)
                return LinearQuantity(
                    f"{slots.name}.{rate}", unit, parts, _entry(state.udot, speed_index)
                )
        for k, (name, unit) in enumerate(zip(slots.q_names, slots.q_units, strict=True)):
            if last in _aliases(name, "q", k, slots.nq):
                parts = (Part(0, self._follows(slots, k)),)
                return LinearQuantity(
                    f"{slots.name}.{name}", unit, parts, _entry(state.q, slots.q + k)
                )
        return None

    def _follows(self, slots: HingeSlots, k: int) -> tuple[tuple[int, float], ...]:
        """Row (index, value) of coordinate k of a hinge along its speeds."""
        if slots.rates_are_speeds:
            return ((slots.u + k, 1.0),)
        engine, state = self._model.looped, self._state
        following = []
        for speed_index in range(slots.u, slots.u + slots.nu):
            unit = np.eye(1, engine.nu, speed_index)[0]
            rates = engine.rates(state.t, state.q, unit, engine.start_memory())
            following.append((speed_index, float(rates[slots.q + k])))
        return tuple(following)

    # --- ends -------------------------------------------------------------------------------------

    def _end_quantity(self, name: str, owner: str, last: str) -> LinearQuantity | None:
        """Component of the motion of a body or end in inertial axes; None if unknown."""
        for kind, (push, order) in _KINDS.items():
            about, end = BODY_QUANTITIES[kind], owner.removesuffix(f".{kind}")
            for axis, short in enumerate(about.short):
                long = end != owner and last == about.labels[axis]
                if (long or (end == owner and last == short)) and end in self._ends:
                    self._check_at_rest(name, order)
                    end = self._ends.canonical(end) or end
                    part = Part(order, channel=Channel("", "", end=end, kind=push, axis=axis))
                    full = f"{end}.{kind}.{about.labels[axis]}"
                    return LinearQuantity(full, about.unit, (part,), self._number(end, kind, axis))
        return None

    def _number(self, end: str, kind: str, axis: int) -> Callable[[], float]:
        column = POINT_COLUMNS[kind].start + axis
        return lambda: float(self._points([self._model.packed_scene.end(end)])[0, column])

    def _points(self, ends: Sequence[tuple[int, tuple[float, ...], tuple[float, ...]]]) -> Array:
        """Motion (ends, 24) at the operating point; columns of `Observation.points`."""
        engine, state = self._model.looped, self._state
        observations = engine.observe(
            np.array([state.t]), state.q[None], state.u[None], engine.start_memory()[None],
            [Probe(*end) for end in ends], parts=("points",),
        )  # fmt: skip
        return observations.points[0]

    def _check_at_rest(self, name: str, order: int) -> None:
        if order and self._state.u.any():
            raise SceneError(
                f'"{name}": at a moving state velocities of ends depend on the configuration; use '
                "coordinates, their rates or positions"
            )

    # --- springs ----------------------------------------------------------------------------------

    def _spring_quantity(self, number: int, kind: str) -> LinearQuantity:
        spring = self._model.scene.spring[number]
        name = f"{spring.name}.{kind}"
        if kind != "length":
            self._check_at_rest(name, 1)
        push = Channel("", "", spring=number)
        if kind != "effort":
            order = 0 if kind == "length" else 1
            parts = (Part(order, channel=push),)
            return LinearQuantity(
                name, SPRING_QUANTITIES[kind].unit, parts, lambda: self._motion(number)[order]
            )
        if spring.type != "spring":
            raise SceneError(
                f'"{name}": the law of force element type "{spring.type}" has no derivatives '
                f"here; use {spring.name}.length"
            )
        return self._effort(name, spring.law, number)

    def _motion(self, number: int) -> tuple[float, float]:
        """Length of a spring, m, and its rate, m/s."""
        near, far = self._points(self._model.packed_scene.system.forces[number].ends)
        length, rate = length_and_rate((far - near)[None, :6])
        return float(length[0]), float(rate[0])

    def _effort(self, name: str, law: SpringLaw, number: int) -> LinearQuantity:
        """Effort of a spring: stiffness, damping and its effort expression."""
        length, rate = (self._spring_quantity(number, kind) for kind in ("length", "length_rate"))

        def read(expression_name: Name) -> LinearQuantity:
            if not expression_name.hinge and expression_name.quantity in ("q", "u"):
                return length if expression_name.quantity == "q" else rate
            return self.read(expression_name)

        given = formula(law.effort, name, SPRING_QUANTITIES["effort"].unit, read)
        springs, damps = (
            scale_parts(quantity.parts, -x)
            for quantity, x in ((length, law.stiffness), (rate, law.damping))
        )

        def value() -> float:
            x, v = self._motion(number)
            return given.value() - law.stiffness * (x - law.rest) - law.damping * v

        return replace(given, parts=(*given.parts, *springs, *damps), value=value)


def _aliases(name: str, short: str, k: int, count: int) -> tuple[str, ...]:
    """Names of a hinge entry in results: angle, q[0], and q for a single entry."""
    return (name, f"{short}[{k}]", short) if count == 1 else (name, f"{short}[{k}]")


def _entry(values: Array, index: int) -> Callable[[], float]:
    return lambda: float(values[index])
