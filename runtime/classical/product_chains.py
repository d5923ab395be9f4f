"""Chains along which the plain product of transfer matrices can eliminate free rotations."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from mstmm.errors import SceneError

from ..packing.packed_scene import PackedScene
from .body_parts import Part
from .supported_elements import BALL, ELASTIC_BALL, ELASTIC_PIN, PIN

#: Kind of a hinge -> type of its free rotation.
_ROTATION_TYPES = {PIN: "pin", ELASTIC_PIN: "pin", BALL: "ball", ELASTIC_BALL: "ball"}


def check_product_chains(packed: PackedScene, parts: Sequence[Part]) -> None:
    """Raise SceneError for spatial chains whose free rotations the plain product cannot eliminate.

    The free rotation of a hinge is eliminated by the condition of the next hinge outboard, so both
    must be of the same type.  In the plane they always are.
    """
    for place, previous in _successive_free_rotations(parts):
        needed_type = _ROTATION_TYPES[parts[previous].kind]
        if _ROTATION_TYPES[parts[place].kind] != needed_type:
            link = packed.topology.links[parts[place].hinge]
            raise SceneError(
                f'hinge "{packed.scene.hinges.name(link.hinge)}": outboard of a hinge that rotates '
                f"as a {needed_type} the plain product needs another of that kind; use method "
                "dttmm-classical"
            )


def _successive_free_rotations(parts: Sequence[Part]) -> Iterator[tuple[int, int]]:
    """Pairs (place, place of the previous hinge with free rotation) along first children."""
    previous_in_branch: dict[int, int] = {}
    parents_with_child: set[int] = set()
    for place, part in enumerate(parts):
        parent = part.parent
        is_first_child = parent >= 0 and parent not in parents_with_child
        parents_with_child.add(parent)
        previous = previous_in_branch.get(parent, -1) if is_first_child else -1
        if part.kind in _ROTATION_TYPES:
            if previous >= 0:
                yield place, previous
            previous = place
        previous_in_branch[place] = previous
