"""Structure of a system for the fused engine, and the vector p of its run-time numbers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import fields, replace
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from mstmm import ir
from mstmm.expression.derivatives import INPUTS
from mstmm.ir import KernelIR, Operand, Port, Statement
from mstmm.ir import scene_structure as code
from mstmm.ir.scene_structure import (
    COUPLING_NUMBERS,
    BodyStructure,
    ClosureStructure,
    CouplingStructure,
    Entries,
    Entry,
    RowStructure,
    Structure,
)
from mstmm.numerics.dual import to_real, value_of

from ..kernels.prebuilt_kernels import Elements, Known
from . import system as given
from .expression_tapes import MOVING
from .row_plan import FlexibleRowPlan, row_groups
from .system import ClosureNumbers, CouplingNumbers, System

#: Constants in expressions that stay in the structure.
_STRUCTURAL = frozenset({"0", "1", "-1", "pi"})
#: Fields of structures that are axes, whose +-1 are structural as well.
_AXES = ("axes", "axes_own")
T = TypeVar("T")


def structure_of(
    system: System, known: Known, bake: bool = False, floors: Sequence[float] = ()
) -> tuple[Structure, NDArray[np.float64]]:
    """(structure, p) of a system; `known` are elements in addition to the prebuilt ones.

    With `bake` all numbers except those of inputs become part of the structure.  `floors` are the
    pivots of the constraint rows below which they count as rounding.
    """
    structure, numbers = structure_and_numbers(system, known, bake, floors)
    return structure, np.array(numbers)


def structure_and_numbers(
    system: System, known: Known, bake: bool = False, floors: Sequence[float] = ()
) -> tuple[Structure, list[Any]]:
    """`structure_of` with p as a list of floats and Duals."""
    builder, elements = _StructureBuilder(system, bake), Elements(known)
    gravity = builder.entries(system.gravity)
    bodies = tuple(body for run in system.bodies for body in builder.bodies(run))
    loops: list[Any] = [(), (), ()]
    if system.has_loops:
        bodies, *loops = _with_loops(bodies, system, builder.entries, floors)
    closures, rows, couplings = loops
    laws = tuple(law for run in system.laws for law in builder.laws(run))
    loads = tuple(builder.structure(code.LoadStructure, load) for load in system.loads)
    forces = tuple(map(builder.force, system.forces))
    used = {key for body in bodies for key in (body.hinge, body.body)}
    used |= {force.element for force in forces}
    values, prescribed = builder.expression(system.values), builder.expression(system.drives)
    coupled = builder.expression(system.coupling_kernel)
    inputs = tuple(sorted(builder.inputs.items()))
    structure = Structure(
        system.nq, system.nu, len(builder.numbers), system.held_inputs.first, gravity, bodies, laws,
        loads, forces, values, prescribed, system.driven, closures, rows, couplings, coupled,
        {key: elements[key].hash for key in sorted(used)}, inputs,
    )  # fmt: skip
    return structure, builder.numbers


class _StructureBuilder:
    """Sorts the numbers of a system into structural constants and indices of p."""

    def __init__(self, system: System, bake: bool) -> None:
        self.moving, self.bake = system.seeded_numbers, bake
        self.numbers: list[Any] = []
        self._inputs_at_zero = [x for channel in system.inputs for x in channel.piece_at(0.0)]
        #: Index among the numbers of all inputs -> index in p, for those that are read.
        self.inputs: dict[int, int] = {}

    def entries(self, values: Iterable[float], axes: bool = False) -> Entries:
        """Sort numbers: zeros, and +-1 of axes, into the structure, all others into p."""
        return tuple(self._entry(to_real(value), axes) for value in values)

    def _entry(self, value: float, axes: bool) -> Entry:
        if value == 0.0 or (axes and abs(value) == 1.0):
            return value_of(value) + 0.0  # -0.0 and 0.0 must give the same structure
        return self._parameter(value)

    def _parameter(self, value: float) -> Entry:
        """Index of a new number of p, or the number itself with `bake`."""
        if self.bake:
            return value
        self.numbers.append(value)
        return len(self.numbers) - 1

    # --- expressions --------------------------------------------------------------------------

    def expression(self, kernel: KernelIR | None) -> code.ExpressionStructure | None:
        """Expressions of the scene with their numbers as inputs; None if there are none."""
        if kernel is None:
            return None
        constants: list[Entry] = []

        def generalise(operand: Operand) -> Operand:
            if isinstance(operand, ir.Element) and operand.port == INPUTS:
                constants.append(self._input(int(operand.index[0])))
            elif isinstance(operand, ir.Element) and operand.port == MOVING:
                constants.append(self._parameter(self.moving[int(operand.index[0])]))
            elif isinstance(operand, ir.Constant) and operand.text not in _STRUCTURAL:
                constants.append(self._parameter(operand.number))
            else:
                return operand
            return ir.Element("constants", (len(constants) - 1,))

        statements: list[Statement] = []
        for statement in kernel.statements:
            if isinstance(statement, ir.Assign):
                statements.append(replace(statement, args=tuple(map(generalise, statement.args))))
            elif isinstance(statement, ir.Store):
                statements.append(replace(statement, value=generalise(statement.value)))
            else:
                statements.append(statement)
        inputs = [port for port in kernel.inputs if port.name not in (INPUTS, MOVING)]
        inputs.append(Port("constants", (len(constants),)))
        general = KernelIR(kernel.name, tuple(inputs), kernel.outputs, tuple(statements))
        return code.ExpressionStructure(general, tuple(constants))

    def _input(self, entry: int) -> int:
        """Index in p of a number of inputs; all its readers share it."""
        if entry not in self.inputs:
            self.inputs[entry] = len(self.numbers)
            self.numbers.append(self._inputs_at_zero[entry])
        return self.inputs[entry]

    # --- records --------------------------------------------------------------------------------

    def structure(self, kind: type[T], source: Any, **others: Any) -> T:
        """Structure with `others` and, in the order of `kind`, the fields of `source`."""
        for field in fields(kind):  # type: ignore[arg-type]
            if field.name not in others and hasattr(source, field.name):
                value = getattr(source, field.name)
                if field.type == "Entries":
                    value = self.entries(value, axes=field.name in _AXES)
                others[field.name] = value
        return kind(**others)

    def bodies(self, run: given.BodyRun) -> Iterable[BodyStructure]:
        """Structures of all bodies of a run."""
        places = zip(run.slots.q_starts().tolist(), run.slots.u_starts().tolist(), strict=True)
        for k, (q, u) in enumerate(places):
            yield self._body(run.member(k), run.position + k - 1 if k else run.parent, q, u)

    def _body(self, body: given.BodyNumbers, parent: int, q: int, u: int) -> BodyStructure:
        link = self._link(body)
        connection = () if link else body.connection
        numbers = {
            "rotation": self.entries(connection[:9], axes=True),
            "position": self.entries(connection[9:]), "hinge_p": self.entries(body.hinge_p),
            "body_p": (*self.entries(body.body_p), *self.entries(body.body_frame, axes=True)),
            "rotor": self.entries(body.rotor), "modal": self._modal(body.modal),
            "section": self._section(body.section),
        }  # fmt: skip
        return self.structure(BodyStructure, body, parent=parent, q=q, u=u, link=link, **numbers)

    def _link(self, body: given.BodyNumbers) -> Entries:
        """Screws about x and z of a connection between axial hinges; empty if there are none.

        A constant angle about z needs a rotation coordinate, which prismatic hinges do not have.
        """
        if not body.link or (code.rotation_coordinate(body.hinge) is None and body.link[3] != 0.0):
            return ()
        return (*self.entries(body.link[:2], axes=True), *self.entries(body.link[2:]))

    def _arrays(self, arrays: given.Arrays | None) -> tuple[tuple[str, Entries], ...]:
        named = {} if arrays is None else arrays.named
        return tuple((name, self.entries(array.ravel().tolist())) for name, array in named.items())

    def _modal(self, modal: given.ModalNumbers | None) -> code.ModalStructure | None:
        """Modes of a flexible body; None for other bodies."""
        if modal is None:
            return None
        drag, moments = self._arrays(modal.drag), self._arrays(modal.moments)
        matrices = dict(self._arrays(modal.matrices))
        return self.structure(code.ModalStructure, modal, moments=moments, drag=drag, **matrices)

    def _section(self, section: given.SectionNumbers | None) -> code.SectionStructure | None:
        """Section of a flexible body in a body's connection; None without one."""
        if section is None:
            return None
        inputs, end = self._arrays(section.inputs), self.entries(section.end, axes=True)
        return self.structure(code.SectionStructure, section, numbers=inputs, end=end)

    def laws(self, run: given.LawRun) -> Iterable[code.LawStructure]:
        """Structures of all laws of a run."""
        for law, body, twist, effort in run.iterate_laws():
            yield self.structure(code.LawStructure, law, body=body, twist=twist, effort=effort)

    def force(self, force: given.ForceNumbers) -> code.ForceStructure:
        """Structure of a force element."""
        (body_f, axes_f, offset_f), (body_t, axes_t, offset_t) = force.ends
        ends = {
            "axes_f": self.entries(axes_f, axes=True), "axes_t": self.entries(axes_t, axes=True),
            "offset_f": self.entries(offset_f), "offset_t": self.entries(offset_t),
            "p": self.entries(force.p), "effort": self.expression(force.effort),
        }  # fmt: skip
        return self.structure(code.ForceStructure, force, body_f=body_f, body_t=body_t, **ends)


# --- closed loops ---------------------------------------------------------------------------------


class EntrySorter(Protocol):
    """Function that sorts numbers into structural constants and indices of p."""

    def __call__(self, values: Iterable[float], axes: bool = False) -> Entries: ...


def _with_loops(
    bodies: Sequence[BodyStructure], system: System, sort: EntrySorter, floors: Sequence[float]
) -> tuple[
    tuple[BodyStructure, ...], tuple[ClosureStructure, ...], tuple[RowStructure, ...],
    tuple[CouplingStructure, ...],
]:  # fmt: skip
    """Bodies with pending rows, closures in the order of their frames, rows, and couplings.

    `floors` are the pivots (rows,) below which they count as rounding; without them it is zero.
    """
    plan = FlexibleRowPlan(system, row_groups([body.parent for body in bodies], system))
    inertia: dict[int, Entries] = {}
    closures = [
        _closure(closure, plan.rows_by_group[group], bodies[closure.frame], sort, inertia)
        for group, closure in enumerate(system.closures)
    ]
    coupling_rows = (rows[0] for rows in plan.rows_by_group[len(closures) :])
    couplings = tuple(
        _coupling_structure(coupling, -1 if coupling.repeats else next(coupling_rows), bodies, sort)
        for coupling in system.couplings
    )
    of_speeds = {
        row
        for group, closure in enumerate(system.closures)
        for row, direction in zip(plan.rows_by_group[group], closure.directions, strict=True)
        if direction in closure.speed_directions
    }
    of_speeds |= {coupling.row for coupling in couplings if coupling.of_speeds}
    rests: dict[int, int] = {}
    for group, closure in enumerate(system.closures):
        if closure.choice is not None:
            without_rotors = [row for row in plan.rows_by_group[group] if row not in inertia]
            rests |= {row: closure.choice[0] + k for k, row in enumerate(without_rotors)}
    rows = tuple(
        RowStructure(
            row.body, row.others, sort(floors[number : number + 1]), inertia.get(number, ()),
            number in of_speeds, rests.get(number, -1),
        )
        for number, row in enumerate(plan.rows)
    )  # fmt: skip
    closures.sort(key=lambda closure: closure.frame)
    return _with_pending_rows(bodies, plan), tuple(closures), rows, couplings


def _coupling_structure(
    coupling: CouplingNumbers, row: int, bodies: Sequence[BodyStructure], sort: EntrySorter
) -> CouplingStructure:
    columns, column = list[tuple[int, int]](), coupling.first + len(COUPLING_NUMBERS)
    for hinge in coupling.hinges:
        columns.append((hinge.position, column))
        column += bodies[hinge.position].nu
    kept = sort(() if coupling.constant is None else (coupling.constant,))
    of_speeds = coupling.of_speeds or coupling.constant is None
    return CouplingStructure(row, coupling.first, of_speeds, kept, tuple(columns))


def _with_pending_rows(
    bodies: Sequence[BodyStructure], plan: FlexibleRowPlan
) -> tuple[BodyStructure, ...]:
    def with_rows(place: int, body: BodyStructure) -> BodyStructure:
        pending, bent = plan.pending.get(place, ()), plan.modal_rows.get(place, ())
        return replace(body, pending=tuple(pending), bent=tuple(bent)) if pending or bent else body

    return tuple(with_rows(place, body) for place, body in enumerate(bodies))


def _closure(
    closure: ClosureNumbers,
    own_rows: range,
    frame: BodyStructure,
    sort: EntrySorter,
    inertia: dict[int, Entries],
) -> ClosureStructure:
    """Structure of a closure; adds the inertia of rotors by row to `inertia`."""
    rows = [-1 if direction < closure.asked else -2 for direction in range(6)]
    for row, direction in zip(own_rows, closure.directions, strict=True):
        rows[direction] = row
        if direction < frame.nu and not frame.imposed[direction]:
            inertia[row] = (frame.rotor[direction],)
    return ClosureStructure(
        closure.frame, closure.outboard, sort(closure.turn, axes=True), sort(closure.end),
        tuple(rows), closure.kind, (*sort(closure.p[:2]), *sort(closure.p[2:], axes=True)),
    )  # fmt: skip
