"""Where everything of a scene lies: in the tree, in q and u, and in internal frames."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from mstmm.graph.mechanism_graph import GROUND
from mstmm.scene import Scene, split_reference
from mstmm.scene.checks.topology import Topology

from ..flexible.modal_body import ModalBody
from .coordinate_layout import Layout
from .flexible.expansion import ExpandedScene
from .frame_placement import Placement
from .merging.simplification import Simplification, Words
from .scene_elements import Elements


@dataclass
class Frames:
    """A scene of nodes with its tree, layout and internal frames, and what its types stand for.

    `positions` and `hinge_position` are places in the tree, `releases` places in memory.
    """

    scene: Scene  #: of nodes: flexible bodies are replaced by theirs
    topology: Topology
    layout: Layout
    elements: Elements
    releases: Mapping[str, int]
    placements: Mapping[str, Placement]
    positions: Mapping[str, int]
    hinge_position: Mapping[str, int]
    expanded: ExpandedScene
    simplified: tuple[Simplification, ...]  #: what is packed otherwise than it is described
    simplify: Words  #: what was to be

    @property
    def described(self) -> Scene:
        """The scene as the user describes it."""
        return self.expanded.described

    @property
    def flexible(self) -> Mapping[str, ModalBody]:
        """Numbers of the flexible bodies."""
        return self.expanded.bodies

    @property
    def modal(self) -> Mapping[str, ModalBody]:
        """Numbers of the flexible bodies, and of those that respond one way."""
        rigidified = self.expanded.rigidified
        return {**self.flexible, **(rigidified.one_way if rigidified else {})}

    def mass_center(self, name: str) -> tuple[float, ...]:
        """(3) mass centre of a body of the scene, internal axes, m."""
        return self.placements[name].point(self.scene.bodies.by_name[name].center_of_mass)

    def end(self, reference: str) -> tuple[int, tuple[float, ...], tuple[float, ...]]:
        """(body position, axes (9), offset (3)) of "body" or "body.end", internal axes."""
        name, at = split_reference(self.expanded.nodes.get(reference, reference))
        if name == "ground":
            return GROUND, (1, 0, 0, 0, 1, 0, 0, 0, 1), (0.0, 0.0, 0.0)
        place = self.placements[name]
        body = self.scene.bodies.by_name[name]
        axes = place.axes(body.end_rotation(at))
        return (
            self.positions[name],
            (*axes[0], *axes[1], *axes[2]),
            place.point(body.end_position(at)),
        )
