"""Bodies of a scene -> their numbers in internal frames, those of chains once for all alike."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from mstmm.numerics.pose import Pose
from mstmm.numerics.rotations import Matrix
from mstmm.scene import Body, Hinge
from mstmm.scene.checks.topology import BodyRow, Topology
from mstmm.scene.tables.hinge_frames import hinge_frames, parameters_from_keys

from ..flexible.kernel_inputs import (
    moment_inputs,
    section_inputs,
    transform_body,
    transform_section,
    without_mass,
)
from ..flexible.modal_body import ModalBody
from . import denavit_hartenberg, frame_placement
from .coordinate_layout import HingeSlots, Layout
from .denavit_hartenberg import link_connection
from .flexible.expansion import ExpandedScene
from .frame_placement import GROUND, Placement, rigid_parameters
from .merging.weld_geometry import end_pose
from .merging.welded_bodies import WeldedBodies
from .scene_elements import Elements, declared_numbers, kernel_type
from .system import Arrays, BodyNumbers, BodyRun, ModalNumbers, Numbers, SectionNumbers

#: The type of body whose numbers are in internal frames.
RIGID = "rigid"


class Bodies:
    """Makes the numbers of all bodies, and keeps their internal frames.

    A body of its own is made in its place.  Of a chain the first member, one period of its pattern
    and the last are made, whose frame suits what hangs on it.
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
        """Internal frame of the body of this number."""
        whole = self.carried.by.get(body)
        if whole is not None:
            return self.carried.placed(body, self._placements[whole][0])
        if body < len(self.scene.body):
            return self._placements[body][0]
        chain, k = self.scene.bodies.member(body)
        first = self.scene.bodies.starts[chain]
        if k + 1 == self.scene.chain[chain].count:
            return self._last[first]
        period = self._placements[first]
        return period[k % len(period)]

    def run(self, run: BodyRow) -> BodyRun:
        """Numbers of a run, behind those of the run it hangs on."""
        period = self._period(run)
        count = min(run.count, period + 1)
        made = [self._body(run, k) for k in range(count)]
        if run.count > count:
            made.append(self._body(run, run.count - 1))
        slots = self.layout.group(run.hinge)
        placements = self._placements[run.body]
        self._last[run.body] = placements[-1]
        del placements[period:]
        return BodyRun(run.place, run.parent, run.count, period, tuple(made), slots)

    # --- one body ---------------------------------------------------------------------------

    def _body(self, run: BodyRow, k: int) -> BodyNumbers:
        """Numbers of the run's member k."""
        body, hinge = self.scene.bodies[run.body + k], self.scene.hinges[run.hinge + k]
        slots = self.layout.slots(run.hinge + k)
        inboard, outboard = hinge_frames(hinge)
        own = frame_placement.body_placement(body, run.outboard_end, outboard)
        flexible = self.expanded.is_node(body.name)
        child = self._child(run, k) if self.align and not flexible else None
        place = denavit_hartenberg.align_frame(own, hinge, child)
        self._placements.setdefault(run.body, []).append(place)
        modal, section = self._flexible(body.name, place) if flexible else (None, None)
        link: Numbers = ()
        connection = _UNMOVED
        if section is None or section.inward:
            axial = self.align and not flexible and denavit_hartenberg.is_axial(hinge)
            link, connection = self._connection(run, k, inboard, place, axial)
        hinge_p = _hinge_parameters(hinge)
        body_p, body_frame = self._body_parameters(run.body + k, place)
        rotor, imposed = _rotor_and_imposed(hinge, slots)
        return BodyNumbers(
            ("hinge", kernel_type(hinge, self.releases)), ("body", body.type), slots.nq, slots.nu,
            slots.straight, slots.steady, slots.turning, connection, link, place.height, hinge_p,
            body_p, body_frame, rotor, imposed, self.releases.get(hinge.name, -1), modal, section,
            body.name in self.expanded.idle, self.linked,
        )  # fmt: skip

    def _flexible(
        self, name: str, place: Placement
    ) -> tuple[ModalNumbers | None, SectionNumbers | None]:
        """Modes and section of a node of a flexible body."""
        passage = self.expanded.passages.get(name)
        body = self.expanded.bodies.get(passage.body if passage else name)
        if body is None:
            return None, None  # the massless node of the section that is held
        modal = None
        if name in self.expanded.bodies:
            turned = transform_body(body, np.array(place.rotation), np.array(place.origin))
            modal = _modal(turned, self.layout.modal[name])
        if passage is None:
            return modal, None
        port = passage.port
        frame = self.scene.bodies.find(passage.body)
        assert frame is not None
        if not passage.inward:
            own = self.placement(frame)
            port = transform_section(port, np.array(own.rotation), np.array(own.origin))
        return modal, SectionNumbers(
            self.topology.place_of_body(frame), passage.inward, Arrays(section_inputs(port)),
            tuple(port.rotation.ravel().tolist()),
        )  # fmt: skip

    def _connection(
        self, run: BodyRow, k: int, inboard: Matrix, own: Placement, axial: bool
    ) -> tuple[Numbers, Numbers]:
        """Way from the parent's frame, as a link where it is one (else that is empty) and as Rt and
        ro."""
        hinge = self.scene.hinges[run.hinge + k]
        parent, parent_place = self._parent(run, k)
        turned, point = frame_placement.connection(parent_place, parent, hinge, inboard, own)
        link = denavit_hartenberg.link_screws(turned, point) if axial else None
        if link is None:
            return (), (*turned[0], *turned[1], *turned[2], *point)
        return link, link_connection(link)

    def _child(self, run: BodyRow, k: int) -> tuple[Hinge, Pose] | None:
        """First hinge on a body, and where the end that it hangs on lies in the body's axes."""
        if k + 1 < run.count:
            body, end = self.scene.bodies[run.body + k], run.ends[k % len(run.ends)]
            return self.scene.hinges[run.hinge + k + 1], end_pose(body, end)
        found = self._first_children.get(run.place + k)
        if found is None:
            return None
        held = end_pose(self.scene.bodies[found.on], found.inboard_end)
        pose = self.carried.poses.get(found.on)
        return self.scene.hinges[found.hinge], held if pose is None else pose.then(held)

    def _period(self, run: BodyRow) -> int:
        if run.body < len(self.scene.body):
            return 1
        return self.scene.chain[self.scene.bodies.member(run.body)[0]].period

    @cached_property
    def _first_children(self) -> dict[int, BodyRow]:
        """Place of a body -> the first run that hangs on it."""
        found: dict[int, BodyRow] = {}
        for run in self.topology.runs:
            found.setdefault(run.parent, run)
        return found

    def _parent(self, run: BodyRow, k: int) -> tuple[Body | None, Placement]:
        if k:
            before = self._placements[run.body][(k - 1) % self._period(run)]
            return self.scene.bodies[run.body + k - 1], before
        if run.parent < 0:
            return None, GROUND
        return self.scene.bodies[run.on], self.placement(run.on)

    def _body_parameters(self, number: int, place: Placement) -> tuple[Numbers, Numbers]:
        """Numbers of the body's kernels, and behind them the internal frame in the body's own:
        rotation (9) and origin (3); a rigid body's numbers are in the internal frame, with those of
        the bodies that it carries."""
        body = self.scene.bodies[number]
        if body.type == RIGID:
            numbers = rigid_parameters(body, place)
            for part in self.carried.parts.get(number, ()):
                own = rigid_parameters(self.scene.body[part], self.carried.placed(part, place))
                numbers = tuple(a + b for a, b in zip(numbers, own, strict=True))
            return numbers, ()
        element = self.elements.get("body", body.type, body.name)
        numbers = declared_numbers(element.declared, body.parameters, f'body "{body.name}"')
        turn = place.rotation
        return numbers, (*turn[0], *turn[1], *turn[2], *place.origin)


#: Rt (9) and ro (3) of a connection that is none but its section.
_UNMOVED: Numbers = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)


def _rotor_and_imposed(hinge: Hinge, slots: HingeSlots) -> tuple[Numbers, tuple[int, ...]]:
    """Inertia of rotors, and 1 where something imposes the speed."""
    rotor, law = (0.0,) * slots.nu, hinge.law
    if hinge.is_weld:
        return rotor, (1,) * slots.nu
    if law.inertia:
        rotor = tuple(law.entry(k).inertia for k in range(slots.nu))
    drives = hinge.drive or (None,) * slots.nu
    return rotor, tuple(int(entry is not None) for entry in drives)


def _modal(body: ModalBody, slots: HingeSlots) -> ModalNumbers:
    """Of a body whose numbers are in the axes of its node."""
    return ModalNumbers(
        len(body.modes), slots.q, slots.u,
        Arrays(moment_inputs(without_mass(body) if body.points else body)),
        None if body.drag is None else Arrays(moment_inputs(body.drag)),
        Arrays({"stiffness": body.K, "damping": body.D}),
    )  # fmt: skip


def _hinge_parameters(hinge: Hinge) -> Numbers:
    """Numbers of the hinge's kernel: of keys of the scene, and given by name."""
    if hinge.facts is None:
        return ()
    own = hinge.facts.own_parameters()
    given = declared_numbers(own, hinge.parameters, f'hinge "{hinge.name}"')
    known = {**dict(zip((p.name for p in own), given, strict=True)), **parameters_from_keys(hinge)}
    return tuple(known[p.name] for p in hinge.facts.parameters)
