"""Spanning tree of a scene, in the order in which the sweeps visit its bodies.

A chain is one node of the tree, whatever its length: its members follow one another.  Where hinges
close loops, each body keeps one of its inboard hinges in the tree, and the others are cut.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

from ...graph.closure_plan import ClosurePlan, closure_plan
from ...graph.mechanism_graph import GROUND
from ..validators.scalars_and_vectors import split_reference
from ..validators.validation_messages import Problem, build_scene_error
from .connectivity import ConnectivityGraph, spanning_tree_problems

if TYPE_CHECKING:
    from ..tables.hinge import Hinge
    from ..tables.scene_tables import SceneTables


@dataclass(frozen=True, slots=True)
class TreeBody:
    """Body at its position in the tree.

    `body` and `hinge` are indices into `bodies` and `hinges` of the scene; `parent` and `children`
    are positions in `Topology.links` (parent -1: the ground).  `inboard_end` is the end of the
    parent at the hinge, `outboard_end` the end of this body at the hinge; "" is the origin of the
    body.
    """

    body: int
    hinge: int
    parent: int
    inboard_end: str
    outboard_end: str
    children: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class BodyRow:
    """Row of `count` bodies, each the child of the one before: a single body, or a chain.

    `body`, `hinge` and `position` are those of the first body; the others follow it.  The first is
    connected to `inboard_end` of the scene's body `on` (-1: the ground) at the position `parent`.
    The others are connected to `ends`, repeated.
    """

    body: int
    hinge: int
    count: int
    position: int
    parent: int
    on: int
    inboard_end: str
    outboard_end: str
    ends: tuple[str, ...] = ()


@dataclass(frozen=True)
class Topology:
    """Tree of a scene, depth first: parents before children, children in scene order.

    The next member of a chain comes before other children of a member.  `runs` are the tree in
    that order; `links`, one object per body, is created at first use.

    `plan` is the closure plan of loops, constraints and couplings, None where nothing closes.  It
    refers to bodies and hinges by scene number.  Its rows are those of the cut hinges, of the
    constraints and of the couplings, in this order.  `carried` maps bodies that are part of another
    one to that body: they share its position, and their hinge has none.
    """

    runs: tuple[BodyRow, ...]
    plan: ClosurePlan | None = None
    carried: Mapping[int, int] = field(default_factory=dict)

    @property
    def cut_hinges(self) -> tuple[int, ...]:
        """Indices of the scene's hinges that are not part of the tree."""
        return () if self.plan is None else self.plan.cut

    @property
    def count(self) -> int:
        """Number of bodies in the tree."""
        return self.runs[-1].position + self.runs[-1].count if self.runs else 0

    @cached_property
    def links(self) -> tuple[TreeBody, ...]:
        """Bodies with an inboard hinge in the tree, in tree order; without carried bodies."""
        parents = self.parents
        children: list[list[int]] = [[] for _ in parents]
        for position, parent in enumerate(parents):
            if parent != GROUND:
                children[parent].append(position)
        return tuple(
            TreeBody(
                run.body + k, run.hinge + k, parents[run.position + k],
                run.inboard_end if k == 0 else run.ends[(k - 1) % len(run.ends)],
                run.outboard_end, tuple(children[run.position + k]),
            )
            for run in self.runs
            for k in range(run.count)
        )  # fmt: skip

    @cached_property
    def order(self) -> tuple[int, ...]:
        """Scene indices of the bodies in tree order, parents first; without carried bodies."""
        return tuple(run.body + k for run in self.runs for k in range(run.count))

    @cached_property
    def parents(self) -> tuple[int, ...]:
        """Position of each link's parent, -1 for the ground."""
        return tuple(
            run.parent if k == 0 else run.position + k - 1
            for run in self.runs
            for k in range(run.count)
        )

    @cached_property
    def position(self) -> tuple[int, ...]:
        """Position in `links` of every body of the scene."""
        return tuple(map(self.position_of_body, range(self.count + len(self.carried))))

    @cached_property
    def _by_body(self) -> tuple[list[int], list[BodyRow]]:
        runs = sorted(self.runs, key=lambda run: run.body)
        return [run.body for run in runs], runs

    @cached_property
    def _by_hinge(self) -> tuple[list[int], list[BodyRow]]:
        runs = sorted(self.runs, key=lambda run: run.hinge)
        return [run.hinge for run in runs], runs

    @cached_property
    def _run_positions(self) -> list[int]:
        return [run.position for run in self.runs]

    def position_of_body(self, body: int) -> int:
        """Position in the tree of a body of the scene."""
        body = self.carried.get(body, body)
        firsts, runs = self._by_body
        run = runs[bisect_right(firsts, body) - 1]
        return run.position + body - run.body

    def position_of_hinge(self, hinge: int) -> int:
        """Position in the tree of the body outboard of a hinge, which must not be cut.

        Raises KeyError for the hinge of a carried body.
        """
        firsts, runs = self._by_hinge
        run = runs[bisect_right(firsts, hinge) - 1]
        if not 0 <= hinge - run.hinge < run.count:
            raise KeyError(hinge)
        return run.position + hinge - run.hinge

    def scene_indices(self, place: int) -> tuple[int, int]:
        """Scene indices (body, hinge) at a position in the tree."""
        run = self.runs[bisect_right(self._run_positions, place) - 1]
        k = place - run.position
        return run.body + k, run.hinge + k

    @property
    def roots(self) -> tuple[int, ...]:
        """Positions of the bodies connected to the ground by a hinge."""
        return tuple(run.position for run in self.runs if run.parent == GROUND)


def build_topology(scene: SceneTables) -> Topology:
    """Build the spanning tree of a scene: O(tables) without loops, no recursion.

    Raises SceneError, one line per problem, for hinges in the wrong direction, cut keys that leave
    no tree, and bodies that no hinge connects to the ground.
    """
    joints = ConnectivityGraph(scene)
    topology = _build_if_tree(joints)
    if topology is None:
        tables = {"body": scene.body, "hinge": scene.hinge, "chain": scene.chain}
        raise build_scene_error(list(spanning_tree_problems(joints)), tables, "scene")
    return topology


def may_have_loops(scene: SceneTables) -> bool:
    """Whether a scene may have loops: hinges in excess of bodies, constraints or couplings."""
    skeleton = scene.skeleton
    excess = len(skeleton.hinge) != len(skeleton.body)
    return excess or bool(scene.constraint or scene.coupling)


def inboard_hinges_by_body(scene: SceneTables) -> dict[str, Hinge]:
    """Inboard hinge in the tree by body name, of a scene that has a tree."""
    skeleton = scene.skeleton
    loops = len(skeleton.hinge) > len(skeleton.body)  # every body has at least one
    cut = set(build_topology(skeleton).cut_hinges) if loops else set()
    return {
        hinge.outboard_body: hinge for number, hinge in enumerate(scene.hinge) if number not in cut
    }


def problems(scene: SceneTables) -> Iterator[Problem]:
    """Locations and messages of all reasons why there is no spanning tree."""
    yield from spanning_tree_problems(ConnectivityGraph(scene))


def _build_if_tree(joints: ConnectivityGraph) -> Topology | None:
    """Topology of a scene, or None where there is no tree."""
    scene, plan = joints.scene, None
    inboard_edges = _unique_inboard_edges(joints)
    if inboard_edges is None or scene.constraint or scene.coupling:
        if next(spanning_tree_problems(joints), None) is not None:
            return None
        plan = closure_plan(joints.body_mechanism())
        chains = range(len(scene.hinge), len(joints.outboard))
        inboard_edges = [*plan.tree[: len(scene.body)], *chains]
    runs = _body_rows(joints, inboard_edges)
    is_complete = sum(run.count for run in runs) == len(scene.bodies)
    return Topology(runs, plan) if is_complete else None


def _unique_inboard_edges(joints: ConnectivityGraph) -> list[int] | None:
    """Inboard edge of each node; None where a node has none or several, or an edge is cut."""
    inboard_edges = [-1] * joints.nodes
    for edge, node in enumerate(joints.outboard):
        inboard_edges[node] = edge
    has_cut = any(hinge.cut for hinge in joints.scene.hinge)
    return (
        None
        if has_cut or -1 in inboard_edges or len(joints.outboard) > joints.nodes
        else inboard_edges
    )


def _body_rows(joints: ConnectivityGraph, held: Sequence[int]) -> tuple[BodyRow, ...]:
    """Rows of bodies of the tree in which `held` is the inboard edge of each node."""
    # For each node (last: the ground) its children, as (member they are connected to, child).
    children: list[list[tuple[int, int]]] = [[] for _ in range(joints.nodes + 1)]
    holder_of = [joints.holder(edge) for edge in held]
    for child, (parent, member) in enumerate(holder_of):
        children[parent].append((member, child))
    for siblings in children:
        # Popped from the end: children of the outermost member of a chain come first.
        siblings.sort(key=lambda one: (one[0], -one[1]))
    runs: list[BodyRow] = []
    first_positions = [0] * (joints.nodes + 1)
    next_position = 0
    stack = [child for _, child in children[GROUND]]
    while stack:
        node = stack.pop()
        parent, member = holder_of[node]
        parent_position = GROUND if parent == GROUND else first_positions[parent] + member
        runs.append(_body_row(joints, node, held[node], next_position, parent_position))
        first_positions[node] = next_position
        next_position += runs[-1].count
        stack.extend(child for _, child in children[node])
    return tuple(runs)


def _body_row(joints: ConnectivityGraph, node: int, edge: int, place: int, parent: int) -> BodyRow:
    scene = joints.scene
    inboard_end, inboard_body = split_reference(joints.inboard[edge])[1], joints.body(edge)
    bodies, hinges = len(scene.body), len(scene.hinge)
    if node < bodies:
        outboard_end = scene.hinge[edge].outboard_end
        return BodyRow(node, edge, 1, place, parent, inboard_body, inboard_end, outboard_end)
    chain = scene.chain[node - bodies]
    body, hinge = scene.bodies.starts[node - bodies], scene.hinges.starts[edge - hinges]
    return BodyRow(
        body, hinge, chain.count, place, parent, inboard_body, inboard_end, "", chain.held_ends
    )
