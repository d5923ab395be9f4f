"""Quantities of hinges and of the modes of flexible bodies.

Coordinates, speeds, efforts, loads, powers, power inputs of motors and drives, Euler angles.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from mstmm.array_validation import Array
from mstmm.ir.hinge_properties import effort_unit

from ...engine.quantity_registry import HINGE_QUANTITIES, acceleration_name, effort_names, rate_unit
from ...packing.coordinate_layout import HingeSlots
from ...packing.system import System
from ..quantity_names import Table, Values
from .applied_loads import AppliedLoads
from .euler_angles import EULER_KIND, euler_angles, gimbal_note, rotation_matrices


def add_hinge(table: Table, acting: AppliedLoads, hinge: HingeSlots) -> None:
    """Add the quantities of a hinge by name and by index: shoulder.angle, shoulder.q[0]."""
    observed, owner = acting.observations, f"hinge {hinge.name}"
    group = _add_motion(table, acting, hinge, owner)
    units = [effort_unit(unit) for unit in hinge.u_units]

    def efforts() -> Array:
        return observed.columns("efforts", (hinge.u_slice,))

    group.add("effort", effort_names(hinge.u_names), units, efforts)
    for first, (kind, description) in zip((0, 3), HINGE_QUANTITIES.items(), strict=True):
        get = partial(observed.loads, hinge.name, first)
        table.vector(f"{hinge.name}.{kind}", owner, description, get, base=hinge.name)
    if hinge.quaternion is not None:
        first = hinge.q + hinge.quaternion

        def angles() -> Array:
            return euler_angles(rotation_matrices(observed.run.q[:, first : first + 4]))

        table.vector(
            f"{hinge.name}.euler", owner, EULER_KIND, angles, note=gimbal_note, base=hinge.name
        )
    if hinge.nu:
        _add_powers(table, acting, hinge, efforts)


def _add_powers(table: Table, acting: AppliedLoads, hinge: HingeSlots, efforts: Values) -> None:
    """Add the power of all efforts along the speeds, and the inputs of drives and `law.effort`."""
    owner, run = f"hinge {hinge.name}", acting.observations.run

    def power(of: Values) -> Array:
        return np.asarray(np.sum(of() * run.u[:, hinge.u_slice], axis=1))

    name = f"{hinge.name}.power"
    table.scalar(name, "W", "power of the effort", partial(power, efforts), owner=owner)
    hinge_index = acting.observations.engine.packed.hinge_position[hinge.name]
    driven_speeds = [k for body, k in acting.system.driven if body == hinge_index]
    slots = effort_slots(acting.system, hinge_index, hinge.nu)
    motor_speeds = [k for k in range(hinge.nu) if k in driven_speeds or slots[k] >= 0]
    if not motor_speeds:
        return

    def motor() -> Array:
        motor_efforts = acting.values_at(slots)
        motor_efforts[:, driven_speeds] = efforts()[:, driven_speeds]
        return motor_efforts

    names = [text.replace("effort", "motor") for text in effort_names(hinge.u_names)]
    for k in motor_speeds:
        label = names[k].replace("_", " ") + " effort"
        unit = effort_unit(hinge.u_units[k])
        table.scalar(f"{hinge.name}.{names[k]}", unit, label, motor, k, owner=owner)
    table.scalar(
        f"{hinge.name}.motor_power", "W", "power of the motor", partial(power, motor), owner=owner
    )


def effort_slots(system: System, body: int, count: int) -> tuple[int, ...]:
    """Indices of the given efforts of laws among the values, speed by speed; -1 for none."""
    slots = [-1] * count
    for run in system.laws:
        repeat, member = divmod(body - run.position, run.period)
        for position, law in enumerate(run.pattern):
            row = repeat * len(run.pattern) + position
            if law.member == member and 0 <= row < run.count:
                law_slots = law.efforts[repeat if len(law.efforts) > 1 else 0]
                slots[law.speed : law.speed + law.n] = law_slots
    return tuple(slots)


def add_modes(table: Table, acting: AppliedLoads, body: HingeSlots) -> None:
    """Add modal coordinates of a flexible body, their speeds and accelerations: blade.y1."""
    _add_motion(table, acting, body, f"flexible body {body.name}", straight=True)


def _add_motion(
    table: Table, acting: AppliedLoads, slots: HingeSlots, owner: str, straight: bool = False
) -> _Group:
    """Add q, u and udot of a hinge or of modes."""
    run, group = acting.observations.run, _Group(table, slots.name, owner)
    rates = [rate_unit(unit) for unit in slots.u_units]
    accelerations = [acceleration_name(name) for name in slots.u_names]

    def speeds() -> Array:
        return run.u[:, slots.u_slice]

    def udot() -> Array:
        return acting.observations.columns("udot", (slots.u_slice,))

    group.add("q", slots.q_names, slots.q_units, lambda: run.q[:, slots.q_slice],
              speeds if straight or slots.rates_are_speeds else None)  # fmt: skip
    group.add("u", slots.u_names, slots.u_units, speeds, udot)
    group.add("udot", accelerations, rates, udot)
    return group


@dataclass
class _Group:
    """Columns of one hinge by name and by index: shoulder.angle, shoulder.q[0]."""

    table: Table
    hinge: str
    owner: str

    def add(
        self, short: str, names: Sequence[str], units: Sequence[str], get: Values,
        rates: Values | None = None,
    ) -> None:  # fmt: skip
        """Add one kind of quantity, with one name and unit per column."""
        for k, (name, unit) in enumerate(zip(names, units, strict=True)):
            full_name, label = f"{self.hinge}.{name}", name.replace("_", " ")
            self.table.scalar(full_name, unit, label, get, k, rates, owner=self.owner)
            self.table.entries[f"{self.hinge}.{short}[{k}]"] = self.table.entries[full_name]
        if len(names) == 1 and names[0] != short:
            self.table.entries[f"{self.hinge}.{short}"] = self.table.entries[full_name]
