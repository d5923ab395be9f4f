"""Positions of all parts of a scene: in the tree, in q and u, and in internal frames."""

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
from .merging.simplification import Simplification, SimplifyOptions
from .scene_elements import Elements


@dataclass
class Frames:
    """Scene of nodes with its tree, layout, internal frames and elements.

    Attributes:
        scene: of nodes, which replace the flexible bodies.
        releases: hinge that may be released -> index in memory.
        placements: body -> internal frame.
        positions: body -> position in the tree.
        hinge_position: hinge -> position of its outboard body in the tree.
        simplified: simplifications done.
        simplify: simplifications requested.
    """

    scene: Scene
    topology: Topology
    layout: Layout
    elements: Elements
    releases: Mapping[str, int]
    placements: Mapping[str, Placement]
    positions: Mapping[str, int]
    hinge_position: Mapping[str, int]
    expanded: ExpandedScene
    simplified: tuple[Simplification, ...]
    simplify: SimplifyOptions

    @property
    def user_scene(self) -> Scene:
        """Scene as the user wrote it."""
        return self.expanded.user_scene

    @property
    def flexible(self) -> Mapping[str, ModalBody]:
        """Flexible bodies of the run by name."""
        return self.expanded.bodies

    @property
    def modal(self) -> Mapping[str, ModalBody]:
        """Flexible bodies of the run, and one-way coupled ones, by name."""
        rigidified = self.expanded.rigidified
        return {**self.flexible, **(rigidified.one_way if rigidified else {})}

    def mass_center(self, name: str) -> tuple[float, ...]:
        """Mass centre (3,) of a body in internal axes, m."""
        return self.placements[name].point(self.scene.bodies.by_name[name].center_of_mass)

    def end(self, reference: str) -> tuple[int, tuple[float, ...], tuple[float, ...]]:
        """End "body.end" or origin "body": (position in the tree, axes (9), offset (3) in m)."""
        name, end = split_reference(self.expanded.nodes.get(reference, reference))
        if name == "ground":
            return GROUND, (1, 0, 0, 0, 1, 0, 0, 0, 1), (0.0, 0.0, 0.0)
        placement = self.placements[name]
        body = self.scene.bodies.by_name[name]
        axes = placement.axes(body.end_rotation(end))
        return (
            self.positions[name],
            (*axes[0], *axes[1], *axes[2]),
            placement.point(body.end_position(end)),
        )
