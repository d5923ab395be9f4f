"""Mechanisms that the tests of the graph share; every pin has two rows, as in the plane."""

from __future__ import annotations

import random

from mstmm.graph.mechanism_graph import GROUND, Edge, MechanismGraph, RowGroup

PIN = 2


def pins(bodies: int, pairs: list[tuple[int, int]]) -> MechanismGraph:
    """A mechanism of pins, each (inboard body, outboard body)."""
    return MechanismGraph(bodies, tuple(Edge(one, other, PIN) for one, other in pairs))


def four_bars(count: int) -> MechanismGraph:
    """Links on the ground side by side, each pair joined by a coupler."""
    pairs = [(GROUND, 0)]
    for coupler in range(1, 2 * count, 2):
        pairs += [(coupler - 1, coupler), (coupler, coupler + 1), (GROUND, coupler + 1)]
    return pins(2 * count + 1, pairs)


def scissors(units: int) -> MechanismGraph:
    """Crossed bars, each pair pinned in its middle and on both tips of the pair before."""
    pairs = [(GROUND, 0), (0, 1)]
    for bar in range(2, 2 * units, 2):
        pairs += [(bar - 1, bar), (bar - 2, bar + 1), (bar, bar + 1)]
    return pins(2 * units, pairs)


def ladder(rungs: int) -> MechanismGraph:
    """Two rails of pinned pieces with a rung between each pair of pieces."""
    pairs = [(GROUND, 0)]
    for left in range(0, 3 * rungs, 3):
        rung, right = left + 1, left + 2
        pairs += [(left - 3, left), (right - 3, right)] if left else []
        pairs += [(left, rung), (rung, right)]
    return pins(3 * rungs, pairs)


def ring(bodies: int) -> MechanismGraph:
    """One loop through the ground."""
    return pins(bodies, [(k - 1, k) for k in range(bodies)] + [(GROUND, bodies - 1)])


def net(length: int, width: int) -> MechanismGraph:
    """Bodies in rows, each pinned to the one before it and to the one beside it."""
    pairs = [(GROUND, 0)]
    for body in range(1, length * width):
        pairs += [(body - width, body)] if body >= width else []
        pairs += [(body - 1, body)] if body % width else []
    return pins(length * width, pairs)


def random_mechanism(seed: int) -> MechanismGraph:
    """A small mechanism with several loops, other rows between two to four bodies among them."""
    draw = random.Random(seed)
    count = draw.randint(3, 10)
    bodies = list(range(count))
    draw.shuffle(bodies)
    edges = [
        Edge(draw.choice([GROUND, *bodies[:k]]), body, draw.choice((2, 3, 5)))
        for k, body in enumerate(bodies)
    ]
    for _ in range(draw.randint(1, 8)):
        one, other = draw.randrange(GROUND, count), draw.randrange(count)
        if one != other:
            edges.append(Edge(one, other, draw.choice((0, 2, 3, 4, 5, 6))))
    draw.shuffle(edges)
    others = tuple(
        RowGroup(tuple(draw.sample(range(GROUND, count), draw.randint(2, 4))), draw.randint(1, 2))
        for _ in range(draw.randint(0, 2))
    )
    return MechanismGraph(count, tuple(edges), others)
