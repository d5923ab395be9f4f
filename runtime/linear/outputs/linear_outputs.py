"""Outputs of linear models: quantities of results, and outputs of the scene.

An output of the scene may be an expression of quantities.  It follows by the chain rule: the
derivatives of its expression at the operating point, times the rows of the quantities.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.scene import Output

from ...result.scene_outputs import single_quantity_name
from ..input_channels import columns, require_names
from .output_rows import LinearQuantity, formula
from .quantity_rows import QuantityLookup

if TYPE_CHECKING:
    from ..input_channels import Channel
    from ..linear_equations import LinearEquations

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
