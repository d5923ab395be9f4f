"""Bodies of a scene as parts of the classical method: one part per rigid body or beam.

A rigid body has the internal frame of the engine.  A beam has its own axes, with the origin at its
inboard end; the nodes that represent it in the engine (floating frame, sections) are one part here.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mstmm.array_validation import Array

from ..engine.looped_engine import Probe
from ..flexible.modal_body import ModalBody
from ..flexible.modal_parts import ModalPort
from ..packing.expansion import HELD
from ..packing.packed_scene import PackedScene
from .supported_elements import Springs, hinge_kinds, unsupported_error

#: Largest distance from the axis of a beam that is rounding, m.
_AXIS_TOLERANCE = 1e-12


def _no_columns(rows: int) -> Array:
    return np.zeros((rows, 0))


@dataclass(frozen=True)
class Bending:
    """Shapes of a beam, in the order of its modal coordinates, which begin at indices `q` and `u`.

    `directions` (n,) are 1 for y, 2 for z; `shift` is int rho phi, `moment` int rho x phi (n,);
    mass, stiffness and damping matrices are (n, n).
    """

    directions: tuple[int, ...]
    shift: Array
    moment: Array
    mass: Array
    stiffness: Array
    damping: Array
    q: int
    u: int

    @property
    def n(self) -> int:
        """Number of shapes."""
        return len(self.directions)


@dataclass(frozen=True)
class Attachment:
    """Attachment of a body to the part `parent` (-1: the ground).

    Hinge point (3,) and hinge axes `rotation` (3, 3) at rest in the frame of the parent, whose
    shapes displace that point by `shapes` (3, n) and rotate it by `slopes` (3, n).
    """

    parent: int
    point: Array
    rotation: Array
    shapes: Array
    slopes: Array


@dataclass(frozen=True)
class Part:
    """Body with its inboard hinge.

    `hinge` is the place of the hinge in the engine's tree, `frame` the axes and origin of the body
    there.  `end` (3, 3) are the hinge's axes on the body at rest; the body's shapes rotate them by
    `section_rotation` (3, n).
    """

    hinge: int
    attachment: Attachment
    kind: str
    springs: Springs | None
    frame: Probe
    mass: float
    first: Array
    inertia: Array
    end: Array
    section_rotation: Array
    bending: Bending | None = None

    @property
    def parent(self) -> int:
        """Index of the part that carries it, -1 for the ground."""
        return self.attachment.parent


def build_parts(packed: PackedScene) -> list[Part]:
    """Parts of a scene, parents first.  SceneError for an unsupported element."""
    parts = list(_PartBuilder(packed))
    hinge_of_beam: dict[int, int] = {}
    for part in parts:
        if part.parent >= 0 and parts[part.parent].bending is not None:
            if part.parent in hinge_of_beam:
                hinge = packed.scene.hinges.name(packed.topology.links[part.hinge].hinge)
                raise unsupported_error(
                    f'hinge "{hinge}"', "its beam carries another hinge already"
                )
            hinge_of_beam[part.parent] = part.hinge
    return parts


class _PartBuilder:
    """One walk over the tree of nodes."""

    def __init__(self, packed: PackedScene) -> None:
        self.packed, self.expanded = packed, packed.expanded
        self.kinds = hinge_kinds(packed)
        #: Place of a node -> its part, and the section of a beam that it is.
        self.owner: dict[int, tuple[int, ModalPort | None]] = {-1: (-1, None)}
        self.origins: list[Array] = []

    def __iter__(self) -> Iterator[Part]:
        scene, passages = self.packed.scene, self.expanded.passages
        for place, link in enumerate(self.packed.topology.links):
            name = scene.bodies.name(link.body)
            if not self.expanded.is_node(name):
                self.owner[place] = (len(self.origins), None)
                yield self._rigid_part(place)
            elif name not in passages:  # its inboard hinge is one of the scene
                beam = name.removesuffix(f"/{HELD}")
                body = self.expanded.bodies[beam]
                port = body.ports[self.expanded.inboard_ends[beam]]
                self.owner[place] = (len(self.origins), port)
                yield self._beam(place, body, port)
            else:
                end = passages[name].port
                assert isinstance(end, ModalPort), "exact beams are refused with their frame"
                self.owner[place] = (self.owner[link.parent][0], end)

    def _rigid_part(self, place: int) -> Part:
        kind, springs = self.kinds[place]
        self.origins.append(np.zeros(3))
        body_parameters = np.array(self.packed.system.body(place).body_p)
        frame = Probe(place, (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
        return Part(
            place,
            self._attachment(place),
            kind,
            springs,
            frame,
            float(body_parameters[0]),
            body_parameters[1:4],
            body_parameters[4:10],
            np.eye(3),
            _no_columns(3),
        )

    def _node(self, place: int) -> tuple[str, Array, Array]:
        """Name of a node, and its internal axes and origin in the user's axes."""
        name = self.packed.scene.bodies.name(self.packed.topology.links[place].body)
        placement = self.packed.placements[name]
        return name, np.array(placement.rotation), np.array(placement.origin)

    def _attachment(self, place: int) -> Attachment:
        parent = self.packed.topology.links[place].parent
        owner, port = self.owner[parent]
        connection = np.array(self.packed.system.body(place).connection)
        hinge_rotation, point = connection[:9].reshape(3, 3), connection[9:12]
        if port is None:
            return Attachment(owner, point, hinge_rotation, _no_columns(3), _no_columns(3))
        _, rotation, origin = self._node(parent)
        if np.abs(origin + rotation @ point).max() > _AXIS_TOLERANCE:
            hinge = self.packed.scene.hinges.name(self.packed.topology.links[place].hinge)
            raise unsupported_error(f'hinge "{hinge}"', "it is not on the axis of a beam")
        position = port.position - self.origins[owner]
        return Attachment(
            owner, position, port.rotation @ rotation @ hinge_rotation, port.phi, port.theta
        )

    def _beam(self, place: int, body: ModalBody, port: ModalPort) -> Part:
        kind, springs = self.kinds[place]
        attachment, bending = self._attachment(place), _beam_shapes(body, port, self.packed)
        self.origins.append(port.position)
        node, axes, _ = self._node(place)
        if node != body.name:  # the section, which turns with the beam
            axes = port.rotation @ axes
        first_moment = body.first - body.mass * port.position
        parallel_axis_terms = np.outer(port.position, body.first) + np.outer(
            first_moment, port.position
        )
        second_moment = body.second - parallel_axis_terms
        inertia = np.trace(second_moment) * np.eye(3) - second_moment
        return Part(
            place, attachment, kind, springs, self._floating_frame(body, port), body.mass,
            first_moment, inertia[np.triu_indices(3)], axes, port.theta, bending,
        )  # fmt: skip

    def _floating_frame(self, body: ModalBody, port: ModalPort) -> Probe:
        """Axes of a beam, and the point of its floating frame at its inboard end at rest."""
        placement = self.packed.placements[body.name]
        x, y, z = (float(entry) for entry in port.position)
        axes = tuple(np.array(placement.rotation).T.ravel().tolist())
        return Probe(self.packed.positions[body.name], axes, placement.point((x, y, z)))


def _beam_shapes(body: ModalBody, port: ModalPort, packed: PackedScene) -> Bending:
    """Shapes of a beam.  SceneError for features that the matrices of beams do not contain."""
    label = f'"{body.name}"'
    if body.stations:
        raise unsupported_error(label, "exact beams have no matrices")
    if body.shapes is None:
        raise unsupported_error(label, "beams are the only flexible bodies with matrices")
    data = body.shapes.data
    if body.shapes.stiffening:
        raise unsupported_error(
            label, "its matrices are linear in the deflection; set stiffening = false"
        )
    if body.points or body.drag is not None or data.rotary:
        raise unsupported_error(
            label, "its matrices contain no quadrature, viscous drag or rotary inertia"
        )
    if any(name[0] not in "yz" for name in body.modes):
        raise unsupported_error(label, "its matrices contain no twist and axial shapes")
    if np.any(port.phi):
        raise unsupported_error(
            label, "its frame does not stay at its inboard end; use tangent or chord"
        )
    direction_indices = np.array(["xyz".index(name[0]) for name in body.modes], dtype=np.int64)
    k, slots = np.arange(len(direction_indices)), packed.layout.modal[body.name]
    moment = body.E[0, direction_indices, k] - port.position[0] * body.C[direction_indices, k]
    mass_matrix = body.F[
        direction_indices[:, None], direction_indices[None, :], k[:, None], k[None, :]
    ]
    return Bending(
        tuple(direction_indices.tolist()),
        body.C[direction_indices, k],
        moment,
        mass_matrix,
        body.K,
        body.D,
        slots.q,
        slots.u,
    )
