"""Table [[chain]]: a row of equal bodies and hinges, and all bodies and hinges of a scene by name.

Members of chains are created on access, so that a chain of a million bodies costs nothing here.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from itertools import accumulate
from math import lcm
from typing import Annotated, Any, Generic, TypeVar, overload

from pydantic import BaseModel

from ..validators import names_and_text as texts
from ..validators import scalars_and_vectors as rules
from ..validators.rotations_and_inertia import orientation_rule
from ..validators.scalars_and_vectors import (
    GROUND,
    NAME_PATTERN,
    Problem,
    Shorthand,
    Table,
    problem,
    split_reference,
)
from ..validators.validation_messages import did_you_mean
from .body import Body, BodyTable
from .hinge import Hinge, HingeTable

#: Longest chain; 1e6 bodies need some gigabytes.
MAX_CHAIN_COUNT = 10_000_000

#: Name of a member's hinge after the name of the member: "rope[3].hinge".
HINGE_SUFFIX = "hinge"


def _pattern_rule(what: str) -> Shorthand:
    def widen(value: Any) -> Any:
        value = [value] if isinstance(value, (dict, BaseModel)) else value
        if isinstance(value, (list, tuple)) and not value:
            raise problem(f"expected a {what} table or a list of them, found an empty list")
        return value

    expected = f"a {what} table, or a list of {what} tables that is repeated along the chain"
    return Shorthand(expected, widen, {"type": "object"})


class Chain(Table):
    """Row of `count` bodies, each connected by a hinge to the body before it.

    Member k, from 0, has the body `body[k % len(body)]` and the hinge `hinge[k % len(hinge)]`.  Its
    name is "rope[3]", that of its hinge "rope[3].hinge"; "rope[last]" is the last member.  The
    first is connected to `inboard`, every other to the `end` of the body before it (None: its only
    end).  `orientation` replaces that of the first hinge (None: the one in its table).
    """

    name: Annotated[str, texts.name_rule("the chain's name")]
    count: Annotated[int, rules.integer(1, MAX_CHAIN_COUNT)]
    inboard: texts.Reference
    position: rules.Position = (0.0, 0.0, 0.0)
    orientation: Annotated[rules.Numbers | None, orientation_rule()] = None
    end: Annotated[str | None, texts.name_rule("the end that connects to the next body")] = None
    body: Annotated[tuple[BodyTable, ...], _pattern_rule("body")]
    hinge: Annotated[tuple[HingeTable, ...], _pattern_rule("hinge")]

    @property
    def period(self) -> int:
        """Number of members after which the pattern repeats."""
        return lcm(len(self.body), len(self.hinge))

    def body_of(self, k: int) -> BodyTable:
        """Body table of member k."""
        return self.body[k % len(self.body)]

    def hinge_of(self, k: int) -> HingeTable:
        """Hinge table of member k."""
        return self.hinge[k % len(self.hinge)]

    @property
    def held_ends(self) -> tuple[str, ...]:
        """For each body of the pattern the end that connects to the next member.

        "" where a body has no end because the chain has one member.
        """
        if self.end is not None:
            return (self.end,) * len(self.body)
        return tuple(next(iter(body.ends), "") for body in self.body)

    def inboard_of(self, k: int) -> str:
        """Inboard end of member k: "ground", "body.end" or "rope[2].tip"."""
        if k == 0:
            return self.inboard
        return f"{self.name}[{k - 1}].{self.held_ends[(k - 1) % len(self.body)]}"

    def _problems(self) -> Iterator[Problem]:
        inboard_body = split_reference(self.inboard)[0]
        if inboard_body != GROUND and self.position != (0.0, 0.0, 0.0):
            yield (
                ("position",),
                'only a chain with inboard = "ground" has a position; '
                f'define an end of "{inboard_body}" there',
            )
        for key in ("body", "hinge"):
            tables = len(getattr(self, key))
            if tables > self.count:
                yield (
                    (key,),
                    f"{tables} tables for a chain of {self.count}; leave some out or raise count",
                )
        yield from self._end_problems()

    def _end_problems(self) -> Iterator[Problem]:
        """Problems of the ends that connect to the next member."""
        connecting_count = min(self.count - 1, len(self.body))
        for i, body in enumerate(self.body):
            names = list(body.ends)
            if HINGE_SUFFIX in names:
                yield (
                    ("body", i, "ends", HINGE_SUFFIX),
                    f'"{self.name}[0].{HINGE_SUFFIX}" is the name of a hinge; rename this end',
                )
            if i >= connecting_count and self.end is None:
                continue
            if self.end is not None and self.end not in names:
                yield (
                    ("body", i, "ends"),
                    f'there is no end "{self.end}" for the next body; '
                    f"give it ends = {{ {self.end} = [x, y, z] }}",
                )
            elif self.end is None and len(names) != 1:
                ends_text = ", ".join(names) if names else "no end"
                remedy = f'write end = "{names[0]}"' if names else "give it one"
                yield (
                    ("body", i, "ends"),
                    f"expected one end for the next body, found {ends_text}; {remedy}",
                )


# --- bodies and hinges by number and by name ------------------------------------------------------


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
        found = self.place(name.removesuffix(self.behind))
        if found is None or not 0 <= found[1] < self.chains[found[0]].count:
            return None
        return self.starts[found[0]] + found[1]

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
        member_name = name.removesuffix(self.behind)
        chain_position = self.place(member_name)
        owner = member_name.partition("[")[0].partition(".")[0]
        if chain_position is None and owner in self._chain:
            chain_position = self._chain[owner], -1
        if chain_position is None:
            return f"there is no {self.word} {shown}{did_you_mean(name, self.names())}"
        chain = self.chains[chain_position[0]]
        first, last = (f"{chain.name}[{k}]{self.behind}" for k in (0, chain.count - 1))
        return f'there is no {self.word} {shown}; the chain "{chain.name}" has {first} to {last}'

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
