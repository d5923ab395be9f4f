"""Substitution of rigid bodies for flexible ones whose model is "rigid" or "one-way".

The rigid body has the mass, mass centre, inertia and ends of the undeformed one.  Every loaded end
of a one-way body becomes a massless body welded to it, "blade/tip", so that the load of the weld is
the total load there.  The cut hinges are chosen before the substitution, because the spanning tree
of the new scene might differ.

A run closes the loops with one-way bodies rigid.  The elastic response added afterwards keeps them
closed if the sections in a loop do not move in the floating frame, except for rotations that its
hinges leave free: beams between pins with simply supported shapes.  Constraint loads then do no
work on the shapes, including those that rigid bodies do not determine.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.expression.expression import Expression, parse
from mstmm.graph.closure_plan import ClosurePlan
from mstmm.graph.mechanism_graph import Paths
from mstmm.numerics.rotations import Matrix, to_quaternion
from mstmm.scene import Body, Bushing, Constraint, End, Hinge, Load, Scene, Spring, split_reference
from mstmm.scene.checks.topology import build_topology, inboard_hinges_by_body, may_have_loops
from mstmm.scene.tables.closures import ROLLING
from mstmm.scene.tables.hinge_frames import initial_motion_axes
from mstmm.scene.tables.scene_tables import rigid_body_of_beam

from ..flexible.modal_body import ModalBody
from ..flexible.modal_parts import ModalPort

if TYPE_CHECKING:
    from mstmm.scene import Hinge
    from mstmm.scene.tables.beam import Beam
    from mstmm.scene.tables.elastic import Elastic

    from ..flexible.elastic.interface_nodes import Port


Joining = TypeVar("Joining", Spring, Bushing, Constraint)


@dataclass
class RigidSubstitution:
    """Scene in which rigid bodies stand for the flexible ones that are not coupled.

    Attributes:
        scene: after the substitution.
        nodes: end ("blade.tip") -> body welded there ("blade/tip").
        one_way: one-way coupled body -> its modal body.
        inboard_ends: one-way coupled body -> its end on the inboard hinge.
        inboard_hinges: one-way coupled body -> its inboard hinge.
        loop_hinges: names of the hinges in closed loops.
        passed: one-way coupled bodies in a closed loop.
    """

    scene: Scene
    nodes: dict[str, str] = field(default_factory=dict)
    one_way: dict[str, ModalBody] = field(default_factory=dict)
    inboard_ends: dict[str, str] = field(default_factory=dict)
    inboard_hinges: dict[str, Hinge] = field(default_factory=dict)
    loop_hinges: frozenset[str] = frozenset()
    passed: frozenset[str] = frozenset()


def substitute_rigid_bodies(
    scene: Scene, known: Mapping[str, ModalBody], only: Collection[str] | None = None
) -> RigidSubstitution:
    """Substitute rigid bodies for those whose model is "rigid" or "one-way".

    `only` restricts this to some names; `known` are modal bodies computed before.
    Raises SceneError for viscous drag, which rigid bodies do not have, and for shapes of a one-way
    body that open a loop.
    """
    bodies: list[Beam | Elastic] = [b for b in scene.beam if b.model != "flexible"]
    bodies += [b for b in scene.elastic if b.model != "flexible"]
    bodies = [b for b in bodies if only is None or b.name in only]
    return _Substitution(scene, bodies, known).run() if bodies else RigidSubstitution(scene)


class _Substitution:
    """Builder of the scene with rigid bodies."""

    def __init__(
        self, scene: Scene, substituted: list[Beam | Elastic], known: Mapping[str, ModalBody]
    ) -> None:
        self.scene, self.substituted = scene, {body.name: body for body in substituted}
        self.known = known
        self.result = RigidSubstitution(scene)
        has_one_way = any(body.model == "one-way" for body in substituted)
        self.inboard_hinges = inboard_hinges_by_body(scene) if has_one_way else {}
        self.cut = None
        if has_one_way and may_have_loops(scene):
            tree_hinges = {hinge.name for hinge in self.inboard_hinges.values()}
            self.cut = frozenset(hinge.name for hinge in scene.hinge) - tree_hinges
        self.bodies: dict[str, Body] = {}
        self.welds: list[Hinge] = []

    def run(self) -> RigidSubstitution:
        for name, body in self.substituted.items():
            self._add_body(name, body)
        self._find_loops()
        scene, names = self.scene, self.substituted
        fields = {key: getattr(scene, key) for key in type(scene).model_fields}
        fields |= {
            "beam": tuple(beam for beam in scene.beam if beam.name not in names),
            "elastic": tuple(body for body in scene.elastic if body.name not in names),
            "body": (*scene.body, *self.bodies.values()),
            "hinge": (*map(self._substitute_hinge, scene.hinge), *self.welds),
            "chain": tuple(
                chain.model_copy(update={"inboard": self._node(chain.inboard)})
                for chain in scene.chain
            ),
            "load": tuple(map(self._substitute_load, scene.load)),
            "spring": tuple(map(self._with_node_ends, scene.spring)),
            "bushing": tuple(map(self._with_node_ends, scene.bushing)),
            "constraint": tuple(map(self._with_node_ends, scene.constraint)),
        }  # fmt: skip
        self.result.scene = Scene.model_construct(**fields)
        return self.result

    def _add_body(self, name: str, body: Beam | Elastic) -> None:
        modal = None
        if body.model == "one-way":
            modal = self.known.get(name) or _modal_body(self.scene, body)
        rigid = _equivalent_rigid_body(body, modal)
        ends = dict(rigid.ends)
        for load in self._distributed_loads(name):
            ends[load.name] = End(position=(_middle(load, self._length(name)), 0.0, 0.0))
        self.bodies[name] = rigid.model_copy(update={"ends": ends})
        if modal is None:
            return
        self.result.one_way[name] = modal
        hinge = self.inboard_hinges.get(name)
        self.result.inboard_ends[name] = next(iter(ends)) if hinge is None else hinge.outboard_end
        if hinge is not None:
            self.result.inboard_hinges[name] = hinge
        used = dict.fromkeys(split_reference(reference)[1] for reference in self._references(name))
        for end in (*used, *(load.name for load in self._distributed_loads(name))):
            self._add_welded_end(name, end)

    def _add_welded_end(self, name: str, end: str) -> None:
        node = f"{name}/{end}"
        massless = Body(name="end", mass=0.0)
        self.bodies[node] = massless.model_copy(update={"name": node})
        weld = Hinge(name="weld", type="fixed", inboard="ground", outboard="end")
        update = {"name": node, "inboard": f"{name}.{end}", "outboard": node}
        self.welds.append(weld.model_copy(update=update))
        self.result.nodes[f"{name}.{end}"] = node

    def _find_loops(self) -> None:
        """Find the hinges and one-way bodies in closed loops; their shapes must not open these."""
        plan = None if self.cut is None else build_topology(self.scene.skeleton).plan
        if plan is None:
            return
        elements, bodies = loop_elements(self.scene, plan), self.result.one_way
        check_loop_ends(bodies, elements)
        self.result.passed = frozenset(name for name in bodies if any(ends_on_body(name, elements)))
        self.result.loop_hinges = frozenset(
            element.name for element in elements if not isinstance(element, Constraint)
        )

    # --- references -----------------------------------------------------------------------------

    def _references(self, name: str) -> Iterator[str]:
        """Ends of a body with hinges (except its inboard one), loads or force elements."""
        references = [hinge.inboard for hinge in self.scene.hinge]
        references += [chain.inboard for chain in self.scene.chain]
        references += [load.on for load in self.scene.load if load.force_per_length is None]
        elements = (*self.scene.forces, *self.scene.constraint)
        references += [end for element in elements for end in (element.from_, element.to)]
        references += [h.outboard for h in self.scene.hinge if h.name in (self.cut or ())]
        yield from (reference for reference in references if split_reference(reference)[0] == name)

    def _distributed_loads(self, name: str) -> list[Load]:
        return [
            load
            for load in self.scene.load
            if load.force_per_length is not None and split_reference(load.on)[0] == name
        ]

    def _length(self, name: str) -> float:
        return float(next(beam.length for beam in self.scene.beam if beam.name == name))

    def _node(self, reference: str) -> str:
        return self.result.nodes.get(reference, reference)

    def _substitute_hinge(self, hinge: Hinge) -> Hinge:
        update: dict[str, object] = {"inboard": self._node(hinge.inboard)}
        if self.cut is not None:
            cut = hinge.name in self.cut
            outboard = self._node(hinge.outboard) if cut else hinge.outboard
            update |= {"cut": cut, "outboard": outboard}
        return hinge.model_copy(update=update)

    def _with_node_ends(self, element: Joining) -> Joining:
        ends = {"from_": self._node(element.from_), "to": self._node(element.to)}
        return element.model_copy(update=ends)

    def _substitute_load(self, load: Load) -> Load:
        """The load on a rigid body; a distributed one becomes its resultant force."""
        name = split_reference(load.on)[0]
        if name not in self.substituted:
            return load
        update: dict[str, object] = {"axes": name if load.axes == "body" else load.axes}
        if load.force_per_length is None:
            return load.model_copy(update=update | {"on": self._node(load.on)})
        first, last = load.span or (0.0, self._length(name))
        force = tuple(scale_expression(entry, last - first) for entry in load.force_per_length)
        on = self._node(f"{name}.{load.name}")
        return load.model_copy(
            update=update | {"on": on, "force": force, "force_per_length": None, "span": None}
        )


def _middle(load: Load, length: float) -> float:
    first, last = load.span or (0.0, length)
    return (first + last) / 2


def scale_expression(entry: Expression, factor: float) -> Expression:
    """Copy of an expression, multiplied by a factor."""
    if entry.is_zero:
        return entry
    return parse(f"{factor!r} * ({entry.text})", constants=dict(entry.constants))


def _modal_body(scene: Scene, body: Beam | Elastic) -> ModalBody:
    from mstmm.scene.tables.beam import Beam

    from ..flexible.beam.modal_beams import beam_body
    from ..flexible.elastic.modal_elastic import modal_body

    if isinstance(body, Beam):  # no mass points: in the tree it is one rigid body
        return beam_body(scene, body.model_copy(update={"quadrature": False}))
    return modal_body(body, scene)


def _equivalent_rigid_body(body: Beam | Elastic, modal: ModalBody | None) -> Body:
    from mstmm.scene.tables.beam import Beam

    from ..flexible.elastic.modal_elastic import rigid_inertia_and_ends

    if isinstance(body, Beam):
        if body.viscous_drag:
            raise SceneError(
                f'beam "{body.name}": viscous_drag needs model = "flexible", found '
                f'"{body.model}", a rigid body in the run; leave one of them out'
            )
        return rigid_body_of_beam(body)
    if modal is not None:
        inertia = np.trace(modal.second) * np.eye(3) - modal.second
        return _rigid_body(body.name, modal.mass, modal.first, inertia, modal.ports)
    j, ports = rigid_inertia_and_ends(body)
    first = np.array([j[5, 1], j[3, 2], j[4, 0]])
    return _rigid_body(body.name, float(j[0, 0]), first, j[3:, 3:], ports)


def _to_matrix(array: Array) -> Matrix:
    """Convert a rotation matrix (3, 3) to nested tuples."""
    (a, b, c), (d, e, f), (g, h, i) = array.tolist()
    return ((a, b, c), (d, e, f), (g, h, i))


def _rigid_body(
    name: str,
    mass: float,
    first_moments: Array,
    inertia: Array,
    ports: Mapping[str, ModalPort] | Mapping[str, Port],
) -> Body:
    """Rigid body with first moments (3,) and inertia (3, 3) about the origin of its axes."""
    center = first_moments / mass
    steiner = float(center @ center) * np.eye(3) - np.outer(center, center)
    j = inertia - mass * steiner
    ends = {
        end: End(
            position=tuple(map(float, port.position)),
            orientation=to_quaternion(_to_matrix(port.rotation)),
        )
        for end, port in ports.items()
    }
    entries = (j[0, 0], j[1, 1], j[2, 2], j[0, 1], j[0, 2], j[1, 2])
    return Body(
        name=name, mass=mass, center_of_mass=tuple(map(float, center)),
        inertia=tuple(map(float, entries)), ends=ends, allow_unphysical_inertia=True,
    )  # fmt: skip


# --- one-way bodies in closed loops ---------------------------------------------------------------

#: Largest motion of a section, relative to the size of the shape, that counts as rounding.
_ROUNDING = 1e-6


def loop_elements(scene: Scene, plan: ClosurePlan) -> tuple[Hinge | Constraint, ...]:
    """Hinges of all loops, cut or not, followed by the constraints."""
    mechanism, paths = plan.mechanism, Paths(plan.mechanism, plan.tree)
    first = len(plan.cut_of)
    row_groups = [
        *(mechanism.groups[cut] for cut in plan.cut_of),
        *plan.groups[first : first + len(scene.constraint)],
    ]
    crossed = {plan.tree[body] for group in row_groups for body, _ in paths.crossed_bodies(group)}
    hinges = scene.skeleton.hinges
    return (*(hinges[number] for number in sorted(crossed.union(plan.cut_of))), *scene.constraint)


def check_loop_ends(
    bodies: Mapping[str, ModalBody], elements: tuple[Hinge | Constraint, ...]
) -> None:
    """Raise SceneError if a shape of one of the bodies moves a section that is in a loop."""
    for name, body in bodies.items():
        for element, end, inboard in ends_on_body(name, elements):
            port = body.ports[end]
            projection = _constrained_projection(element, port, inboard)
            shift, rotation = _section_motion(body, port, projection)
            moving = shift + rotation > _ROUNDING
            if not moving.any():
                continue
            table = "constraint" if isinstance(element, Constraint) else "hinge"
            first = int(moving.argmax())
            motion = "moves" if shift[first] > _ROUNDING else "rotates"
            raise SceneError(
                f'"{name}": model: shape {body.modes[first]} {motion} the end "{end}", where '
                f'{table} "{element.name}" closes a loop that one-way coupling would open; for a '
                'beam between pins use basis = "simply-supported" and frame = "chord", otherwise '
                'model = "flexible"'
            )


def ends_on_body(
    name: str, elements: tuple[Hinge | Constraint, ...]
) -> Iterator[tuple[Hinge | Constraint, str, bool]]:
    """Ends of a body on the elements: (element, end, whether it is the element's inboard one)."""
    for element in elements:
        pair = (
            (element.from_, element.to) if isinstance(element, Constraint)
            else (element.inboard, element.outboard)
        )  # fmt: skip
        for inboard, reference in zip((True, False), pair, strict=True):
            body, end = split_reference(reference)
            if body == name:
                yield element, end, inboard


def _constrained_projection(element: Hinge | Constraint, port: ModalPort, inboard: bool) -> Array:
    """Projection (3, 3) onto the rotations of a section that an element constrains."""
    if isinstance(element, Constraint):
        return np.eye(3) * (element.type == ROLLING)
    axes = port.rotation @ np.array(element.rotation) if inboard else port.rotation
    return constrained_rotations(element, axes, unknown=np.eye(3))


def _section_motion(body: ModalBody, port: ModalPort, projection: Array) -> tuple[Array, Array]:
    """Displacement and constrained rotation (modes,) of a section, relative to the shapes' size."""
    size = np.sqrt(np.diag(body.Mff) / body.mass)
    positions = np.array([port.position for port in body.ports.values()])
    length = float(np.linalg.norm(np.ptp(positions, axis=0))) or 1.0
    shift = np.abs(port.phi).max(axis=0)
    rotation = np.abs(projection @ port.theta).max(axis=0)
    return shift / size, length * rotation / size


def constrained_rotations(hinge: Hinge, rotation: Array, unknown: Array) -> Array:
    """Projection (3, 3) of rotations onto those that a hinge constrains, in body axes.

    `rotation` are the axes of its outboard end in those of the body.  `unknown` is returned for
    hinges whose free axes rotate.  Driven coordinates are constrained.
    """
    motions, facts = initial_motion_axes(hinge), hinge.facts
    if facts is None or motions is None:
        return unknown
    drive = hinge.drive or (None,) * len(motions)
    free = [k for k in facts.turns if drive[k] is None]
    if not free:
        return np.eye(3)
    if len(free) >= 3:
        return np.zeros((3, 3))
    if len(free) > 1 or "q" in facts.varies[free[0]][3:]:
        return unknown
    axis = rotation @ np.array(motions[free[0]][1])
    axis /= np.linalg.norm(axis)
    return np.eye(3) - np.outer(axis, axis)
