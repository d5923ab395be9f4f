"""Reasons why the hinges of a mechanism form no spanning tree in their given direction."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

from .mechanism_graph import GROUND, MechanismGraph
from .spanning_tree import grow_tree


@dataclass(frozen=True, slots=True)
class ConflictingTreeHinges:
    """Hinges with the same outboard body that must all be part of the tree."""

    body: int
    hinges: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class AllHingesCut:
    """Body all of whose inboard hinges must be cut."""

    body: int
    hinges: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class WrongHingeDirection:
    """Body outside the tree whose `hinge` connects to the tree in the wrong direction."""

    body: int
    hinge: int


@dataclass(frozen=True, slots=True)
class Cyclic:
    """Bodies that form a cycle without the ground because of `cut` keys of `hinges`."""

    body: int
    hinges: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class UnconnectedBodies:
    """Bodies that no hinge connects to the ground; `base` is one without an inboard hinge."""

    bodies: tuple[int, ...]
    base: int


TreeProblem = (
    ConflictingTreeHinges | AllHingesCut | WrongHingeDirection | Cyclic | UnconnectedBodies
)


def tree_problems(mechanism: MechanismGraph) -> Iterator[TreeProblem]:
    """Yield every reason why there is no spanning tree, by bodies; nothing where there is one."""
    unconnected = list(_unconnected_parts(mechanism))
    yield from unconnected
    unconnected_bodies = {body for problem in unconnected for body in problem.bodies}
    conflicts = list(_conflicting_cut_keys(mechanism))
    yield from conflicts
    connected = {body for body, hinge in enumerate(grow_tree(mechanism)) if hinge is not None}
    if conflicts or len(connected) + len(unconnected_bodies) == mechanism.bodies:
        return
    uncut_graph = MechanismGraph(mechanism.bodies, tuple(
        type(edge)(edge.inboard, edge.outboard, edge.rows) for edge in mechanism.hinges
    ))  # fmt: skip
    reachable = {body for body, hinge in enumerate(grow_tree(uncut_graph)) if hinge is not None}
    wrong_directions = list(_wrong_directions(mechanism, reachable | unconnected_bodies))
    yield from wrong_directions
    unreached_bodies = [body for body in range(mechanism.bodies) if body in reachable - connected]
    if unreached_bodies and not wrong_directions:
        hinges = tuple(
            number for number, edge in enumerate(mechanism.hinges)
            if edge.cut is not None and edge.outboard in unreached_bodies
        )  # fmt: skip
        yield Cyclic(unreached_bodies[0], hinges)


def _conflicting_cut_keys(
    mechanism: MechanismGraph,
) -> Iterator[ConflictingTreeHinges | AllHingesCut]:
    inboard_hinges: list[list[int]] = [[] for _ in range(mechanism.bodies)]
    for number, edge in enumerate(mechanism.hinges):
        inboard_hinges[edge.outboard].append(number)
    for body, hinges in enumerate(inboard_hinges):
        required_hinges = tuple(
            number for number in hinges if mechanism.hinges[number].cut is False
        )
        if len(required_hinges) > 1:
            yield ConflictingTreeHinges(body, required_hinges)
        if hinges and all(mechanism.hinges[number].cut for number in hinges):
            yield AllHingesCut(body, tuple(hinges))


def _wrong_directions(
    mechanism: MechanismGraph, reached: set[int]
) -> Iterator[WrongHingeDirection]:
    """Hinges that connect every body once reversed: one for each unreachable part."""
    outboard_bodies: list[list[int]] = [[] for _ in range(mechanism.bodies)]
    reversed_edges: deque[tuple[int, int]] = deque()
    for number, edge in enumerate(mechanism.hinges):
        if edge.inboard != GROUND:
            outboard_bodies[edge.inboard].append(edge.outboard)
            if edge.outboard in reached and edge.inboard not in reached:
                reversed_edges.append((number, edge.inboard))
    inboard_edges: list[list[tuple[int, int]]] = [[] for _ in range(mechanism.bodies)]
    for number, edge in enumerate(mechanism.hinges):
        if edge.inboard != GROUND:
            inboard_edges[edge.outboard].append((number, edge.inboard))
    reached = set(reached)
    while reversed_edges:
        hinge, body = reversed_edges.popleft()
        if body in reached:
            continue
        yield WrongHingeDirection(body, hinge)
        stack = [body]
        while stack:
            current = stack.pop()
            if current not in reached:
                reached.add(current)
                stack.extend(outboard_bodies[current])
                reversed_edges.extend(inboard_edges[current])


def _unconnected_parts(mechanism: MechanismGraph) -> Iterator[UnconnectedBodies]:
    """Parts that no hinge connects to the ground, in either direction."""
    neighbours: list[list[int]] = [[] for _ in range(mechanism.bodies + 1)]
    for edge in mechanism.hinges:
        neighbours[edge.inboard].append(edge.outboard)
        neighbours[edge.outboard].append(edge.inboard)
    outboard = {edge.outboard for edge in mechanism.hinges}
    is_visited = [False] * (mechanism.bodies + 1)
    for start in range(GROUND, mechanism.bodies):
        if is_visited[start]:
            continue
        component, stack = [], [start]
        is_visited[start] = True
        while stack:
            body = stack.pop()
            component.append(body)
            for neighbour in neighbours[body]:
                if not is_visited[neighbour]:
                    is_visited[neighbour] = True
                    stack.append(neighbour)
        if start != GROUND:
            component.sort()
            base = next((body for body in component if body not in outboard), component[0])
            yield UnconnectedBodies(tuple(component), base)
