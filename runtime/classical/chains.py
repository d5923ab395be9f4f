"""Chains along which the plain product of transfer matrices can eliminate free rotations."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from mstmm.errors import SceneError

from ..pack.packed import Packed
from .known import BALL, ELASTIC_BALL, ELASTIC_PIN, PIN
from .parts import Part

#: Kind of a hinge -> type of its free rotation.
_TURNS = {PIN: "pin", ELASTIC_PIN: "pin", BALL: "ball", ELASTIC_BALL: "ball"}


def refuse_product(packed: Packed, parts: Sequence[Part]) -> None:
    """Raise SceneError for spatial chains whose free rotations the plain product cannot eliminate.

    The free rotation of a hinge is eliminated by the condition of the next hinge outboard, so both
    must be of the same type.  In the plane they always are.
    """
    for place, before in _along_chains(parts):
        needed = _TURNS[parts[before].kind]
        if _TURNS[parts[place].kind] != needed:
            link = packed.topology.links[parts[place].hinge]
            raise SceneError(
                f'hinge "{packed.scene.hinges.name(link.hinge)}": outboard of a hinge that rotates '
                f"as a {needed} the plain product needs another of that kind; use method "
                "dttmm-classical"
            )


def _along_chains(parts: Sequence[Part]) -> Iterator[tuple[int, int]]:
    """Pairs (place, place of the previous hinge with free rotation) along first children."""
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
