"""Constraints and couplings over a run: loads on the constrained bodies and speeds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mstmm.arrays import Array
from mstmm.scene.rules.values import GROUND
from mstmm.scene.tables.closures import CURVE, DISTANCE, ROLLING

from ...engine.shown import XYZ, Kind
from ...pack.layout import OF_CONSTRAINT
from ..names import Table

if TYPE_CHECKING:
    from mstmm.scene import Constraint

    from ..observed import Observed

_FORCE = Kind("N", "force on the end `to`", XYZ, ())


def add_constraint(table: Table, observed: Observed, one: Constraint) -> None:
    """Its quantities under their names: rod.force, rod.load, road.friction, wire.s."""
    name, owner = one.name, f"constraint {one.name}"

    def force() -> Array:
        return _force(observed, one)

    def load() -> Array:
        return np.asarray(np.einsum("ni,ni->n", force(), _direction(observed, one)))

    def friction() -> Array:
        along = load()[:, None] * _direction(observed, one)
        return np.asarray(np.linalg.norm(force() - along, axis=1))

    table.vector(f"{name}.force", owner, _FORCE, force)
    if one.type == CURVE:
        packed = observed.engine.packed
        place = int(packed.system.places["q"][packed.hinge_position[_frame(one)]])
        table.scalar(
            f"{name}.s", "", "parameter of the curve", lambda: observed.run.q[:, place],
            owner=owner,
        )  # fmt: skip
        return
    what = "which pushes the ends apart" if one.type == DISTANCE else "along the normal"
    table.scalar(f"{name}.load", "N", f"load, {what},", load, owner=owner)
    if one.type == ROLLING:
        table.scalar(f"{name}.friction", "N", "friction against slip", friction, owner=owner)


def add_coupling(table: Table, observed: Observed, name: str) -> None:
    """Its load: what it puts on a coordinate, for a slope of one of its expression by that."""
    loops = observed.engine.packed.written.loops
    rows = [] if loops is None else [x.row for x in loops.couplings if x.coupling.name == name]

    def load() -> Array:
        found = observed.part("rows")
        return -found[:, rows[0]] if rows else np.zeros(len(found))

    what = "load, by the slopes of its expression,"
    table.scalar(f"{name}.load", "", what, load, owner=f"coupling {name}")


def _frame(one: Constraint) -> str:
    return one.name + OF_CONSTRAINT


def _force(observed: Observed, one: Constraint) -> Array:
    """(n, 3), inertial axes."""
    place = observed.engine.packed.hinge_position[_frame(one)]
    return observed.columns("loads", (place, slice(0, 3)))


def _direction(observed: Observed, one: Constraint) -> Array:
    """(n, 3) along the load, inertial axes: of a distance from `from` to `to`."""
    if one.type == DISTANCE:
        apart = _place(observed, one, one.to) - _place(observed, one, one.from_)
        return np.asarray(apart / np.linalg.norm(apart, axis=1)[:, None])
    normal = one.unit_normal
    assert normal is not None
    if one.from_ == GROUND:
        return np.tile(np.asarray(normal), (len(observed.run.t), 1))
    return np.asarray(observed.points(one.from_)[:, 15:24].reshape(-1, 3, 3) @ np.asarray(normal))


def _place(observed: Observed, one: Constraint, end: str) -> Array:
    if end == GROUND:
        return np.tile(np.asarray(one.position), (len(observed.run.t), 1))
    return observed.points(end)[:, :3]
