"""Quantities of hinges and of the modes of flexible bodies.

Coordinates, speeds, efforts, loads, powers, power inputs of motors and drives, Euler angles.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mstmm.array_validation import Array
from mstmm.ir.hinge_properties import effort_unit

from ..engine.quantity_registry import (
    HINGE_QUANTITIES,
    QuantityKind,
    coordinate_columns,
    effort_names,
)
from ..packing.coordinate_layout import HingeSlots
from ..packing.system import System
from .element_quantities import AppliedLoads, ElementValues
from .observations import euler_angles, rotation_matrices
from .quantity_names import Table


def add_coordinates(
    table: Table, acting: AppliedLoads, slots: HingeSlots, owner: str, modes: bool = False
) -> None:
    """Add q, u and udot of a hinge or of modes, and efforts of a hinge, by name and by index."""
    run, observed = acting.observations.run, acting.observations
    values = {
        "q": lambda: run.q[:, slots.q_slice],
        "u": lambda: run.u[:, slots.u_slice],
        "udot": lambda: observed.columns("udot", (slots.u_slice,)),
        "efforts": lambda: observed.columns("efforts", (slots.u_slice,)),
    }
    rates = {"u": values["udot"]}
    if modes or slots.rates_are_speeds:
        rates["q"] = values["u"]
    for column in coordinate_columns(slots, efforts=not modes):
        get, rate = values[column.part], rates.get(column.part)
        table.add(slots.name, column.kind, get, rate, owner, column.k)
        for alias in column.names[1:]:
            name = f"{slots.name}.{column.names[0]}"
            table.entries[f"{slots.name}.{alias}"] = table.entries[name]


class HingeValues(ElementValues):
    """Quantities of a hinge by name: shoulder.angle, shoulder.force, shoulder.power."""

    word = "hinge"

    def kinds(self) -> Iterator[QuantityKind]:
        present = {"force": True, "moment": True, "power": self.element.nu > 0}
        present["euler"] = self.element.quaternion is not None
        yield from (kind for kind in HINGE_QUANTITIES.values() if present.get(kind.name))

    def add_to(self, table: Table) -> None:
        """Add the coordinates, then loads, angles and powers, then the inputs of motors."""
        hinge, owner = self.element, f"hinge {self.name}"
        add_coordinates(table, self.acting, hinge, owner)
        super().add_to(table)
        motor_speeds = [
            k for k in range(hinge.nu) if k in self._driven_speeds() or self._effort_slots()[k] >= 0
        ]
        names = [text.replace("effort", "motor") for text in effort_names(hinge.u_names)]
        for k in motor_speeds:
            label = names[k].replace("_", " ") + " effort"
            kind = QuantityKind(names[k], effort_unit(hinge.u_units[k]), label)
            table.add(self.name, kind, self._motor_efforts, owner=owner, column=k)
        if motor_speeds:
            kind = HINGE_QUANTITIES["motor_power"]
            table.add(self.name, kind, self.motor_power, owner=owner)

    def force(self) -> Array:
        return self.observations.loads(self.name, 0)

    def moment(self) -> Array:
        return self.observations.loads(self.name, 3)

    def euler(self) -> Array:
        first = self.element.q + self.element.quaternion
        return euler_angles(rotation_matrices(self.observations.run.q[:, first : first + 4]))

    def power(self) -> Array:
        return self._power(self._efforts())

    def motor_power(self) -> Array:
        return self._power(self._motor_efforts())

    def _power(self, efforts: Array) -> Array:
        speeds = self.observations.run.u[:, self.element.u_slice]
        return np.asarray(np.sum(efforts * speeds, axis=1))

    def _efforts(self) -> Array:
        return self.observations.columns("efforts", (self.element.u_slice,))

    def _motor_efforts(self) -> Array:
        """Inputs (n, nu) of drives and of `law.effort`."""
        efforts, driven_speeds = self.acting.values_at(self._effort_slots()), self._driven_speeds()
        efforts[:, driven_speeds] = self._efforts()[:, driven_speeds]
        return efforts

    def _driven_speeds(self) -> list[int]:
        index = self.observations.engine.packed.hinge_position[self.name]
        return [k for body, k in self.acting.system.driven if body == index]

    def _effort_slots(self) -> tuple[int, ...]:
        index = self.observations.engine.packed.hinge_position[self.name]
        return _effort_slots(self.acting.system, index, self.element.nu)


def _effort_slots(system: System, body: int, count: int) -> tuple[int, ...]:
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
