"""Connectivity graph of a scene, with chains as single nodes or with every body separate."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ...graph.mechanism_graph import GROUND, Edge, MechanismGraph
from ..validators.scalars_and_vectors import split_reference
from .loop_closures import closure_row_groups, row_count_if_cut

if TYPE_CHECKING:
    from ..tables.scene_tables import SceneTables


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
        return (
            (GROUND, 0)
            if chain_position is None
            else (len(self.index) + chain_position[0], chain_position[1])
        )

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
