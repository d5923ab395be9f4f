"""Where loops close and in which order: against the definitions and a dense elimination."""

from __future__ import annotations

import random
from fractions import Fraction
from functools import partial

import pytest

from mstmm.graph.closure_plan import ClosurePlan, closure_plan, elimination_order
from mstmm.graph.mechanism_graph import GROUND, Edge, MechanismGraph, RowGroup
from tests.support.graph import exhaustive_search as reference
from tests.support.graph.mechanisms import (
    four_bars,
    ladder,
    net,
    pins,
    random_mechanism,
    ring,
    scissors,
)
from tests.support.work import calls

SEEDS = range(40)


@pytest.mark.parametrize("seed", SEEDS)
def test_rows_are_pending_from_their_ends_to_where_they_close(seed: int) -> None:
    mechanism = random_mechanism(seed)
    plan = closure_plan(mechanism)
    known = dict(enumerate((*plan.cut_of, *range(len(mechanism.hinges), 99))))
    found = [{known[group] for group in groups} for groups in plan.pending]
    drop = {hinge for hinge in plan.cut if mechanism.hinges[hinge].rows == 0}
    assert found == [groups - drop for groups in reference.pending(mechanism, plan.tree)]
    closes = {closing.group: closing.body for closing in plan.closings}
    assert sorted(closes) == list(range(len(plan.groups)))
    for group, rows in enumerate(plan.groups):
        ways = [reference.inwards(mechanism, plan.tree, end) if end != GROUND else [GROUND]
                for end in rows.ends]  # fmt: skip
        assert closes[group] == next(b for b in ways[0] if all(b in way for way in ways))


@pytest.mark.parametrize("seed", SEEDS)
def test_closings_come_before_what_they_need_is_gone(seed: int) -> None:
    """A body's closings come before those of every body nearer to the ground on its way."""
    mechanism = random_mechanism(seed)
    plan = closure_plan(mechanism)
    done: list[int] = []
    for closing in plan.closings:
        if closing.body != GROUND:
            assert not set(done) & set(reference.inwards(mechanism, plan.tree, closing.body)[1:])
        done.append(closing.body)


def _coupling_matrix(plan: ClosurePlan, draw: random.Random) -> list[list[Fraction]]:
    """L of all groups as if each had one row: a sum of squares over the hinges they pass."""
    size = len(plan.groups)
    total = [[Fraction(0)] * size for _ in range(size)]
    for groups in plan.pending:
        for _ in range(2):
            column = {group: Fraction(draw.randint(1, 10**6)) for group in groups}
            for i, x in column.items():
                for j, y in column.items():
                    total[i][j] += x * y
    return total


@pytest.mark.parametrize("seed", SEEDS)
def test_blocks_that_are_left_out_are_zero(seed: int) -> None:
    """Gauss' elimination in exact numbers, group by group in the order of the closings."""
    plan = closure_plan(random_mechanism(seed))
    matrix = _coupling_matrix(plan, random.Random(seed))
    left = set(range(len(plan.groups)))
    for closing in plan.closings:
        left.discard(closing.group)
        row, pivot = matrix[closing.group], matrix[closing.group][closing.group]
        assert {other for other in left if row[other]} <= set(closing.coupled) <= left
        assert pivot > 0
        for i in left:
            for j in left:
                matrix[i][j] -= row[i] * row[j] / pivot


def test_the_ground_closes_a_row_of_four_bars_in_a_band() -> None:
    """Block tridiagonal: each group is coupled with at most one that closes later."""
    plan = closure_plan(four_bars(1000))
    assert {closing.body for closing in plan.closings} == {GROUND}
    assert max(len(closing.coupled) for closing in plan.closings) == 1
    assert len(plan.blocks) == 2 * 1000 - 1


@pytest.mark.parametrize("build", [scissors, ladder])
def test_loops_away_from_the_ground_close_on_bodies(build: object) -> None:
    plan = closure_plan(build(50))  # type: ignore[operator]
    assert GROUND not in {closing.body for closing in plan.closings}
    assert len({closing.body for closing in plan.closings}) == len(plan.cut)


def test_a_ring_closes_once() -> None:
    plan = closure_plan(ring(9))
    assert (plan.rows, plan.front, len(plan.closings)) == (2, 2, 1)


def test_a_net_has_blocks_in_proportion_to_its_length() -> None:
    short, long = (closure_plan(net(length, 3)) for length in (40, 400))
    assert len(long.blocks) < 11 * len(short.blocks)


def test_minimum_degree_takes_the_leaves_of_a_star_first() -> None:
    couplings = [{1, 2, 3, 4}, {0}, {0}, {0}, {0}]
    order = elimination_order(range(5), couplings, [1] * 5)
    assert [group for group, _ in order] == [1, 2, 3, 0, 4]
    assert all(len(coupled) <= 1 for _, coupled in order)


def test_groups_that_stay_are_coupled_by_those_that_go() -> None:
    couplings = [{1, 2}, {0}, {0}]
    assert elimination_order([0], couplings, [1, 1, 1]) == [(0, (1, 2))]
    assert couplings[1] == {2} and couplings[2] == {1}


def test_a_coupling_of_hinges_is_pending_from_its_hinges_inwards() -> None:
    """Gears on a carrier: the row closes on the carrier and passes both wheels' hinges."""
    hinges = tuple(Edge(*pair, 5) for pair in ((GROUND, 0), (0, 1), (0, 2)))
    plan = closure_plan(MechanismGraph(3, hinges, (RowGroup((0, 1, 0, 2), 1),)))
    assert plan.pending == ((), (0,), (0,))
    assert [closing.body for closing in plan.closings] == [0]


def test_a_cut_hinge_without_rows_needs_no_closing() -> None:
    plan = closure_plan(MechanismGraph(1, (Edge(GROUND, 0, 5), Edge(GROUND, 0, 0))))
    assert (plan.cut, plan.cut_of, plan.closings) == ((1,), (), ())


def test_a_tree_has_nothing_to_close() -> None:
    plan = closure_plan(pins(3, [(GROUND, 0), (0, 1), (0, 2)]))
    assert (plan.rows, plan.front, plan.work, plan.blocks) == (0, 0, 0, ())


def test_a_plan_of_ten_times_the_loops_takes_ten_times_the_work() -> None:
    for build in (four_bars, scissors, ladder):
        few, many = (calls(partial(closure_plan, build(count))) for count in (30, 300))
        assert many < 12 * few
