"""Quantities of a run by name, such as "shoulder.angle", "rod1.tip.vx", "energy".

Every name gives values over time with their unit and one label per column.  Axes are inertial.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from mstmm.argument_validation import require_word
from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.scene import Output
from mstmm.scene.validators.validation_messages import did_you_mean

from ..engine.quantity_registry import (  # fmt: skip
    BODY_QUANTITIES,
    POINT_COLUMNS,
    SUMS,
    WXYZ,
    XYZ,
    QuantityKind,
)
from ..packing.coordinate_layout import HingeSlots
from .flexible.flexible_quantity_names import add_body_quantities
from .observations import quaternions
from .quantity_names import Quantity, Table, Values
from .scene_outputs import component_of, quantity_of, single_quantity_name
from .sources.applied_loads import AppliedLoads
from .sources.bushings import add_bushing
from .sources.constraints import add_constraint, add_coupling
from .sources.euler_angles import EULER_KIND, euler_angles, gimbal_note
from .sources.hinges import add_hinge, add_modes
from .sources.loads import add_load
from .sources.springs import add_spring

if TYPE_CHECKING:
    from .flexible.quantities import FlexibleResults
    from .observations import Observations


#: Quantities whose time derivatives are quantities too.
RATE_KINDS = {
    "position": "velocity", "velocity": "acceleration", "angular_velocity": "angular_acceleration",
}  # fmt: skip


class Quantities:
    """Quantities of a run by name, from its states and observations.

    Names are created on demand per owner: a hinge, a body, an end, a spring, a load, a bushing, a
    constraint, a coupling or the scene ("").
    """

    def __init__(self, observed: Observations, flexible: FlexibleResults) -> None:
        self.observations, self.run = observed, observed.run
        self._flexible, self.applied_loads = flexible, AppliedLoads(observed)
        self.layout = observed.engine.packed.layout
        self._external_names = observed.references.scene.names
        self._orientations: dict[str, Array] = {}
        self._tables: dict[str, Table] = {}
        #: Functions that add the quantities of other elements and of loops, by name.
        self._deferred_entries: dict[str, list[Callable[[Table], None]]] = {}
        scene, loop_scene = observed.references.scene, observed.engine.packed.user_scene
        for spring in scene.spring:
            self._add_deferred(
                spring.name, partial(add_spring, acting=self.applied_loads, spring=spring)
            )
        for k, load in enumerate(scene.load):
            self._add_deferred(
                load.name, partial(add_load, acting=self.applied_loads, load=load, number=k)
            )
        for bushing in scene.bushing:
            self._add_deferred(
                bushing.name, partial(add_bushing, observed=observed, bushing=bushing)
            )
        for constraint in loop_scene.constraint:
            self._add_deferred(
                constraint.name, partial(add_constraint, observed=observed, constraint=constraint)
            )
        for coupling in loop_scene.coupling:
            self._add_deferred(
                coupling.name, partial(add_coupling, observed=observed, name=coupling.name)
            )

    # --- bodies ---------------------------------------------------------------------------------

    def body_quantity(self, reference: str, kind: str) -> Array:
        """Quantity (n, 3) of a body or end, or (n, 4) for the orientation."""
        points = self.observations.points(reference)
        if kind != "orientation":
            return points[:, POINT_COLUMNS[kind]]
        if reference not in self._orientations:
            self._orientations[reference] = quaternions(points[:, 15:24])
        return self._orientations[reference]

    # --- hinges ---------------------------------------------------------------------------------

    def slots(self, hinge: str) -> HingeSlots:
        """Slots of a hinge in q and u; SceneError with the nearest name if there is none."""
        require_word("hinge", hinge, "the name of a hinge")
        hinge_slots = self.layout.hinges.get(hinge)
        if hinge_slots is None:
            hinges = self.observations.references.scene.hinges
            if hinges.of_chain(hinge):
                raise SceneError(f'"{hinge}": {hinges.missing(hinge)}')
            hint = did_you_mean(hinge, (*self.layout.hinges, *self._external_names.hinge))
            raise SceneError(f'"{hinge}": there is no such hinge in the scene{hint}')
        return hinge_slots

    def hinge_quantity(self, hinge: str, kind: str) -> Array:
        """Force or moment (n, 3) of a hinge."""
        if require_word("hinge", hinge, "the name of a hinge") in self.layout.modal:
            raise SceneError(
                f'"{hinge}": {kind} exists for hinges only, and this is a flexible body; give its '
                "inboard hinge"
            )
        hinge_name = self.slots(hinge).name
        return self.observations.loads(hinge_name, 0 if kind == "force" else 3)

    def effort(self, hinge: str) -> Array:
        """Efforts (n, nu) of laws and drives along the speeds of a hinge."""
        return self.observations.columns("efforts", (self.slots(hinge).u_slice,))

    def sum(self, name: str) -> Array:
        """Sum over the scene, by name: (n,) or (n, 3)."""
        columns = SUMS[name][2]
        values = self.observations.part("sums")[:, columns]
        if name == "energy":
            return np.asarray(values.sum(axis=1))
        return values[:, 0] if columns.stop - columns.start == 1 else values

    # --- by name --------------------------------------------------------------------------------

    def get(self, name: str) -> Quantity:
        """Quantity of this name; SceneError with the nearest name if there is none."""
        if not isinstance(name, str):
            raise SceneError(f"quantity {name!r}: expected a name, such as energy")
        for full_name in self._external_names.resolve(name):
            if (entry := self._entry(full_name)) is not None:
                return entry() if full_name == name else replace(entry(), name=name)
        owners = [
            owner
            for full_name in self._external_names.resolve(name)
            for owner in self._owners_in(full_name)
        ]
        known_names = [n for owner in owners for n in self.table_of(owner).entries]
        hint = did_you_mean(name, (*known_names, *self._all_names()))
        raise SceneError(f'"{name}": there is no such quantity{hint}')

    def _entry(self, name: str) -> Callable[[], Quantity] | None:
        """Getter of the quantity of this name; None if there is none."""
        tables = map(self.table_of, ["", *self._owners_in(name)])
        return next((table.entries[name] for table in tables if name in table.entries), None)

    def _owners_in(self, name: str) -> list[str]:
        """Hinges, bodies and ends with which a name begins."""
        parts = name.split(".")
        owners = (".".join(parts[:k]) for k in range(1, len(parts)))
        return [owner for owner in owners if self._is_owner(owner)]

    def load_vectors(self) -> Iterator[Quantity]:
        """Vector quantities of springs, loads, bushings and loop constraints, undivided.

        For a name shared with a hinge or body, those of the hinge or body are elsewhere.
        """
        for owner in self._deferred_entries:
            table = Table({}, [])
            for add in self._deferred_entries[owner]:
                add(table)
            yield from (table.entries[name]() for name in table.vector_names)

    def names(self) -> list[str]:
        """Names of all quantities."""
        return list(self._all_names())

    def _all_names(self) -> Iterator[str]:
        return (name for owner in self.owners() for name in self.table_of(owner).entries)

    def scalars(self) -> list[str]:
        """Names of all scalar columns per sample, in the order of a wide table."""
        return [name for owner in self.owners() for name in self.table_of(owner).scalars]

    def outputs(self) -> list[str]:
        """Outputs of the scene that are available in this model."""
        scene_entries = self.table_of("").entries
        return [
            output.name
            for output in self.observations.references.scene.output
            if output.name in scene_entries
        ]

    def owners(self) -> Iterator[str]:
        """Hinges, bodies and ends, springs, loads, bushings, constraints, couplings, the scene."""
        yield from self.layout.hinges
        yield from self.observations.references
        bodies = (self.layout.hinges, self.observations.references)
        yield from (
            name
            for name in self._deferred_entries
            if not any(name in bodies_of_kind for bodies_of_kind in bodies)
        )
        yield ""

    def table_of(self, owner: str) -> Table:
        """Name table of one owner."""
        if owner not in self._tables:
            table = Table({}, [])
            hinges, is_own_name = (
                self.layout.hinges,
                self._external_names.hinge.get(owner, owner) == owner,
            )
            if is_own_name and owner in hinges and owner not in self.layout.modal:
                add_hinge(table, self.applied_loads, hinges[owner])
            elif owner in self.observations.references:
                self._body(table, owner)
            elif not owner:
                self._scene(table)
            for add in self._deferred_entries.get(owner, ()):
                add(table)
            self._tables[owner] = table
        return self._tables[owner]

    def _is_owner(self, owner: str) -> bool:
        owner_groups = (self.layout.hinges, self.observations.references, self._deferred_entries)
        return any(owner in owners for owners in owner_groups)

    def _add_deferred(self, name: str, add: Callable[[Table], None]) -> None:
        self._deferred_entries.setdefault(name, []).append(add)

    def _body(self, table: Table, reference: str) -> None:
        for kind, description in BODY_QUANTITIES.items():
            rates = RATE_KINDS.get(kind)
            table.vector(
                f"{reference}.{kind}",
                reference,
                description,
                self._bound(self.body_quantity, reference, kind),
                None if rates is None else self._bound(self.body_quantity, reference, rates),
            )
        table.vector(
            f"{reference}.euler", reference, EULER_KIND,
            lambda: euler_angles(self.observations.points(reference)[:, 15:24]), note=gimbal_note,
        )  # fmt: skip
        if reference in self.layout.modal:
            add_modes(table, self.applied_loads, self.layout.modal[reference])
        add_body_quantities(table, self._flexible, reference)

    def _scene(self, table: Table) -> None:
        for name, (unit, long_name, columns) in SUMS.items():
            get = self._sum_getter(name)
            if name == "energy" or columns.stop - columns.start == 1:
                table.scalar(name, unit, long_name, get)
            else:
                table.vector(name, "the scene", QuantityKind(unit, long_name, XYZ, ()), get)
        work_label = "work of all non-conservative efforts"
        power = self._sum_getter("power")
        table.scalar("work", "J", work_label, lambda: self.run.work, rates=power)
        scene = self.observations.references.scene
        for word, channels in (("input", scene.input), ("signal", scene.signal)):
            for channel in channels:
                table.scalar(
                    channel.name,
                    channel.unit,
                    f"{word} {channel.name}",
                    self._input_getter(channel.name),
                )
        column = self.observations.engine.packed.system.held_inputs.first
        for controller in scene.controller:
            for k in range(len(controller.A)):
                name, owner = f"{controller.name}.x[{k}]", f"controller {controller.name}"
                table.scalar(
                    name, "", f"state {k}", self._memory_getter(column + 1 + k), owner=owner
                )
            column += 1 + len(controller.A) + len(controller.outputs)
        for output in scene.output:
            self._output(table, output)

    def _output(self, table: Table, output: Output) -> None:
        """Add an output under its name, and the components of a vector.

        Models of a lower level, which lack a quantity of the output, do not have it.
        """

        def is_known_name(name: str) -> bool:
            owners = (table, *map(self.table_of, self._owners_in(name)))
            return name == "t" or any(name in owner.entries for owner in owners)

        if not all(is_known_name(name.text) for name in output.of.names):
            return

        def evaluate_output() -> Quantity:
            return quantity_of(output, self.run.t, self.get)

        def component(label: str) -> Callable[[], Quantity]:
            return lambda: component_of(evaluate_output(), label)

        table.entries[output.name] = evaluate_output
        source = single_quantity_name(output)
        labels = [label for label in WXYZ if source and is_known_name(f"{source}.{label}")]
        for label in labels:
            table.entries[f"{output.name}.{label}"] = component(label)
        table.scalars += [f"{output.name}.{label}" for label in labels] or [output.name]

    def _sum_getter(self, name: str) -> Values:
        return lambda: self.sum(name)

    def _input_getter(self, name: str) -> Values:
        packed = self.observations.engine.packed
        column = packed.system.held_inputs.memory_indices[packed.layout.inputs[name]]
        if column >= 0:
            return lambda: self.run.memory[:, column]
        channel = packed.system.inputs[packed.layout.inputs[name]]
        return lambda: np.array([channel.value(t) for t in self.run.t.tolist()])

    def _memory_getter(self, memory_index: int) -> Values:
        return lambda: self.run.memory[:, memory_index]

    @staticmethod
    def _bound(method: Callable[[str, str], Array], name: str, kind: str) -> Values:
        return lambda: method(name, kind)
