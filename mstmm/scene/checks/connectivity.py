"""Connectivity graph of a scene, rows of its loop closures, and messages where it has no tree."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from ...expression.expression import Name
from ...graph.mechanism_graph import GROUND, Edge, MechanismGraph, RowGroup
from ...graph.tree_errors import (
    AllHingesCut,
    ConflictingTreeHinges,
    Cyclic,
    TreeProblem,
    UnconnectedBodies,
    WrongHingeDirection,
    tree_problems,
)
from ..validators.scalars_and_vectors import split_reference
from ..validators.validation_messages import Problem

if TYPE_CHECKING:
    from ..tables.hinge import HingeTable
    from ..tables.scene_tables import SceneTables


def row_count_if_cut(hinge: HingeTable) -> int:
    """Number of constraint rows of a hinge if it is cut.

    These are 6 less its coordinates, plus one for each coordinate that is driven or carries rotor
    inertia.  A user-defined type counts as a pin until its definition is loaded.
    """
    speeds = 1 if hinge.facts is None else len(hinge.facts.speeds)
    drive, inertia = hinge.drive or (), hinge.law.inertia
    driven_count = sum(any(drive[k : k + 1]) or any(inertia[k : k + 1]) for k in range(speeds))
    return 6 - speeds + driven_count


def closure_row_groups(scene: SceneTables) -> Iterator[RowGroup]:
    """Row groups of the constraints of a scene, then those of its couplings."""
    for constraint in scene.constraint:
        yield _row_group(scene, (constraint.from_, constraint.to), constraint.rows)
    for coupling in scene.coupling:
        names = dict.fromkeys(name.hinge for name in coupling.names)
        hinges = [scene.hinges.by_name[name] for name in names]
        ends = [end for hinge in hinges for end in (hinge.inboard, hinge.outboard)]
        yield _row_group(scene, ends, 1)


def resolve_coordinate(scene: SceneTables, name: Name) -> tuple[int, str, int]:
    """Resolve a name in a coupling to (hinge number, "q" or "u", entry).

    The name is `arm.q`, `arm.q[1]`, `arm.u`, or a coordinate by its own name, `arm.angle`.  Raises
    KeyError where the scene has no such hinge, ValueError where the hinge has no such entry.
    """
    hinge = scene.hinges.find(name.hinge)
    if hinge is None:
        raise KeyError(name.hinge)
    if name.quantity in ("q", "u"):
        return hinge, name.quantity, name.index or 0
    facts = scene.hinges[hinge].facts
    coordinates = () if facts is None else facts.coordinates
    return hinge, "q", [coordinate.name for coordinate in coordinates].index(name.quantity)


def _row_group(scene: SceneTables, ends: Sequence[str], count: int) -> RowGroup:
    """Row group between ends of bodies or the ground."""
    bodies = (scene.bodies.find(split_reference(end)[0]) for end in ends)
    return RowGroup(tuple(GROUND if body is None else body for body in bodies), count)


# --- graph ----------------------------------------------------------------------------------------


class ConnectivityGraph:
    """Graph of a scene: nodes are bodies, then chains; edges are hinges, then those of chains.

    The edge of a chain is its first hinge.
    """

    def __init__(self, scene: SceneTables) -> None:
        self.scene = scene
        self.index = {body.name: i for i, body in enumerate(scene.body)}
        self.nodes = len(scene.body) + len(scene.chain)
        self.inboard = [hinge.inboard for hinge in scene.hinge]
        self.inboard += [chain.inboard for chain in scene.chain]
        self.outboard = [self.index[hinge.outboard_body] for hinge in scene.hinge]
        self.outboard += range(len(scene.body), self.nodes)

    def holder(self, edge: int) -> tuple[int, int]:
        """Inboard end of an edge: (node or -1 for the ground, member of it if it is a chain)."""
        name = split_reference(self.inboard[edge])[0]
        node = self.index.get(name)
        if node is not None:
            return node, 0
        chain_position = self.scene.bodies.place(name)
        if chain_position is None:
            return GROUND, 0
        return len(self.index) + chain_position[0], chain_position[1]

    def scene_location(self, edge: int) -> tuple[str, int]:
        """Table and index of an edge in the scene."""
        hinges = len(self.scene.hinge)
        return ("hinge", edge) if edge < hinges else ("chain", edge - hinges)

    def name(self, node: int) -> str:
        """Name of a node for messages."""
        bodies = len(self.scene.body)
        return self.scene.body[node].name if node < bodies else self.scene.chain[node - bodies].name

    def edge_name(self, edge: int) -> str:
        """Name of an edge for messages."""
        table, number = self.scene_location(edge)
        name: str = getattr(self.scene, table)[number].name
        return f"{name}[0].hinge" if table == "chain" else name

    @property
    def node_mechanism(self) -> MechanismGraph:
        """Mechanism of nodes and edges, sufficient to find out whether there is a tree."""
        cuts = [hinge.cut for hinge in self.scene.hinge]
        return MechanismGraph(self.nodes, tuple(
            Edge(self.holder(edge)[0], node, 0, cuts[edge] if edge < len(cuts) else None)
            for edge, node in enumerate(self.outboard)
        ))  # fmt: skip

    def body_mechanism(self) -> MechanismGraph:
        """Mechanism of all bodies and hinges by scene number, with the rows of all closures."""
        return MechanismGraph(
            len(self.scene.bodies), tuple(self._edges()), tuple(closure_row_groups(self.scene))
        )

    def _edges(self) -> Iterator[Edge]:
        scene = self.scene
        for edge, hinge in enumerate(scene.hinge):
            yield Edge(self.body(edge), self.outboard[edge], row_count_if_cut(hinge), hinge.cut)
        for number, chain in enumerate(scene.chain):
            first_body = scene.bodies.starts[number]
            for k in range(chain.count):
                inboard = first_body + k - 1 if k else self.body(len(scene.hinge) + number)
                yield Edge(inboard, first_body + k, 0, cut=False)

    def body(self, edge: int) -> int:
        """Scene number of the inboard body of an edge, -1 for the ground."""
        node, member = self.holder(edge)
        bodies = len(self.scene.body)
        return node if node < bodies else self.scene.bodies.starts[node - bodies] + member


# --- messages about hinges that form no spanning tree ---------------------------------------------


def spanning_tree_problems(joints: ConnectivityGraph) -> Iterator[Problem]:
    """Locations and messages of all reasons why there is no spanning tree."""
    for problem in tree_problems(joints.node_mechanism):
        yield _tree_problem(joints, problem)


def _tree_problem(joints: ConnectivityGraph, one: TreeProblem) -> Problem:
    match one:
        case WrongHingeDirection(body, hinge):
            return (
                ("body", body),
                f"it has no inboard hinge; swap inboard and outboard of hinge "
                f'"{joints.edge_name(hinge)}"',
            )
        case UnconnectedBodies():
            return _unconnected_problem(joints, one)
        case ConflictingTreeHinges(body, (first, second, *_)):
            return (
                (*joints.scene_location(second), "cut"),
                f'"{joints.name(body)}" already has the inboard hinge "{joints.edge_name(first)}" '
                "with cut = false; leave cut out of one of them",
            )
        case AllHingesCut(body, (hinge,)):
            return (
                (*joints.scene_location(hinge), "cut"),
                f'cannot be cut: it is the only inboard hinge of "{joints.name(body)}"; '
                "leave cut out",
            )
        case AllHingesCut(body, hinges) | Cyclic(body, hinges):
            names = " or ".join(f'"{joints.edge_name(hinge)}"' for hinge in hinges[:4])
            return (
                (*joints.scene_location(hinges[0]), "cut"),
                f'with these cut keys no tree of hinges reaches "{joints.name(body)}"; '
                f"leave cut out of {names}",
            )
    raise AssertionError(one)


def _unconnected_problem(joints: ConnectivityGraph, one: UnconnectedBodies) -> Problem:
    names = [joints.name(node) for node in one.bodies]
    more_text = f" (with {', '.join(names[1:5])}{', ...' if len(names) > 5 else ''})"
    more_text = more_text if names[1:] else ""
    bodies = len(joints.scene.body)
    if one.bodies[0] >= bodies:
        return (
            ("chain", one.bodies[0] - bodies),
            f'no hinge connects it{more_text} to the ground; set inboard = "ground"',
        )
    return (
        ("body", one.bodies[0]),
        f'no hinge connects it{more_text} to the ground; add a hinge of type "free" with '
        f'inboard = "ground" and outboard = "{joints.name(one.base)}"',
    )
