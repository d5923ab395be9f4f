"""Expansion of a user's scene into nodes: loops are cut, flexible bodies become rigid ones.

The frame C of a cut hinge is a massless body with the ends of the body B that it replaces, so that
the cut hinge keeps its kernels, coordinates, law and drive.  The constraint rows of the loop
require that C coincides with B.  A constraint has a massless frame at its end `from`.  For a point
on a curve, this frame is on a hinge that moves along the curve: the curve parameter s is its
coordinate, and rows hold the other end in the frame across the curve.  So no search for the nearest
point is needed, curves may intersect themselves, and revolutions around closed curves are counted.

A flexible body "blade" becomes a frame node "blade" (its floating frame, with the modes) and a node
per end.  If its inboard section moves relative to the frame, that section gets a massless node.
All nodes are rigid bodies on fixed hinges; `ExpandedScene` lists which connections pass a section.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from mstmm.argument_validation import require_word
from mstmm.errors import SceneError
from mstmm.expression.derivatives import motion
from mstmm.ir import KernelIR, Port
from mstmm.ir.differentiation import differentiate
from mstmm.ir.element_spec import ElementSpec
from mstmm.ir.graph import Graph
from mstmm.ir.hinge_properties import HingeProperties, Param
from mstmm.ir.tape import compile_tape
from mstmm.numerics.rotations import IDENTITY, to_matrix, to_quaternion
from mstmm.scene import Body, Constraint, End, Hinge, Scene, split_reference
from mstmm.scene.checks.topology import build_topology, may_have_loops
from mstmm.scene.tables.beam import EXACT
from mstmm.scene.tables.closures import CURVE
from mstmm.scene.tables.hinge import Initial
from mstmm.scene.tables.hinge_frames import axes_about
from mstmm.scene.tables.loads import Load
from mstmm.scene.validators.scalars_and_vectors import GROUND

from ..flexible.modal_body import ModalBody
from ..flexible.modal_parts import MassPoint, ModalPort, Station
from ..kernels.prebuilt_kernels import Element
from .coordinate_layout import OF_CONSTRAINT
from .rigid_substitution import RigidSubstitution, scale_expression, substitute_rigid_bodies

if TYPE_CHECKING:
    from collections.abc import Iterable

    from mstmm.ir.scene_structure import Key


# --- hinges along curves --------------------------------------------------------------------------

_TITLE, _S, _RATE = "motion along a curve", Param("s"), Param("s_rate", "1/s")
_OUTPUTS = (Port("R", (3, 3)), Port("d", (3,)), Port("H", (6,)), Port("v", (3,)), Port("w", (3,)),
            Port("c", (6,)), Port("qdot", (1,)))  # fmt: skip


def curve_hinge(constraint: Constraint, held: Hinge) -> Hinge:
    """Copy of the hinge `held` that moves along the curve of the constraint."""
    name = _type_name(constraint)
    hinge = held.model_copy(update={
        "type": name, "initial": Initial(q=(constraint.start or 0.0,), u=(0.0,))
    })  # fmt: skip
    hinge.__dict__["facts"] = HingeProperties(
        name, _TITLE, (_S,), (_RATE,), (), "own", (),
        name, None, True, False, ("qqq000",), _kernel(constraint),
    )  # fmt: skip
    return hinge


def curve_elements(constraints: Iterable[Constraint]) -> dict[Key, Element]:
    """Elements of the hinges along curves, evaluated by the tape interpreter."""
    curves = [constraint for constraint in constraints if constraint.curve is not None]
    return {("hinge", _type_name(curve)): _element(curve) for curve in curves}


def _element(constraint: Constraint) -> Element:
    kernel, name = _kernel(constraint), _type_name(constraint)
    derivatives = differentiate(kernel, ("q", "u"), None, values=False, guards=False)
    spec = ElementSpec("hinge", name, _TITLE, (_S,), (_RATE,), (), (kernel,))
    return Element(
        "hinge", name, 1, 1, (), {}, {}, None, compile_tape(kernel), compile_tape(derivatives),
        hash=spec.hash(), spec=spec,
    )  # fmt: skip


def _type_name(constraint: Constraint) -> str:
    return f"{constraint.name}/curve"


def _kernel(constraint: Constraint) -> KernelIR:
    """Kernel of a hinge that translates along c(s): d = c, H = c', bias acceleration c'' s'^2."""
    graph = Graph()
    s, rate = graph.element("q", 0), graph.element("u", 0)
    zero, unit = graph.constant(0), graph.constant(1)
    assert constraint.curve is not None
    position, first, second = zip(
        *(motion(entry, s, lambda _: s) for entry in constraint.curve), strict=True
    )
    no_rotation = [zero] * 3
    values: dict[str, object] = {
        "R": [[unit if i == j else zero for j in range(3)] for i in range(3)],
        "d": list(position), "H": [*first, *no_rotation], "v": [rate * x for x in first],
        "w": no_rotation, "c": [*(rate * rate * x for x in second), *no_rotation], "qdot": [rate],
    }  # fmt: skip
    inputs = [Port("p", (0,)), Port("q", (1,)), Port("u", (1,))]
    return graph.kernel("hinge", inputs, _OUTPUTS, values, purpose=_TITLE)


# --- spanning tree --------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Cut:
    """Closure of a loop, by names.

    Attributes:
        hinge: cut hinge, or the hinge that carries the frame of a constraint.
        frame: massless body outboard of the hinge.
        body: body that the frame must coincide with; an end of it if it is flexible.
        constraint: None for a cut hinge.
    """

    hinge: str
    frame: str
    body: str
    constraint: Constraint | None = None


def cut_loops(scene: Scene) -> tuple[Scene, tuple[Cut, ...]]:
    """Scene with a tree topology, and the closures: cut hinges, then constraints."""
    if not may_have_loops(scene):
        return scene, ()
    plan = build_topology(scene.skeleton).plan
    if plan is None or not (plan.cut or scene.constraint):
        return scene, ()
    tables, bodies, cuts = list(scene.hinge), list(scene.body), list[Cut]()
    flexible = {body.name for body in (*scene.beam, *scene.elastic)}
    for number in plan.cut:
        hinge = tables[number]
        end, name = hinge.outboard_end, f"{hinge.name}/cut"
        cut, ends = Cut(hinge.name, name, hinge.outboard_body), dict[str, End]()
        if cut.body in flexible:
            cut, end = replace(cut, body=hinge.outboard), ""
        else:
            ends = scene.bodies.by_name[cut.body].ends
        update = {"outboard": f"{name}.{end}" if end else name, "cut": None}
        tables[number] = hinge.model_copy(update=update)
        bodies.append(_frame(cut.frame, ends))
        cuts.append(cut)
    for constraint in scene.constraint:
        hinge = _frame_hinge(constraint)
        tables.append(hinge)
        bodies.append(_frame(hinge.outboard, {}))
        cuts.append(Cut(hinge.name, hinge.outboard, split_reference(constraint.to)[0], constraint))
    fields = {name: getattr(scene, name) for name in type(scene).model_fields}
    fields |= {"body": tuple(bodies), "hinge": tuple(tables), "constraint": ()}
    return Scene.model_construct(**fields), tuple(cuts)


def _frame_hinge(constraint: Constraint) -> Hinge:
    """Hinge between the end `from` of a constraint and its frame, with a reserved name.

    It is a weld, with z along the normal if there is one; of a point on a curve it moves along it.
    """
    name, normal = f"{constraint.name}{OF_CONSTRAINT}", constraint.unit_normal
    axes = IDENTITY if normal is None else axes_about(normal, None)
    weld = Hinge(name="frame", type="fixed", inboard=GROUND, outboard="frame",
                 orientation=to_quaternion(axes))  # fmt: skip
    on_ground = split_reference(constraint.from_)[0] == GROUND
    weld = weld.model_copy(update={
        "name": name, "inboard": constraint.from_, "outboard": f"{name}/frame",
        "position": constraint.position if on_ground else (0.0, 0.0, 0.0),
    })  # fmt: skip
    return curve_hinge(constraint, weld) if constraint.type == CURVE else weld


def _frame(name: str, ends: Mapping[str, End]) -> Body:
    return Body(name="frame", mass=0.0).model_copy(update={"name": name, "ends": ends})


# --- flexible bodies ------------------------------------------------------------------------------

HELD, POINT, STATION = "held", "point", "station"


@dataclass(frozen=True)
class Passage:
    """Connection through a section of the flexible body `body`, inward to its frame or outward.

    A `Station` stands for the segment that leads to it.
    """

    body: str
    port: ModalPort | Station
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
        load_parts: number of a load of the user -> further loads of `scene` that belong to it.
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
    load_parts: dict[int, tuple[int, ...]] = field(default_factory=dict)

    def is_node(self, name: str) -> bool:
        """Whether a body of the expanded scene belongs to a flexible body."""
        return name in self.bodies or name in self.passages or name.endswith(f"/{HELD}")


#: Values of `compile(flexibility=)`, and the `model` that they give every flexible body.
LEVELS = {"coupled": "flexible", "one-way": "one-way", "rigid": "rigid"}


def with_level(scene: Scene, flexibility: str | None) -> Scene:
    """Set the model level of all flexible bodies; None keeps the scene.

    Raises SceneError for an unknown level, and for the one-way response of an exact beam.
    """
    if flexibility is None:
        return scene
    known = ", ".join(LEVELS)
    if require_word("flexibility", flexibility, f"one of {known}, or None") not in LEVELS:
        raise SceneError(f'flexibility: expected one of {known}, found "{flexibility}"')
    level = {"model": LEVELS[flexibility]}
    if level["model"] == "one-way":
        for beam in scene.beam:
            if beam.kinematics == EXACT:
                raise SceneError(
                    f'beam "{beam.name}": the one-way response is linear and does not exist for '
                    'kinematics = "exact"; leave kinematics out, or use flexibility = "coupled"'
                )
    fields = {key: getattr(scene, key) for key in type(scene).model_fields}
    fields["beam"] = tuple(beam.model_copy(update=level) for beam in scene.beam)
    fields["elastic"] = tuple(body.model_copy(update=level) for body in scene.elastic)
    return Scene.model_construct(**fields)


def expansion_of(scene: Scene, flexible: Mapping[str, ModalBody] | None = None) -> ExpandedScene:
    """Expand a scene into nodes, after rigid substitution and cutting of loops.

    `flexible` are all modal bodies if they are known already.
    """
    if not (scene.beam or scene.elastic):
        nodes, cuts = cut_loops(scene)
        return ExpandedScene(nodes, scene, {}, cuts=cuts)
    from ..flexible.flexible_bodies import modal_bodies

    substitution = substitute_rigid_bodies(scene, flexible or {})
    nodes, cuts = cut_loops(substitution.scene)
    if flexible is None:
        bodies = modal_bodies(substitution.scene)
    else:
        bodies = {n: body for n, body in flexible.items() if n not in substitution.one_way}
    expanded = expand(nodes, bodies, cuts)
    expanded.user_scene, expanded.rigidified = scene, substitution
    expanded.nodes |= substitution.nodes
    return expanded


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
            "load": self._point_loads(),
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

    def _point_loads(self) -> tuple[Load, ...]:
        """Loads on nodes in the order of the user's; further parts of line loads come last."""
        loads, parts = list[Load](), list[Load]()
        for number, load in enumerate(self.scene.load):
            name = split_reference(load.on)[0]
            body = self.expanded.bodies.get(name)
            pieces = body.line_loads.get(load.name, ()) if body is not None else ()
            if not pieces:
                loads.append(self._point_load(load))
                continue
            own = [self._station_load(load, name, *piece) for piece in pieces]
            loads.append(own[0])
            first = len(self.scene.load) + len(parts)
            parts += own[1:]
            self.expanded.load_parts[number] = tuple(range(first, first + len(own) - 1))
        return (*loads, *parts)

    def _station_load(self, load: Load, name: str, station: int, length: float) -> Load:
        """Part of a load per length on the station of an exact beam, for a length (m) of it."""
        force = tuple(scale_expression(entry, length) for entry in load.force_per_length or ())
        axes = name if load.axes == "body" else load.axes
        on = f"{name}/{STATION} {station + 1}"
        return load.model_copy(update={"on": on, "force": force, "axes": axes})

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
        self._add_stations(name, body)
        segment_ends = {station.end for station in body.stations}
        for end_name, end_port in body.ports.items():
            if end_name not in segment_ends and (end_name != inboard_end or not moves):
                self._add_end(name, end_name, Passage(name, end_port, inward=False), name)
        for k, point in enumerate(body.points):
            self._add_mass_point(name, k, point)
        return [
            hinge.model_copy(update={"outboard": target}) if hinge.outboard_body == name else hinge
            for hinge in hinges
        ]

    def _add_end(self, name: str, end: str, passage: Passage, inboard: str) -> None:
        """Add the massless node of an end, outboard of the node `inboard`."""
        node = f"{name}/{end}"
        self.body.append(Body(name="end", mass=0.0).model_copy(update={"name": node}))
        self._add_weld(node, inboard, node)
        self.expanded.passages[node] = passage
        self.expanded.nodes[f"{name}.{end}"] = node
        loaded = any(
            load.name == end and split_reference(load.on)[0] == name for load in self.scene.load
        )
        if f"{name}.{end}" not in self.used and not loaded:
            self.expanded.idle.add(node)

    def _add_mass_point(self, name: str, k: int, point: MassPoint) -> None:
        node = f"{name}/{POINT} {k + 1}"
        self._add_slice(node, name, point)
        self.expanded.passages[node] = Passage(name, point.port, inward=False)

    def _add_stations(self, name: str, body: ModalBody) -> None:
        """Add the chain of stations of an exact beam, and its ends."""
        nodes: list[str] = []
        for k, station in enumerate(body.stations):
            inboard = nodes[station.previous] if station.previous >= 0 else name
            passage = Passage(name, station, inward=False)
            if station.end:
                self._add_end(name, station.end, passage, inboard)
                nodes.append(f"{name}/{station.end}")
                continue
            nodes.append(f"{name}/{STATION} {k + 1}")
            self._add_slice(nodes[-1], inboard, station)
            self.expanded.passages[nodes[-1]] = passage

    def _add_slice(self, node: str, inboard: str, piece: MassPoint | Station) -> None:
        """Add a node with the mass of a slice, outboard of the node `inboard`."""
        j = piece.inertia
        entries = (j[0, 0], j[1, 1], j[2, 2], j[0, 1], j[0, 2], j[1, 2])
        body = Body(
            name="point", mass=float(piece.mass), inertia=tuple(map(float, entries)),
            allow_unphysical_inertia=True,
        )  # fmt: skip
        update: dict[str, object] = {"name": node}
        if isinstance(piece, Station):
            update["center_of_mass"] = tuple(map(float, piece.center))
        self.body.append(body.model_copy(update=update))
        self._add_weld(node, inboard, node)

    def _add_weld(self, name: str, inboard: str, outboard: str) -> None:
        weld = Hinge(name="weld", type="fixed", inboard="ground", outboard="frame")
        update = {"name": name, "inboard": inboard, "outboard": outboard}
        self.internal.append(weld.model_copy(update=update))
