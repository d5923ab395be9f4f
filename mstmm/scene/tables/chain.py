"""Table [[chain]]: a row of equal bodies and hinges, validated once for all members."""

from __future__ import annotations

from collections.abc import Iterator
from math import lcm
from typing import Annotated, Any

from pydantic import BaseModel, model_validator

from ...numerics.rotations import Vector
from ..validators import names_and_text as texts
from ..validators import rotations_and_inertia
from ..validators import scalars_and_vectors as rules
from ..validators.scalars_and_vectors import (
    GROUND,
    Location,
    Orientation,
    Shorthand,
    Table,
    ValidationProblems,
    problem,
    split_reference,
)
from .body import BodyTable
from .hinge import HingeTable

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
    inboard: Annotated[str, texts.end_rule()]
    position: Annotated[Vector, rules.vector_rule("m")] = (0.0, 0.0, 0.0)
    orientation: Annotated[Orientation | None, rotations_and_inertia.orientation_rule()] = None
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

    @model_validator(mode="after")
    def _check(self) -> Chain:
        problems = [*self._position_problems(), *self._count_problems(), *self._ends()]
        if problems:
            raise ValidationProblems(*problems)
        return self

    def _position_problems(self) -> Iterator[tuple[Location, str]]:
        inboard_body = split_reference(self.inboard)[0]
        if inboard_body != GROUND and self.position != (0.0, 0.0, 0.0):
            yield (
                ("position",),
                'only a chain with inboard = "ground" has a position; '
                f'define an end of "{inboard_body}" there',
            )

    def _count_problems(self) -> Iterator[tuple[Location, str]]:
        for key in ("body", "hinge"):
            tables = len(getattr(self, key))
            if tables > self.count:
                yield (
                    (key,),
                    f"{tables} tables for a chain of {self.count}; leave some out or raise count",
                )

    def _ends(self) -> Iterator[tuple[Location, str]]:
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
