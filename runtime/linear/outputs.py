"""Outputs of linear models: quantities of results, and outputs of the scene.

Each quantity is a sum of rows times powers of s.  By duality the displacement of a point along n
for a unit of each coordinate equals the generalised efforts of a unit force along n at the point.
Likewise rotations of bodies follow from unit moments, and elongations of springs from unit spring
efforts.  An output of the scene may be an expression of quantities.  It follows by the chain rule:
the derivatives of its expression at the operating point, times the rows of the quantities.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.expression.derivatives import expression_derivatives
from mstmm.expression.expression import Expression, Name
from mstmm.scene import Output
from mstmm.scene.tables.law import SpringLaw
from mstmm.scene.validators.validation_messages import did_you_mean

from ..engine.looped_engine import Probe, length_and_rate
from ..engine.quantity_registry import (
    BODY_COMPONENTS,
    BODY_QUANTITIES,
    ELEMENT_QUANTITIES,
    BodyReferences,
    QuantityKind,
    coordinate_columns,
)
from ..packing.coordinate_layout import HingeSlots
from ..result.quantity_names import single_quantity_name
from .input_channels import Channel, columns, require_names

if TYPE_CHECKING:
    from .input_channels import Channel
    from .linear_equations import LinearEquations


@dataclass(frozen=True)
class Part:
    """Term of a linearised quantity: `factor` times s to the power `order` times a row.

    The row is given by entries (index, value) of `speeds`, or is the effort column of `channel`.
    """

    order: int
    speeds: tuple[tuple[int, float], ...] = ()
    channel: Channel | None = None
    factor: float = 1.0


@dataclass(frozen=True)
class LinearQuantity:
    """Linearised quantity as a sum of `parts`.

    `value` returns its value at the operating point; `feedthrough` lists direct feedthrough as
    (input, factor).
    """

    name: str
    unit: str
    parts: tuple[Part, ...]
    value: Callable[[], float]
    feedthrough: tuple[tuple[str, float], ...] = ()


def formula(
    of: Expression, name: str, unit: str, read: Callable[[Name], LinearQuantity]
) -> LinearQuantity:
    """Linearised expression: its derivatives at the operating point times those of quantities.

    Raises SceneError where the expression is not differentiable there.
    """
    seen = {name: read(name) for name in of.names}
    numbers = {name: quantity.value() for name, quantity in seen.items()}
    parts, through = list[Part](), list[tuple[str, float]]()
    for variable, slope in expression_derivatives(of, numbers.__getitem__).items():
        if not math.isfinite(slope):
            raise SceneError(
                f'"{of.text}" has no finite derivative with respect to {variable.text} at this '
                f"state, {variable.text} = {numbers[variable]:.6g}"
            )
        parts += scale_parts(seen[variable].parts, slope)
        through += [(given, slope * x) for given, x in seen[variable].feedthrough]
    value = of.evaluate(numbers.__getitem__)
    return LinearQuantity(name, unit, tuple(parts), lambda: value, tuple(through))


def scale_parts(parts: Sequence[Part], factor: float) -> Iterator[Part]:
    """Parts multiplied by `factor`."""
    return (replace(part, factor=factor * part.factor) for part in parts)


#: Quantities of springs that linear models have, and the order of their rates.
_SPRING_ORDERS = {"length": 0, "length_rate": 1, "effort": 1}

#: Orders of coordinates, speeds and accelerations as rates of the increments.
_ORDERS = {"q": 0, "u": 1, "udot": 2}


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
        if owner in self._springs and last in _SPRING_ORDERS:
            return self._spring_quantity(self._springs[owner], last)
        return self._end_quantity(name, owner, last)

    def known_names(self) -> Iterator[str]:
        """Known names, coordinates first."""
        yield from self._linear.coordinate_names
        yield from self._model.scene.channels
        yield from (f"{spring}.{kind}" for spring in self._springs for kind in _SPRING_ORDERS)
        for slots in self._layout.hinges.values():
            for part in ("u", "udot"):
                columns = (x for x in coordinate_columns(slots) if x.part == part)
                yield from (f"{slots.name}.{column.kind.name}" for column in columns)
        linear_kinds = [kind for kind in BODY_QUANTITIES.values() if kind.dual]
        for end in self._ends:
            for kind in linear_kinds:
                yield from (f"{end}.{kind.name}.{axis}" for axis in kind.labels)

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
        for column in coordinate_columns(slots, efforts=False):
            if last in column.names:
                follows = column.part == "q"
                row = self._follows(slots, column.k) if follows else ((column.index, 1.0),)
                parts = (Part(_ORDERS[column.part], row),)
                value = _entry(getattr(self._state, column.part), column.index)
                name, unit = f"{slots.name}.{column.kind.name}", column.kind.unit
                return LinearQuantity(name, unit, parts, value)
            is_increment = column.part == "u" and last == f"{column.kind.name}_increment"
            if is_increment and not slots.rates_are_speeds:
                unit = column.kind.unit.removesuffix("/s")
                parts = (Part(0, ((column.index, 1.0),)),)
                return LinearQuantity(f"{slots.name}.{last}", unit, parts, lambda: 0.0)
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
        base, _, kind_name = owner.rpartition(".")
        for end, text in ((owner, last), (base, f"{kind_name}.{last}")):
            kind, axis = BODY_COMPONENTS.get(text, (None, 0))
            if kind is not None and kind.dual is not None and end in self._ends:
                load, order = kind.dual
                self._check_at_rest(name, order)
                end = self._ends.canonical(end) or end
                part = Part(order, channel=Channel("", "", end=end, kind=load, axis=axis))
                full_name = f"{end}.{kind.name}.{kind.labels[axis]}"
                value = self._component(end, kind, axis)
                return LinearQuantity(full_name, kind.unit, (part,), value)
        return None

    def _component(self, end: str, kind: QuantityKind, axis: int) -> Callable[[], float]:
        column = kind.columns.start + axis
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
        spring, order = self._model.scene.spring[number], _SPRING_ORDERS[kind]
        name = f"{spring.name}.{kind}"
        self._check_at_rest(name, order)
        if kind != "effort":
            parts = (Part(order, channel=Channel("", "", spring=number)),)
            unit = ELEMENT_QUANTITIES["spring"][kind].unit
            return LinearQuantity(name, unit, parts, lambda: self._motion(number)[order])
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

        given = formula(law.effort, name, ELEMENT_QUANTITIES["spring"]["effort"].unit, read)
        springs = scale_parts(length.parts, -law.stiffness)
        damps = scale_parts(rate.parts, -law.damping)

        def value() -> float:
            x, v = self._motion(number)
            return given.value() - law.stiffness * (x - law.rest) - law.damping * v

        return replace(given, parts=(*given.parts, *springs, *damps), value=value)


def _entry(values: Array, index: int) -> Callable[[], float]:
    return lambda: float(values[index])


_AXES = "xyz"


def outputs_of(linear: LinearEquations, names: Sequence[str] | None) -> list[LinearQuantity]:
    """Outputs by name; None: available outputs of the scene, else all coordinates.

    Names are of hinges, "shoulder.angle" or "shoulder.angle_rate"; of bodies and ends in inertial
    axes, "boom.tip.velocity.y" or short "boom.tip.vy"; of springs, "strut.length"; and of outputs
    of the scene, a vector giving each component.

    Raises SceneError for an unknown name, or one that is not available about a moving state.
    """
    shown = _Outputs(linear)
    if names is not None:
        return [
            quantity
            for name in require_names("outputs", names)
            for quantity in shown.find_by_name(name)
        ]
    of_scene = [
        quantity
        for output in linear.model.scene.output
        for quantity in shown.available_quantities(output)
    ]
    return of_scene or [shown.lookup.get(name) for name in linear.coordinate_names]


def read_by(linear: LinearEquations, names: Sequence[str] | None) -> list[str]:
    """Names of quantities that outputs and their expressions read; None: outputs of the scene."""
    scene = {output.name: output.of.names for output in linear.model.scene.output}
    names_read = list[str]()
    for name in scene if names is None else require_names("outputs", names):
        names_read += (
            [expression_name.text for expression_name in scene[name]] if name in scene else [name]
        )
    return names_read


def unavailable_outputs(linear: LinearEquations) -> list[tuple[str, str]]:
    """Outputs (name, reason) of the scene that are not available in the linear model."""
    shown, unavailable = _Outputs(linear), []
    for output in linear.model.scene.output:
        try:
            shown.scene_output_quantities(output)
        except SceneError as error:
            unavailable.append((output.name, str(error)))
    return unavailable


class _Outputs:
    """Lookup of outputs of one linear model by name."""

    def __init__(self, linear: LinearEquations) -> None:
        self.lookup, self._scene_outputs = QuantityLookup(linear), linear.model.scene.output

    def find_by_name(self, name: str) -> list[LinearQuantity]:
        """Quantities of a name.

        Raises SceneError with the closest known name if the name is unknown.
        """
        for output in self._scene_outputs:
            if name == output.name or name.rpartition(".")[0] == output.name:
                every = self.scene_output_quantities(output)
                some = every if name == output.name else [x for x in every if x.name == name]
                if some:
                    return some
        return [self.lookup.get(name)]

    def available_quantities(self, output: Output) -> list[LinearQuantity]:
        """Quantities of an output of the scene; empty if not available in linear models."""
        try:
            return self.scene_output_quantities(output)
        except SceneError:
            return []

    def scene_output_quantities(self, output: Output) -> list[LinearQuantity]:
        """Quantities of an output of the scene; the components of a vector."""
        source = single_quantity_name(output)
        try:
            if not source:
                return [formula(output.of, output.name, output.unit, self.lookup.read)]
            quantity = self.lookup.find(source)
            if quantity is not None:
                return [_rename_quantity(quantity, output, "")]
            axes = [(axis, self.lookup.find(f"{source}.{axis}")) for axis in _AXES]
            some = [
                _rename_quantity(quantity, output, f".{axis}")
                for axis, quantity in axes
                if quantity is not None
            ]
            return some or [self.lookup.get(source)]
        except SceneError as error:
            raise SceneError(f'output "{output.name}": of: {error}') from None


def _rename_quantity(quantity: LinearQuantity, output: Output, component: str) -> LinearQuantity:
    return replace(quantity, name=f"{output.name}{component}", unit=output.unit or quantity.unit)


@dataclass(frozen=True)
class Rows:
    """Output rows along all speeds, by power of s, and direct feedthrough.

    `orders` maps the power of s to rows (outputs, nu) of perturbations; `feedthrough` (outputs,
    inputs) is the direct feedthrough.
    """

    orders: dict[int, Array]
    feedthrough: Array


def rows_of(
    linear: LinearEquations, outputs: Sequence[LinearQuantity], pushes: Sequence[Channel]
) -> Rows:
    """Rows of outputs for some inputs."""
    nu, shape = linear.model.nu, (len(outputs), linear.model.nu)
    parts = [(k, part) for k, quantity in enumerate(outputs) for part in quantity.parts]
    orders = {part.order: np.zeros(shape) for _, part in parts}
    reach = [part.channel for _, part in parts if part.channel is not None]
    distinct = {reached: k for k, reached in enumerate(dict.fromkeys(reach))}
    reached = columns(linear.open_tree, linear.state, list(distinct), list(range(nu)))
    for k, part in parts:
        row = orders[part.order][k]
        if part.channel is not None:
            row += part.factor * reached[:, distinct[part.channel]]
        for index, number in part.speeds:
            row[index] += part.factor * number
    through = np.zeros((len(outputs), len(pushes)))
    column_by_input = {channel.name: j for j, channel in enumerate(pushes)}
    for k, quantity in enumerate(outputs):
        for name, slope in quantity.feedthrough:
            if name in column_by_input:
                through[k, column_by_input[name]] += slope
    if linear.constrained_motion is not None:
        drives = {speed for channel in pushes for speed, _ in channel.drive_factors} | {
            *linear.drive_indices
        }
        orders = linear.constrained_motion.rows(linear.state, orders, drives)
    orders = _with_rate_matrix(linear, orders)
    if linear.frame_transform is not None:
        orders = linear.frame_transform.rows(orders, list(linear.free_speed_indices))
    return Rows(orders, through)


def _with_rate_matrix(linear: LinearEquations, orders: dict[int, Array]) -> dict[int, Array]:
    """Rows of x from rows of speeds, where x' = G x + du: du = x' - G x, da = x'' - G x'."""
    if linear.rate_matrix is None:
        return orders
    free, rows_found = (
        list(linear.free_speed_indices),
        {order: rows.copy() for order, rows in orders.items()},
    )
    for order, rows in orders.items():
        if order:
            lower = rows_found.setdefault(order - 1, np.zeros_like(rows))
            lower[:, free] -= rows[:, free] @ linear.rate_matrix
    return rows_found
