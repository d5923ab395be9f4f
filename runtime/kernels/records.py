"""Arrays of C records held by numpy: filled one by one through cffi, or column by column."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from mstmm.arrays import Integers
from mstmm.errors import SceneError
from mstmm.scene.tables.members import Members

_WHOLE = {"int": np.int32, "int64_t": np.int64}

T = TypeVar("T")


class Records:
    """`count` records of a C struct, zero at first, in one block of memory.

    `array` is what cffi sees (`array[3].parent = 2`); `column` is one field of all of them.
    """

    def __init__(self, ffi: Any, struct: str, count: int) -> None:
        self.ffi, self.struct, self.count = ffi, struct, count
        self.numbers = np.zeros((max(1, count), ffi.sizeof(struct)), dtype=np.uint8)
        self.array = ffi.from_buffer(f"{struct}[]", self.numbers)
        self._fields = dict(ffi.typeof(struct).fields)

    def column(self, name: str) -> NDArray[Any]:
        """A field of all records, writable: whole numbers, or addresses of pointers."""
        field = self._fields[name]
        kind: Any = _WHOLE.get(field.type.cname, np.uintp)
        return np.ndarray(
            (self.count,), kind, self.numbers, field.offset, (self.numbers.shape[1],)
        )  # fmt: skip

    def write(self, name: str, values: Integers) -> None:
        """Fill a column.  SceneError where its numbers do not fit the C type."""
        column = self.column(name)
        if len(values) and int(values.max()) > np.iinfo(column.dtype).max:
            raise SceneError(
                f"the scene has {self.count} bodies, more than the engine counts ({name}); "
                "make it smaller"
            )
        column[:] = values

    def copy(self, places: slice, prototypes: Records, which: Integers) -> None:
        """Records `places` become copies of the prototypes of these numbers."""
        whole = np.dtype((np.void, self.numbers.shape[1]))
        self.numbers[places].view(whole)[:, 0] = prototypes.numbers.view(whole)[:, 0][which]


class Lookup(Mapping[str, T]):
    """Something of every body or hinge by its name, made from its number when asked for."""

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
