"""Reasons why the hinges of a mechanism form no spanning tree in their given direction."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

from .growing import held
from .mechanism import GROUND, Mechanism


@dataclass(frozen=True, slots=True)
class KeptTwice:
    """Hinges with the same outboard body that must all be part of the tree."""

    body: int
    hinges: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class OnlyCut:
    """Body all of whose inboard hinges must be cut."""

    body: int
    hinges: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Turned:
    """Body outside the tree whose `hinge` connects to the tree in the wrong direction."""

    body: int
    hinge: int


@dataclass(frozen=True, slots=True)
class Cyclic:
    """Bodies that form a cycle without the ground because of `cut` keys of `hinges`."""

    body: int
    hinges: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Loose:
    """Bodies that no hinge connects to the ground; `base` is one without an inboard hinge."""

    bodies: tuple[int, ...]
    base: int


Obstacle = KeptTwice | OnlyCut | Turned | Cyclic | Loose


def obstacles(mechanism: Mechanism) -> Iterator[Obstacle]:
    """Yield every reason why there is no spanning tree, by bodies; nothing where there is one."""
    loose = list(_loose(mechanism))
    yield from loose
    apart = {body for one in loose for body in one.bodies}
    wishes = list(_wishes(mechanism))
    yield from wishes
    reached = {body for body, hinge in enumerate(held(mechanism)) if hinge is not None}
    if wishes or len(reached) + len(apart) == mechanism.bodies:
        return
    plain = Mechanism(mechanism.bodies, tuple(
        type(edge)(edge.inboard, edge.outboard, edge.rows) for edge in mechanism.hinges
    ))  # fmt: skip
    written = {body for body, hinge in enumerate(held(plain)) if hinge is not None}
    turned = list(_turned(mechanism, written | apart))
    yield from turned
    lost = [body for body in range(mechanism.bodies) if body in written - reached]
    if lost and not turned:
        hinges = tuple(
            number for number, edge in enumerate(mechanism.hinges)
            if edge.cut is not None and edge.outboard in lost
        )  # fmt: skip
        yield Cyclic(lost[0], hinges)


def _wishes(mechanism: Mechanism) -> Iterator[KeptTwice | OnlyCut]:
    holding: list[list[int]] = [[] for _ in range(mechanism.bodies)]
    for number, edge in enumerate(mechanism.hinges):
        holding[edge.outboard].append(number)
    for body, hinges in enumerate(holding):
        kept = tuple(number for number in hinges if mechanism.hinges[number].cut is False)
        if len(kept) > 1:
            yield KeptTwice(body, kept)
        if hinges and all(mechanism.hinges[number].cut for number in hinges):
            yield OnlyCut(body, tuple(hinges))


def _turned(mechanism: Mechanism, reached: set[int]) -> Iterator[Turned]:
    """Hinges that connect every body once reversed: one for each unreachable part."""
    outward: list[list[int]] = [[] for _ in range(mechanism.bodies)]
    backward: deque[tuple[int, int]] = deque()
    for number, edge in enumerate(mechanism.hinges):
        if edge.inboard != GROUND:
            outward[edge.inboard].append(edge.outboard)
            if edge.outboard in reached and edge.inboard not in reached:
                backward.append((number, edge.inboard))
    inward: list[list[tuple[int, int]]] = [[] for _ in range(mechanism.bodies)]
    for number, edge in enumerate(mechanism.hinges):
        if edge.inboard != GROUND:
            inward[edge.outboard].append((number, edge.inboard))
    reached = set(reached)
    while backward:
        hinge, body = backward.popleft()
        if body in reached:
            continue
        yield Turned(body, hinge)
        stack = [body]
        while stack:
            at = stack.pop()
            if at not in reached:
                reached.add(at)
                stack.extend(outward[at])
                backward.extend(inward[at])


def _loose(mechanism: Mechanism) -> Iterator[Loose]:
    """Parts that no hinge connects to the ground, in either direction."""
    joined: list[list[int]] = [[] for _ in range(mechanism.bodies + 1)]
    for edge in mechanism.hinges:
        joined[edge.inboard].append(edge.outboard)
        joined[edge.outboard].append(edge.inboard)
    outboard = {edge.outboard for edge in mechanism.hinges}
    seen = [False] * (mechanism.bodies + 1)
    for start in range(GROUND, mechanism.bodies):
        if seen[start]:
            continue
        part, stack = [], [start]
        seen[start] = True
        while stack:
            body = stack.pop()
            part.append(body)
            for other in joined[body]:
                if not seen[other]:
                    seen[other] = True
                    stack.append(other)
        if start != GROUND:
            part.sort()
            base = next((body for body in part if body not in outboard), part[0])
            yield Loose(tuple(part), base)
