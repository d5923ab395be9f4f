"""The tree of a mechanism with many loops, grown without a look at what they cost."""

from __future__ import annotations

from collections.abc import Callable

from ....graph.choice import chosen
from ....graph.growing import Tree, breadth_first
from ....graph.mechanism import GROUND, Edge, Mechanism
from ....graph.paths import work
from ...definition import Definition, Method
from ...scale import COUNT

#: Rows of a pin that closes a loop in the plane.
PIN = 2


def _lift(pairs: int) -> Mechanism:
    """Pairs of crossed bars, pinned in their middle and on both tips of the pair below."""
    held = [(GROUND, 0), (0, 1)]
    for bar in range(2, 2 * pairs, 2):
        held += [(bar - 1, bar), (bar - 2, bar + 1), (bar, bar + 1)]
    return Mechanism(2 * pairs, tuple(Edge(one, other, PIN) for one, other in held))


def _work(pairs: float, grown: Callable[[Mechanism], Tree]) -> float:
    """Of a body's hinge, on average."""
    lift = _lift(int(pairs))
    return work(lift, grown(lift)) / lift.bodies


CASE = Definition(
    name="grown-tree",
    title="Closed loops: the tree of a scissor lift",
    why="Rows of a loop wait at every hinge from where it is cut to the body where it closes, and "
    "any two that wait at one hinge meet there. Grown breadth first, as shortest ways are, the "
    "tree of a lift holds each bar from below and cuts the pins in the middle: all loops close at "
    "the foot, and work grows with the square of their number. Depth first is as bad for windows "
    "side by side. So both are taken beside some at random, and hinges swapped while that helps.",
    parameter="pairs of crossed bars", unit="", low=2, high=300, scale=COUNT,
    measured="pairs of rows that meet at a hinge, mean", limit=100.0,
    method=Method("breadth first", lambda n: _work(n, breadth_first)),
    remedy=Method("the best of several, swapped", lambda n: _work(n, chosen)), reach=1000,
    source="Amaldi, Liberti, Maffioli, Maculan, Mathematical Methods of Operations Research 69, "
    "2009 (fundamental cycles by swaps); Wittenburg, Dynamics of Multibody Systems, 2008, ch. 5",
)  # fmt: skip
