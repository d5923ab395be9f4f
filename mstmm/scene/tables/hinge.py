"""Table [[hinge]]: a hinge between two bodies, or between a body and the ground."""

from __future__ import annotations

from typing import Annotated, Self

from pydantic import model_validator

from ...expression.expression import Expression
from ...numerics.rotations import Vector
from ..validators import names_and_text as texts
from ..validators import scalars_and_vectors as rules
from ..validators.scalars_and_vectors import GROUND, Location, split_reference
from .hinge_keys import HingeKeys, HingeRating
from .hinge_rules import resolve_defaults


class HingeTable(HingeKeys):
    """Properties of a hinge without its name and ends.

    `axis` and `axis2` are in the axes of the outboard end at q = 0; for planar hinges they are the
    normal and the direction of x.  `drive` has one entry per coordinate, None where the coordinate
    is free; it is None for a hinge without drive.  For built-in types `initial` is complete (None
    if every coordinate is driven) and `law` has one entry per speed.
    """

    @model_validator(mode="after")
    def _apply_defaults(self) -> Self:
        for key, value in resolve_defaults(self).items():
            object.__setattr__(self, key, value)
        return self


class Hinge(HingeTable):
    """Hinge between an inboard end (or the ground) and an outboard body.

    If the outboard body has several inboard hinges, loops close: one of the hinges is part of the
    tree and the others are cut, which affects only the cost.  `cut` True: cut this one; False: not
    this one; None: whichever costs less.  In loops, initial values are targets of the assembly;
    `hold` keeps those of q exactly.  `rated` has no effect on the motion.
    """

    name: Annotated[str, texts.name_rule("the hinge's name")]
    inboard: Annotated[str, texts.end_rule()]
    outboard: Annotated[str, texts.end_rule()]
    position: Annotated[Vector, rules.vector_rule("m")] = (0.0, 0.0, 0.0)
    release: Annotated[
        Expression | None,
        texts.condition_rule('a time in s or a comparison such as "t >= 1"', time=True),
    ] = None
    cut: Annotated[bool | None, texts.flag_rule()] = None
    hold: Annotated[bool, texts.flag_rule()] = False
    rated: HingeRating | None = None

    @model_validator(mode="after")
    def _rates(self) -> Hinge:
        facts_of_type = self.builtin
        if self.rated is not None and facts_of_type is not None and len(facts_of_type.speeds) != 1:
            raise rules.problem("only hinges of one coordinate are rated; leave it out", "rated")
        return self

    @property
    def inboard_body(self) -> str:
        """Name of the inboard body, or "ground"."""
        return split_reference(self.inboard)[0]

    @property
    def inboard_end(self) -> str:
        """Inboard end of the hinge, "" for the origin of the body or the ground."""
        return split_reference(self.inboard)[1]

    @property
    def outboard_body(self) -> str:
        return split_reference(self.outboard)[0]

    @property
    def outboard_end(self) -> str:
        """Outboard end of the hinge, "" for the origin of the body."""
        return split_reference(self.outboard)[1]

    def end_problems(self) -> list[tuple[Location, str]]:
        """Problems of the ends: ground as outboard, a single body, or a misplaced position."""
        problems: list[tuple[Location, str]] = []
        if self.outboard_body == GROUND:
            problems.append(
                (("outboard",), "the ground cannot be outboard; swap inboard and outboard")
            )
        elif self.inboard_body == self.outboard_body:
            problems.append((
                ("outboard",),
                f'"{self.outboard_body}" is hinged to itself; connect two different bodies',
            ))  # fmt: skip
        if self.inboard_body != GROUND and self.position != (0.0, 0.0, 0.0):
            problems.append((
                ("position",),
                'only a hinge with inboard = "ground" has a position; '
                f'define an end of "{self.inboard_body}" there',
            ))  # fmt: skip
        return problems

    @property
    def keeps_initial_values(self) -> bool:
        """Whether initial values of q are kept exactly."""
        return self.hold

    @property
    def is_released(self) -> bool:
        """Whether the hinge has a release condition."""
        return self.release is not None
