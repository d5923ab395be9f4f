"""Along which chains the plain product can eliminate what its hinges leave free."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from mstmm.errors import SceneError

from ..pack.packed import Packed
from .known import BALL, ELASTIC_BALL, ELASTIC_PIN, PIN
from .parts import Part

#: Kind of a hinge -> how it turns freely.
_TURNS = {PIN: "pin", ELASTIC_PIN: "pin", BALL: "ball", ELASTIC_BALL: "ball"}


def refuse_product(packed: Packed, parts: Sequence[Part]) -> None:
    """SceneError for chains along which the plain product cannot eliminate the free turns in space.

    A hinge that turns freely takes the condition of the next one outward, so they must be alike;
    in the plane they are.
    """
    for place, before in _along_chains(parts):
        needed = _TURNS[parts[before].kind]
        if _TURNS[parts[place].kind] != needed:
            link = packed.topology.links[parts[place].hinge]
            raise SceneError(
                f'hinge "{packed.scene.hinges.name(link.hinge)}": behind a hinge that turns as a '
                f"{needed} the plain product needs another of that kind; use method dttmm-classical"
            )


def _along_chains(parts: Sequence[Part]) -> Iterator[tuple[int, int]]:
    """(place, place of the hinge with free turns before it) along chains of first children."""
    before: dict[int, int] = {}
    led: set[int] = set()
    for place, part in enumerate(parts):
        parent = part.parent
        first = parent >= 0 and parent not in led
        led.add(parent)
        last = before.get(parent, -1) if first else -1
        if part.kind in _TURNS:
            if last >= 0:
                yield place, last
            last = place
        before[place] = last
