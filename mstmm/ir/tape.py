"""Tape: bytecode of a kernel, a flat list of integers that prebuilt C interprets.

Expressions of scenes, and hinges on machines without a compiler, run this way.  The layout of the
workspace is [inputs | constants | temporaries].  No SymPy, no numpy.
"""

from __future__ import annotations

from dataclasses import dataclass

from .kernel import KernelIR
from .operations import OPERATIONS
from .statements import Assign, Constant, Element, Guard, Operand, Store, Temporary

#: Operation name -> opcode, in the order of `ir.OPERATIONS`.
OPCODES: dict[str, int] = {name: number for number, name in enumerate(OPERATIONS)}

#: Opcode of a guard, which leaves with `destination` as code unless operand a is true.
GUARD_OPCODE = len(OPCODES)

#: Integers per instruction: opcode, destination, operands a, b, c.
INSTRUCTION_WIDTH = 5

#: Integers per stored value: output array, index in it, slot, 1 if added to its contents.
OUTPUT_WIDTH = 4


@dataclass(frozen=True)
class Tape:
    """Bytecode of one kernel of fixed size, for `mstmm_tape_run`.

    `instructions` and `outputs` are flat; `slots` is the length of the workspace in numbers.
    Outputs are stored after the last guard, so that a tape that fails writes nothing.
    """

    name: str
    input_lengths: tuple[int, ...]
    output_lengths: tuple[int, ...]
    constants: tuple[float, ...]
    slots: int
    instructions: tuple[int, ...]
    outputs: tuple[int, ...]
    guards: tuple[tuple[int, str], ...]

    def message(self, code: int) -> str:
        """Message of the guard with this code."""
        return next((text for number, text in self.guards if number == code), "unknown failure")


def compile_tape(kernel: KernelIR) -> Tape:
    """Translate a kernel into a tape.

    ValueError for a kernel with a run-time size: there are no instructions for loops and `solve`.
    """
    if kernel.size_symbol is not None:
        raise ValueError(
            f"{kernel.name}: a tape needs fixed sizes, found the size {kernel.size_symbol!r}"
        )
    layout = _Layout(kernel)
    instructions: list[int] = []
    outputs: list[int] = []
    output_indices = {port.name: output_index for output_index, port in enumerate(kernel.outputs)}
    for statement in kernel.statements:
        if isinstance(statement, Assign):
            slots = [layout.slot(operand) for operand in statement.args]
            slots += [slots[0]] * (3 - len(slots))
            instructions += [OPCODES[statement.op], layout.temporary(statement.number), *slots]
        elif isinstance(statement, Guard):
            instructions += [GUARD_OPCODE, statement.code]
            instructions += [layout.slot(statement.condition)] * 3
        elif isinstance(statement, Store):
            output_index = output_indices[statement.port]
            port = kernel.outputs[output_index]
            slot = layout.slot(statement.value)
            outputs += [output_index, port.offset(statement.index), slot, int(port.accumulate)]
        else:
            raise ValueError(f"{kernel.name}: a tape has no loops and no solve")
    return Tape(
        name=kernel.name,
        input_lengths=tuple(port.length() for port in kernel.inputs),
        output_lengths=tuple(port.length() for port in kernel.outputs),
        constants=tuple(layout.constants),
        slots=max(1, layout.next),
        instructions=tuple(instructions),
        outputs=tuple(outputs),
        guards=tuple((s.code, s.message) for s in kernel.statements if isinstance(s, Guard)),
    )


class _Layout:
    """Slots of the workspace, by operand."""

    def __init__(self, kernel: KernelIR) -> None:
        self._ports = {port.name: port for port in kernel.inputs}
        self._starts: dict[str, int] = {}
        start = 0
        for port in kernel.inputs:
            self._starts[port.name] = start
            start += port.length()
        self.constants: list[float] = []
        self._constants: dict[str, int] = {}
        for constant in _constants(kernel):
            if constant.text not in self._constants:
                self._constants[constant.text] = start + len(self.constants)
                self.constants.append(constant.number)
        self.next = start + len(self.constants)
        self._temporaries: dict[int, int] = {}

    def temporary(self, number: int) -> int:
        """Allocate a slot for the temporary."""
        self._temporaries[number] = self.next
        self.next += 1
        return self._temporaries[number]

    def slot(self, operand: Operand) -> int:
        if isinstance(operand, Constant):
            return self._constants[operand.text]
        if isinstance(operand, Temporary):
            return self._temporaries[operand.number]
        assert isinstance(operand, Element)
        return self._starts[operand.port] + self._ports[operand.port].offset(operand.index)


def _constants(kernel: KernelIR) -> list[Constant]:
    """Constants in the order of their use by the statements."""
    operands: list[Operand] = []
    for statement in kernel.statements:
        if isinstance(statement, Assign):
            operands += statement.args
        elif isinstance(statement, Guard):
            operands.append(statement.condition)
        elif isinstance(statement, Store):
            operands.append(statement.value)
    return [operand for operand in operands if isinstance(operand, Constant)]
