"""Packed scene -> Structure for the fused engine, and the vector p of its run-time numbers."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mstmm.ir import (
    Assign,
    Constant,
    KernelIR,
    Operand,
    Port,
    Statement,
    Store,
)
from mstmm.ir import (
    Element as ArrayEntry,
)
from mstmm.ir.structure import (
    BodyStructure,
    Entries,
    Entry,
    ExpressionStructure,
    ForceStructure,
    Key,
    LawStructure,
    LoadStructure,
    ModalStructure,
    SectionStructure,
    Structure,
    angle_of,
)

from ..kernels import prebuilt
from ..kernels.prebuilt import Element
from .bodies import Known, kernel_type
from .packed import Packed

#: Numbers behind the parameters of a user's body: internal frame in its own (rotation, origin).
_USER_FRAME = 12
#: Numbers of expressions that decide which terms there are.
_STRUCTURAL = frozenset({"0", "1", "-1", "pi"})


class _Reader:
    """Reads the engine's records; numbers become structural constants or places in p."""

    def __init__(self, packed: Packed, known: Known, bake: bool) -> None:
        self.packed, self.ffi, self.bake = packed, packed.ffi, bake
        self.numbers: list[float] = []
        self.elements = {**prebuilt.elements(), **known}
        self._owners = {
            (name, self._address(function)): key
            for key, element in self.elements.items()
            for name, function in element.functions.items()
        }

    def _address(self, function: Any) -> int:
        return int(self.ffi.cast("uintptr_t", function))

    def owner(self, kernel: str, function: Any) -> Key:
        """Element to which a kernel function belongs."""
        return self._owners[kernel, self._address(function)]

    def hinge(self, index: int, record: Any) -> Key:
        """Element of a body's hinge; one that is interpreted has no function to be known by."""
        if record.hinge != self.ffi.NULL:
            return self.owner("hinge", record.hinge)
        link = self.packed.topology.links[index]
        return "hinge", kernel_type(self.packed.scene.hinges[link.hinge], self.packed.releases)

    def law_kernel(self, function: Any) -> str:
        """Name of a kernel of the laws."""
        laws = self.elements["sweep", "laws"].functions
        address = self._address(function)
        return next(name for name, f in laws.items() if self._address(f) == address)

    def entries(self, values: Iterable[float], axes: bool = False) -> Entries:
        """Zeros, and +-1 of axes, are structure; the rest goes to p."""
        return tuple(self._entry(float(value), axes) for value in values)

    def _entry(self, value: float, axes: bool) -> Entry:
        if value == 0.0 or (axes and abs(value) == 1.0):
            return value + 0.0  # -0.0 and 0.0 are one structure
        return self._place(value)

    def expression(self, name: str) -> ExpressionStructure | None:
        """Expressions of the scene with their numbers taken out; None if there are none."""
        kernel = self.packed.expressions.get(name)
        if kernel is None:
            return None
        texts: list[str] = []

        def taken(operand: Operand) -> Operand:
            if not isinstance(operand, Constant) or operand.text in _STRUCTURAL:
                return operand
            texts.append(operand.text)
            return ArrayEntry("constants", (len(texts) - 1,))

        statements: list[Statement] = []
        for statement in kernel.statements:
            if isinstance(statement, Assign):
                arguments = tuple(map(taken, statement.args))
                statements.append(Assign(statement.number, statement.op, arguments))
            elif isinstance(statement, Store):
                statements.append(Store(statement.port, statement.index, taken(statement.value)))
            else:
                statements.append(statement)
        inputs = (*kernel.inputs, Port("constants", (len(texts),)))
        ir = KernelIR(kernel.name, inputs, kernel.outputs, tuple(statements))
        return ExpressionStructure(ir, tuple(self._place(Constant(x).number) for x in texts))

    def _place(self, value: float) -> Entry:
        if self.bake:
            return value
        self.numbers.append(value)
        return len(self.numbers) - 1

    def unpack(self, pointer: Any, count: int) -> list[Any]:
        """The first `count` numbers of a C array."""
        return list(self.ffi.unpack(pointer, count)) if count else []


def structure_of(
    packed: Packed, known: Known, bake: bool = False
) -> tuple[Structure, NDArray[np.float64]]:
    """(structure, p) of a packed scene; `known` are elements beyond the prebuilt ones.

    With `bake` every number is part of the structure and p is empty.
    """
    reader, model = _Reader(packed, known, bake), packed.model
    gravity = reader.entries(model.gravity)
    drives = [model.drives[k] for k in range(model.n_drives)]
    bodies = tuple(_body(reader, i) for i in range(model.n_bodies))
    laws = tuple(_law(reader, model.laws[k]) for k in range(model.n_laws))
    loads = tuple(_load(reader, model.loads[k]) for k in range(model.n_loads))
    forces = tuple(_force(reader, k) for k in range(model.n_forces))
    used = {key for body in bodies for key in (body.hinge, body.body)}
    used |= {force.element for force in forces}
    values, prescribed = reader.expression("values"), reader.expression("drives")
    structure = Structure(
        int(model.nq), int(model.nu), len(reader.numbers), int(model.n_memory), gravity, bodies,
        laws, loads, forces, values, prescribed,
        tuple((int(d.body), int(d.speed)) for d in drives),
        {key: _hash(reader, reader.elements[key]) for key in sorted(used)},
    )  # fmt: skip
    return structure, np.array(reader.numbers)


def _hash(reader: _Reader, element: Element) -> str:
    return prebuilt.text(reader.ffi, element.descriptor.hash)


def _body(reader: _Reader, index: int) -> BodyStructure:
    record = reader.packed.model.bodies[index]
    hinge, body = reader.hinge(index, record), reader.owner("inertia", record.inertia)
    link = _link(reader, record, hinge)
    connection = [] if link else reader.unpack(record.connection, 12)
    count = reader.elements[body].descriptor.np
    own = reader.unpack(record.body_p, count if body[1] == "rigid" else count + _USER_FRAME)
    return BodyStructure(
        int(record.parent), hinge, body, int(record.q), int(record.u), int(record.nq),
        int(record.nu), reader.entries(connection[:9], axes=True), reader.entries(connection[9:]),
        reader.entries(reader.unpack(record.hinge_p, reader.elements[hinge].descriptor.np)),
        (*reader.entries(own[:count]), *reader.entries(own[count:], axes=True)),
        reader.entries(reader.unpack(record.rotor, record.nu)), link,
        tuple(reader.unpack(record.imposed_mask, record.nu)),
        _modal(reader, record.modal), _section(reader, record), bool(record.idle),
    )  # fmt: skip


#: Fields of `mstmm_moments` in the order of the kernels' inputs: name, field, place in it.
_MOMENTS = (
    ("p", "rigid", None), ("C", "c", None), ("P", "p", None), ("B", "b", None),
    *((f"Z_{ab}", "z", k) for k, ab in enumerate(("xx", "xy", "xz", "yy", "yz", "zz"))),
    *((f"Y_{a}", "y", k) for k, a in enumerate("xyz")),
    *((f"G_{a}", "g", k) for k, a in enumerate("xyz")),
    ("M", "m", None),
)  # fmt: skip
#: Rows of those that are not n x n.
_ROWS = {"C": 3, "P": 3, "B": 6}


def _moments(reader: _Reader, record: Any, n: int) -> tuple[tuple[str, Entries], ...]:
    found = []
    for name, field, place in _MOMENTS:
        pointer = getattr(record, field)
        count = 10 if name == "p" else n * _ROWS.get(name, n)
        array = reader.unpack(pointer if place is None else pointer[place], count)
        found.append((name, reader.entries(array)))
    return tuple(found)


def _modal(reader: _Reader, record: Any) -> ModalStructure | None:
    """Modes of a flexible body; None for a body without."""
    if record == reader.ffi.NULL:
        return None
    n = int(record.n)
    drag = () if record.drag == reader.ffi.NULL else _moments(reader, record.drag, n)
    return ModalStructure(
        n, int(record.q), int(record.u), _moments(reader, record.moments, n), drag,
        reader.entries(reader.unpack(record.stiffness, n * n)),
        reader.entries(reader.unpack(record.damping, n * n)),
    )  # fmt: skip


def _section(reader: _Reader, body: Any) -> SectionStructure | None:
    """Section that a body's connection passes; None where it passes none."""
    record = body.section
    if record == reader.ffi.NULL:
        return None
    n, model = int(record.modal.n), reader.packed.model
    frame = next(i for i in range(model.n_bodies) if model.bodies[i].modal == record.modal)
    arrays = [
        ("r", record.point, 3), ("phi", record.phi, 3 * n), ("theta", record.theta, 3 * n),
        *((f"g_{a}", record.drawn[k], n * n) for k, a in enumerate("xyz")),
        *((f"h_{a}", record.turned[k], n * n) for k, a in enumerate("xyz")),
    ]  # fmt: skip
    return SectionStructure(
        frame, bool(record.inward),
        tuple((name, reader.entries(reader.unpack(x, count))) for name, x, count in arrays),
        reader.entries(reader.unpack(record.end, 9), axes=True),
    )  # fmt: skip


def _link(reader: _Reader, record: Any, hinge: Key) -> Entries:
    """Screws about x and z of a connection between axial hinges; empty if it is none.

    A slide has no coordinate that could take up a constant angle about z.
    """
    if record.link == reader.ffi.NULL:
        return ()
    cosine, sine, shift, angle, height = reader.unpack(record.link, 5)
    if angle_of(hinge) is None and angle != 0.0:
        return ()
    return (*reader.entries((cosine, sine), axes=True), *reader.entries((shift, angle, height)))


def _law(reader: _Reader, record: Any) -> LawStructure:
    kernel = reader.law_kernel(record.evaluate)
    kind = int(record.kind)
    counts = {"linear": 3, "full": 11, "rotation": 7, "six": 16}
    return LawStructure(
        int(record.body), kernel, int(record.coordinate), int(record.speed), int(record.n),
        int(record.twist), reader.entries(reader.unpack(record.p, counts[kernel])),
        reader.entries(reader.unpack(record.axes, 9 * kind), axes=True),
        tuple(reader.unpack(record.effort, record.n)),
    )  # fmt: skip


def _load(reader: _Reader, record: Any) -> LoadStructure:
    return LoadStructure(
        int(record.body), int(record.axes), reader.entries(record.axes_own, axes=True),
        reader.entries(record.offset), tuple(record.force), tuple(record.moment),
    )  # fmt: skip


def _force(reader: _Reader, index: int) -> ForceStructure:
    record = reader.packed.model.forces[index]
    element = reader.owner("wrench", record.wrench)
    count = reader.elements[element].descriptor.np
    return ForceStructure(
        element, int(record.body_f), int(record.body_t), reader.entries(record.axes_f, axes=True),
        reader.entries(record.axes_t, axes=True), reader.entries(record.offset_f),
        reader.entries(record.offset_t), reader.entries(reader.unpack(record.p, count)),
        reader.expression(f"effort {index}"),
    )  # fmt: skip
