"""A chain: a body and a hinge repeated in a row, read and checked once for all its members."""

from __future__ import annotations

from collections.abc import Iterator
from math import lcm
from typing import Annotated, Any

from pydantic import BaseModel, model_validator

from ...numbers.rotations import Vector
from ..rules import text as texts
from ..rules import turns
from ..rules import values as rules
from ..rules.values import GROUND, Location, Orientation, Refused, Shorthand, Table, refuse, split
from .body import BodyTable
from .hinge import HingeTable

#: The longest chain; 1e6 bodies take some gigabytes.
MAX_COUNT = 10_000_000

#: What a member's hinge is called behind the member's name: "rope[3].hinge".
HINGE = "hinge"


def _pattern(what: str) -> Shorthand:
    def widen(value: Any) -> Any:
        value = [value] if isinstance(value, (dict, BaseModel)) else value
        if isinstance(value, (list, tuple)) and not value:
            raise refuse(f"expected a {what} table or a list of them, found an empty list")
        return value

    expected = f"a {what} table, or a list of {what} tables that is repeated along the chain"
    return Shorthand(expected, widen, {"type": "object"})


class Chain(Table):
    """`count` bodies in a row, each on a hinge on the body before it.

    Member k, from 0, has the body `body[k % len(body)]` on the hinge `hinge[k % len(hinge)]`.  It
    is called "rope[3]", its hinge "rope[3].hinge"; "rope[last]" is the last one.  The first hangs
    on `inboard`, every other on the `end` of the body before it (None: its only end).
    `orientation` is that of the first hinge, in place of the one in its table (None: that one).
    """

    name: Annotated[str, texts.name("the chain's name")]
    count: Annotated[int, rules.whole(1, MAX_COUNT)]
    inboard: Annotated[str, texts.end()]
    position: Annotated[Vector, rules.vector("m")] = (0.0, 0.0, 0.0)
    orientation: Annotated[Orientation | None, turns.orientation()] = None
    end: Annotated[str | None, texts.name("the end on which the next body hangs")] = None
    body: Annotated[tuple[BodyTable, ...], _pattern("body")]
    hinge: Annotated[tuple[HingeTable, ...], _pattern("hinge")]

    @property
    def period(self) -> int:
        """Members after which the pattern begins again."""
        return lcm(len(self.body), len(self.hinge))

    def body_of(self, k: int) -> BodyTable:
        """The body of member k."""
        return self.body[k % len(self.body)]

    def hinge_of(self, k: int) -> HingeTable:
        """The hinge of member k."""
        return self.hinge[k % len(self.hinge)]

    @property
    def held_ends(self) -> tuple[str, ...]:
        """Per body of the pattern, the end on which the next member hangs; "" where there is none
        because the chain has one member."""
        if self.end is not None:
            return (self.end,) * len(self.body)
        return tuple(next(iter(body.ends), "") for body in self.body)

    def inboard_of(self, k: int) -> str:
        """The end on which member k hangs: "ground", "body.end" or "rope[2].tip"."""
        if k == 0:
            return self.inboard
        return f"{self.name}[{k - 1}].{self.held_ends[(k - 1) % len(self.body)]}"

    @model_validator(mode="after")
    def _check(self) -> Chain:
        problems = [*self._misplaced(), *self._too_many(), *self._ends()]
        if problems:
            raise Refused(*problems)
        return self

    def _misplaced(self) -> Iterator[tuple[Location, str]]:
        on = split(self.inboard)[0]
        if on != GROUND and self.position != (0.0, 0.0, 0.0):
            yield (
                ("position",),
                'only a chain whose inboard is "ground" takes a position; '
                f'give "{on}" an end there',
            )

    def _too_many(self) -> Iterator[tuple[Location, str]]:
        for key in ("body", "hinge"):
            tables = len(getattr(self, key))
            if tables > self.count:
                yield (
                    (key,),
                    f"{tables} tables for a chain of {self.count}; leave some out or raise count",
                )

    def _ends(self) -> Iterator[tuple[Location, str]]:
        """Every body that carries another needs an end for it."""
        carriers = min(self.count - 1, len(self.body))
        for i, body in enumerate(self.body):
            names = list(body.ends)
            if HINGE in names:
                yield (
                    ("body", i, "ends", HINGE),
                    f'"{self.name}[0].{HINGE}" is the name of a hinge; rename this end',
                )
            if i >= carriers and self.end is None:
                continue
            if self.end is not None and self.end not in names:
                yield (
                    ("body", i, "ends"),
                    f'there is no end "{self.end}" for the next body; '
                    f"give it ends = {{ {self.end} = [x, y, z] }}",
                )
            elif self.end is None and len(names) != 1:
                has = ", ".join(names) if names else "no end"
                way_out = f'write end = "{names[0]}"' if names else "give it one"
                yield (
                    ("body", i, "ends"),
                    f"the next body hangs on its only end, but it has {has}; {way_out}",
                )
