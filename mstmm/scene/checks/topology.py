"""The tree of a scene: which body hangs on which, in the order in which the sweeps visit them.

A chain is one node of the tree, whatever its length: its members follow one another.
"""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from ..rules.messages import report
from ..rules.values import split

if TYPE_CHECKING:
    from ..tables.all import SceneTables

GROUND_INDEX = -1
Problem = tuple[tuple[str | int, ...], str]


@dataclass(frozen=True, slots=True)
class Link:
    """One body in its place in the tree.

    `body` and `hinge` are indices into the scene's `bodies` and `hinges`, `parent` and `children`
    are positions in `Topology.links` (parent -1: the ground).  `inboard_end` is the end of the
    parent that holds the hinge, `outboard_end` the end by which this body is held; "" is a body's
    own origin.
    """

    body: int
    hinge: int
    parent: int
    inboard_end: str
    outboard_end: str
    children: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Run:
    """`count` bodies in a row, each the child of the one before: a body of its own, or a chain.

    `body`, `hinge` and `place` are those of the first, the others follow it.  `parent` is the place
    of the body on whose `inboard_end` the first hangs; the others hang on `ends`, repeated.
    """

    body: int
    hinge: int
    count: int
    place: int
    parent: int
    inboard_end: str
    outboard_end: str
    ends: tuple[str, ...] = ()


@dataclass(frozen=True)
class Topology:
    """Bodies depth first: parents before children, branch by branch, children in scene order.

    The next member of a chain comes before what else hangs on a member.  `runs` are the tree in
    that order; `links` and what follows from it are made when first asked for, an object per body.
    """

    runs: tuple[Run, ...]

    @property
    def count(self) -> int:
        """How many bodies there are."""
        return self.runs[-1].place + self.runs[-1].count if self.runs else 0

    @cached_property
    def links(self) -> tuple[Link, ...]:
        """Every body in its place."""
        parents = self.parents
        children: list[list[int]] = [[] for _ in parents]
        for place, parent in enumerate(parents):
            if parent != GROUND_INDEX:
                children[parent].append(place)
        return tuple(
            Link(
                run.body + k, run.hinge + k, parents[run.place + k],
                run.inboard_end if k == 0 else run.ends[(k - 1) % len(run.ends)],
                run.outboard_end, tuple(children[run.place + k]),
            )
            for run in self.runs
            for k in range(run.count)
        )  # fmt: skip

    @cached_property
    def order(self) -> tuple[int, ...]:
        """Scene indices of the bodies, parents first."""
        return tuple(run.body + k for run in self.runs for k in range(run.count))

    @cached_property
    def parents(self) -> tuple[int, ...]:
        """Position of each link's parent, -1 for the ground."""
        return tuple(
            run.parent if k == 0 else run.place + k - 1
            for run in self.runs
            for k in range(run.count)
        )

    @cached_property
    def position(self) -> tuple[int, ...]:
        """Place in `links` of every body of the scene."""
        position = [0] * self.count
        for place, body in enumerate(self.order):
            position[body] = place
        return tuple(position)

    @cached_property
    def _by_body(self) -> tuple[list[int], list[Run]]:
        runs = sorted(self.runs, key=lambda run: run.body)
        return [run.body for run in runs], runs

    @cached_property
    def _by_hinge(self) -> tuple[list[int], list[Run]]:
        runs = sorted(self.runs, key=lambda run: run.hinge)
        return [run.hinge for run in runs], runs

    @cached_property
    def _places(self) -> list[int]:
        return [run.place for run in self.runs]

    def place_of_body(self, body: int) -> int:
        """Place of the scene's body."""
        firsts, runs = self._by_body
        run = runs[bisect_right(firsts, body) - 1]
        return run.place + body - run.body

    def place_of_hinge(self, hinge: int) -> int:
        """Place of the body whose inboard hinge is the scene's hinge."""
        firsts, runs = self._by_hinge
        run = runs[bisect_right(firsts, hinge) - 1]
        return run.place + hinge - run.hinge

    def at(self, place: int) -> tuple[int, int]:
        """(body, hinge) of the scene at a place."""
        run = self.runs[bisect_right(self._places, place) - 1]
        k = place - run.place
        return run.body + k, run.hinge + k

    @property
    def roots(self) -> tuple[int, ...]:
        """Positions of the bodies hinged to the ground."""
        return tuple(run.place for run in self.runs if run.parent == GROUND_INDEX)

    @property
    def is_chain(self) -> bool:
        """True for one unbranched chain from the ground."""
        return all(run.parent == run.place - 1 for run in self.runs)


def build(scene: SceneTables) -> Topology:
    """The tree of a scene.  O(tables), no recursion.

    Raises SceneError, one line per problem, for closed loops, hinges written the wrong way round
    and bodies that no hinge connects to the ground.
    """
    tree = _tree(_Graph(scene))
    if tree is None:
        tables = {"body": scene.body, "hinge": scene.hinge, "chain": scene.chain}
        raise report(list(problems(scene)), tables, "scene")
    return tree


class _Graph:
    """Nodes are the scene's bodies, then its chains; edges its hinges, then the chains' first."""

    def __init__(self, scene: SceneTables) -> None:
        self.scene = scene
        self.index = {body.name: i for i, body in enumerate(scene.body)}
        self.nodes = len(scene.body) + len(scene.chain)
        self.inboard = [hinge.inboard for hinge in scene.hinge]
        self.inboard += [chain.inboard for chain in scene.chain]
        self.outboard = [self.index[hinge.outboard_body] for hinge in scene.hinge]
        self.outboard += range(len(scene.body), self.nodes)

    def holder(self, edge: int) -> tuple[int, int]:
        """(node on which an edge hangs, member of it where it is a chain); -1: the ground."""
        name = split(self.inboard[edge])[0]
        known = self.index.get(name)
        if known is not None:
            return known, 0
        place = self.scene.bodies.place(name)
        return (GROUND_INDEX, 0) if place is None else (len(self.index) + place[0], place[1])

    def place(self, edge: int) -> tuple[str, int]:
        """Table and number of an edge."""
        hinges = len(self.scene.hinge)
        return ("hinge", edge) if edge < hinges else ("chain", edge - hinges)

    def name(self, node: int) -> str:
        """What a message calls a node."""
        bodies = len(self.scene.body)
        return self.scene.body[node].name if node < bodies else self.scene.chain[node - bodies].name

    def edge_name(self, edge: int) -> str:
        table, number = self.place(edge)
        name: str = getattr(self.scene, table)[number].name
        return f"{name}[0].hinge" if table == "chain" else name


def _tree(graph: _Graph) -> Topology | None:
    """The tree, or None if the hinges are not one."""
    nodes = graph.nodes
    if len(graph.outboard) != nodes:
        return None
    # Per node (-1: the ground) its children, as (member that holds it, child).
    children: list[list[tuple[int, int]]] = [[] for _ in range(nodes + 1)]
    edge_of, holder_of = [0] * nodes, [(GROUND_INDEX, 0)] * nodes
    for edge, child in enumerate(graph.outboard):
        edge_of[child], holder_of[child] = edge, graph.holder(edge)
        parent, member = holder_of[child]
        children[parent].append((member, child))
    for siblings in children:
        # Popped from the end: what hangs farthest out on a chain comes first.
        siblings.sort(key=lambda one: (one[0], -one[1]))
    runs: list[Run] = []
    first = [0] * (nodes + 1)
    bodies, places = graph.scene.bodies, 0
    stack = [child for _, child in children[GROUND_INDEX]]
    while stack:
        node = stack.pop()
        parent, member = holder_of[node]
        at = GROUND_INDEX if parent == GROUND_INDEX else first[parent] + member
        runs.append(_run(graph, node, edge_of[node], places, at))
        first[node] = places
        places += runs[-1].count
        stack.extend(child for _, child in children[node])
    return Topology(tuple(runs)) if places == len(bodies) else None


def _run(graph: _Graph, node: int, edge: int, place: int, parent: int) -> Run:
    scene = graph.scene
    inboard_end = split(graph.inboard[edge])[1]
    bodies, hinges = len(scene.body), len(scene.hinge)
    if node < bodies:
        outboard_end = scene.hinge[edge].outboard_end
        return Run(node, edge, 1, place, parent, inboard_end, outboard_end)
    chain = scene.chain[node - bodies]
    body, hinge = scene.bodies.starts[node - bodies], scene.hinges.starts[edge - hinges]
    return Run(body, hinge, chain.count, place, parent, inboard_end, "", chain.held_ends)


# --- what is not a tree ---------------------------------------------------------------------------


@dataclass
class _Component:
    """Nodes that hinges connect, walked from one of them without regard to direction.

    `via[node]` = (node before it, edge); `closing` are the edges that close a loop.
    """

    nodes: list[int]
    via: dict[int, tuple[int, int]]
    turned: list[int]
    closing: list[tuple[int, int, int]]


def problems(scene: SceneTables) -> Iterator[Problem]:
    """Places and messages of everything that keeps the hinges from being a tree."""
    graph = _Graph(scene)
    edges: list[list[tuple[int, int, bool]]] = [[] for _ in range(graph.nodes + 1)]
    for edge, outboard in enumerate(graph.outboard):
        inboard = graph.holder(edge)[0]
        edges[inboard].append((outboard, edge, False))
        edges[outboard].append((inboard, edge, True))
    seen = [False] * len(edges)
    for start in range(GROUND_INDEX, graph.nodes):
        if not seen[start]:
            component = _walk(start, edges, seen)
            yield from _loops(graph, component)
            yield from _direction(graph, component, start)


def _walk(start: int, edges: list[list[tuple[int, int, bool]]], seen: list[bool]) -> _Component:
    component = _Component([start], {}, [], [])
    seen[start] = True
    used: set[int] = set()
    queue = deque([start])
    while queue:
        node = queue.popleft()
        for other, edge, backwards in edges[node]:
            if edge in used:
                continue
            used.add(edge)
            if seen[other]:
                component.closing.append((node, other, edge))
                continue
            seen[other] = True
            component.via[other] = (node, edge)
            component.nodes.append(other)
            if backwards:
                component.turned.append(edge)
            queue.append(other)
    return component


def _loops(graph: _Graph, component: _Component) -> Iterator[Problem]:
    """Closed loops, by the hinges on each."""
    for one, other, closing in component.closing:
        ring = sorted({closing, *_path(component, one) ^ _path(component, other)})
        names = ", ".join(f'"{graph.edge_name(edge)}"' for edge in ring[:8])
        names += f" and {len(ring) - 8} more" if len(ring) > 8 else ""
        yield (
            graph.place(closing),
            f"closes a loop of the hinges {names}; closed loops come in a later release, "
            "remove one of them for now",
        )


def _path(component: _Component, node: int) -> set[int]:
    """Edges between a node and the start of its component."""
    edges = set()
    while node in component.via:
        node, edge = component.via[node]
        edges.add(edge)
    return edges


def _direction(graph: _Graph, component: _Component, start: int) -> Iterator[Problem]:
    """Hinges written the wrong way round, or a part that is not held by the ground."""
    if start == GROUND_INDEX:
        if not component.closing:
            for edge in component.turned:
                inboard = split(graph.inboard[edge])[0]
                yield (
                    graph.place(edge),
                    f'points towards the ground: "{inboard}" is already held by another hinge; '
                    "swap inboard and outboard",
                )
        return
    names = [graph.name(i) for i in sorted(component.nodes)]
    more = f" (with {', '.join(names[1:5])}{', ...' if len(names) > 5 else ''})"
    more = more if names[1:] else ""
    held = {graph.name(graph.outboard[edge]) for _, edge in component.via.values()}
    base = next((name for name in names if name not in held), names[0])
    bodies = len(graph.scene.body)
    if start >= bodies:
        yield (
            ("chain", start - bodies),
            f'no hinge connects it{more} to the ground; hang it on the ground, inboard = "ground"',
        )
        return
    yield (
        ("body", start),
        f'no hinge connects it{more} to the ground; add a hinge of type "free" with '
        f'inboard = "ground" and outboard = "{base}"',
    )
