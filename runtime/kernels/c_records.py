"""Arrays of C structs in numpy memory: filled one by one through cffi, or column by column."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from mstmm.array_validation import Integers
from mstmm.errors import SceneError
from mstmm.scene.tables.chain import Members

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


class Lookup(Mapping[str, T]):
    """Mapping from names of bodies or hinges to values computed from their index on access."""

    def __init__(self, members: Members[Any], get: Callable[[int], T]) -> None:
        self.members, self.get_number = members, get

    def __getitem__(self, name: str) -> T:
        number = self.members.find(name)
        if number is None:
            raise KeyError(name)
        return self.get_number(number)

    def __iter__(self) -> Iterator[str]:
        return self.members.names()

    def __len__(self) -> int:
        return len(self.members)
