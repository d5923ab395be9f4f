"""Beams whose two ends are held apart: the rest of the scene resists a change of their length.

Gruebler's count over the smallest part of the scene that has all loops through a beam (a block of
its graph): the free coordinates of its hinges less 3 (in a plane, else 6) per independent loop.
Where the length of the beam as one more coordinate leaves no motion, stretching it meets the
stiffness of the rest.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from mstmm.scene.validators.scalars_and_vectors import split_reference

from .planar_motion import PlanarMotionCheck

if TYPE_CHECKING:
    from mstmm.scene import Scene
    from mstmm.scene.tables.hinge import Hinge


class Edge(NamedTuple):
    """A hinge, or a constraint (None) with its rows, between two bodies."""

    ends: tuple[str, str]
    hinge: Hinge | None
    rows: int = 0


def restrained_beams(scene: Scene) -> frozenset[str]:
    """Names of the beams whose length the rest of the scene holds."""
    hinges = [Edge((h.inboard_body, h.outboard_body), h) for h in scene.hinge]
    constraints = [
        Edge((split_reference(c.from_)[0], split_reference(c.to)[0]), None, c.rows)
        for c in scene.constraint
    ]
    beams = {beam.name for beam in scene.beam if any(s.axial_stiffness for s in beam.sections)}
    if not beams or len(hinges) + len(constraints) <= len(scene.skeleton.body):
        return frozenset()
    plane, found = PlanarMotionCheck(scene), set[str]()
    for block in blocks([*hinges, *constraints]):
        bodies = {end for edge in block for end in edge.ends}
        loops = len(block) - len(bodies) + 1
        for beam in beams & bodies if loops else ():
            if _mobility(plane, beam, block, loops) < 0:
                found.add(beam)
    return frozenset(found)


def _mobility(plane: PlanarMotionCheck, beam: str, block: list[Edge], loops: int) -> int:
    """Motions of the block by count, in a plane of the beam if all its hinges stay in it."""
    hinges = [edge.hinge for edge in block if edge.hinge is not None]
    in_plane = not plane.possible or any(plane.stay(beam, axis, hinges) for axis in (1, 2))
    each = 3 if in_plane else 6  # 3 claims less
    left_by_rows = sum(each - edge.rows for edge in block if edge.hinge is None)
    return sum(map(_free, hinges)) + left_by_rows - each * loops


def _free(hinge: Hinge) -> int:
    """Coordinates of a hinge that nothing drives; of an unknown type all six."""
    drive = hinge.drive or ()
    count = 6 if hinge.facts is None else len(hinge.facts.speeds)
    return count - sum(entry is not None for entry in drive)


def blocks(edges: list[Edge]) -> list[list[Edge]]:
    """The biconnected components of a graph: every two edges of one lie on a common cycle.

    R. Tarjan, SIAM J. Comput. 1 (1972) 146-160, without recursion.
    """
    at: dict[str, list[int]] = {}
    for number, edge in enumerate(edges):
        for end in edge.ends:
            at.setdefault(end, []).append(number)
    found: list[list[Edge]] = []
    order, low = dict[str, int](), dict[str, int]()
    done, kept = set[int](), list[int]()
    for start in at:
        if start in order:
            continue
        order[start] = low[start] = len(order)
        path = [(start, -1, iter(at[start]))]
        while path:
            body, came, left = path[-1]
            number = next((k for k in left if k not in done), -1)
            if number < 0:
                path.pop()
                if path:
                    before = path[-1][0]
                    low[before] = min(low[before], low[body])
                    if low[body] >= order[before]:
                        first = kept.index(came)
                        found.append([edges[k] for k in kept[first:]])
                        del kept[first:]
                continue
            done.add(number)
            kept.append(number)
            one, other = edges[number].ends
            end = other if one == body else one
            if end in order:
                low[body] = min(low[body], order[end])
            else:
                order[end] = low[end] = len(order)
                path.append((end, number, iter(at[end])))
    return found
