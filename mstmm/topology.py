"""The tree of a scene: which body hangs on which, in the order in which the sweeps visit them."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .scene import Scene

GROUND_INDEX = -1
Problem = tuple[tuple[str | int, ...], str]


@dataclass(frozen=True, slots=True)
class Link:
    """One body in its place in the tree.

    `body` and `hinge` are indices into the scene, `parent` and `children` are positions in
    `Topology.links` (parent -1: the ground).  `inboard_end` is the end of the parent that holds
    the hinge, `outboard_end` the end by which this body is held; "" is a body's own origin.
    """

    body: int
    hinge: int
    parent: int
    inboard_end: str
    outboard_end: str
    children: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Topology:
    """Bodies depth first: parents before children, branch by branch, children in scene order.

    `position[i]` is the place of the scene's body i in `links`.
    """

    links: tuple[Link, ...]
    position: tuple[int, ...]

    @property
    def order(self) -> tuple[int, ...]:
        """Scene indices of the bodies, parents first."""
        return tuple(link.body for link in self.links)

    @property
    def parents(self) -> tuple[int, ...]:
        """Position of each link's parent, -1 for the ground."""
        return tuple(link.parent for link in self.links)

    @property
    def roots(self) -> tuple[int, ...]:
        """Positions of the bodies hinged to the ground."""
        return tuple(i for i, link in enumerate(self.links) if link.parent == GROUND_INDEX)

    @property
    def is_chain(self) -> bool:
        """True for one unbranched chain from the ground."""
        return len(self.roots) == 1 and all(len(link.children) <= 1 for link in self.links)


def build(scene: Scene) -> Topology:
    """The tree of a scene.  O(bodies + hinges), no recursion.

    Raises SceneError, one line per problem, for closed loops, hinges written the wrong way round
    and bodies that no hinge connects to the ground.
    """
    tree = _tree(scene)
    if tree is None:
        from .scene_errors import report

        tables = {"body": scene.body, "hinge": scene.hinge}
        raise report(list(problems(scene)), tables, "scene")
    return tree


def _tree(scene: Scene) -> Topology | None:
    """The tree, or None if the hinges are not one."""
    index = {body.name: i for i, body in enumerate(scene.body)}
    children: list[list[int]] = [[] for _ in range(len(scene.body) + 1)]
    hinge_of = [0] * len(scene.body)
    if len(scene.hinge) != len(scene.body):
        return None
    for h, hinge in enumerate(scene.hinge):
        child = index[hinge.outboard_body]
        hinge_of[child] = h
        children[index.get(hinge.inboard_body, GROUND_INDEX)].append(child)
    for siblings in children:
        siblings.sort(reverse=True)
    order: list[int] = []
    stack = list(children[GROUND_INDEX])
    while stack:
        body = stack.pop()
        order.append(body)
        stack.extend(children[body])
    if len(order) != len(scene.body):
        return None
    position = [0] * len(order)
    for place, body in enumerate(order):
        position[body] = place
    links = []
    for body in order:
        hinge = scene.hinge[hinge_of[body]]
        parent = index.get(hinge.inboard_body, GROUND_INDEX)
        links.append(Link(
            body, hinge_of[body], GROUND_INDEX if parent == GROUND_INDEX else position[parent],
            hinge.inboard_end, hinge.outboard_end,
            tuple(position[c] for c in reversed(children[body])),
        ))  # fmt: skip
    return Topology(tuple(links), tuple(position))


# --- what is not a tree ---------------------------------------------------------------------------


@dataclass
class _Component:
    """Bodies that hinges connect, walked from one of them without regard to direction.

    `via[node]` = (node before it, hinge); `closing` are the hinges that close a loop.
    """

    nodes: list[int]
    via: dict[int, tuple[int, int]]
    turned: list[int]
    closing: list[tuple[int, int, int]]


def problems(scene: Scene) -> Iterator[Problem]:
    """Places and messages of everything that keeps the hinges from being a tree."""
    index = {body.name: i for i, body in enumerate(scene.body)}
    edges: list[list[tuple[int, int, bool]]] = [[] for _ in range(len(scene.body) + 1)]
    for h, hinge in enumerate(scene.hinge):
        inboard = index.get(hinge.inboard_body, GROUND_INDEX)
        outboard = index[hinge.outboard_body]
        edges[inboard].append((outboard, h, False))
        edges[outboard].append((inboard, h, True))
    seen = [False] * len(edges)
    for start in range(GROUND_INDEX, len(scene.body)):
        if not seen[start]:
            component = _walk(start, edges, seen)
            yield from _loops(scene, component)
            yield from _direction(scene, component, start)


def _walk(start: int, edges: list[list[tuple[int, int, bool]]], seen: list[bool]) -> _Component:
    component = _Component([start], {}, [], [])
    seen[start] = True
    used: set[int] = set()
    queue = deque([start])
    while queue:
        node = queue.popleft()
        for other, hinge, backwards in edges[node]:
            if hinge in used:
                continue
            used.add(hinge)
            if seen[other]:
                component.closing.append((node, other, hinge))
                continue
            seen[other] = True
            component.via[other] = (node, hinge)
            component.nodes.append(other)
            if backwards:
                component.turned.append(hinge)
            queue.append(other)
    return component


def _loops(scene: Scene, component: _Component) -> Iterator[Problem]:
    """Closed loops, by the hinges on each."""
    for one, other, closing in component.closing:
        ring = sorted({closing, *_path(component, one) ^ _path(component, other)})
        names = ", ".join(f'"{scene.hinge[h].name}"' for h in ring[:8])
        names += f" and {len(ring) - 8} more" if len(ring) > 8 else ""
        yield (
            ("hinge", closing),
            f"closes a loop of the hinges {names}; closed loops come in a later release, "
            "remove one of them for now",
        )


def _path(component: _Component, node: int) -> set[int]:
    """Hinges between a node and the start of its component."""
    hinges = set()
    while node in component.via:
        node, hinge = component.via[node]
        hinges.add(hinge)
    return hinges


def _direction(scene: Scene, component: _Component, start: int) -> Iterator[Problem]:
    """Hinges written the wrong way round, or a part that is not held by the ground."""
    if start == GROUND_INDEX:
        if not component.closing:
            for hinge in component.turned:
                inboard = scene.hinge[hinge].inboard_body
                yield (
                    ("hinge", hinge),
                    f'points towards the ground: "{inboard}" is already held by another hinge; '
                    "swap inboard and outboard",
                )
        return
    names = [scene.body[i].name for i in sorted(component.nodes)]
    more = f" (with {', '.join(names[1:5])}{', ...' if len(names) > 5 else ''})"
    more = more if names[1:] else ""
    held = {scene.hinge[h].outboard_body for _, h in component.via.values()}
    base = next((name for name in names if name not in held), names[0])
    yield (
        ("body", start),
        f'no hinge connects it{more} to the ground; add a hinge of type "free" with '
        f'inboard = "ground" and outboard = "{base}"',
    )
