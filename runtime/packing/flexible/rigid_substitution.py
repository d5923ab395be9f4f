"""Flexible bodies made rigid: the level of model below the coupled one, and the first step of
linear elastodynamics.

A body whose `model` is "rigid" or "one-way" becomes a rigid body with the mass, mass centre,
inertia and ends of the undeformed one.  Of a one-way body every end on which something acts becomes
a massless body welded to it, "blade/tip": the load of that weld is all that acts there.  Which
hinges close loops is decided before that, for what holds a body would be a choice again.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from mstmm.argument_validation import require_word
from mstmm.array_validation import Array
from mstmm.errors import SceneError
from mstmm.expression.expression import Expression, parse
from mstmm.numerics.rotations import Matrix, to_quaternion
from mstmm.scene import Body, Bushing, Constraint, End, Hinge, Load, Scene, Spring, split_reference
from mstmm.scene.checks.topology import build_topology, inboard_hinges_by_body
from mstmm.scene.tables.rigid_equivalent import rigid_body_of_beam

from ...flexible.modal_body import ModalBody
from ...flexible.modal_port import ModalPort
from ..loops.loop_detection import may_have_loops
from .one_way_loops import check_loop_ends, ends_on_body, loop_elements

if TYPE_CHECKING:
    from mstmm.scene.tables.beam import Beam
    from mstmm.scene.tables.elastic import Elastic

    from ...flexible.elastic.interface_nodes import Port

Joining = TypeVar("Joining", Spring, Bushing, Constraint)

#: What `compile(flexibility=)` takes, and the `model` it gives every flexible body.
LEVELS = {"coupled": "flexible", "one-way": "one-way", "rigid": "rigid"}


@dataclass
class RigidSubstitution:
    """A scene whose flexible bodies are all coupled ones.

    Attributes:
        nodes: "blade.tip" -> the body welded there, "blade/tip".
        one_way: the modal bodies of those that respond one way.
        held: the end by which each of them is held.
        holders: the hinge of the tree that holds each of them.
        looped: names of the hinges around closed loops.
        passed: those of them that a loop passes.
    """

    scene: Scene
    nodes: dict[str, str] = field(default_factory=dict)
    one_way: dict[str, ModalBody] = field(default_factory=dict)
    held: dict[str, str] = field(default_factory=dict)
    holders: dict[str, Hinge] = field(default_factory=dict)
    looped: frozenset[str] = frozenset()
    passed: frozenset[str] = frozenset()


def with_level(scene: Scene, flexibility: str | None) -> Scene:
    """The scene with one level of model for all flexible bodies; None leaves it as it is.

    SceneError for a level that does not exist.
    """
    if flexibility is None:
        return scene
    known = ", ".join(LEVELS)
    if require_word("flexibility", flexibility, f"one of {known}, or None") not in LEVELS:
        raise SceneError(f'flexibility "{flexibility}" is not known; there are: {known}')
    level = {"model": LEVELS[flexibility]}
    fields = {key: getattr(scene, key) for key in type(scene).model_fields}
    fields["beam"] = tuple(beam.model_copy(update=level) for beam in scene.beam)
    fields["elastic"] = tuple(body.model_copy(update=level) for body in scene.elastic)
    return Scene.model_construct(**fields)


def substitute_rigid_bodies(
    scene: Scene, known: Mapping[str, ModalBody], only: Collection[str] | None = None
) -> RigidSubstitution:
    """The scene with rigid bodies in place of those whose model is "rigid" or "one-way"; of `only`
    these names where they are given.

    `known` are the modal bodies that need not be computed.

    SceneError for a viscous drag, which rigid bodies do not have, and for shapes of a one-way body
    that open a loop.
    """
    stiff: list[Beam | Elastic] = [b for b in scene.beam if b.model != "flexible"]
    stiff += [b for b in scene.elastic if b.model != "flexible"]
    stiff = [b for b in stiff if only is None or b.name in only]
    return _Rigidifying(scene, stiff, known).run() if stiff else RigidSubstitution(scene)


class _Rigidifying:
    """One walk over the bodies to be made rigid."""

    def __init__(
        self, scene: Scene, stiff: list[Beam | Elastic], known: Mapping[str, ModalBody]
    ) -> None:
        self.scene, self.stiff = scene, {body.name: body for body in stiff}
        self.known = known
        self.made = RigidSubstitution(scene)
        responds = any(body.model == "one-way" for body in stiff)
        self.held = inboard_hinges_by_body(scene) if responds else {}
        self.cut = None
        if responds and may_have_loops(scene):
            held = {hinge.name for hinge in self.held.values()}
            self.cut = frozenset(hinge.name for hinge in scene.hinge) - held
        self.bodies: dict[str, Body] = {}
        self.welds: list[Hinge] = []

    def run(self) -> RigidSubstitution:
        for name, body in self.stiff.items():
            self._body(name, body)
        self._closed()
        scene, names = self.scene, self.stiff
        fields = {key: getattr(scene, key) for key in type(scene).model_fields}
        fields |= {
            "beam": tuple(beam for beam in scene.beam if beam.name not in names),
            "elastic": tuple(body for body in scene.elastic if body.name not in names),
            "body": (*scene.body, *self.bodies.values()),
            "hinge": (*map(self._hinge, scene.hinge), *self.welds),
            "chain": tuple(
                chain.model_copy(update={"inboard": self._node(chain.inboard)})
                for chain in scene.chain
            ),
            "load": tuple(map(self._load, scene.load)),
            "spring": tuple(map(self._between, scene.spring)),
            "bushing": tuple(map(self._between, scene.bushing)),
            "constraint": tuple(map(self._between, scene.constraint)),
        }  # fmt: skip
        self.made.scene = Scene.model_construct(**fields)
        return self.made

    def _body(self, name: str, body: Beam | Elastic) -> None:
        modal = None
        if body.model == "one-way":
            modal = self.known.get(name) or _modal(self.scene, body)
        rigid = _rigid(body, modal)
        ends = dict(rigid.ends)
        for load in self._spread(name):
            ends[load.name] = End(position=(_middle(load, self._length(name)), 0.0, 0.0))
        self.bodies[name] = rigid.model_copy(update={"ends": ends})
        if modal is None:
            return
        self.made.one_way[name] = modal
        holder = self.held.get(name)
        self.made.held[name] = next(iter(ends)) if holder is None else holder.outboard_end
        if holder is not None:
            self.made.holders[name] = holder
        used = dict.fromkeys(split_reference(reference)[1] for reference in self._references(name))
        for end in (*used, *(load.name for load in self._spread(name))):
            self._weld(name, end)

    def _weld(self, name: str, end: str) -> None:
        node = f"{name}/{end}"
        massless = Body(name="end", mass=0.0)
        self.bodies[node] = massless.model_copy(update={"name": node})
        weld = Hinge(name="weld", type="fixed", inboard="ground", outboard="end")
        update = {"name": node, "inboard": f"{name}.{end}", "outboard": node}
        self.welds.append(weld.model_copy(update=update))
        self.made.nodes[f"{name}.{end}"] = node

    def _closed(self) -> None:
        """What loops pass, where one-way bodies are in the scene."""
        plan = None if self.cut is None else build_topology(self.scene.skeleton).plan
        if plan is None:
            return
        elements, bodies = loop_elements(self.scene, plan), self.made.one_way
        check_loop_ends(bodies, elements)
        self.made.passed = frozenset(name for name in bodies if any(ends_on_body(name, elements)))
        self.made.looped = frozenset(
            one.name for one in elements if not isinstance(one, Constraint)
        )

    # --- references -----------------------------------------------------------------------------

    def _references(self, name: str) -> Iterator[str]:
        """Ends of a body on which something acts, but for the hinge that holds it."""
        references = [hinge.inboard for hinge in self.scene.hinge]
        references += [chain.inboard for chain in self.scene.chain]
        references += [load.on for load in self.scene.load if load.force_per_length is None]
        joined = (*self.scene.forces, *self.scene.constraint)
        references += [end for one in joined for end in (one.from_, one.to)]
        references += [one.outboard for one in self.scene.hinge if one.name in (self.cut or ())]
        yield from (reference for reference in references if split_reference(reference)[0] == name)

    def _spread(self, name: str) -> list[Load]:
        return [
            load
            for load in self.scene.load
            if load.force_per_length is not None and split_reference(load.on)[0] == name
        ]

    def _length(self, name: str) -> float:
        return float(next(beam.length for beam in self.scene.beam if beam.name == name))

    def _node(self, reference: str) -> str:
        return self.made.nodes.get(reference, reference)

    def _hinge(self, hinge: Hinge) -> Hinge:
        update: dict[str, object] = {"inboard": self._node(hinge.inboard)}
        if self.cut is not None:
            cut = hinge.name in self.cut
            outboard = self._node(hinge.outboard) if cut else hinge.outboard
            update |= {"cut": cut, "outboard": outboard}
        return hinge.model_copy(update=update)

    def _between(self, element: Joining) -> Joining:
        ends = {"from_": self._node(element.from_), "to": self._node(element.to)}
        return element.model_copy(update=ends)

    def _load(self, load: Load) -> Load:
        name = split_reference(load.on)[0]
        if name not in self.stiff:
            return load
        update: dict[str, object] = {"axes": name if load.axes == "body" else load.axes}
        if load.force_per_length is None:
            return load.model_copy(update=update | {"on": self._node(load.on)})
        first, last = load.span or (0.0, self._length(name))
        force = tuple(_times(entry, last - first) for entry in load.force_per_length)
        on = self._node(f"{name}.{load.name}")
        return load.model_copy(
            update=update | {"on": on, "force": force, "force_per_length": None, "span": None}
        )


def _middle(load: Load, length: float) -> float:
    first, last = load.span or (0.0, length)
    return (first + last) / 2


def _times(entry: Expression, length: float) -> Expression:
    return (
        entry
        if entry.is_zero
        else parse(f"{length!r} * ({entry.text})", constants=dict(entry.constants))
    )


def _modal(scene: Scene, body: Beam | Elastic) -> ModalBody:
    from mstmm.scene.tables.beam import Beam

    from ...flexible.beam.modal_beams import beam_body
    from ...flexible.elastic.modal_elastic import modal_body

    if isinstance(body, Beam):  # its run has no mass points: the tree carries one rigid body
        return beam_body(scene, body.model_copy(update={"quadrature": False}))
    return modal_body(body, scene)


def _rigid(body: Beam | Elastic, modal: ModalBody | None) -> Body:
    from mstmm.scene.tables.beam import Beam

    from ...flexible.elastic.modal_elastic import rigid_inertia_and_ends

    if isinstance(body, Beam):
        if body.viscous_drag:
            raise SceneError(
                f'beam "{body.name}": viscous_drag needs model = "flexible", found '
                f'"{body.model}", a rigid body in the run; leave one of them out'
            )
        return rigid_body_of_beam(body)
    if modal is not None:
        turning = np.trace(modal.second) * np.eye(3) - modal.second
        return _rigid_body(body.name, modal.mass, modal.first, turning, modal.ports)
    j, ports = rigid_inertia_and_ends(body)
    first = np.array([j[5, 1], j[3, 2], j[4, 0]])
    return _rigid_body(body.name, float(j[0, 0]), first, j[3:, 3:], ports)


def _to_matrix(array: Array) -> Matrix:
    """A rotation matrix as the scene's tables hold it."""
    (a, b, c), (d, e, f), (g, h, i) = array.tolist()
    return ((a, b, c), (d, e, f), (g, h, i))


def _rigid_body(
    name: str,
    mass: float,
    first: Array,
    turning: Array,
    ports: Mapping[str, ModalPort] | Mapping[str, Port],
) -> Body:
    """A rigid body with first moments and inertia (3, 3) about the origin of its axes."""
    center = first / mass
    lever = float(center @ center) * np.eye(3) - np.outer(center, center)
    j = turning - mass * lever
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
