"""Spanning tree of a mechanism with many loops, without a cost model."""

from __future__ import annotations

from collections.abc import Callable

from ....graph.mechanism_graph import GROUND, Edge, MechanismGraph
from ....graph.spanning_tree import spanning_tree
from ....graph.tree_growth import Tree, breadth_first_tree
from ....graph.tree_paths import total_cost
from ...case_definition import CaseDefinition, MethodDefinition
from ...parameter_scale import COUNT_SCALE

#: Number of constraint rows of a pin that closes a planar loop.
PIN_ROWS = 2


def _lift(pairs: int) -> MechanismGraph:
    """Scissor lift: pairs of bars pinned in the middle and to the tips of the pair below."""
    hinges = [(GROUND, 0), (0, 1)]
    for bar in range(2, 2 * pairs, 2):
        hinges += [(bar - 1, bar), (bar - 2, bar + 1), (bar, bar + 1)]
    return MechanismGraph(
        2 * pairs, tuple(Edge(first, second, PIN_ROWS) for first, second in hinges)
    )


def _mean_work(pairs: float, build_tree: Callable[[MechanismGraph], Tree]) -> float:
    """Mean number of pairs of rows per hinge of the tree."""
    lift = _lift(int(pairs))
    return total_cost(lift, build_tree(lift)) / lift.bodies


CASE = CaseDefinition(
    name="grown-tree",
    title="Closed loops: the tree of a scissor lift",
    cause="Rows of a loop are carried through every hinge from the cut to the body where the loop "
    "closes, and all pairs of rows at a hinge are coupled. Grown breadth first (shortest paths), "
    "the tree of a lift supports each bar from below and cuts the middle pins. All loops close at "
    "the base, and the work grows with the square of their number. Depth first is as bad for "
    "adjacent windows. So both are tried with some random trees, and hinges are swapped as long as "
    "that reduces the work.",
    parameter="pairs of crossed bars",
    unit="",
    low=2,
    high=300,
    scale=COUNT_SCALE,
    measured="pairs of rows at a hinge, mean",
    limit=100.0,
    method=MethodDefinition("breadth first", lambda n: _mean_work(n, breadth_first_tree)),
    remedy=MethodDefinition(
        "best of several trees, with swaps", lambda n: _mean_work(n, spanning_tree)
    ),
    reach=1000,
    source="Amaldi, Liberti, Maffioli, Maculan, Mathematical Methods of Operations Research 69, "
    "2009 (fundamental cycles by swaps); Wittenburg, Dynamics of Multibody Systems, 2008, ch. 5",
)
