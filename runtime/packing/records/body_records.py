"""Bodies -> C records: one filled for all that are alike, and copied."""

from __future__ import annotations

from typing import Any

import numpy as np

from mstmm.array_validation import Integers
from mstmm.ir.scene_structure import Key

from ...kernels import prebuilt_kernels
from ...kernels.c_records import CRecords
from ..bodies import RIGID
from ..scene_elements import Elements
from ..system import BodyNumbers, Numbers, System
from .memory import Memory
from .modal_records import ModalRecords

_HINGE = (
    "hinge", "forward", "condense", "recover", "hinge_slope", "rates_by_coordinates",
    "rates_by_speeds", "forward_kept", "directions",
)  # fmt: skip
_BODY = ("inertia", "bias_load", "energy")
#: Kernels that elements of earlier versions do not have.
_BODY_SLOPES = ("bias_load_slope", "load_by_motion")


class BodyRecords:
    """The records of a system's bodies, in the order of the tree.

    `blocks` are the places of the bodies' blocks in the workspace, `end` is behind them and behind
    the numbers of flexible bodies.
    """

    def __init__(self, system: System, elements: Elements, memory: Memory, lib: Any) -> None:
        self.system, self.elements, self.memory = system, elements, memory
        self.modal = ModalRecords(memory, lib)
        self._made: dict[tuple[Key, Key, str], Any] = {}
        self.records = self._filled()
        memory.kept.append(self.records)
        self.blocks, behind = self._blocks(lib)
        columns = {"parent": system.parents, **system.places, "block": self.blocks}
        for name, column in columns.items():
            self.records.write(name, column)
        self.end = self.modal.begin(behind)

    def _filled(self) -> CRecords:
        """Every body but for its place."""
        alike = [(run.place, one) for run in self.system.bodies for one in run.alike]
        prototypes = CRecords(self.memory.ffi, "mstmm_body", len(alike))
        for record, (place, one) in zip(prototypes.array, alike, strict=False):
            self._fill(record, one, place)
        if len(alike) == self.system.count:
            return prototypes
        records = CRecords(self.memory.ffi, "mstmm_body", self.system.count)
        records.copy(slice(None), prototypes, self.system.which)
        return records

    def _blocks(self, lib: Any) -> tuple[Integers, int]:
        """Places of the blocks in the workspace, behind the ground's, and the place behind them."""
        fixed, per_speed = int(lib.MSTMM_BLOCK_FIXED), int(lib.MSTMM_BLOCK_PER_SPEED)
        if not self.system.count:
            return np.zeros(0, dtype=np.int64), fixed
        lengths = fixed + per_speed * self.system.rows(lambda body: body.nu).astype(np.int64)
        ends = fixed + np.cumsum(lengths)
        return ends - lengths, int(ends[-1])

    def _fill(self, record: Any, body: BodyNumbers, place: int) -> None:
        """Numbers, and the kernels that read them."""
        record.nq, record.nu = body.nq, body.nu
        record.straight, record.steady = int(body.straight), int(body.steady)
        record.turning = int(body.turning)
        record.release, record.idle = body.release, int(body.idle)
        record.n_imposed, record.imposed_mask = sum(body.imposed), self.memory.ints(body.imposed)
        self._numbers(record, body)
        unknown = not self.elements[body.hinge].functions.get("condense")
        bound = any(body.imposed) or any(body.rotor)
        # Columns of rows and poses ask for the hinge's motion, which is then found once for all.
        posed = unknown or body.section is not None or self.system.closes
        record.generic, record.kernels = int(posed or bound), self._kernels(body, posed)
        if body.modal is not None:
            record.modal = self.modal.add_modal(place, body.modal)
        if body.section is not None:
            record.section = self.modal.add_section(place, body.section)

    def _numbers(self, record: Any, body: BodyNumbers) -> None:
        """Arrays side by side in memory."""
        link: Numbers = ()
        if link_kernel(body):
            # every link has room for a number of its hinge
            link = (
                *body.body_p,
                body.rotor[0],
                *(body.hinge_p or (0.0,)),
                *connection_numbers(body),
            )
        own = (*body.body_p, *body.body_frame)
        start = self.memory.reals(
            (*body.connection, 0.0, 0.0, -body.height, *body.rotor, *body.hinge_p, *own, *link)
        )
        record.connection, record.rotor = start, start + 15
        record.hinge_p = start = start + (15 + len(body.rotor))
        record.body_p = start = start + len(body.hinge_p)
        if link:
            record.link = start + len(own)

    def _kernels(self, body: BodyNumbers, posed: bool) -> Any:
        """Functions of the hinge, the body and the link, shared by bodies of one kind."""
        link = "" if posed else link_kernel(body)
        kind = (body.hinge, body.body, link)
        if kind not in self._made:
            made = self._kernels_of(body.hinge, body.body, link)
            made.link_numbers, made.link_angles = (
                len(connection_numbers(body)),
                int(bool(body.link)),
            )
            self._made[kind] = made
        return self._made[kind]

    def _kernels_of(self, of_hinge: Key, of_body: Key, link: str) -> Any:
        made, none = self.memory.new("mstmm_kernels *"), self.memory.ffi.NULL
        hinge, rigid = self.elements[of_hinge], self.elements[of_body].functions
        for name in _HINGE:
            setattr(made, name, hinge.functions.get(name, none))
        for name in _BODY:
            setattr(made, name, rigid[name])
        made.rigid = int(of_body[1] == RIGID)
        for name in _BODY_SLOPES:
            setattr(made, name, rigid.get(name, none))
        if hinge.tape is not None:
            made.tape = self.memory.tape(hinge.tape)
            made.slope_tape = self.memory.tape(hinge.slope_tape) if hinge.slope_tape else none
        if link:
            for name, function in self.elements["sweep", link].functions.items():
                setattr(made, f"link_{name}", function)
        return made


def connection_numbers(body: BodyNumbers) -> Numbers:
    """Numbers of the way from the parent in a link: screws, or a rotation and a place."""
    return body.link or body.connection


def link_kernel(body: BodyNumbers) -> str:
    """The link that a body with its hinge is swept as; none where it is no link, where something
    imposes the speed, for several speeds with rotors, and for hinges of the user's."""
    if not body.linked:
        return ""
    rotor, about_a_point = any(body.rotor), body.turning and body.nu > 1
    if not (body.link or about_a_point) or body.body[1] != RIGID or body.section or body.modal:
        return ""
    if any(body.imposed) or (rotor and body.nu > 1):
        return ""
    name = f"link_{body.hinge[1]}{'_rotor' if rotor else ''}"
    return name if ("sweep", name) in prebuilt_kernels.elements() else ""
