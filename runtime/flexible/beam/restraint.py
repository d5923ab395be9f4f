"""Beams whose length the rest of the scene constrains.

Gruebler's count over the smallest part of the scene with all loops through a beam (a block of its
graph): the free coordinates of its hinges less 3 (in a plane, else 6) per independent loop.  If the
count is negative, there is no motion even with the length of the beam as a further coordinate.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from mstmm.scene.validators.scalars_and_vectors import split_reference

from .planar_motion import PlanarMotionCheck

if TYPE_CHECKING:
    from mstmm.scene import Scene
    from mstmm.scene.tables.hinge import Hinge


class Edge(NamedTuple):
    """Edge between two bodies: a hinge, or a constraint (hinge None) with its number of rows."""

    ends: tuple[str, str]
    hinge: Hinge | None
    rows: int = 0


def restrained_beams(scene: Scene) -> frozenset[str]:
    """Names of the beams whose length the rest of the scene constrains."""
    hinges = [Edge((h.inboard_body, h.outboard_body), h) for h in scene.hinge]
    constraints = [
        Edge((split_reference(c.from_)[0], split_reference(c.to)[0]), None, c.rows)
        for c in scene.constraint
    ]
    beams = {beam.name for beam in scene.beam if any(s.axial_stiffness for s in beam.sections)}
    if not beams or len(hinges) + len(constraints) <= len(scene.skeleton.body):
        return frozenset()
    planar_check, restrained = PlanarMotionCheck(scene), set[str]()
    for block in biconnected_components([*hinges, *constraints]):
        bodies = {end for edge in block for end in edge.ends}
        loops = len(block) - len(bodies) + 1
        for beam in beams & bodies if loops else ():
            if _mobility(planar_check, beam, block, loops) < 0:
                restrained.add(beam)
    return frozenset(restrained)


def _mobility(check: PlanarMotionCheck, beam: str, block: list[Edge], loops: int) -> int:
    """Mobility of a block by count, planar if all its hinges move in a plane of the beam."""
    hinges = [edge.hinge for edge in block if edge.hinge is not None]
    in_plane = not check.possible or any(check.is_planar(beam, axis, hinges) for axis in (1, 2))
    per_body = 3 if in_plane else 6  # 3 is the weaker claim where the poses are unknown
    free_by_constraints = sum(per_body - edge.rows for edge in block if edge.hinge is None)
    return sum(map(_free_coordinates, hinges)) + free_by_constraints - per_body * loops


def _free_coordinates(hinge: Hinge) -> int:
    """Number of coordinates of a hinge without drive; 6 for an unknown type."""
    drive = hinge.drive or ()
    count = 6 if hinge.facts is None else len(hinge.facts.speeds)
    return count - sum(entry is not None for entry in drive)


def biconnected_components(edges: list[Edge]) -> list[list[Edge]]:
    """Biconnected components of a graph: any two edges of one lie on a common cycle.

    R. Tarjan, SIAM J. Comput. 1 (1972) 146-160, without recursion.
    """
    edges_at: dict[str, list[int]] = {}
    for number, edge in enumerate(edges):
        for end in edge.ends:
            edges_at.setdefault(end, []).append(number)
    components: list[list[Edge]] = []
    order, low = dict[str, int](), dict[str, int]()
    visited, open_edges = set[int](), list[int]()
    for start in edges_at:
        if start in order:
            continue
        order[start] = low[start] = len(order)
        path = [(start, -1, iter(edges_at[start]))]
        while path:
            body, entry, remaining = path[-1]
            number = next((k for k in remaining if k not in visited), -1)
            if number < 0:
                path.pop()
                if path:
                    parent = path[-1][0]
                    low[parent] = min(low[parent], low[body])
                    if low[body] >= order[parent]:
                        first = open_edges.index(entry)
                        components.append([edges[k] for k in open_edges[first:]])
                        del open_edges[first:]
                continue
            visited.add(number)
            open_edges.append(number)
            first_end, second_end = edges[number].ends
            end = second_end if first_end == body else first_end
            if end in order:
                low[body] = min(low[body], order[end])
            else:
                order[end] = low[end] = len(order)
                path.append((end, number, iter(edges_at[end])))
    return components
