"""Bodies and hinges of a scene by number and by name: tables, then members of the chains.

Members of chains are created on access, so that a chain of a million bodies costs nothing here.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from itertools import accumulate
from typing import Generic, TypeVar, overload

from ..validators.scalars_and_vectors import NAME_PATTERN
from ..validators.validation_messages import did_you_mean
from .body import Body
from .chain import HINGE_SUFFIX, Chain
from .hinge import Hinge

_MEMBER_PATTERN = re.compile(rf"({NAME_PATTERN.pattern})\[([0-9]+|last)\]")

T = TypeVar("T", bound=Body | Hinge)


class Members(Sequence[T], Generic[T]):
    """Bodies or hinges of a scene as a sequence, with access by name."""

    #: Suffix of the member's name: "" for bodies, ".hinge" for hinges.
    behind = ""
    word = ""

    def __init__(self, tables: tuple[T, ...], chains: tuple[Chain, ...]) -> None:
        self.tables, self.chains = tables, chains
        self._index = {table.name: i for i, table in enumerate(tables)}
        self._chain = {chain.name: i for i, chain in enumerate(chains)}
        counts = accumulate((chain.count for chain in chains), initial=len(tables))
        #: Index of each chain's first member, then the total count.
        self.starts = tuple(counts)

    def __len__(self) -> int:
        return self.starts[-1]

    @overload
    def __getitem__(self, index: int) -> T: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[T]: ...
    def __getitem__(self, index: int | slice) -> T | Sequence[T]:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        index = index + len(self) if index < 0 else index
        if 0 <= index < len(self.tables):
            return self.tables[index]
        chain, k = self.member(index)
        return self._make(self.chains[chain], k)

    def _make(self, chain: Chain, k: int) -> T:
        raise NotImplementedError

    def member(self, index: int) -> tuple[int, int]:
        """Chain and position in it of an index after the tables.  Raises IndexError."""
        if not len(self.tables) <= index < len(self):
            raise IndexError(f"expected an index below {len(self)}, found {index}")
        chain = bisect_right(self.starts, index) - 1
        return chain, index - self.starts[chain]

    def name(self, index: int) -> str:
        """Name of the element at `index`: "rod1" or "rope[3]"."""
        if index < len(self.tables):
            return self.tables[index].name
        chain, k = self.member(index)
        return f"{self.chains[chain].name}[{k}]{self.behind}"

    def find(self, name: str) -> int | None:
        """Index of the element with this name, or None."""
        table_index = self._index.get(name)
        if table_index is not None or not self.chains or not name.endswith(self.behind):
            return table_index
        chain_position = self.place(name.removesuffix(self.behind) if self.behind else name)
        if (
            chain_position is None
            or not 0 <= chain_position[1] < self.chains[chain_position[0]].count
        ):
            return None
        return self.starts[chain_position[0]] + chain_position[1]

    def place(self, name: str) -> tuple[int, int] | None:
        """Chain and k of the name "rope[k]" of an existing chain; k may exceed its length."""
        match = _MEMBER_PATTERN.fullmatch(name)
        if match is None or match[1] not in self._chain:
            return None
        chain = self._chain[match[1]]
        return chain, self.chains[chain].count - 1 if match[2] == "last" else int(match[2])

    def of_chain(self, name: str) -> bool:
        """Whether a name begins with the name of a chain."""
        return name.partition("[")[0].partition(".")[0] in self._chain

    def missing(self, name: str, shown: str = "") -> str:
        """Message about a missing name, with a suggestion; `shown` is the name in quotes."""
        shown = shown or f'"{name}"'
        member_name = name.removesuffix(self.behind) if self.behind else name
        chain_position = self.place(member_name)
        owner = member_name.partition("[")[0].partition(".")[0]
        if chain_position is None and owner in self._chain:
            chain_position = self._chain[owner], -1
        if chain_position is None:
            return f"there is no {self.word} {shown}{did_you_mean(name, self.names())}"
        chain = self.chains[chain_position[0]]
        first_member, last_member = (
            f"{chain.name}[{k}]{self.behind}" for k in (0, chain.count - 1)
        )
        return (
            f'there is no {self.word} {shown}; the chain "{chain.name}" has {first_member} to '
            f"{last_member}"
        )

    def names(self) -> Iterator[str]:
        """Yield all names in order."""
        yield from self._index
        for chain in self.chains:
            for k in range(chain.count):
                yield f"{chain.name}[{k}]{self.behind}"

    @property
    def by_name(self) -> Mapping[str, T]:
        """Mapping from names to elements."""
        return ByName(self)


class Bodies(Members[Body]):
    """All bodies of a scene as a sequence."""

    word = "body"

    def _make(self, chain: Chain, k: int) -> Body:
        return Body.model_construct(name=f"{chain.name}[{k}]", **vars(chain.body_of(k)))

    def ends(self, name: str) -> Mapping[str, object] | None:
        """Ends of the body with this name, or None if there is no such body."""
        index = self.find(name)
        if index is None:
            return None
        if index < len(self.tables):
            return self.tables[index].ends
        chain, k = self.member(index)
        return self.chains[chain].body_of(k).ends


class Hinges(Members[Hinge]):
    """All hinges of a scene as a sequence."""

    word = "hinge"
    behind = f".{HINGE_SUFFIX}"

    def _make(self, chain: Chain, k: int) -> Hinge:
        pattern = chain.hinge_of(k)
        table = vars(pattern)
        if k == 0 and chain.orientation is not None:
            table = {**table, "orientation": chain.orientation}
        hinge = Hinge.model_construct(
            name=f"{chain.name}[{k}]{self.behind}", inboard=chain.inboard_of(k),
            outboard=f"{chain.name}[{k}]", position=chain.position if k == 0 else (0.0, 0.0, 0.0),
            **table,
        )  # fmt: skip
        vars(hinge)["facts"] = pattern.facts
        return hinge


class ByName(Mapping[str, T]):
    """Mapping from names to members, which are created on access."""

    def __init__(self, members: Members[T]) -> None:
        self.members = members

    def __getitem__(self, name: str) -> T:
        index = self.members.find(name)
        if index is None:
            raise KeyError(name)
        return self.members[index]

    def __iter__(self) -> Iterator[str]:
        return self.members.names()

    def __len__(self) -> int:
        return len(self.members)
