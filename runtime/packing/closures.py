"""Closures of loops: numbers of cut hinges and constraints, and the rows of couplings.

With the constraint phi(q, t) = 0 of a coupling and the rates q' of all coordinates, which are
functions of q and u, its numbers are

    slip   phi' = phi_t + phi_q q'            (of speeds: A u - b(t))
    C      derivative of phi' by the speeds
    drift  phi'' at constant speeds

by exact derivatives of the expression and of the rates.  The rates are u for most hinges; for the
others they come from the hinge's kernel.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from mstmm.errors import SceneError
from mstmm.ir import KernelIR, Port
from mstmm.ir.differentiation import derivative
from mstmm.ir.graph import Graph, Node
from mstmm.ir.inline import Inliner
from mstmm.numerics.rotations import IDENTITY, rotate
from mstmm.scene import Constraint, Coupling, Scene, split_reference
from mstmm.scene.checks.connectivity import resolve_coordinate
from mstmm.scene.tables.closures import CURVE, DISTANCE, PLANE

from .coordinate_layout import HingeSlots
from .expression_tapes import state_ports
from .system import BodyNumbers, BodyRun, ClosureNumbers, CoupledHinge, CouplingNumbers

if TYPE_CHECKING:
    from mstmm.expression.expression import Name

    from .expansion import Cut
    from .packed_scene import Frames


#: Identity rotation, row by row.
_IDENTITY = (*IDENTITY[0], *IDENTITY[1], *IDENTITY[2])


def closure_numbers(frames: Frames, runs: Sequence[BodyRun]) -> Iterator[ClosureNumbers]:
    """Closures of the cut hinges, then of the constraints."""
    first_bodies = {run.position: run.members[0] for run in runs}
    for cut in frames.expanded.cuts:
        place = frames.positions[cut.frame]
        if cut.constraint is None:
            yield _cut_hinge_closure(frames, cut, place, first_bodies[place])
        else:
            yield _constraint_closure(cut.constraint, frames, place)


def _cut_hinge_closure(frames: Frames, cut: Cut, place: int, frame: BodyNumbers) -> ClosureNumbers:
    """Closure of a cut hinge; speeds that are prescribed or have a rotor get rows as well."""
    frame_placement, body_placement = (frames.placements[name] for name in (cut.frame, cut.body))
    turn = body_placement.axes(frame_placement.rotation)
    constrained = [k for k in range(frame.nu) if frame.imposed[k] or frame.rotor[k]]
    return ClosureNumbers(
        place, frames.positions[cut.body], (*turn[0], *turn[1], *turn[2]),
        body_placement.point(frame_placement.origin), (*constrained, *range(frame.nu, 6)),
    )  # fmt: skip


def _constraint_closure(constraint: Constraint, frames: Frames, place: int) -> ClosureNumbers:
    """Closure of a constraint whose frame is at position `place` in the tree."""
    body, axes, end = frames.end(constraint.to)
    if body < 0:
        end = constraint.position
    ends = (place, body, _IDENTITY, end)
    if constraint.type == DISTANCE:
        assert constraint.length is not None
        return ClosureNumbers(*ends, (0,), "distance", (constraint.length,), asked=1)
    if constraint.type == CURVE:  # direction 0 is the free speed along the curve
        return ClosureNumbers(*ends, (1, 2), asked=3)
    height = constraint.offset or 0.0
    if constraint.type == PLANE:
        return ClosureNumbers(*ends, (0,), "plane", (height,), asked=1)
    assert constraint.radius is not None
    axis = rotate((axes[0:3], axes[3:6], axes[6:9]), constraint.unit_axis)  # type: ignore[arg-type]
    p = (height, constraint.radius, *axis)
    return ClosureNumbers(*ends, (0, 1, 2), "rolling", p, speed_directions=(0, 1), asked=3)


# --- couplings ------------------------------------------------------------------------------------


def coupling_numbers(
    frames: Frames, runs: Sequence[BodyRun]
) -> tuple[tuple[CouplingNumbers, ...], KernelIR | None]:
    """Couplings, and the kernel (t, q, u) -> numbers of all of them.

    Each coupling has drift, value, rate, rate at rest, and -C hinge by hinge.
    """
    scene = frames.user_scene
    if not scene.coupling:
        return (), None
    rows, nodes, couplings = _Rows(frames, scene, runs), list[Node](), []
    for coupling in scene.coupling:
        numbers, row_nodes = rows.row(coupling, len(nodes))
        nodes += row_nodes
        couplings.append(numbers)
    output = Port("numbers", (len(nodes),))
    kernel = rows.graph.kernel(
        "couplings", state_ports(frames.layout), [output], {"numbers": nodes}
    )
    return tuple(couplings), kernel


@dataclass
class _Rows:
    """Builder of the coupling rows of a scene, in one graph."""

    frames: Frames
    scene: Scene
    runs: Sequence[BodyRun]
    graph: Graph = field(default_factory=Graph)

    def row(self, coupling: Coupling, first: int) -> tuple[CouplingNumbers, list[Node]]:
        """Coupling and the nodes of its numbers, which begin at index `first`."""
        names = dict.fromkeys(
            self.scene.hinges.name(resolve_coordinate(self.scene, name)[0])
            for name in coupling.names
        )
        slots = [self.frames.layout.hinges[name] for name in names]
        hinges = tuple(map(self._coupled_hinge, slots))
        time_derivatives = {self.graph.element("t", 0): self.graph.constant(1)}
        for hinge in slots:
            for i, coordinate_rate in enumerate(self._coordinate_rates(hinge)):
                time_derivatives[self.graph.element("q", hinge.q + i)] = coordinate_rate
        value, rate, rate_at_rest = self._value_and_rates(coupling, time_derivatives)
        speeds = [k for hinge in slots for k in range(hinge.u, hinge.u + hinge.nu)]
        columns = [-derivative(rate, {self.graph.element("u", k): 1}) for k in speeds]
        is_initial_value = coupling.expression is not None and coupling.equals is None
        numbers = CouplingNumbers(
            coupling.name, first, hinges, coupling.speeds is not None,
            None if is_initial_value else 0.0,
        )  # fmt: skip
        return numbers, [derivative(rate, time_derivatives), value, rate, rate_at_rest, *columns]

    def _coupled_hinge(self, slots: HingeSlots) -> CoupledHinge:
        """Position of a hinge in the tree, and of the bodies on both sides."""
        frames = self.frames
        table = frames.scene.hinges.by_name[slots.name]
        body_of_frame = {cut.frame: cut.body for cut in frames.expanded.cuts}
        sides = [
            body_of_frame.get(body, body)
            for body in (split_reference(table.inboard)[0], table.outboard_body)
        ]
        inboard, outboard = (frames.positions.get(body, -1) if body != "ground" else -1
                             for body in sides)  # fmt: skip
        return CoupledHinge(frames.hinge_position[slots.name], inboard, outboard)

    def _value_and_rates(
        self, coupling: Coupling, time_derivatives: dict[Node, Node]
    ) -> tuple[Node, Node, Node]:
        """Value, rate, and rate at zero speeds."""
        graph = self.graph

        def resolve(name: Name) -> Node:
            number, quantity, entry = resolve_coordinate(self.scene, name)
            slots = self.frames.layout.hinges[self.scene.hinges.name(number)]
            return graph.element(quantity, (slots.q if quantity == "q" else slots.u) + entry)

        time, zero = graph.element("t", 0), graph.constant(0)
        target = coupling.equals.build(graph, lambda _: time) if coupling.equals else zero
        gap = coupling.row.build(graph, resolve) - target
        if coupling.speeds is not None:
            return zero, gap, -target
        return gap, derivative(gap, time_derivatives), derivative(gap, {time: 1})

    def _coordinate_rates(self, slots: HingeSlots) -> list[Node]:
        """Rates of a hinge's coordinates as functions of its coordinates and speeds."""
        graph = self.graph
        speeds = [graph.element("u", slots.u + i) for i in range(slots.nu)]
        if slots.rates_are_speeds:
            return speeds
        facts = self.scene.hinges.by_name[slots.name].facts
        if facts is None or facts.rates is None:
            raise SceneError(
                f'coupling: hinge "{slots.name}" has a type generated by an earlier mstmm, without '
                "the rates of its coordinates; generate it again: mstmm generate FILE"
            )
        place = self.frames.hinge_position[slots.name]
        run = next(run for run in self.runs if run.position <= place < run.position + run.count)
        inputs = {
            "p": [graph.constant(float(x)) for x in run.member(place - run.position).hinge_p],
            "q": [graph.element("q", slots.q + i) for i in range(slots.nq)], "u": speeds,
        }  # fmt: skip
        return Inliner(graph).run(facts.rates, inputs)["qdot"]
