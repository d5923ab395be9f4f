"""[[hinge]]: what joins two bodies, or a body to the ground."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import model_validator

from ...expression.expression import Expression
from ...numbers.rotations import Vector
from ..rules import text as texts
from ..rules import values as rules
from ..rules.values import GROUND, Location, split
from .hinge_keys import HingeKeys, Rated
from .hinge_rules import settled


class HingeTable(HingeKeys):
    """What a hinge is, without its name and what it joins.

    `axis` and `axis2` are in the axes of the outboard end at q = 0; planar: the normal and the
    direction of x.  `drive` has one entry per coordinate, None where the coordinate is free; it is
    None for a hinge without drive.  For built-in types `initial` is filled in (None when every
    coordinate is driven) and `law` has one entry per speed.
    """

    @model_validator(mode="after")
    def _settle(self) -> Self:
        for key, value in settled(self).items():
            object.__setattr__(self, key, value)
        return self


class Hinge(HingeTable):
    """A hinge between an inboard end (or the ground) and an outboard body.

    Where other hinges hold the outboard body too, loops close: one of them is part of the tree and
    the others are cut, which costs it nothing but work.  `cut` True: cut this one; False: not this
    one; None: whichever costs less.  In loops start values are wishes; `hold` keeps those of q
    exactly.  Nothing acts by what it is `rated` for.
    """

    name: Annotated[str, texts.name("the hinge's name")]
    inboard: Annotated[str, texts.end()]
    outboard: Annotated[str, texts.end()]
    position: Annotated[Vector, rules.vector("m")] = (0.0, 0.0, 0.0)
    release: Annotated[
        Expression | None,
        texts.condition('a time in s or a comparison such as "t >= 1"', time=True),
    ] = None
    cut: Annotated[bool | None, texts.flag()] = None
    hold: Annotated[bool, texts.flag()] = False
    rated: Rated | None = None

    @model_validator(mode="after")
    def _rates(self) -> Hinge:
        kind = self.builtin
        if self.rated is not None and kind is not None and len(kind.speeds) != 1:
            raise rules.refuse("only hinges of one coordinate are rated; leave it out", "rated")
        return self

    @property
    def inboard_body(self) -> str:
        """Name of the inboard body, or "ground"."""
        return split(self.inboard)[0]

    @property
    def inboard_end(self) -> str:
        """End of the inboard body, "" for its origin or the ground."""
        return split(self.inboard)[1]

    @property
    def outboard_body(self) -> str:
        return split(self.outboard)[0]

    @property
    def outboard_end(self) -> str:
        """End by which the outboard body is held, "" for its origin."""
        return split(self.outboard)[1]

    def misplaced(self) -> list[tuple[Location, str]]:
        """Ends that cannot be joined."""
        problems: list[tuple[Location, str]] = []
        if self.outboard_body == GROUND:
            problems.append(
                (("outboard",), "the ground cannot be outboard; swap inboard and outboard")
            )
        elif self.inboard_body == self.outboard_body:
            problems.append((
                ("outboard",),
                f'"{self.outboard_body}" is hinged to itself; join two different bodies',
            ))  # fmt: skip
        if self.inboard_body != GROUND and self.position != (0.0, 0.0, 0.0):
            problems.append((
                ("position",),
                'only a hinge whose inboard is "ground" takes a position; '
                f'give "{self.inboard_body}" an end there',
            ))  # fmt: skip
        return problems

    @property
    def holds(self) -> bool:
        """True when its start values are kept exactly."""
        return self.hold

    @property
    def lets_go(self) -> bool:
        """True when it is released by itself."""
        return self.release is not None
