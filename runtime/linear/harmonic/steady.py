"""States that turn balls: what a frequency response can be asked there.

Increments go in outboard axes, which turn along with the state.  They answer a push of one
frequency with that frequency alone where neither the matrices nor the push, nor what is read,
change along the motion: an effort of a hinge stays what it is, a force with inertial components
goes round.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from mstmm.errors import SceneError
from mstmm.printable import abbreviate

from ..channels import Channel
from ..judged import accelerating
from ..output.outputs import outputs_of, rows_of
from ..output.seen import Seen
from ..rotors.later import SAME, apart, later

if TYPE_CHECKING:
    from ..equations import Equations


def refuse_turning(linear: Equations) -> None:
    """SceneError for exact beams beside a state that turns a ball: they have no matrices."""
    if linear.turning is not None:
        raise SceneError(
            "exact: the state turns a ball, a free or another hinge whose rates go by its "
            "coordinates; ask about a state at rest, or leave beams their shapes"
        )


def refuse_unsteady(linear: Equations, pushes: Sequence[Channel], shown: Sequence[Seen]) -> None:
    """SceneError where a state turns balls and what is asked changes along its motion."""
    if linear.turning is None:
        return
    changing = list(_changing(linear, pushes, shown))
    if changing:
        raise SceneError(
            "frequency response: the state turns, and along its motion changes "
            f"{abbreviate(changing)}, so that other frequencies answer too; push by "
            "efforts of hinges and read their speeds, which go in outboard axes, "
            "or ask about a state at rest"
        )


def _changing(linear: Equations, pushes: Sequence[Channel], shown: Sequence[Seen]) -> Iterator[str]:
    there = later(linear)
    if any(apart(getattr(linear, x), getattr(there, x)) > SAME for x in "MCK"):
        yield "the matrices"
    yield from accelerating(linear)
    for push in pushes:
        if apart(linear.pushed([push]), there.pushed([push])) > SAME:
            yield push.name
    names = [one.name for one in shown]
    for one, other in zip(shown, outputs_of(there, names), strict=True):
        now, then = (rows_of(at, [it], ()).orders for at, it in ((linear, one), (there, other)))
        if any(apart(now[order], then[order]) > SAME for order in now):
            yield one.name
