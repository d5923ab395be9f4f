"""Spanning tree of a mechanism with many loops, without a cost model."""

from __future__ import annotations

from collections.abc import Callable

from ....graph.choice import chosen
from ....graph.growing import Tree, breadth_first
from ....graph.mechanism import GROUND, Edge, Mechanism
from ....graph.paths import work
from ...definition import Definition, Method
from ...scale import COUNT

#: Number of constraint rows of a pin that closes a planar loop.
PIN = 2


def _lift(pairs: int) -> Mechanism:
    """Scissor lift: pairs of bars pinned in the middle and to the tips of the pair below."""
    held = [(GROUND, 0), (0, 1)]
    for bar in range(2, 2 * pairs, 2):
        held += [(bar - 1, bar), (bar - 2, bar + 1), (bar, bar + 1)]
    return Mechanism(2 * pairs, tuple(Edge(one, other, PIN) for one, other in held))


def _work(pairs: float, grown: Callable[[Mechanism], Tree]) -> float:
    """Mean work per hinge of a body."""
    lift = _lift(int(pairs))
    return work(lift, grown(lift)) / lift.bodies


CASE = Definition(
    name="grown-tree",
    title="Closed loops: the tree of a scissor lift",
    why="Rows of a loop are carried through every hinge from the cut to the body where the loop "
    "closes, and all pairs of rows at a hinge are coupled. Grown breadth first (shortest paths), "
    "the tree of a lift supports each bar from below and cuts the middle pins. All loops close at "
    "the base, and the work grows with the square of their number. Depth first is as bad for "
    "adjacent windows. So both are tried with some random trees, and hinges are swapped as long as "
    "that reduces the work.",
    parameter="pairs of crossed bars", unit="", low=2, high=300, scale=COUNT,
    measured="pairs of rows at a hinge, mean", limit=100.0,
    method=Method("breadth first", lambda n: _work(n, breadth_first)),
    remedy=Method("best of several trees, with swaps", lambda n: _work(n, chosen)), reach=1000,
    source="Amaldi, Liberti, Maffioli, Maculan, Mathematical Methods of Operations Research 69, "
    "2009 (fundamental cycles by swaps); Wittenburg, Dynamics of Multibody Systems, 2008, ch. 5",
)  # fmt: skip
