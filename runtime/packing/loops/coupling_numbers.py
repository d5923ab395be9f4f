"""[[coupling]] -> its row by t, q and u: what it lacks, its rate, and its columns on speeds.

With phi(q, t) = 0 and the rates q' of all coordinates, which go by the speeds of their hinges,

    slip   phi' = phi_t + phi_q q'            (of speeds: A u - b(t))
    C      the slope of phi' along the speeds
    drift  phi'' where no speed changes

by exact derivatives of the expression and of the rates, which are u itself of most hinges and what
the kernel of a hinge says of the others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from mstmm.errors import SceneError
from mstmm.ir import KernelIR, Port
from mstmm.ir.differentiation import derivative
from mstmm.ir.graph import Graph, Node
from mstmm.ir.inline import Inliner
from mstmm.scene import Coupling, Scene, split_reference
from mstmm.scene.checks.loop_closures import resolve_coordinate

from ..coordinate_layout import HingeSlots
from ..expression_tapes import state_ports
from ..system import BodyRun, CoupledHinge, CouplingNumbers

if TYPE_CHECKING:
    from mstmm.expression.expression import Name

    from ..scene_frames import Frames


def coupling_numbers(
    frames: Frames, runs: Sequence[BodyRun]
) -> tuple[tuple[CouplingNumbers, ...], KernelIR | None]:
    """Couplings, and the kernel t, q, u -> the numbers of all: of each drift, value, rate, rate at
    rest, and -C hinge by hinge."""
    scene = frames.described
    if not scene.coupling:
        return (), None
    rows, nodes, found = _Rows(frames, scene, runs), list[Node](), []
    for coupling in scene.coupling:
        numbers, more = rows.row(coupling, len(nodes))
        nodes += more
        found.append(numbers)
    output = Port("numbers", (len(nodes),))
    kernel = rows.graph.kernel(
        "couplings", state_ports(frames.layout), [output], {"numbers": nodes}
    )
    return tuple(found), kernel


@dataclass
class _Rows:
    """The rows of a scene, nodes of one graph."""

    frames: Frames
    scene: Scene
    runs: Sequence[BodyRun]
    graph: Graph = field(default_factory=Graph)

    def row(self, coupling: Coupling, first: int) -> tuple[CouplingNumbers, list[Node]]:
        """The places of a row, and its numbers, which stand behind `first` others."""
        names = dict.fromkeys(
            self.scene.hinges.name(resolve_coordinate(self.scene, name)[0])
            for name in coupling.names
        )
        slots = [self.frames.layout.hinges[name] for name in names]
        hinges = tuple(self._hinge(one) for one in slots)
        moving = {self.graph.element("t", 0): self.graph.constant(1)}
        for one in slots:
            for i, rate in enumerate(self._rates(one)):
                moving[self.graph.element("q", one.q + i)] = rate
        value, rate, still = self._levels(coupling, moving)
        speeds = [k for one in slots for k in range(one.u, one.u + one.nu)]
        columns = [-derivative(rate, {self.graph.element("u", k): 1}) for k in speeds]
        open_ = coupling.expression is not None and coupling.equals is None
        numbers = CouplingNumbers(
            coupling.name, first, hinges, coupling.speeds is not None, None if open_ else 0.0
        )
        return numbers, [derivative(rate, moving), value, rate, still, *columns]

    def _hinge(self, slots: HingeSlots) -> CoupledHinge:
        """Where a hinge is, and the bodies on both sides."""
        frames = self.frames
        table = frames.scene.hinges.by_name[slots.name]
        stands = {cut.frame: cut.body for cut in frames.expanded.cuts}
        sides = [
            stands.get(body, body)
            for body in (split_reference(table.inboard)[0], table.outboard_body)
        ]
        inboard, outboard = (frames.positions.get(body, -1) if body != "ground" else -1
                             for body in sides)  # fmt: skip
        return CoupledHinge(frames.hinge_position[slots.name], inboard, outboard)

    def _levels(self, coupling: Coupling, moving: dict[Node, Node]) -> tuple[Node, Node, Node]:
        """Value, rate, and the rate at rest."""
        graph = self.graph

        def resolve(name: Name) -> Node:
            number, quantity, entry = resolve_coordinate(self.scene, name)
            own = self.frames.layout.hinges[self.scene.hinges.name(number)]
            return graph.element(quantity, (own.q if quantity == "q" else own.u) + entry)

        time, nothing = graph.element("t", 0), graph.constant(0)
        wanted = coupling.equals.build(graph, lambda _: time) if coupling.equals else nothing
        found = coupling.row.build(graph, resolve) - wanted
        if coupling.speeds is not None:
            return nothing, found, -wanted
        return found, derivative(found, moving), derivative(found, {time: 1})

    def _rates(self, slots: HingeSlots) -> list[Node]:
        """Rates of a hinge's coordinates, by its coordinates and speeds."""
        graph = self.graph
        speeds = [graph.element("u", slots.u + i) for i in range(slots.nu)]
        if slots.straight:
            return speeds
        facts = self.scene.hinges.by_name[slots.name].facts
        if facts is None or facts.rates is None:
            raise SceneError(
                f'coupling: hinge "{slots.name}" has a type that was generated by an earlier '
                "mstmm, which did not tell the rates of its coordinates apart; generate it again: "
                "mstmm generate FILE"
            )
        place = self.frames.hinge_position[slots.name]
        numbers = next(run for run in self.runs if run.place <= place < run.place + run.count)
        given = {
            "p": [graph.constant(float(x)) for x in numbers.member(place - numbers.place).hinge_p],
            "q": [graph.element("q", slots.q + i) for i in range(slots.nq)], "u": speeds,
        }  # fmt: skip
        return Inliner(graph).run(facts.rates, given)["qdot"]
