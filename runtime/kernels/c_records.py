"""C records in memory of Python: arrays of structs, and the arrays and tapes they point to."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Array, Integers
from mstmm.errors import SceneError
from mstmm.ir import KernelIR
from mstmm.ir.tape import Tape, compile_tape

_INTEGER_TYPES = {"int": np.int32, "int64_t": np.int64}

T = TypeVar("T")


class CRecords:
    """Array of `count` records of a C struct, initially zero, in one block of memory.

    `array` is its cffi view (`array[3].parent = 2`); `column` is one field of all records.
    """

    def __init__(self, ffi: Any, struct: str, count: int) -> None:
        self.ffi, self.struct, self.count = ffi, struct, count
        self.numbers = np.zeros((max(1, count), ffi.sizeof(struct)), dtype=np.uint8)
        self.array = ffi.from_buffer(f"{struct}[]", self.numbers)
        self._fields = dict(ffi.typeof(struct).fields)

    def column(self, name: str) -> NDArray[Any]:
        """Writable view of a field of all records: integers, or addresses of pointers."""
        field = self._fields[name]
        kind: Any = _INTEGER_TYPES.get(field.type.cname, np.uintp)
        return np.ndarray(
            (self.count,), kind, self.numbers, field.offset, (self.numbers.shape[1],)
        )  # fmt: skip

    def write(self, name: str, values: Integers) -> None:
        """Fill a column.  SceneError if its numbers do not fit the C type."""
        column = self.column(name)
        if len(values) and int(values.max()) > np.iinfo(column.dtype).max:
            raise SceneError(
                f"the scene has {self.count} bodies, more than the engine supports ({name}); "
                "use fewer bodies"
            )
        column[:] = values

    def copy(self, places: slice, prototypes: CRecords, which: Integers) -> None:
        """Copy the prototypes with indices `which` into the records `places`."""
        record_type = np.dtype((np.void, self.numbers.shape[1]))
        self.numbers[places].view(record_type)[:, 0] = prototypes.numbers.view(record_type)[:, 0][
            which
        ]


def c_tape(ffi: Any, tape: Tape, kept: list[Any]) -> Any:
    """Convert a tape to `mstmm_tape *`; its arrays are added to `kept`, which must outlive it."""
    arrays = {
        "input_lengths": ffi.new("int[]", list(tape.input_lengths) or [0]),
        "constants": ffi.new("real[]", list(tape.constants) or [0.0]),
        "instructions": ffi.new("int[]", list(tape.instructions) or [0]),
        "outputs": ffi.new("int[]", list(tape.outputs) or [0]),
    }
    result = ffi.new("mstmm_tape *", arrays)
    result.n_inputs = len(tape.input_lengths)
    result.n_constants = len(tape.constants)
    result.n_slots = tape.slots
    result.n_instructions = len(tape.instructions) // 5
    result.n_outputs = len(tape.outputs) // 4
    kept += [result, arrays]
    return result


#: Length of the blocks that hold small arrays side by side, in the order in which a sweep over many
#: bodies reads them.
_BLOCK_LENGTH = 4096


class Memory:
    """Allocator of C arrays, tapes and records.

    `keep_alive` are the references that keep them alive, `slots` is the largest workspace of a
    tape.
    """

    def __init__(self, ffi: Any) -> None:
        self.ffi, self.slots = ffi, 0
        self.keep_alive: list[Any] = []
        #: C type -> current block, and the length used.
        self._blocks: dict[str, tuple[Any, int]] = {}
        #: C type and class of a source -> name, conversion and source of the fields.
        self._fields: dict[tuple[Any, type], list[tuple[str, Callable[[Any], Any], bool]]] = {}

    def new(self, kind: str, given: Any = None) -> Any:
        """Allocate a record or an array of them."""
        data = self.ffi.new(kind) if given is None else self.ffi.new(kind, given)
        self.keep_alive.append(data)
        return data

    def reals(self, numbers: Sequence[float]) -> Any:
        """Pointer `real *` to a copy of the numbers, stored after those of the last call."""
        return self._store("real", list(numbers) or [0.0])

    def ints(self, numbers: Sequence[int]) -> Any:
        """Pointer `int *` to a copy of the numbers, stored after those of the last call."""
        return self._store("int", list(numbers) or [0])

    def _store(self, kind: str, numbers: list[Any]) -> Any:
        count = len(numbers)
        block, used = self._blocks.get(kind, (None, _BLOCK_LENGTH))
        if used + count > _BLOCK_LENGTH:
            block, used = self.new(f"{kind}[]", max(_BLOCK_LENGTH, count)), 0
        block[used : used + count] = numbers
        self._blocks[kind] = block, used + count
        return block + used

    def fill(self, record: Any, source: Any = None, /, **others: Any) -> None:
        """Fill the fields of a C record that `others` name, or that the dataclass `source` has.

        Behind pointers to numbers and tapes is a copy of the value in this memory; None is NULL.
        """
        kind = self.ffi.typeof(record)
        key = kind, type(source)
        if key not in self._fields:
            in_source = set() if source is None else {field.name for field in fields(source)}
            self._fields[key] = [
                (name, self._conversion(field.type), name in in_source)
                for name, field in (kind.item if kind.kind == "pointer" else kind).fields
            ]
        for name, convert, is_in_source in self._fields[key]:
            if name in others:
                setattr(record, name, convert(others[name]))
            elif is_in_source:
                setattr(record, name, convert(getattr(source, name)))

    def _conversion(self, kind: Any) -> Callable[[Any], Any]:
        """Function from a value to one of the C type of a field."""
        if kind.kind not in ("pointer", "function"):
            return lambda value: value
        copies: dict[str, Callable[[Any], Any]] = {
            "double": self._numbers, "int": self.ints, "mstmm_tape": self.expression,
        }  # fmt: skip
        to_pointer = copies.get(kind.item.cname if kind.kind == "pointer" else "")

        def convert(value: Any) -> Any:
            if value is None:
                return self.ffi.NULL
            if to_pointer is None or isinstance(value, self.ffi.CData):
                return value
            return to_pointer(value)

        return convert

    def _numbers(self, numbers: Sequence[float] | Array) -> Any:
        return self.array(numbers) if isinstance(numbers, np.ndarray) else self.reals(numbers)

    def array(self, numbers: Array) -> Any:
        """Pointer `real *` to the entries of an array, row by row."""
        flat = np.ascontiguousarray(np.ravel(numbers) if np.size(numbers) else [0.0], dtype=float)
        self.keep_alive.append(flat)
        return self.ffi.from_buffer("real[]", flat)

    def tape(self, tape: Tape) -> Any:
        """Pointer `mstmm_tape *` to a copy of the tape."""
        self.slots = max(self.slots, tape.slots)
        return c_tape(self.ffi, tape, self.keep_alive)

    def expression(self, kernel: KernelIR | Tape) -> Any:
        """Tape of a kernel of expressions."""
        return self.tape(kernel if isinstance(kernel, Tape) else compile_tape(kernel))
