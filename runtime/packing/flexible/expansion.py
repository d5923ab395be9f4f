"""Expansion of flexible bodies: from the user's scene to the scene of nodes.

A flexible body "blade" becomes a frame node "blade" (its floating frame, with the modes) and a node
per end.  If its inboard section moves relative to the frame, that section gets a massless node.
All nodes are rigid bodies on fixed hinges; `ExpandedScene` lists which connections pass a section.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

from mstmm.errors import SceneError
from mstmm.numerics.rotations import to_matrix, to_quaternion
from mstmm.scene import Body, Hinge, Scene, split_reference
from mstmm.scene.tables.body import End
from mstmm.scene.tables.loads import Load

from ...flexible.modal_body import ModalBody
from ...flexible.modal_port import MassPoint, ModalPort
from ..loops.cut_tree import Cut
from .rigid_substitution import RigidSubstitution, scale_expression

HELD, POINT = "held", "point"


@dataclass(frozen=True)
class Passage:
    """Connection through a section of the flexible body `body`, inward to its frame or outward."""

    body: str
    port: ModalPort
    inward: bool


@dataclass
class ExpandedScene:
    """Scene of nodes.

    Attributes:
        scene: of nodes.
        user_scene: as the user wrote it.
        bodies: flexible bodies.
        nodes: end ("blade.tip") -> name of its node.
        passages: node -> section that its connection passes.
        idle: nodes without hinges, loads and force elements on them.
        inboard_ends: flexible body -> its end on the inboard hinge.
        rigidified: substitution of bodies that are rigid in the run; None without any.
        cuts: cut hinges and constraints that close loops.
    """

    scene: Scene
    user_scene: Scene
    bodies: Mapping[str, ModalBody]
    nodes: dict[str, str] = field(default_factory=dict)
    passages: dict[str, Passage] = field(default_factory=dict)
    idle: set[str] = field(default_factory=set)
    inboard_ends: dict[str, str] = field(default_factory=dict)
    rigidified: RigidSubstitution | None = None
    cuts: tuple[Cut, ...] = ()

    def is_node(self, name: str) -> bool:
        """Whether a body of the expanded scene belongs to a flexible body."""
        return name in self.bodies or name in self.passages or name.endswith(f"/{HELD}")


def expand(
    scene: Scene, bodies: Mapping[str, ModalBody], cuts: tuple[Cut, ...] = ()
) -> ExpandedScene:
    """Expand flexible bodies into nodes; `cuts` close the loops of the scene.

    Raises SceneError for a flexible body without an inboard hinge.
    """
    if not bodies:
        return ExpandedScene(scene, scene, bodies, cuts=cuts)
    return _Expansion(scene, bodies, cuts).run()


class _Expansion:
    """Builder of the expanded scene."""

    def __init__(
        self, scene: Scene, bodies: Mapping[str, ModalBody], cuts: tuple[Cut, ...]
    ) -> None:
        self.scene, self.cuts = scene, cuts
        self.expanded = ExpandedScene(scene, scene, bodies)
        self.body = list(scene.body)
        self.internal: list[Hinge] = []
        self.used = {self._full_reference(reference) for reference in self._references()}

    def run(self) -> ExpandedScene:
        self.expanded.inboard_ends = self._inboard_ends()
        hinges = list(self.scene.hinge)
        for name, body in self.expanded.bodies.items():
            hinges = self._add_flexible_body(name, body, hinges)
        inboard = [self._node(hinge.inboard) for hinge in hinges]
        hinges = [
            hinge if name == hinge.inboard else hinge.model_copy(update={"inboard": name})
            for hinge, name in zip(hinges, inboard, strict=True)
        ]
        chains = [
            chain.model_copy(update={"inboard": self._node(chain.inboard)})
            for chain in self.scene.chain
        ]
        fields = {name: getattr(self.scene, name) for name in type(self.scene).model_fields}
        fields |= {
            "body": tuple(self.body), "hinge": (*hinges, *self.internal), "chain": tuple(chains),
            "load": tuple(map(self._point_load, self.scene.load)),
        }  # fmt: skip
        self.expanded.scene = Scene.model_construct(**fields)
        self.expanded.cuts = tuple(replace(cut, body=self._node(cut.body)) for cut in self.cuts)
        return self.expanded

    # --- references ---------------------------------------------------------------------------

    def _references(self) -> Iterator[str]:
        """Bodies and ends on which hinges, loads, force elements and constraints are."""
        for cut in self.cuts:
            yield cut.body if cut.constraint is None else cut.constraint.to
        yield from (hinge.inboard for hinge in self.scene.hinge)
        yield from (chain.inboard for chain in self.scene.chain)
        yield from (load.on for load in self.scene.load)
        for element in (*self.scene.forces, *self.scene.constraint):
            yield from (element.from_, element.to)

    def _full_reference(self, reference: str) -> str:
        """Reference with the end in it: the bare name of a beam means its root."""
        name, end = split_reference(reference)
        if name not in self.expanded.bodies or end:
            return reference
        return f"{name}.root"

    def _node(self, reference: str) -> str:
        return self.expanded.nodes.get(self._full_reference(reference), reference)

    def _inboard_ends(self) -> dict[str, str]:
        """Flexible body -> its end on the inboard hinge."""
        ends = (split_reference(self._full_reference(h.outboard)) for h in self.scene.hinge)
        return {name: end for name, end in ends if name in self.expanded.bodies}

    def _point_load(self, load: Load) -> Load:
        """The load on a node; a distributed one acts on the node of its weighted mean section."""
        name = split_reference(load.on)[0]
        if name not in self.expanded.bodies:
            return load
        if load.force_per_length is None:
            on = self._full_reference(load.on)
            axes = on if load.axes == "body" else load.axes
            return load.model_copy(update={"on": on, "axes": axes})
        length = self._span_length(load)
        force = tuple(scale_expression(entry, length) for entry in load.force_per_length)
        axes = name if load.axes == "body" else load.axes
        return load.model_copy(update={"on": f"{name}.{load.name}", "force": force, "axes": axes})

    def _span_length(self, load: Load) -> float:
        """Length of the loaded part of a beam, m."""
        beam = next(b for b in self.scene.beam if b.name == split_reference(load.on)[0])
        first, last = load.span or (0.0, beam.length)
        return float(last - first)

    # --- nodes --------------------------------------------------------------------------------

    def _add_flexible_body(self, name: str, body: ModalBody, hinges: list[Hinge]) -> list[Hinge]:
        """Add the nodes of a flexible body; returns `hinges` with its inboard hinge on them."""
        inboard_end = self.expanded.inboard_ends.get(name)
        if inboard_end is None:
            raise SceneError(
                f'scene: "{name}" has no inboard hinge; add one with outboard = "{name}"'
            )
        port = body.ports[inboard_end]
        moves = port.can_move
        frame = Body(name="frame", mass=0.0)
        if moves:
            node = f"{name}/{HELD}"
            self.body.append(frame.model_copy(update={"name": node}))
            self._add_weld(f"{name}/frame", node, name)
            self.expanded.passages[name] = Passage(name, port, inward=True)
            self.expanded.nodes[f"{name}.{inboard_end}"] = node
            target = node
        else:
            rotation = to_matrix([[float(x) for x in row] for row in port.rotation])
            x, y, z = (float(entry) for entry in port.position)
            end = End(position=(x, y, z), orientation=to_quaternion(rotation))
            frame = frame.model_copy(update={"ends": {inboard_end: end}})
            target = f"{name}.{inboard_end}"
        self.body.append(frame.model_copy(update={"name": name}))
        for end_name, end_port in body.ports.items():
            if end_name != inboard_end or not moves:
                self._add_end(name, end_name, end_port)
        for k, point in enumerate(body.points):
            self._add_mass_point(name, k, point)
        return [
            hinge.model_copy(update={"outboard": target}) if hinge.outboard_body == name else hinge
            for hinge in hinges
        ]

    def _add_end(self, name: str, end: str, port: ModalPort) -> None:
        node = f"{name}/{end}"
        self.body.append(Body(name="end", mass=0.0).model_copy(update={"name": node}))
        self._add_weld(node, name, node)
        self.expanded.passages[node] = Passage(name, port, inward=False)
        self.expanded.nodes[f"{name}.{end}"] = node
        loaded = any(
            load.name == end and split_reference(load.on)[0] == name for load in self.scene.load
        )
        if f"{name}.{end}" not in self.used and not loaded:
            self.expanded.idle.add(node)

    def _add_mass_point(self, name: str, k: int, point: MassPoint) -> None:
        node = f"{name}/{POINT} {k + 1}"
        j = point.inertia
        entries = (j[0, 0], j[1, 1], j[2, 2], j[0, 1], j[0, 2], j[1, 2])
        body = Body(
            name="point", mass=float(point.mass), inertia=tuple(map(float, entries)),
            allow_unphysical_inertia=True,
        )  # fmt: skip
        self.body.append(body.model_copy(update={"name": node}))
        self._add_weld(node, name, node)
        self.expanded.passages[node] = Passage(name, point.port, inward=False)

    def _add_weld(self, name: str, inboard: str, outboard: str) -> None:
        weld = Hinge(name="weld", type="fixed", inboard="ground", outboard="frame")
        update = {"name": name, "inboard": inboard, "outboard": outboard}
        self.internal.append(weld.model_copy(update=update))


__all__ = ["ExpandedScene", "Passage", "expand"]
