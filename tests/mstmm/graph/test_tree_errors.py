"""Mechanisms without a tree, and what they are told."""

from __future__ import annotations

import pytest

from mstmm.graph.mechanism_graph import GROUND, Edge, MechanismGraph
from mstmm.graph.spanning_tree import grow_tree
from mstmm.graph.tree_errors import (
    AllHingesCut,
    ConflictingTreeHinges,
    Cyclic,
    TreeProblem,
    UnconnectedBodies,
    WrongHingeDirection,
    tree_problems,
)
from tests.support.graph.mechanisms import pins, random_mechanism

CUT, KEPT = True, False


@pytest.mark.parametrize(
    ("mechanism", "expected"),
    [
        (pins(2, [(GROUND, 0), (1, 0)]), [WrongHingeDirection(1, 1)]),
        (pins(3, [(GROUND, 0), (1, 0), (2, 1)]), [
            WrongHingeDirection(1, 1), WrongHingeDirection(2, 2)]),
        (pins(3, [(GROUND, 0), (1, 0), (1, 2)]), [WrongHingeDirection(1, 1)]),
        (pins(3, [(GROUND, 0), (1, 0), (1, 2), (2, 1)]), [WrongHingeDirection(1, 1)]),
        (pins(3, [(GROUND, 0), (1, 2)]), [UnconnectedBodies((1, 2), 1)]),
        (pins(3, [(GROUND, 0), (2, 1), (1, 2)]), [UnconnectedBodies((1, 2), 1)]),
        (MechanismGraph(1, (Edge(GROUND, 0, 5, CUT),)), [AllHingesCut(0, (0,))]),
        (MechanismGraph(1, (Edge(GROUND, 0, 5, KEPT), Edge(GROUND, 0, 5, KEPT))),
         [ConflictingTreeHinges(0, (0, 1))]),
        (MechanismGraph(2, (Edge(GROUND, 0, 5), Edge(1, 0, 5, KEPT), Edge(0, 1, 5))),
         [Cyclic(0, (1,))]),
        (MechanismGraph(2, (Edge(GROUND, 0, 5, CUT), Edge(1, 0, 5), Edge(0, 1, 5))),
         [Cyclic(0, (0,))]),
        (MechanismGraph(2, (Edge(GROUND, 0, 5, CUT), Edge(0, 1, 5))), [AllHingesCut(0, (0,))]),
    ],
)  # fmt: skip
def test_what_stands_in_the_way_is_named(
    mechanism: MechanismGraph, expected: list[TreeProblem]
) -> None:
    assert list(tree_problems(mechanism)) == expected


def test_turning_what_is_named_lets_every_body_be_held() -> None:
    turned = 0
    for seed in range(60):
        plain = random_mechanism(seed)
        edges = list(plain.hinges)
        for k, edge in enumerate(edges):
            if edge.inboard != GROUND and (seed + k) % 3 == 0:
                edges[k] = Edge(edge.outboard, edge.inboard, edge.rows)
        found = list(tree_problems(MechanismGraph(plain.bodies, tuple(edges))))
        for one in found:
            assert isinstance(one, WrongHingeDirection)
            edge = edges[one.hinge]
            assert edge.inboard == one.body
            edges[one.hinge] = Edge(edge.outboard, edge.inboard, edge.rows)
            turned += 1
        assert None not in grow_tree(MechanismGraph(plain.bodies, tuple(edges)))
    assert turned > 20


def test_a_mechanism_with_a_tree_has_no_obstacle() -> None:
    assert not [one for seed in range(40) for one in tree_problems(random_mechanism(seed))]
