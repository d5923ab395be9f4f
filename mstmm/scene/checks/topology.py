"""The tree of a scene: which body hangs on which, in the order in which the sweeps visit them.

A chain is one node of the tree, whatever its length: its members follow one another.  Where hinges
close loops, each body hangs on one of those that hold it, and the others are cut.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

from ...graph.mechanism import GROUND
from ...graph.plan import Plan, planned
from ..rules.messages import Problem, report
from ..rules.values import split
from . import tree
from .joints import Joints

if TYPE_CHECKING:
    from ..tables.all import SceneTables
    from ..tables.hinge import Hinge


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

    `body`, `hinge` and `place` are those of the first, the others follow it.  The first hangs on
    the `inboard_end` of the scene's body `on` (-1: the ground), at the place `parent`; the others
    hang on `ends`, repeated.
    """

    body: int
    hinge: int
    count: int
    place: int
    parent: int
    on: int
    inboard_end: str
    outboard_end: str
    ends: tuple[str, ...] = ()


@dataclass(frozen=True)
class Topology:
    """Bodies depth first: parents before children, branch by branch, children in scene order.

    The next member of a chain comes before what else hangs on a member.  `runs` are the tree in
    that order; `links` and what follows from it are made when first asked for, an object per body.

    `plan` says how loops, constraints and couplings close, None where there is nothing to close:
    bodies and hinges by their numbers in the scene; its rows are those of the cut hinges, of the
    constraints and of the couplings, in this order.  `carried` are bodies that are part of another
    one: each has the place of that, and its hinge has none.
    """

    runs: tuple[Run, ...]
    plan: Plan | None = None
    carried: Mapping[int, int] = field(default_factory=dict)

    @property
    def cut(self) -> tuple[int, ...]:
        """The scene's hinges that are not part of the tree."""
        return () if self.plan is None else self.plan.cut

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
            if parent != GROUND:
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
        """Scene indices of the bodies, parents first; without those that others carry."""
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
        return tuple(map(self.place_of_body, range(self.count + len(self.carried))))

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
        body = self.carried.get(body, body)
        firsts, runs = self._by_body
        run = runs[bisect_right(firsts, body) - 1]
        return run.place + body - run.body

    def place_of_hinge(self, hinge: int) -> int:
        """Place of the body whose inboard hinge is the scene's hinge, which must not be cut.

        KeyError for that of a body that another one carries.
        """
        firsts, runs = self._by_hinge
        run = runs[bisect_right(firsts, hinge) - 1]
        if not 0 <= hinge - run.hinge < run.count:
            raise KeyError(hinge)
        return run.place + hinge - run.hinge

    def at(self, place: int) -> tuple[int, int]:
        """(body, hinge) of the scene at a place."""
        run = self.runs[bisect_right(self._places, place) - 1]
        k = place - run.place
        return run.body + k, run.hinge + k

    @property
    def roots(self) -> tuple[int, ...]:
        """Positions of the bodies hinged to the ground."""
        return tuple(run.place for run in self.runs if run.parent == GROUND)


def build(scene: SceneTables) -> Topology:
    """The tree of a scene.  O(tables) without loops, no recursion.

    Raises SceneError, one line per problem, for hinges written the wrong way round, wishes of what
    to cut that leave no tree, and bodies that no hinge connects to the ground.
    """
    joints = Joints(scene)
    found = _tree(joints)
    if found is None:
        tables = {"body": scene.body, "hinge": scene.hinge, "chain": scene.chain}
        raise report(list(tree.problems(joints)), tables, "scene")
    return found


def holders(scene: SceneTables) -> dict[str, Hinge]:
    """Per name of a body the hinge of the tree that holds it; of a scene whose tree there is."""
    skeleton = scene.skeleton
    loops = len(skeleton.hinge) > len(skeleton.body)  # every body is held
    cut = set(build(skeleton).cut) if loops else set()
    return {h.outboard_body: h for number, h in enumerate(scene.hinge) if number not in cut}


def problems(scene: SceneTables) -> Iterator[Problem]:
    """Places and messages of everything that keeps the hinges from holding every body."""
    yield from tree.problems(Joints(scene))


def _tree(joints: Joints) -> Topology | None:
    """The tree, or None where there is none."""
    scene, plan = joints.scene, None
    held = _only(joints)
    if held is None or scene.constraint or scene.coupling:
        if next(tree.problems(joints), None) is not None:
            return None
        plan = planned(joints.by_bodies())
        chains = range(len(scene.hinge), len(joints.outboard))
        held = [*plan.tree[: len(scene.body)], *chains]
    runs = _runs(joints, held)
    covered = sum(run.count for run in runs) == len(scene.bodies)
    return Topology(runs, plan) if covered else None


def _only(joints: Joints) -> list[int] | None:
    """Per node the edge that holds it; None where one has none or several, or must not have it."""
    held = [-1] * joints.nodes
    for edge, node in enumerate(joints.outboard):
        held[node] = edge
    cut = any(hinge.cut for hinge in joints.scene.hinge)
    return None if cut or -1 in held or len(joints.outboard) > joints.nodes else held


def _runs(joints: Joints, held: Sequence[int]) -> tuple[Run, ...]:
    """The runs of the tree in which `held` is the edge of every node."""
    # Per node (last: the ground) its children, as (member that holds it, child).
    children: list[list[tuple[int, int]]] = [[] for _ in range(joints.nodes + 1)]
    holder_of = [joints.holder(edge) for edge in held]
    for child, (parent, member) in enumerate(holder_of):
        children[parent].append((member, child))
    for siblings in children:
        # Popped from the end: what hangs farthest out on a chain comes first.
        siblings.sort(key=lambda one: (one[0], -one[1]))
    runs: list[Run] = []
    first = [0] * (joints.nodes + 1)
    places = 0
    stack = [child for _, child in children[GROUND]]
    while stack:
        node = stack.pop()
        parent, member = holder_of[node]
        at = GROUND if parent == GROUND else first[parent] + member
        runs.append(_run(joints, node, held[node], places, at))
        first[node] = places
        places += runs[-1].count
        stack.extend(child for _, child in children[node])
    return tuple(runs)


def _run(joints: Joints, node: int, edge: int, place: int, parent: int) -> Run:
    scene = joints.scene
    inboard_end, on = split(joints.inboard[edge])[1], joints.body(edge)
    bodies, hinges = len(scene.body), len(scene.hinge)
    if node < bodies:
        outboard_end = scene.hinge[edge].outboard_end
        return Run(node, edge, 1, place, parent, on, inboard_end, outboard_end)
    chain = scene.chain[node - bodies]
    body, hinge = scene.bodies.starts[node - bodies], scene.hinges.starts[edge - hinges]
    return Run(body, hinge, chain.count, place, parent, on, inboard_end, "", chain.held_ends)
