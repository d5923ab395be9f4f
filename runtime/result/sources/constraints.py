"""Constraints and couplings over a run: loads on the constrained bodies and speeds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mstmm.array_validation import Array
from mstmm.scene.tables.closures import CURVE, DISTANCE, ROLLING
from mstmm.scene.validators.scalars_and_vectors import GROUND

from ...engine.quantity_registry import XYZ, QuantityKind
from ...packing.coordinate_layout import OF_CONSTRAINT
from ..quantity_names import Table

if TYPE_CHECKING:
    from mstmm.scene import Constraint

    from ..observations import Observations

_FORCE = QuantityKind("N", "force on the end `to`", XYZ, ())


def add_constraint(table: Table, observed: Observations, constraint: Constraint) -> None:
    """Add the quantities of a constraint: rod.force, rod.load, road.friction, wire.s."""
    name, owner = constraint.name, f"constraint {constraint.name}"

    def force() -> Array:
        return _constraint_force(observed, constraint)

    def load() -> Array:
        return np.asarray(np.einsum("ni,ni->n", force(), _load_direction(observed, constraint)))

    def friction() -> Array:
        normal_force = load()[:, None] * _load_direction(observed, constraint)
        return np.asarray(np.linalg.norm(force() - normal_force, axis=1))

    table.vector(f"{name}.force", owner, _FORCE, force)
    if constraint.type == CURVE:
        packed = observed.engine.packed
        column = int(
            packed.system.first_indices["q"][packed.hinge_position[_frame_hinge_name(constraint)]]
        )
        table.scalar(
            f"{name}.s", "", "parameter of the curve", lambda: observed.run.q[:, column],
            owner=owner,
        )  # fmt: skip
        return
    meaning = "which pushes the ends apart" if constraint.type == DISTANCE else "along the normal"
    table.scalar(f"{name}.load", "N", f"load, {meaning},", load, owner=owner)
    if constraint.type == ROLLING:
        table.scalar(f"{name}.friction", "N", "friction force", friction, owner=owner)


def add_coupling(table: Table, observed: Observations, name: str) -> None:
    """Add the load of a coupling: the effort on a coordinate per slope of its expression."""
    loops = observed.engine.packed.written.loops
    rows = [] if loops is None else [x.row for x in loops.couplings if x.coupling.name == name]

    def load() -> Array:
        row_loads = observed.part("rows")
        return -row_loads[:, rows[0]] if rows else np.zeros(len(row_loads))

    meaning = "load per derivative of its expression,"
    table.scalar(f"{name}.load", "", meaning, load, owner=f"coupling {name}")


def _frame_hinge_name(constraint: Constraint) -> str:
    return constraint.name + OF_CONSTRAINT


def _constraint_force(observed: Observations, constraint: Constraint) -> Array:
    """Constraint force (n, 3), inertial axes."""
    hinge_index = observed.engine.packed.hinge_position[_frame_hinge_name(constraint)]
    return observed.columns("loads", (hinge_index, slice(0, 3)))


def _load_direction(observed: Observations, constraint: Constraint) -> Array:
    """Direction (n, 3) of the load, inertial axes: for a distance from `from` to `to`."""
    if constraint.type == DISTANCE:
        difference = _end_position(observed, constraint, constraint.to) - _end_position(
            observed, constraint, constraint.from_
        )
        return np.asarray(difference / np.linalg.norm(difference, axis=1)[:, None])
    normal = constraint.unit_normal
    assert normal is not None
    if constraint.from_ == GROUND:
        return np.tile(np.asarray(normal), (len(observed.run.t), 1))
    return np.asarray(
        observed.points(constraint.from_)[:, 15:24].reshape(-1, 3, 3) @ np.asarray(normal)
    )


def _end_position(observed: Observations, constraint: Constraint, end: str) -> Array:
    if end == GROUND:
        return np.tile(np.asarray(constraint.position), (len(observed.run.t), 1))
    return observed.points(end)[:, :3]
