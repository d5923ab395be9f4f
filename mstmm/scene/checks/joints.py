"""The graph of a scene: what holds what, chains as one, and with every body for itself."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ...graph.mechanism import GROUND, Edge, Mechanism
from ..rules.values import split
from .closures import rows_of, rows_of_closures

if TYPE_CHECKING:
    from ..tables.all import SceneTables


class Joints:
    """Nodes are the scene's bodies, then its chains; edges its hinges, then the chains' first."""

    def __init__(self, scene: SceneTables) -> None:
        self.scene = scene
        self.index = {body.name: i for i, body in enumerate(scene.body)}
        self.nodes = len(scene.body) + len(scene.chain)
        self.inboard = [hinge.inboard for hinge in scene.hinge]
        self.inboard += [chain.inboard for chain in scene.chain]
        self.outboard = [self.index[hinge.outboard_body] for hinge in scene.hinge]
        self.outboard += range(len(scene.body), self.nodes)

    def holder(self, edge: int) -> tuple[int, int]:
        """(node on which an edge hangs, member of it where it is a chain); -1: the ground."""
        name = split(self.inboard[edge])[0]
        known = self.index.get(name)
        if known is not None:
            return known, 0
        place = self.scene.bodies.place(name)
        return (GROUND, 0) if place is None else (len(self.index) + place[0], place[1])

    def place(self, edge: int) -> tuple[str, int]:
        """Table and number of an edge."""
        hinges = len(self.scene.hinge)
        return ("hinge", edge) if edge < hinges else ("chain", edge - hinges)

    def name(self, node: int) -> str:
        """What a message calls a node."""
        bodies = len(self.scene.body)
        return self.scene.body[node].name if node < bodies else self.scene.chain[node - bodies].name

    def edge_name(self, edge: int) -> str:
        """What a message calls an edge."""
        table, number = self.place(edge)
        name: str = getattr(self.scene, table)[number].name
        return f"{name}[0].hinge" if table == "chain" else name

    @property
    def by_nodes(self) -> Mechanism:
        """The nodes and edges; enough to see whether there is a tree."""
        cuts = [hinge.cut for hinge in self.scene.hinge]
        return Mechanism(self.nodes, tuple(
            Edge(self.holder(edge)[0], node, 0, cuts[edge] if edge < len(cuts) else None)
            for edge, node in enumerate(self.outboard)
        ))  # fmt: skip

    def by_bodies(self) -> Mechanism:
        """Every body and hinge by its number in the scene, with the rows of all closures."""
        return Mechanism(
            len(self.scene.bodies), tuple(self._edges()), tuple(rows_of_closures(self.scene))
        )

    def _edges(self) -> Iterator[Edge]:
        scene = self.scene
        for edge, hinge in enumerate(scene.hinge):
            yield Edge(self.body(edge), self.outboard[edge], rows_of(hinge), hinge.cut)
        for number, chain in enumerate(scene.chain):
            first = scene.bodies.starts[number]
            for k in range(chain.count):
                inboard = first + k - 1 if k else self.body(len(scene.hinge) + number)
                yield Edge(inboard, first + k, 0, cut=False)

    def body(self, edge: int) -> int:
        """Number of the body on which an edge hangs, -1 for the ground."""
        node, member = self.holder(edge)
        bodies = len(self.scene.body)
        return node if node < bodies else self.scene.bodies.starts[node - bodies] + member
