"""What a linear model shows: quantities of results, and outputs of the scene, which may be
expressions of them.

An output of the scene follows from its quantities by the chain rule: the slopes of its expression
at the state, times what the quantities do.
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
from ..input_channels import columns, names_of
from .output_rows import LinearQuantity, formula
from .quantity_rows import QuantityLookup

if TYPE_CHECKING:
    from ..input_channels import Channel
    from ..linear_equations import LinearEquations

_AXES = "xyz"


def outputs_of(linear: LinearEquations, names: Sequence[str] | None) -> list[LinearQuantity]:
    """The outputs of names, or (None) those of the scene that linear models have, or all
    coordinates: "shoulder.angle", "shoulder.angle_rate", of bodies and ends in inertial axes
    "boom.tip.velocity.y" or short "boom.tip.vy", of springs "strut.length", and outputs of the
    scene by their own names, of vectors each component.

    Raises SceneError for a name that is none of these, or that a moving state does not give.
    """
    shown = _Outputs(linear)
    if names is not None:
        return [one for name in names_of("outputs", names) for one in shown.named(name)]
    of_scene = [one for output in linear.model.scene.output for one in shown.given(output)]
    return of_scene or [shown.sight.get(name) for name in linear.coordinates]


def read_by(linear: LinearEquations, names: Sequence[str] | None) -> list[str]:
    """Names of quantities that outputs read, those of expressions too; None: of all the scene's."""
    scene = {output.name: output.of.names for output in linear.model.scene.output}
    found = list[str]()
    for name in scene if names is None else names_of("outputs", names):
        found += [one.text for one in scene[name]] if name in scene else [name]
    return found


def left_out(linear: LinearEquations) -> list[tuple[str, str]]:
    """Outputs of the scene that linear models do not have, and why."""
    shown, found = _Outputs(linear), []
    for output in linear.model.scene.output:
        try:
            shown.of_scene(output)
        except SceneError as error:
            found.append((output.name, str(error)))
    return found


class _Outputs:
    """Looks up outputs of one linear model."""

    def __init__(self, linear: LinearEquations) -> None:
        self.sight, self._known = QuantityLookup(linear), linear.model.scene.output

    def named(self, name: str) -> list[LinearQuantity]:
        """What a name means; SceneError with the nearest one where it means nothing."""
        for output in self._known:
            if name == output.name or name.rpartition(".")[0] == output.name:
                every = self.of_scene(output)
                some = every if name == output.name else [x for x in every if x.name == name]
                if some:
                    return some
        return [self.sight.get(name)]

    def given(self, output: Output) -> list[LinearQuantity]:
        """An output of the scene; none where linear models do not have it."""
        try:
            return self.of_scene(output)
        except SceneError:
            return []

    def of_scene(self, output: Output) -> list[LinearQuantity]:
        """An output of the scene; of a vector its components."""
        source = single_quantity_name(output)
        try:
            if not source:
                return [formula(output.of, output.name, output.unit, self.sight.read)]
            found = self.sight.find(source)
            if found is not None:
                return [_renamed(found, output, "")]
            axes = [(axis, self.sight.find(f"{source}.{axis}")) for axis in _AXES]
            some = [_renamed(one, output, f".{axis}") for axis, one in axes if one is not None]
            return some or [self.sight.get(source)]
        except SceneError as error:
            raise SceneError(f'output "{output.name}": of: {error}') from None


def _renamed(found: LinearQuantity, output: Output, component: str) -> LinearQuantity:
    return replace(found, name=f"{output.name}{component}", unit=output.unit or found.unit)


@dataclass(frozen=True)
class Rows:
    """What outputs are of increments along all speeds, times powers of s: order -> (outputs, nu);
    `through` (outputs, pushes) is what they have of pushes at once."""

    orders: dict[int, Array]
    through: Array


def rows_of(
    linear: LinearEquations, outputs: Sequence[LinearQuantity], pushes: Sequence[Channel]
) -> Rows:
    """The rows of outputs under some pushes."""
    nu, shape = linear.model.nu, (len(outputs), linear.model.nu)
    parts = [(k, part) for k, one in enumerate(outputs) for part in one.parts]
    orders = {part.order: np.zeros(shape) for _, part in parts}
    reach = [part.push for _, part in parts if part.push is not None]
    distinct = {one: k for k, one in enumerate(dict.fromkeys(reach))}
    reached = columns(linear.tree, linear.state, list(distinct), list(range(nu)))
    for k, part in parts:
        row = orders[part.order][k]
        if part.push is not None:
            row += part.factor * reached[:, distinct[part.push]]
        for place, number in part.speeds:
            row[place] += part.factor * number
    through = np.zeros((len(outputs), len(pushes)))
    places = {one.name: j for j, one in enumerate(pushes)}
    for k, one in enumerate(outputs):
        for name, slope in one.through:
            if name in places:
                through[k, places[name]] += slope
    if linear.mechanism is not None:
        drives = {speed for one in pushes for speed, _ in one.moves} | {*linear.drives}
        orders = linear.mechanism.rows(linear.state, orders, drives)
    orders = _with_turning(linear, orders)
    if linear.carrying is not None:
        orders = linear.carrying.rows(orders, list(linear.free))
    return Rows(orders, through)


def _with_turning(linear: LinearEquations, orders: dict[int, Array]) -> dict[int, Array]:
    """From speeds to x': where x' = G x + du, du = x' - G x and da = x'' - G x'."""
    if linear.turning is None:
        return orders
    free, found = list(linear.free), {order: rows.copy() for order, rows in orders.items()}
    for order, rows in orders.items():
        if order:
            lower = found.setdefault(order - 1, np.zeros_like(rows))
            lower[:, free] -= rows[:, free] @ linear.turning
    return found
