"""The user's scene with flexible bodies -> the scene of nodes that the sweep visits.

A flexible body "blade" becomes a frame node "blade" (its floating frame, with the modes as internal
coordinates), a node per end, and, where the frame is not that of the section by which the body is
held, a massless node at that section.  All are rigid bodies behind fixed hinges to what follows;
which connections pass sections of flexible bodies is kept beside the scene.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

from mstmm.errors import SceneError
from mstmm.expression.expression import Expression, parse
from mstmm.numerics.rotations import to_matrix, to_quaternion
from mstmm.scene import Body, Hinge, Scene, split_reference
from mstmm.scene.tables.body import End
from mstmm.scene.tables.loads import Load

from ...flexible.modal_body import ModalBody
from ...flexible.modal_port import MassPoint, ModalPort
from ..loops.cut_tree import Cut
from .rigid_substitution import RigidSubstitution

HELD, POINT = "held", "point"


@dataclass(frozen=True)
class Passage:
    """A connection that passes a section of the flexible body `body`, to its frame or from it."""

    body: str
    port: ModalPort
    inward: bool


@dataclass
class ExpandedScene:
    """The scene of nodes; `nodes` are ends ("blade.tip") by the names of their nodes, `passages`
    the sections passed, `idle` the nodes that nothing hangs on or acts on."""

    scene: Scene
    described: Scene
    bodies: Mapping[str, ModalBody]
    nodes: dict[str, str] = field(default_factory=dict)
    passages: dict[str, Passage] = field(default_factory=dict)
    idle: set[str] = field(default_factory=set)
    #: End by which each flexible body is held.
    held: dict[str, str] = field(default_factory=dict)
    #: What became of the bodies that are rigid in the run, None where there is none.
    rigidified: RigidSubstitution | None = None
    #: What closes loops.
    cuts: tuple[Cut, ...] = ()

    def is_node(self, name: str) -> bool:
        """Whether a body of the scene of nodes belongs to a flexible body."""
        return name in self.bodies or name in self.passages or name.endswith(f"/{HELD}")


def expand(
    scene: Scene, bodies: Mapping[str, ModalBody], cuts: tuple[Cut, ...] = ()
) -> ExpandedScene:
    """The scene of nodes of a scene and its flexible bodies; `cuts` are the hinges that close loops
    in it.

    Raises SceneError for a flexible body that no hinge holds.
    """
    if not bodies:
        return ExpandedScene(scene, scene, bodies, cuts=cuts)
    return _Expansion(scene, bodies, cuts).run()


class _Expansion:
    """One walk over the flexible bodies; tables of the new scene grow as it goes."""

    def __init__(
        self, scene: Scene, bodies: Mapping[str, ModalBody], cuts: tuple[Cut, ...]
    ) -> None:
        self.scene, self.made, self.cuts = scene, ExpandedScene(scene, scene, bodies), cuts
        self.body = list(scene.body)
        self.internal: list[Hinge] = []
        self.used = {self._full(x) for x in self._references()}

    def run(self) -> ExpandedScene:
        self.made.held = self._held()
        hinges = list(self.scene.hinge)
        for name, body in self.made.bodies.items():
            hinges = self._flexible(name, body, hinges)
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
            "load": tuple(map(self._load, self.scene.load)),
        }  # fmt: skip
        self.made.scene = Scene.model_construct(**fields)
        self.made.cuts = tuple(replace(cut, body=self._node(cut.body)) for cut in self.cuts)
        return self.made

    # --- references ---------------------------------------------------------------------------

    def _references(self) -> Iterator[str]:
        for cut in self.cuts:
            yield cut.body if cut.constraint is None else cut.constraint.to
        yield from (hinge.inboard for hinge in self.scene.hinge)
        yield from (chain.inboard for chain in self.scene.chain)
        yield from (load.on for load in self.scene.load)
        for element in (*self.scene.forces, *self.scene.constraint):
            yield from (element.from_, element.to)

    def _full(self, reference: str) -> str:
        """The end that a reference means: the bare name of a beam is its root."""
        name, end = split_reference(reference)
        if name not in self.made.bodies or end:
            return reference
        return f"{name}.root"

    def _node(self, reference: str) -> str:
        return self.made.nodes.get(self._full(reference), reference)

    def _held(self) -> dict[str, str]:
        """End by which each flexible body is held."""
        ends = (split_reference(self._full(hinge.outboard)) for hinge in self.scene.hinge)
        return {name: end for name, end in ends if name in self.made.bodies}

    def _load(self, load: Load) -> Load:
        """A distributed load acts on the node of its weighted mean section."""
        name = split_reference(load.on)[0]
        if name not in self.made.bodies:
            return load
        if load.force_per_length is None:
            axes = self._full(load.on) if load.axes == "body" else load.axes
            return load.model_copy(update={"on": self._full(load.on), "axes": axes})
        length = self._span(load)
        force = tuple(_times(entry, length) for entry in load.force_per_length)
        axes = name if load.axes == "body" else load.axes
        return load.model_copy(update={"on": f"{name}.{load.name}", "force": force, "axes": axes})

    def _span(self, load: Load) -> float:
        beam = next(b for b in self.scene.beam if b.name == split_reference(load.on)[0])
        first, last = load.span or (0.0, beam.length)
        return float(last - first)

    # --- nodes --------------------------------------------------------------------------------

    def _flexible(self, name: str, body: ModalBody, hinges: list[Hinge]) -> list[Hinge]:
        held = self.made.held.get(name)
        if held is None:
            raise SceneError(
                f'scene: "{name}" is held by no hinge; add one with outboard = "{name}"'
            )
        port = body.ports[held]
        moves = port.moves
        frame = Body(name="frame", mass=0.0)
        if moves:
            node = f"{name}/{HELD}"
            self.body.append(frame.model_copy(update={"name": node}))
            self._hinge(f"{name}/frame", node, name)
            self.made.passages[name] = Passage(name, port, inward=True)
            self.made.nodes[f"{name}.{held}"] = node
            target = node
        else:
            turned = to_matrix([[float(x) for x in row] for row in port.rotation])
            x, y, z = (float(entry) for entry in port.position)
            end = End(position=(x, y, z), orientation=to_quaternion(turned))
            frame = frame.model_copy(update={"ends": {held: end}})
            target = f"{name}.{held}"
        self.body.append(frame.model_copy(update={"name": name}))
        for end_name, one in body.ports.items():
            if end_name != held or not moves:
                self._end(name, end_name, one)
        for k, point in enumerate(body.points):
            self._point(name, k, point)
        return [
            hinge.model_copy(update={"outboard": target}) if hinge.outboard_body == name else hinge
            for hinge in hinges
        ]

    def _end(self, name: str, end: str, port: ModalPort) -> None:
        node = f"{name}/{end}"
        self.body.append(Body(name="end", mass=0.0).model_copy(update={"name": node}))
        self._hinge(node, name, node)
        self.made.passages[node] = Passage(name, port, inward=False)
        self.made.nodes[f"{name}.{end}"] = node
        loaded = any(
            load.name == end and split_reference(load.on)[0] == name for load in self.scene.load
        )
        if f"{name}.{end}" not in self.used and not loaded:
            self.made.idle.add(node)

    def _point(self, name: str, k: int, point: MassPoint) -> None:
        node = f"{name}/{POINT} {k + 1}"
        j = point.inertia
        entries = (j[0, 0], j[1, 1], j[2, 2], j[0, 1], j[0, 2], j[1, 2])
        body = Body(
            name="point", mass=float(point.mass), inertia=tuple(map(float, entries)),
            allow_unphysical_inertia=True,
        )  # fmt: skip
        self.body.append(body.model_copy(update={"name": node}))
        self._hinge(node, name, node)
        self.made.passages[node] = Passage(name, point.port, inward=False)

    def _hinge(self, name: str, inboard: str, outboard: str) -> None:
        weld = Hinge(name="weld", type="fixed", inboard="ground", outboard="frame")
        update = {"name": name, "inboard": inboard, "outboard": outboard}
        self.internal.append(weld.model_copy(update=update))


def _times(entry: Expression, length: float) -> Expression:
    return (
        entry
        if entry.is_zero
        else parse(f"{length!r} * ({entry.text})", constants=dict(entry.constants))
    )


__all__ = ["ExpandedScene", "Passage", "expand"]
