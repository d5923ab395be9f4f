"""Loads over a run: force and moment in inertial axes, and their power."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array

from ...engine.quantity_registry import POINT_COLUMNS, XYZ, QuantityKind
from ..quantity_names import Table
from .applied_loads import AppliedLoads

if TYPE_CHECKING:
    from mstmm.scene import Load

#: Quantities of a load. A load per length is given by its resultant.
LOAD_QUANTITIES = {
    "force": QuantityKind("N", "force", XYZ, ("fx", "fy", "fz")),
    "moment": QuantityKind("N*m", "moment", XYZ, ("mx", "my", "mz")),
}


def add_load(table: Table, acting: AppliedLoads, load: Load, number: int) -> None:
    """Add the quantities of a load: wind.force, wind.moment if it has one, wind.power."""
    numbers, owner = acting.system.loads[number], f"load {load.name}"

    def force() -> Array:
        return inertial_components(acting, number, numbers.force)

    def moment() -> Array:
        return inertial_components(acting, number, numbers.moment)

    def power() -> Array:
        points = acting.load(number)[0]
        force_power = np.einsum("ni,ni->n", force(), points[:, POINT_COLUMNS["velocity"]])
        moment_power = np.einsum("ni,ni->n", moment(), points[:, POINT_COLUMNS["angular_velocity"]])
        return np.asarray(force_power + moment_power)

    table.vector(f"{load.name}.force", owner, LOAD_QUANTITIES["force"], force, base=load.name)
    if any(index >= 0 for index in numbers.moment):
        table.vector(
            f"{load.name}.moment", owner, LOAD_QUANTITIES["moment"], moment, base=load.name
        )
    table.scalar(f"{load.name}.power", "W", "power", power, owner=owner)


def inertial_components(acting: AppliedLoads, number: int, indices: tuple[int, ...]) -> Array:
    """Inertial components (n, 3) of the three values of a load at `indices`."""
    axes = acting.load(number)[1][:, 15:24].reshape(-1, 3, 3)
    return np.einsum("nij,nj->ni", axes, acting.values_at(indices))
