"""Body numbers in internal frames; equal members of a chain are computed once."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from mstmm.numerics.rotations import Matrix, Pose
from mstmm.scene import Body, Hinge
from mstmm.scene.checks.topology import BodyRow, Topology
from mstmm.scene.tables.hinge_frames import hinge_frames, parameters_from_keys

from ..flexible.modal_body import (
    ModalBody,
    moment_inputs,
    section_inputs,
    segment_inputs,
    transform_body,
    transform_section,
    transform_station,
    without_mass,
)
from ..flexible.modal_parts import Station
from ..kernels.prebuilt_kernels import Elements, declared_numbers
from . import internal_frames
from .coordinate_layout import HingeSlots, Layout
from .expansion import ExpandedScene
from .internal_frames import GROUND, Placement, link_connection, rigid_parameters
from .simplification import WeldedBodies, end_pose
from .system import Arrays, BodyNumbers, BodyRun, ModalNumbers, Numbers, SectionNumbers

#: The type of body whose numbers are in internal frames.
RIGID = "rigid"


#: Type that runs a weld which may be released; its speeds are prescribed until then.
LETS_GO = "free"


def kernel_type(hinge: Hinge, releases: Mapping[str, int]) -> str:
    """Name of the element whose kernels compute the motion of a hinge."""
    if hinge.is_weld and hinge.name in releases:
        return LETS_GO
    return hinge.type if hinge.facts is None else hinge.facts.runs_as


class Bodies:
    """Computes the numbers of all bodies and stores their internal frames.

    Of a chain only the first member, one period of its pattern and the last member are computed:
    the frame of the last one depends on its own child.
    """

    def __init__(
        self,
        expanded: ExpandedScene,
        topology: Topology,
        layout: Layout,
        elements: Elements,
        releases: Mapping[str, int],
        align: bool,
        linked: bool,
        carried: WeldedBodies,
    ) -> None:
        self.expanded, self.scene, self.topology = expanded, expanded.scene, topology
        self.layout, self.elements = layout, elements
        self.releases, self.carried = releases, carried
        self.align, self.linked = align and linked, linked
        #: First body of a run -> placements of one period.
        self._placements: dict[int, list[Placement]] = {}
        #: First body of a chain -> placement of its last member.
        self._last: dict[int, Placement] = {}

    def placement(self, body: int) -> Placement:
        """Internal frame of a body, given by its number."""
        carrier = self.carried.carriers.get(body)
        if carrier is not None:
            return self.carried.pose_in_carrier(body, self._placements[carrier][0])
        if body < len(self.scene.body):
            return self._placements[body][0]
        chain, k = self.scene.bodies.member(body)
        first = self.scene.bodies.starts[chain]
        if k + 1 == self.scene.chain[chain].count:
            return self._last[first]
        period = self._placements[first]
        return period[k % len(period)]

    def run(self, run: BodyRow) -> BodyRun:
        """Numbers of a run of bodies; call it for the inboard run first."""
        period = self._period(run)
        count = min(run.count, period + 1)
        members = [self._body_numbers(run, k) for k in range(count)]
        if run.count > count:
            members.append(self._body_numbers(run, run.count - 1))
        slots = self.layout.group(run.hinge)
        placements = self._placements[run.body]
        self._last[run.body] = placements[-1]
        del placements[period:]
        return BodyRun(run.position, run.parent, run.count, period, tuple(members), slots)

    # --- one body ---------------------------------------------------------------------------

    def _body_numbers(self, run: BodyRow, k: int) -> BodyNumbers:
        """Numbers of member k of a run."""
        body, hinge = self.scene.bodies[run.body + k], self.scene.hinges[run.hinge + k]
        slots = self.layout.slots(run.hinge + k)
        inboard, outboard = hinge_frames(hinge)
        hinge_placement = internal_frames.body_placement(body, run.outboard_end, outboard)
        flexible = self.expanded.is_node(body.name)
        child = self._first_child(run, k) if self.align and not flexible else None
        placement = internal_frames.align_frame(hinge_placement, hinge, child)
        self._placements.setdefault(run.body, []).append(placement)
        modal, section = self._modal_and_section(body.name, placement) if flexible else (None, None)
        link: Numbers = ()
        connection = _IDENTITY_CONNECTION
        if section is None or section.inward:
            axial = self.align and not flexible and internal_frames.is_axial(hinge)
            link, connection = self._link_and_connection(run, k, inboard, placement, axial)
        hinge_p = _hinge_parameters(hinge)
        body_p, body_frame = self._body_parameters(run.body + k, placement)
        rotor, imposed = _rotor_and_imposed(hinge, slots)
        return BodyNumbers(
            ("hinge", kernel_type(hinge, self.releases)), ("body", body.type), slots.nq, slots.nu,
            slots.rates_are_speeds, slots.constant_subspace, slots.rotation_speeds, connection,
            link, placement.height, hinge_p, body_p, body_frame, rotor, imposed,
            self.releases.get(hinge.name, -1), modal, section, body.name in self.expanded.idle,
            self.linked,
        )  # fmt: skip

    def _modal_and_section(
        self, name: str, placement: Placement
    ) -> tuple[ModalNumbers | None, SectionNumbers | None]:
        """Modes and section of a node of a flexible body; None where it has none."""
        passage = self.expanded.passages.get(name)
        body = self.expanded.bodies.get(passage.body if passage else name)
        if body is None:
            return None, None  # the massless node of the section at the inboard hinge
        modal = None
        if name in self.expanded.bodies:
            body = transform_body(body, np.array(placement.rotation), np.array(placement.origin))
            modal = _modal_numbers(body, self.layout.modal[name])
        if passage is None:
            return modal, None
        port = passage.port
        frame = self.scene.bodies.find(passage.body)
        assert frame is not None
        if not passage.inward:
            placed = self.placement(frame)
            axes = np.array(placed.rotation), np.array(placed.origin)
            port = (
                transform_station(port, *axes)
                if isinstance(port, Station)
                else transform_section(port, *axes)
            )
        inputs = segment_inputs(port) if isinstance(port, Station) else section_inputs(port)
        return modal, SectionNumbers(
            self.topology.position_of_body(frame), passage.inward, Arrays(inputs),
            tuple(port.rotation.ravel().tolist()),
        )  # fmt: skip

    def _link_and_connection(
        self, run: BodyRow, k: int, inboard: Matrix, placement: Placement, axial: bool
    ) -> tuple[Numbers, Numbers]:
        """Transform from the parent's frame as link screws (may be empty) and as Rt, ro."""
        hinge = self.scene.hinges[run.hinge + k]
        parent, parent_placement = self._parent(run, k)
        rotation, position = internal_frames.connection(
            parent_placement, parent, hinge, inboard, placement
        )
        link = internal_frames.link_screws(rotation, position) if axial else None
        if link is None:
            return (), (*rotation[0], *rotation[1], *rotation[2], *position)
        return link, link_connection(link)

    def _first_child(self, run: BodyRow, k: int) -> tuple[Hinge, Pose] | None:
        """First hinge on a body, and the pose of its inboard end in the body's axes."""
        if k + 1 < run.count:
            body, end = self.scene.bodies[run.body + k], run.ends[k % len(run.ends)]
            return self.scene.hinges[run.hinge + k + 1], end_pose(body, end)
        child = self._first_children.get(run.position + k)
        if child is None:
            return None
        inboard_end = end_pose(self.scene.bodies[child.on], child.inboard_end)
        pose = self.carried.poses.get(child.on)
        return (
            self.scene.hinges[child.hinge],
            inboard_end if pose is None else pose.compose(inboard_end),
        )

    def _period(self, run: BodyRow) -> int:
        if run.body < len(self.scene.body):
            return 1
        return self.scene.chain[self.scene.bodies.member(run.body)[0]].period

    @cached_property
    def _first_children(self) -> dict[int, BodyRow]:
        """Position of a body in the tree -> first run outboard of it."""
        first: dict[int, BodyRow] = {}
        for run in self.topology.runs:
            first.setdefault(run.parent, run)
        return first

    def _parent(self, run: BodyRow, k: int) -> tuple[Body | None, Placement]:
        """Parent of member k (None: the ground) and its placement."""
        if k:
            placement = self._placements[run.body][(k - 1) % self._period(run)]
            return self.scene.bodies[run.body + k - 1], placement
        if run.parent < 0:
            return None, GROUND
        return self.scene.bodies[run.on], self.placement(run.on)

    def _body_parameters(self, number: int, placement: Placement) -> tuple[Numbers, Numbers]:
        """Numbers of the body's kernels, and the internal frame in user axes.

        A rigid body's numbers are given in the internal frame, include the bodies welded to it, and
        need no frame (empty).  For user-defined bodies it is rotation (9) and origin (3).
        """
        body = self.scene.bodies[number]
        if body.type == RIGID:
            numbers = rigid_parameters(body, placement)
            for part in self.carried.parts.get(number, ()):
                part_placement = self.carried.pose_in_carrier(part, placement)
                part_numbers = rigid_parameters(self.scene.body[part], part_placement)
                numbers = tuple(a + b for a, b in zip(numbers, part_numbers, strict=True))
            return numbers, ()
        element = self.elements.get("body", body.type, body.name)
        numbers = declared_numbers(element.declared, body.parameters, f'body "{body.name}"')
        rotation = placement.rotation
        return numbers, (*rotation[0], *rotation[1], *rotation[2], *placement.origin)


#: Rt (9) and ro (3) where the section of a flexible body is the whole connection.
_IDENTITY_CONNECTION: Numbers = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


def _rotor_and_imposed(hinge: Hinge, slots: HingeSlots) -> tuple[Numbers, tuple[int, ...]]:
    """Rotor inertia of each speed (kg m^2 or kg), and 1 for each prescribed speed."""
    rotor, law = (0.0,) * slots.nu, hinge.law
    if hinge.is_weld:
        return rotor, (1,) * slots.nu
    if law.inertia:
        rotor = tuple(law.entry(k).inertia for k in range(slots.nu))
    drives = hinge.drive or (None,) * slots.nu
    return rotor, tuple(int(entry is not None) for entry in drives)


def _modal_numbers(body: ModalBody, slots: HingeSlots) -> ModalNumbers:
    """Modal numbers of a flexible body given in the axes of its frame node."""
    return ModalNumbers(
        len(body.modes), slots.q, slots.u,
        Arrays(moment_inputs(without_mass(body) if body.points or body.stations else body)),
        None if body.drag is None else Arrays(moment_inputs(body.drag)),
        Arrays({"stiffness": body.K, "damping": body.D}),
    )  # fmt: skip


def _hinge_parameters(hinge: Hinge) -> Numbers:
    """Parameters of the hinge's kernel: from scene keys, and from the table `parameters`."""
    if hinge.facts is None:
        return ()
    declared = hinge.facts.extra_parameters()
    numbers = declared_numbers(declared, hinge.parameters, f'hinge "{hinge.name}"')
    values = dict(zip((p.name for p in declared), numbers, strict=True))
    values |= parameters_from_keys(hinge)
    return tuple(values[p.name] for p in hinge.facts.parameters)
