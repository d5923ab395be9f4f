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
from mstmm.scene import Output, split_reference
from mstmm.scene.validators.validation_messages import did_you_mean

from ..engine.quantity_registry import (
    BODY_QUANTITIES,
    END_QUANTITIES,
    FLEXIBLE_QUANTITIES,
    HINGE_QUANTITIES,
    MASS_QUANTITIES,
    SUMS,
    WORK_KIND,
    WXYZ,
    QuantityKind,
)
from ..packing.coordinate_layout import HingeSlots
from .element_quantities import AppliedLoads, ElementValues, element_values
from .hinge_quantities import HingeValues, add_coordinates
from .observations import euler_angles, quaternions
from .quantity_names import Quantity, Table, component_of, quantity_of, single_quantity_name

if TYPE_CHECKING:
    from .flexible.quantities import FlexibleResults
    from .observations import Observations


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
        scene, loop_scene = observed.references.scene, observed.engine.packed.user_scene
        #: Springs, loads, bushings and closures of loops by name, which a hinge may share.
        self._elements: dict[str, list[ElementValues]] = {}
        for element in element_values(self.applied_loads, scene, loop_scene):
            self._elements.setdefault(element.name, []).append(element)

    # --- bodies ---------------------------------------------------------------------------------

    def body_quantity(self, reference: str, kind: str) -> Array:
        """Quantity (n, 3) of a body or end, or (n, 4) for the orientation."""
        points = self.observations.points(reference)
        if BODY_QUANTITIES[kind].part:
            return points[:, BODY_QUANTITIES[kind].columns]
        if kind == "euler":
            return euler_angles(points[:, 15:24])
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
        return self.observations.loads(hinge_name, HINGE_QUANTITIES[kind].columns.start)

    def effort(self, hinge: str) -> Array:
        """Efforts (n, nu) of laws and drives along the speeds of a hinge."""
        return self.observations.columns("efforts", (self.slots(hinge).u_slice,))

    def sum(self, name: str) -> Array:
        """Sum over the scene, by name: (n,) or (n, 3)."""
        values = self.observations.part("sums")[:, SUMS[name].columns]
        if name == "energy":
            return np.asarray(values.sum(axis=1))
        return values if SUMS[name].labels else values[:, 0]

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
        for elements in self._elements.values():
            table = Table({}, [])
            for element in elements:
                element.add_to(table)
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
        yield from (name for name in self._elements if not any(name in names for names in bodies))
        yield ""

    def table_of(self, owner: str) -> Table:
        """Name table of one owner."""
        if owner not in self._tables:
            table, hinges = Table({}, []), self.layout.hinges
            is_own_name = self._external_names.hinge.get(owner, owner) == owner
            if is_own_name and owner in hinges and owner not in self.layout.modal:
                HingeValues(self.applied_loads, hinges[owner]).add_to(table)
            elif owner in self.observations.references:
                self._add_body(table, owner)
            elif not owner:
                self._add_scene(table)
            for element in self._elements.get(owner, ()):
                element.add_to(table)
            self._tables[owner] = table
        return self._tables[owner]

    def _is_owner(self, owner: str) -> bool:
        owner_groups = (self.layout.hinges, self.observations.references, self._elements)
        return any(owner in owners for owners in owner_groups)

    def _add_body(self, table: Table, reference: str) -> None:
        for kind in BODY_QUANTITIES.values():
            get = partial(self.body_quantity, reference, kind.name)
            rates = partial(self.body_quantity, reference, kind.rates) if kind.rates else None
            table.add(reference, kind, get, rates, reference)
        slots = self.layout.modal.get(reference)
        if slots is not None:
            owner = f"flexible body {slots.name}"
            add_coordinates(table, self.applied_loads, slots, owner, modes=True)
        body, end = split_reference(reference)
        for kind in self._kinds_with_method(body, end):
            method = getattr(self._flexible, kind.method or kind.name)
            get = partial(method, body, end) if end else partial(method, body)
            table.add(reference, kind, get, owner=reference)

    def _kinds_with_method(self, body: str, end: str) -> Iterator[QuantityKind]:
        """Kinds of a body or of one of its ends that methods of `Result` compute."""
        flexible = self._flexible.model.flexible_bodies.get(body)
        if end:
            has_axis = flexible is not None and flexible.has_axis
            yield from END_QUANTITIES.values() if has_axis else ()
            return
        for kind in MASS_QUANTITIES.values():
            yield replace(kind, listed=flexible is not None)
        if flexible is not None:
            yield replace(FLEXIBLE_QUANTITIES["modal_energy"], labels=flexible.modes)
            yield FLEXIBLE_QUANTITIES["strain_energy"]

    def _add_scene(self, table: Table) -> None:
        for name, kind in SUMS.items():
            owner = "the scene" if kind.labels else ""
            table.add("", kind, partial(self.sum, name), owner=owner)
        table.add("", WORK_KIND, lambda: self.run.work, partial(self.sum, WORK_KIND.rates))
        scene = self.observations.references.scene
        for word, channels in (("input", scene.input), ("signal", scene.signal)):
            for channel in channels:
                kind = QuantityKind(channel.name, channel.unit, f"{word} {channel.name}")
                table.add("", kind, partial(self._input, channel.name))
        column = self.observations.engine.packed.system.held_inputs.first
        for controller in scene.controller:
            for k in range(len(controller.A)):
                kind = QuantityKind(f"x[{k}]", "", f"state {k}")
                get = partial(self._memory, column + 1 + k)
                table.add(controller.name, kind, get, owner=f"controller {controller.name}")
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

    def _input(self, name: str) -> Array:
        packed = self.observations.engine.packed
        number = packed.layout.inputs[name]
        column = packed.system.held_inputs.memory_indices[number]
        if column >= 0:
            return self._memory(column)
        channel = packed.system.inputs[number]
        return np.array([channel.value(t) for t in self.run.t.tolist()])

    def _memory(self, memory_index: int) -> Array:
        return self.run.memory[:, memory_index]
