"""Loads over a run: force and moment in inertial axes, and the power that they bring."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import Array

from ...engine.shown import COLUMNS, XYZ, Kind
from ..names import Table
from .acting import Acting

if TYPE_CHECKING:
    from mstmm.scene import Load

#: Quantities of a load.  One per length is told by what it adds up to.
LOAD = {
    "force": Kind("N", "force", XYZ, ("fx", "fy", "fz")),
    "moment": Kind("N*m", "moment", XYZ, ("mx", "my", "mz")),
}


def add_load(table: Table, acting: Acting, load: Load, number: int) -> None:
    """Its quantities under their names: wind.force, wind.moment where it has one, wind.power."""
    numbers, owner = acting.system.loads[number], f"load {load.name}"

    def force() -> Array:
        return turned(acting, number, numbers.force)

    def moment() -> Array:
        return turned(acting, number, numbers.moment)

    def power() -> Array:
        points = acting.load(number)[0]
        along = np.einsum("ni,ni->n", force(), points[:, COLUMNS["velocity"]])
        about = np.einsum("ni,ni->n", moment(), points[:, COLUMNS["angular_velocity"]])
        return np.asarray(along + about)

    table.vector(f"{load.name}.force", owner, LOAD["force"], force, base=load.name)
    if any(place >= 0 for place in numbers.moment):
        table.vector(f"{load.name}.moment", owner, LOAD["moment"], moment, base=load.name)
    table.scalar(f"{load.name}.power", "W", "power", power, owner=owner)


def turned(acting: Acting, number: int, places: tuple[int, ...]) -> Array:
    """(n, 3): three components of a load in inertial axes."""
    axes = acting.load(number)[1][:, 15:24].reshape(-1, 3, 3)
    return np.einsum("nij,nj->ni", axes, acting.at(places))
