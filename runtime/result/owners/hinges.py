"""Quantities of hinges, and of the modes of flexible bodies: coordinates, speeds, efforts, loads,
powers, what motors and drives put in, Euler angles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from mstmm.arrays import Array
from mstmm.ir.facts import effort_unit

from ...engine.shown import HINGE, acceleration_name, effort_names, rate_unit
from ...pack.layout import HingeSlots
from ...pack.system import System
from ..names import Table, Values
from .acting import Acting
from .angles import EULER, euler, gimbal, matrices


def add_hinge(table: Table, acting: Acting, hinge: HingeSlots) -> None:
    """Of a hinge: by its own names and by number, shoulder.angle, shoulder.q[0]."""
    observed, owner = acting.observed, f"hinge {hinge.name}"
    group = _moving(table, acting, hinge, owner)
    units = [effort_unit(unit) for unit in hinge.u_units]

    def efforts() -> Array:
        return observed.columns("efforts", (hinge.u_slice,))

    group.add("effort", effort_names(hinge.u_names), units, efforts)
    for first, (kind, about) in zip((0, 3), HINGE.items(), strict=True):
        get = partial(observed.loads, hinge.name, first)
        table.vector(f"{hinge.name}.{kind}", owner, about, get, base=hinge.name)
    if hinge.quaternion is not None:
        first = hinge.q + hinge.quaternion

        def angles() -> Array:
            return euler(matrices(observed.run.q[:, first : first + 4]))

        table.vector(f"{hinge.name}.euler", owner, EULER, angles, note=gimbal, base=hinge.name)
    if hinge.nu:
        _powers(table, acting, hinge, efforts)


def _powers(table: Table, acting: Acting, hinge: HingeSlots, efforts: Values) -> None:
    """Of all that acts along the speeds; and what of it drives and `law.effort` put in."""
    owner, run = f"hinge {hinge.name}", acting.observed.run

    def power(of: Values) -> Array:
        return np.asarray(np.sum(of() * run.u[:, hinge.u_slice], axis=1))

    name = f"{hinge.name}.power"
    table.scalar(name, "W", "power of the effort", partial(power, efforts), owner=owner)
    place = acting.observed.engine.packed.hinge_position[hinge.name]
    driven = [k for body, k in acting.system.driven if body == place]
    given = effort_places(acting.system, place, hinge.nu)
    pushed = [k for k in range(hinge.nu) if k in driven or given[k] >= 0]
    if not pushed:
        return

    def motor() -> Array:
        found = acting.at(given)
        found[:, driven] = efforts()[:, driven]
        return found

    names = [text.replace("effort", "motor") for text in effort_names(hinge.u_names)]
    for k in pushed:
        what = names[k].replace("_", " ") + " effort"
        unit = effort_unit(hinge.u_units[k])
        table.scalar(f"{hinge.name}.{names[k]}", unit, what, motor, k, owner=owner)
    table.scalar(
        f"{hinge.name}.motor_power", "W", "power of the motor", partial(power, motor), owner=owner
    )


def effort_places(system: System, body: int, count: int) -> tuple[int, ...]:
    """Where the efforts that laws are given stand among the values, speed by speed; -1 for none."""
    found = [-1] * count
    for run in system.laws:
        repeat, member = divmod(body - run.place, run.period)
        for which, law in enumerate(run.pattern):
            row = repeat * len(run.pattern) + which
            if law.member == member and 0 <= row < run.count:
                places = law.efforts[repeat if len(law.efforts) > 1 else 0]
                found[law.speed : law.speed + law.n] = places
    return tuple(found)


def add_modes(table: Table, acting: Acting, body: HingeSlots) -> None:
    """Modal coordinates of a flexible body, their speeds and accelerations: blade.y1."""
    _moving(table, acting, body, f"flexible body {body.name}", straight=True)


def _moving(
    table: Table, acting: Acting, slots: HingeSlots, owner: str, straight: bool = False
) -> _Group:
    """q, u and udot."""
    run, group = acting.observed.run, _Group(table, slots.name, owner)
    rates = [rate_unit(unit) for unit in slots.u_units]
    accelerations = [acceleration_name(name) for name in slots.u_names]

    def speeds() -> Array:
        return run.u[:, slots.u_slice]

    def udot() -> Array:
        return acting.observed.columns("udot", (slots.u_slice,))

    group.add("q", slots.q_names, slots.q_units, lambda: run.q[:, slots.q_slice],
              speeds if straight or slots.straight else None)  # fmt: skip
    group.add("u", slots.u_names, slots.u_units, speeds, udot)
    group.add("udot", accelerations, rates, udot)
    return group


@dataclass
class _Group:
    """Columns of one hinge under their own names and by number: shoulder.angle, shoulder.q[0]."""

    table: Table
    hinge: str
    owner: str

    def add(
        self, short: str, names: Sequence[str], units: Sequence[str], get: Values,
        rates: Values | None = None,
    ) -> None:  # fmt: skip
        """One kind of quantity, one name and unit per column."""
        for k, (name, unit) in enumerate(zip(names, units, strict=True)):
            full, what = f"{self.hinge}.{name}", name.replace("_", " ")
            self.table.scalar(full, unit, what, get, k, rates, owner=self.owner)
            self.table.entries[f"{self.hinge}.{short}[{k}]"] = self.table.entries[full]
        if len(names) == 1 and names[0] != short:
            self.table.entries[f"{self.hinge}.{short}"] = self.table.entries[full]
