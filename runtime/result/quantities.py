"""Quantities of a run by name, such as "shoulder.angle", "rod1.tip.vx", "energy".

Every name gives values over time with their unit and one label per column.  Axes are inertial.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from mstmm.arguments import word_of
from mstmm.arrays import Array
from mstmm.errors import SceneError
from mstmm.scene import Output
from mstmm.scene.rules.messages import near

from ..engine.shown import (
    BODY,
    COLUMNS,
    SUMS,
    WXYZ,
    XYZ,
    Kind,
)  # fmt: skip
from ..pack.layout import HingeSlots
from .flexible.names import add_body
from .names import Quantity, Table, Values
from .observed import quaternions
from .outputs import component_of, one_quantity, quantity_of
from .owners.acting import Acting
from .owners.angles import EULER, euler, gimbal
from .owners.bushings import add_bushing
from .owners.constraints import add_constraint, add_coupling
from .owners.hinges import add_hinge, add_modes
from .owners.loads import add_load
from .owners.springs import add_spring

if TYPE_CHECKING:
    from .flexible.quantities import FlexibleResults
    from .observed import Observed


#: Quantities whose time derivatives are quantities too.
RATES = {
    "position": "velocity", "velocity": "acceleration", "angular_velocity": "angular_acceleration",
}  # fmt: skip


class Quantities:
    """Quantities of a run by name, from its states and observations.

    Names are made per owner, a hinge, a body, an end, a spring, a load, a bushing, a constraint, a
    coupling or the scene (""), when they are asked for.
    """

    def __init__(self, observed: Observed, flexible: FlexibleResults) -> None:
        self.observed, self.run = observed, observed.run
        self._flexible, self.acting = flexible, Acting(observed)
        self.layout = observed.engine.packed.layout
        self._named = observed.references.scene.names
        self._orientations: dict[str, Array] = {}
        self._tables: dict[str, Table] = {}
        #: What adds the quantities of whatever else acts or closes loops, by its name.
        self._more: dict[str, list[Callable[[Table], None]]] = {}
        scene, closing = observed.references.scene, observed.engine.packed.described
        for spring in scene.spring:
            self._owned(spring.name, partial(add_spring, acting=self.acting, spring=spring))
        for k, load in enumerate(scene.load):
            self._owned(load.name, partial(add_load, acting=self.acting, load=load, number=k))
        for bushing in scene.bushing:
            self._owned(bushing.name, partial(add_bushing, observed=observed, bushing=bushing))
        for one in closing.constraint:
            self._owned(one.name, partial(add_constraint, observed=observed, one=one))
        for coupling in closing.coupling:
            self._owned(coupling.name, partial(add_coupling, observed=observed, name=coupling.name))

    # --- of bodies ------------------------------------------------------------------------------

    def of_body(self, reference: str, kind: str) -> Array:
        """(n, 3), or (n, 4) for the orientation."""
        points = self.observed.points(reference)
        if kind != "orientation":
            return points[:, COLUMNS[kind]]
        if reference not in self._orientations:
            self._orientations[reference] = quaternions(points[:, 15:24])
        return self._orientations[reference]

    # --- of hinges ------------------------------------------------------------------------------

    def slots(self, hinge: str) -> HingeSlots:
        """Place of a hinge in q and u; SceneError with the nearest name if there is none."""
        word_of("hinge", hinge, "the name of a hinge")
        found = self.layout.hinges.get(hinge)
        if found is None:
            hinges = self.observed.references.scene.hinges
            if hinges.of_chain(hinge):
                raise SceneError(f'"{hinge}": {hinges.missing(hinge)}')
            hint = near(hinge, (*self.layout.hinges, *self._named.hinge))
            raise SceneError(f'"{hinge}": there is no such hinge in the scene{hint}')
        return found

    def of_hinge(self, hinge: str, kind: str) -> Array:
        """force or moment (n, 3)."""
        if word_of("hinge", hinge, "the name of a hinge") in self.layout.modal:
            raise SceneError(
                f'"{hinge}": {kind} is known of hinges; this is a flexible body: ask for the hinge '
                "that holds it"
            )
        own = self.slots(hinge).name
        return self.observed.loads(own, 0 if kind == "force" else 3)

    def effort(self, hinge: str) -> Array:
        """Efforts (n, nu) of laws and drives along the speeds of a hinge."""
        return self.observed.columns("efforts", (self.slots(hinge).u_slice,))

    def sum(self, name: str) -> Array:
        """One of SUMS: (n,) or (n, 3)."""
        columns = SUMS[name][2]
        values = self.observed.part("sums")[:, columns]
        if name == "energy":
            return np.asarray(values.sum(axis=1))
        return values[:, 0] if columns.stop - columns.start == 1 else values

    # --- by name --------------------------------------------------------------------------------

    def get(self, name: str) -> Quantity:
        """The quantity of this name; SceneError with the nearest name if there is none."""
        if not isinstance(name, str):
            raise SceneError(f"quantity {name!r}: expected a name, such as energy")
        for own in self._named.meant(name):
            if (entry := self._entry(own)) is not None:
                return entry() if own == name else replace(entry(), name=name)
        owners = [one for own in self._named.meant(name) for one in self._owners_in(own)]
        known = [n for owner in owners for n in self.of(owner).entries]
        hint = near(name, (*known, *self._every()))
        raise SceneError(f'"{name}": there is no such quantity{hint}')

    def _entry(self, name: str) -> Callable[[], Quantity] | None:
        """Getter of the quantity of this name; None if there is none."""
        tables = map(self.of, ["", *self._owners_in(name)])
        return next((table.entries[name] for table in tables if name in table.entries), None)

    def _owners_in(self, name: str) -> list[str]:
        """Hinges, bodies and ends with which a name begins."""
        parts = name.split(".")
        owners = (".".join(parts[:k]) for k in range(1, len(parts)))
        return [owner for owner in owners if self._owns(owner)]

    def acting_wholes(self) -> Iterator[Quantity]:
        """What springs, loads, bushings and what closes loops do, vectors undivided; of a name that
        is also that of a hinge or body, what those do stands elsewhere."""
        for owner in self._more:
            table = Table({}, [])
            for add in self._more[owner]:
                add(table)
            yield from (table.entries[name]() for name in table.whole)

    def names(self) -> list[str]:
        """Names of all quantities."""
        return list(self._every())

    def _every(self) -> Iterator[str]:
        return (name for owner in self.owners() for name in self.of(owner).entries)

    def scalars(self) -> list[str]:
        """One name for every number there is per sample, in the order of a wide table."""
        return [name for owner in self.owners() for name in self.of(owner).scalars]

    def outputs(self) -> list[str]:
        """The outputs of the scene that this model has."""
        there = self.of("").entries
        return [one.name for one in self.observed.references.scene.output if one.name in there]

    def owners(self) -> Iterator[str]:
        """Hinges, bodies and ends, springs, loads, bushings, constraints, couplings, the scene."""
        yield from self.layout.hinges
        yield from self.observed.references
        bodies = (self.layout.hinges, self.observed.references)
        yield from (name for name in self._more if not any(name in known for known in bodies))
        yield ""

    def of(self, owner: str) -> Table:
        """Name table of one owner."""
        if owner not in self._tables:
            table = Table({}, [])
            hinges, own = self.layout.hinges, self._named.hinge.get(owner, owner) == owner
            if own and owner in hinges and owner not in self.layout.modal:
                add_hinge(table, self.acting, hinges[owner])
            elif owner in self.observed.references:
                self._body(table, owner)
            elif not owner:
                self._scene(table)
            for add in self._more.get(owner, ()):
                add(table)
            self._tables[owner] = table
        return self._tables[owner]

    def _owns(self, owner: str) -> bool:
        known = (self.layout.hinges, self.observed.references, self._more)
        return any(owner in owners for owners in known)

    def _owned(self, name: str, add: Callable[[Table], None]) -> None:
        self._more.setdefault(name, []).append(add)

    def _body(self, table: Table, reference: str) -> None:
        for kind, about in BODY.items():
            rates = RATES.get(kind)
            table.vector(
                f"{reference}.{kind}", reference, about, self._bound(self.of_body, reference, kind),
                None if rates is None else self._bound(self.of_body, reference, rates),
            )  # fmt: skip
        table.vector(
            f"{reference}.euler", reference, EULER,
            lambda: euler(self.observed.points(reference)[:, 15:24]), note=gimbal,
        )  # fmt: skip
        if reference in self.layout.modal:
            add_modes(table, self.acting, self.layout.modal[reference])
        add_body(table, self._flexible, reference)

    def _scene(self, table: Table) -> None:
        for name, (unit, long_name, columns) in SUMS.items():
            get = self._summed(name)
            if name == "energy" or columns.stop - columns.start == 1:
                table.scalar(name, unit, long_name, get)
            else:
                table.vector(name, "the scene", Kind(unit, long_name, XYZ, ()), get)
        about = "work of everything that is not stored"
        power = self._summed("power")
        table.scalar("work", "J", about, lambda: self.run.work, rates=power)
        scene = self.observed.references.scene
        for word, given in (("input", scene.input), ("signal", scene.signal)):
            for one in given:
                table.scalar(one.name, one.unit, f"{word} {one.name}", self._over_time(one.name))
        place = self.observed.engine.packed.system.held.first
        for controller in scene.controller:
            for k in range(len(controller.A)):
                name, owner = f"{controller.name}.x[{k}]", f"controller {controller.name}"
                table.scalar(name, "", f"state {k}", self._kept(place + 1 + k), owner=owner)
            place += 1 + len(controller.A) + len(controller.outputs)
        for output in scene.output:
            self._output(table, output)

    def _output(self, table: Table, output: Output) -> None:
        """Under its name; of a vector its components too.  Models of a lower level, which lack a
        quantity of it, do not have it."""

        def is_there(name: str) -> bool:
            owners = (table, *map(self.of, self._owners_in(name)))
            return name == "t" or any(name in owner.entries for owner in owners)

        if not all(is_there(name.text) for name in output.of.names):
            return

        def whole() -> Quantity:
            return quantity_of(output, self.run.t, self.get)

        def component(label: str) -> Callable[[], Quantity]:
            return lambda: component_of(whole(), label)

        table.entries[output.name] = whole
        source = one_quantity(output)
        labels = [label for label in WXYZ if source and is_there(f"{source}.{label}")]
        for label in labels:
            table.entries[f"{output.name}.{label}"] = component(label)
        table.scalars += [f"{output.name}.{label}" for label in labels] or [output.name]

    def _summed(self, name: str) -> Values:
        return lambda: self.sum(name)

    def _over_time(self, name: str) -> Values:
        packed = self.observed.engine.packed
        held = packed.system.held.places[packed.layout.inputs[name]]
        if held >= 0:
            return lambda: self.run.memory[:, held]
        channel = packed.system.inputs[packed.layout.inputs[name]]
        return lambda: np.array([channel.value(t) for t in self.run.t.tolist()])

    def _kept(self, place: int) -> Values:
        return lambda: self.run.memory[:, place]

    @staticmethod
    def _bound(method: Callable[[str, str], Array], name: str, kind: str) -> Values:
        return lambda: method(name, kind)
