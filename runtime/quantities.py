"""Quantities of a run by name: "shoulder.angle", "rod1.tip.vx", "shoulder.force", "energy".

Every name gives values over time with their unit and one label per column.  Axes are inertial.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mstmm.errors import SceneError
from mstmm.hinge_types import effort_unit
from mstmm.scene_errors import near

from .layout import HingeSlots
from .observed import quaternions

if TYPE_CHECKING:
    from .observed import Observed

Array = NDArray[np.float64]

_XYZ, _WXYZ = ("x", "y", "z"), ("w", "x", "y", "z")


@dataclass(frozen=True)
class Quantity:
    """Values (n,) or (n, k) over time; `labels` has one entry per column."""

    name: str
    values: Array
    unit: str
    long_name: str
    labels: tuple[str, ...] = ()


@dataclass(frozen=True)
class Kind:
    """A vector quantity of a body or hinge: unit, long name, columns, short names of those."""

    unit: str
    long_name: str
    labels: tuple[str, ...]
    short: tuple[str, ...]


#: Quantities of a body or an end, in the order of `Observation.points`.
BODY = {
    "position": Kind("m", "position of the origin", _XYZ, _XYZ),
    "velocity": Kind("m/s", "velocity of the origin", _XYZ, ("vx", "vy", "vz")),
    "acceleration": Kind("m/s2", "acceleration of the origin", _XYZ, ("ax", "ay", "az")),
    "orientation": Kind("", "quaternion, body to inertial axes", _WXYZ, ("qw", "qx", "qy", "qz")),
    "angular_velocity": Kind("rad/s", "angular velocity", _XYZ, ("wx", "wy", "wz")),
    "angular_acceleration": Kind(
        "rad/s2", "angular acceleration", _XYZ, ("alphax", "alphay", "alphaz")
    ),
}  # fmt: skip

#: Loads of the inboard on the outboard side of a hinge.
HINGE = {
    "force": Kind("N", "force of the inboard on the outboard side", _XYZ, ("fx", "fy", "fz")),
    "moment": Kind(
        "N*m", "moment of the inboard on the outboard side at P", _XYZ, ("mx", "my", "mz")
    ),
}  # fmt: skip

#: Sums over the scene: unit, long name, columns of `Observation.sums`.
SUMS: dict[str, tuple[str, str, slice]] = {
    "energy": ("J", "total energy", slice(0, 3)),
    "energy.kinetic": ("J", "kinetic energy", slice(0, 1)),
    "energy.gravity": ("J", "potential energy of gravity", slice(1, 2)),
    "energy.springs": ("J", "energy of springs", slice(2, 3)),
    "power": ("W", "power of everything that is not stored", slice(3, 4)),
    "momentum": ("kg*m/s", "linear momentum", slice(4, 7)),
    "angular_momentum": ("kg*m2/s", "angular momentum about the inertial origin", slice(7, 10)),
}

_COLUMNS = {
    "position": slice(0, 3), "velocity": slice(3, 6), "acceleration": slice(6, 9),
    "angular_velocity": slice(9, 12), "angular_acceleration": slice(12, 15),
}  # fmt: skip


class Quantities:
    """Every quantity of a run by its name, from the states and what they show."""

    def __init__(self, observed: Observed) -> None:
        self.observed, self.run = observed, observed.run
        self.layout = observed.engine.packed.layout
        self._orientations: dict[str, Array] = {}
        self._table: dict[str, Callable[[], Quantity]] | None = None
        self._scalars: list[str] = []

    # --- of bodies ------------------------------------------------------------------------------

    def of_body(self, reference: str, kind: str) -> Array:
        """(n, 3), or (n, 4) for the orientation."""
        points = self.observed.points(reference)
        if kind != "orientation":
            return points[:, _COLUMNS[kind]]
        if reference not in self._orientations:
            self._orientations[reference] = quaternions(points[:, 15:24])
        return self._orientations[reference]

    # --- of hinges ------------------------------------------------------------------------------

    def slots(self, hinge: str) -> HingeSlots:
        """Place of a hinge in q and u; SceneError with the nearest name if there is none."""
        found = self.layout.hinges.get(hinge)
        if found is None:
            hint = near(hinge, self.layout.hinges)
            raise SceneError(f'"{hinge}": there is no such hinge in the scene{hint}')
        return found

    def of_hinge(self, hinge: str, kind: str) -> Array:
        """force or moment (n, 3)."""
        self.slots(hinge)
        place = self.observed.engine.packed.hinge_position[hinge]
        first = 0 if kind == "force" else 3
        return self.observed.part("loads")[:, place, first : first + 3]

    def effort(self, hinge: str) -> Array:
        """(n, nu): what laws and drives put in along the speeds."""
        return self.observed.part("efforts")[:, self.slots(hinge).u_slice]

    def sum(self, name: str) -> Array:
        """One of SUMS: (n,) or (n, 3)."""
        columns = SUMS[name][2]
        values = self.observed.part("sums")[:, columns]
        if name == "energy":
            return np.asarray(values.sum(axis=1))
        return values[:, 0] if columns.stop - columns.start == 1 else values

    # --- by name --------------------------------------------------------------------------------

    @property
    def table(self) -> dict[str, Callable[[], Quantity]]:
        """Every name and how to get its quantity."""
        if self._table is None:
            self._table = self._names()
        return self._table

    @property
    def scalars(self) -> list[str]:
        """One name for every number there is per sample, in the order of a wide table."""
        return self._scalars if self.table else []

    def get(self, name: str) -> Quantity:
        """The quantity of this name; SceneError with the nearest name if there is none."""
        found = self.table.get(name)
        if found is None:
            hint = near(name, _nearby(name, self.table))
            raise SceneError(f'"{name}": there is no such quantity{hint}')
        return found()

    def _names(self) -> dict[str, Callable[[], Quantity]]:
        table: dict[str, Callable[[], Quantity]] = {}
        for hinge in self.layout.hinges.values():
            self._coordinates(table, hinge)
            for kind, about in HINGE.items():
                get = _bound(self.of_hinge, hinge.name, kind)
                self._scalars += _vector(table, f"{hinge.name}.{kind}", hinge.name, about, get)
        for reference in self.observed.references:
            for kind, about in BODY.items():
                get = _bound(self.of_body, reference, kind)
                self._scalars += _vector(table, f"{reference}.{kind}", reference, about, get)
        for name in SUMS:
            self._sum(table, name)
        table["work"] = lambda: Quantity(
            "work", self.run.work, "J", "work of everything that is not stored"
        )
        self._scalars.append("work")
        return table

    def _coordinates(self, table: dict[str, Callable[[], Quantity]], hinge: HingeSlots) -> None:
        """q, u, their rates and efforts by the hinge's own names and by number."""
        accelerations = [acceleration_name(name) for name in hinge.u_names]
        efforts = [effort_unit(unit) for unit in hinge.u_units]
        groups: list[tuple[str, str, list[str], list[str], Callable[[], Array]]] = [
            ("q", "coordinate", list(hinge.q_names), list(hinge.q_units),
             lambda: self.run.q[:, hinge.q_slice]),
            ("u", "speed", list(hinge.u_names), list(hinge.u_units),
             lambda: self.run.u[:, hinge.u_slice]),
            ("udot", "acceleration", accelerations, [rate_unit(unit) for unit in hinge.u_units],
             lambda: self.observed.part("udot")[:, hinge.u_slice]),
            ("effort", "effort", [f"effort_{name}" for name in hinge.u_names], efforts,
             lambda: self.effort(hinge.name)),
        ]  # fmt: skip
        for short, word, names, units, get in groups:
            for k, (name, unit) in enumerate(zip(names, units, strict=True)):
                full, long_name = f"{hinge.name}.{name}", f"{word} {name} of hinge {hinge.name}"
                table[full] = _column(get, k, full, unit, long_name)
                self._scalars.append(full)
                table[f"{hinge.name}.{short}[{k}]"] = table[full]
            if len(names) == 1:
                table[f"{hinge.name}.{short}"] = table[f"{hinge.name}.{short}[0]"]

    def _sum(self, table: dict[str, Callable[[], Quantity]], name: str) -> None:
        unit, long_name, columns = SUMS[name]
        if name == "energy" or columns.stop - columns.start == 1:
            table[name] = lambda: Quantity(name, self.sum(name), unit, long_name)
            self._scalars.append(name)
            return
        about = Kind(unit, long_name, _XYZ, ())
        self._scalars += _vector(table, name, "the scene", about, lambda: self.sum(name))


def acceleration_name(speed: str) -> str:
    """Name of a speed's derivative: angle_rate -> angle_acceleration, vx -> vx_dot."""
    stem = speed.removesuffix("_rate")
    return f"{stem}_acceleration" if stem != speed else f"{speed}_dot"


def rate_unit(unit: str) -> str:
    """Unit of the time derivative: m/s -> m/s2."""
    return f"{unit}2" if unit.endswith("/s") else f"{unit or '1'}/s"


def _bound(method: Callable[[str, str], Array], name: str, kind: str) -> Callable[[], Array]:
    return lambda: method(name, kind)


def _column(
    get: Callable[[], Array], k: int, name: str, unit: str, long_name: str
) -> Callable[[], Quantity]:
    return lambda: Quantity(name, get()[:, k], unit, long_name)


def _vector(
    table: dict[str, Callable[[], Quantity]],
    name: str,
    owner: str,
    about: Kind,
    get: Callable[[], Array],
) -> list[str]:
    """The vector under its name, each component under name.x, and short as in rod1.tip.vx.

    Returns one name per component, the short one where it is free.
    """
    names = []
    long_name = f"{about.long_name} of {owner}"
    table[name] = lambda: Quantity(name, get(), about.unit, long_name, about.labels)
    for k, label in enumerate(about.labels):
        full = f"{name}.{label}"
        table[full] = _column(get, k, full, about.unit, f"{long_name}, {label}")
        if about.short:
            short = f"{owner}.{about.short[k]}"
            if short not in table:
                table[short] = _column(get, k, short, about.unit, f"{long_name}, {label}")
                full = short
        names.append(full)
    return names


def _nearby(name: str, table: dict[str, Callable[[], Quantity]]) -> list[str]:
    """Names to suggest from: those of the same body or hinge, else all."""
    owner = name.rsplit(".", 1)[0]
    same = [known for known in table if known.rsplit(".", 1)[0] == owner]
    return same or list(table)
