"""C record `mstmm_model` of a system, derivative tapes added on first use, and trial rotors."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mstmm.array_validation import Integers
from mstmm.expression.derivatives import INPUTS
from mstmm.ir import KernelIR
from mstmm.ir.differentiation import differentiate
from mstmm.ir.tape import compile_tape
from mstmm.numerics.piecewise_polynomial import PiecewisePolynomial

from ...kernels import prebuilt_kernels
from ...kernels.c_records import CRecords, Memory, c_tape
from ...kernels.prebuilt_kernels import Elements
from ..load_coupling import LoadDependence, load_coupling
from ..system import LawNumbers, LawRun, System
from .body_records import BodyRecords, attach_runs
from .loop_records import LoopRecords, attach_loops
from .planar_records import attach_planar_bodies, motion_plane


@dataclass(frozen=True)
class Written:
    """Model record with its memory, and the layout of the workspace.

    Attributes:
        keep_alive: references that keep the memory of the records alive.
        blocks, modal, sections: offsets of the numbers of bodies, flexible bodies and sections, by
            position in the tree.
        scratch: offset behind them.
        slots: largest workspace of a tape.
        load_dependence: dependence of the loads on the motion of bodies.
        loops: records of the closed loops, None without any.
    """

    model: Any
    keep_alive: list[Any]
    blocks: Integers
    modal: dict[int, int]
    sections: dict[int, int]
    scratch: int
    slots: int
    load_dependence: LoadDependence
    loops: LoopRecords | None


def write_model(system: System, elements: Elements) -> Written:
    """Write the records of a system."""
    ffi, lib = prebuilt_kernels.module()
    memory = Memory(ffi)
    model = memory.new("mstmm_model *")
    bodies, laws = BodyRecords(system, elements, memory, lib), _LawRecords(system, memory)
    drives = [{"body": body, "coordinate": k, "speed": k} for body, k in system.driven]
    reach = load_coupling(system)
    for place in reach.own_load_bodies:
        bodies.records.array[place].placed = 1
    loads = memory.new("mstmm_load[]", max(1, len(system.loads)))
    for record, load, is_own in zip(loads, system.loads, reach.loads, strict=False):
        memory.fill(record, load, own=is_own)
    forces = memory.new("mstmm_force[]", max(1, len(system.forces)))
    for record, force, is_own in zip(forces, system.forces, reach.forces, strict=False):
        functions = elements[force.element].functions
        ends = {
            f"{name}_{letter}": value
            for letter, end in zip("ft", force.ends, strict=True)
            for name, value in zip(("body", "axes", "offset"), end, strict=True)
        }
        memory.fill(
            record, force, own=is_own, wrench=functions["wrench"],
            wrench_slope=functions.get("wrench_slope"), **ends,
        )  # fmt: skip
    memory.fill(
        model, system, strained=system.strain_index, n_bodies=system.count,
        bodies=bodies.records.array, n_flexible=len(bodies.modal.modal),
        n_imposed=int(system.rows(lambda body: any(body.imposed)).sum()),
        drives=memory.new("mstmm_drive[]", drives or 1), n_drives=len(drives),
        drive_tape=system.drives, laws=laws.records.array, n_laws=laws.records.count,
        loads=loads, n_loads=len(system.loads), forces=forces, n_forces=len(system.forces),
        needs_pose=bool(
            system.forces or system.loads or system.bodies_with_drag or system.has_loops
        ),
        inputs=write_inputs(system.inputs, system.held_inputs.memory_indices, memory),
        n_inputs=len(system.inputs), n_values=system.n_values, value_tape=system.values,
        closures=None, couplings=None,
    )  # fmt: skip
    offset, loops = bodies.end, None
    if system.has_loops:
        offset, loops = attach_loops(model, system, memory, lib, offset)
        axes = motion_plane(system, elements)
        if axes is not None:
            offset = attach_planar_bodies(
                model, system, elements, memory, lib, loops.body_records, axes, offset
            )
    scratch = attach_runs(model, system, memory, lib, offset)
    return Written(
        model, memory.keep_alive, bodies.blocks, bodies.modal.modal, bodies.modal.sections,
        scratch, memory.slots, reach, loops,
    )  # fmt: skip


def write_inputs(inputs: Sequence[PiecewisePolynomial], held: Sequence[int], memory: Memory) -> Any:
    """Write `mstmm_input[]` of inputs and signals; `held` are their indices in memory, or -1."""
    records = memory.new("mstmm_input[]", max(1, len(inputs)))
    written: dict[int, tuple[Any, Any]] = {}  # many trajectories may share a long signal
    for record, channel, index in zip(records, inputs, held, strict=False):
        if id(channel) not in written:
            pieces = [x for piece in channel.pieces for x in piece]
            written[id(channel)] = memory.reals(channel.knots), memory.reals(pieces)
        knots, numbers = written[id(channel)]
        memory.fill(record, n_knots=len(channel.knots), knots=knots, numbers=numbers, held=index)
    return records


# --- hinge laws -----------------------------------------------------------------------------------


class _LawRecords:
    """Records of the hinge laws, run by run; those of a pattern are filled once and copied."""

    def __init__(self, system: System, memory: Memory) -> None:
        self.memory, self.functions = memory, prebuilt_kernels.element("sweep", "laws").functions
        self.records = CRecords(memory.ffi, "mstmm_law", sum(run.count for run in system.laws))
        memory.keep_alive.append(self.records)
        first = 0
        for run in system.laws:
            self._fill_run(run, first)
            first += run.count

    def _fill_run(self, run: LawRun, first: int) -> None:
        if run.count == len(run.pattern):
            for number, (law, body, twist, efforts) in enumerate(run.iterate_laws(), first):
                record = self.records.array[number]
                self._fill(record, law)
                record.body, record.twist = body, twist
                record.effort = self.memory.ints(efforts)
            return
        prototypes = CRecords(self.memory.ffi, "mstmm_law", len(run.pattern))
        for record, law in zip(prototypes.array, run.pattern, strict=True):
            self._fill(record, law)
        numbers = slice(first, first + run.count)
        repeats, k_in_pattern = np.divmod(np.arange(run.count), len(run.pattern))
        self.records.copy(numbers, prototypes, k_in_pattern)
        member = np.array([law.member for law in run.pattern])[k_in_pattern]
        turn = np.array([law.turn for law in run.pattern])[k_in_pattern]
        column = self.records.column
        column("body")[numbers] = run.position + repeats * run.period + member
        column("twist")[numbers] = np.where(
            turn < 0, -1, run.twist + repeats * run.rotation_count + turn
        )
        for k, law in enumerate(run.pattern):
            pointers = column("effort")[numbers][k :: len(run.pattern)]
            indices = np.array(law.efforts, dtype=np.int32)
            self.memory.keep_alive.append(indices)
            pointers[:] = indices.ctypes.data
            if len(indices) > 1:
                pointers += indices.strides[0] * np.arange(len(pointers), dtype=pointers.dtype)

    def _fill(self, record: Any, law: LawNumbers) -> None:
        """Fill the fields that all repeats of a law share."""
        self.memory.fill(
            record, law, kind=law.turn >= 0, axes=law.axes or None,
            evaluate=self.functions[law.kernel],
            evaluate_slope=self.functions[f"{law.kernel}_slope"],
        )  # fmt: skip


# --- derivatives of expressions -------------------------------------------------------------------


@dataclass
class Slopes:
    """Tapes of derivatives: their largest workspace, and references that keep them alive."""

    slots: int = 0
    keep_alive: list[Any] = field(default_factory=list)


def write_slopes(system: System, model: Any, ffi: Any) -> Slopes:
    """Write derivative tapes of drives, values, couplings and spring efforts to `model`."""
    slopes = Slopes()

    def tape(kernel: KernelIR | None) -> Any:
        if kernel is None:
            return ffi.NULL
        ports = [port.name for port in kernel.inputs if port.name != INPUTS]
        slope = compile_tape(differentiate(kernel, ports, values=False, guards=False))
        slopes.slots = max(slopes.slots, slope.slots)
        return c_tape(ffi, slope, slopes.keep_alive)

    model.drive_slopes, model.value_slopes = tape(system.drives), tape(system.values)
    model.coupling_slopes = tape(system.coupling_kernel)
    for k, force in enumerate(system.forces):
        model.forces[k].effort_slope = tape(force.effort)
    return slopes


# --- trial rotors ---------------------------------------------------------------------------------


@contextmanager
def trial_rotors(written: Written) -> Iterator[Callable[[int], None]]:
    """Context in which hinges, by position in the tree, can be given rotors of 1 kg m^2.

    All rotors are removed at its end.  Links do not support them, so the sweep then goes body by
    body.
    """
    ffi, _ = prebuilt_kernels.module()
    rotor = ffi.new("real[]", [1.0] * 6)
    before: dict[int, tuple[object, int]] = {}
    model = written.model
    posed, model.needs_pose = model.needs_pose, 1

    def add_rotor(place: int) -> None:
        record = model.bodies[place]
        before[place] = (record.rotor, int(record.generic))
        record.rotor, record.generic = rotor, 1

    try:
        yield add_rotor
    finally:
        model.needs_pose = posed
        for place, (old, generic) in before.items():
            record = model.bodies[place]
            record.rotor, record.generic = old, generic
