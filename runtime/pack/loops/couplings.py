"""[[coupling]] -> its row by t, q and u: what it lacks, its rate, and its columns on speeds.

With phi(q, t) = 0 and the rates q' of all coordinates, which go by the speeds of their hinges,

    slip   phi' = phi_t + phi_q q'            (of speeds: A u - b(t))
    C      the slope of phi' along the speeds
    drift  phi'' where no speed changes

by exact derivatives of the expression; q' = u but for curved hinges, whose rates and slopes of them
are given.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mstmm.ir import KernelIR, Port
from mstmm.ir.graph import Graph, Node
from mstmm.ir.tangent import derivative, derivatives
from mstmm.scene import Coupling, Scene, split
from mstmm.scene.checks.closures import coordinate

from ..layout import HingeSlots
from ..system import CoupledHinge, CouplingNumbers
from ..values import state_ports

if TYPE_CHECKING:
    from mstmm.expression.expression import Name

    from ..frames import Frames

#: Ports of the rates of coordinates, and of their slopes of curved hinges.
_RATES, _SLOPES = "qdot", "slopes"
#: Leaf -> its derivative.
_Seeds = dict[Node, Node | int]


def couplings_of(frames: Frames) -> tuple[tuple[CouplingNumbers, ...], KernelIR | None]:
    """Couplings, and the kernel t, q, u, qdot, slopes -> the numbers of all: of each drift, value,
    rate, rate at rest, and -C hinge by hinge."""
    scene = frames.described
    if not scene.coupling:
        return (), None
    rows, graph = _Rows(frames, scene), Graph()
    nodes, found = list[Node](), []
    for coupling in scene.coupling:
        numbers, more = rows.row(coupling, graph, len(nodes))
        nodes += more
        found.append(numbers)
    inputs = [*state_ports(frames.layout), Port(_RATES, (frames.layout.nq,))]
    inputs.append(Port(_SLOPES, (rows.slopes,)))
    output = Port("numbers", (len(nodes),))
    return tuple(found), graph.kernel("couplings", inputs, [output], {"numbers": nodes})


@dataclass
class _Rows:
    """The rows of a scene; `slopes` so many numbers there are of curved hinges."""

    frames: Frames
    scene: Scene
    slopes: int = 0

    def __post_init__(self) -> None:
        self.curved: dict[str, int] = {}

    def row(
        self, coupling: Coupling, graph: Graph, first: int
    ) -> tuple[CouplingNumbers, list[Node]]:
        """The places of a row, and its numbers, which stand behind `first` others."""
        names = dict.fromkeys(
            self.scene.hinges.name(coordinate(self.scene, name)[0]) for name in coupling.names
        )
        slots = [self.frames.layout.hinges[name] for name in names]
        hinges = tuple(self._hinge(one) for one in slots)
        value, rate, still = self._levels(coupling, graph, slots)
        drift = derivative(rate, self._motion(graph, slots, True))
        columns = [
            -slope
            for one in slots
            for k in range(one.nu)
            for slope in derivatives([rate], self._along(graph, one, k))
        ]
        open_ = coupling.expression is not None and coupling.equals is None
        numbers = CouplingNumbers(
            coupling.name, first, hinges, coupling.speeds is not None, None if open_ else 0.0
        )
        return numbers, [drift, value, rate, still, *columns]

    def _hinge(self, slots: HingeSlots) -> CoupledHinge:
        """Where a hinge is, and the bodies on both sides."""
        frames = self.frames
        if not slots.straight and slots.name not in self.curved:
            self.curved[slots.name] = self.slopes
            self.slopes += (slots.nu + slots.nq) * slots.nq
        table = frames.scene.hinges.by_name[slots.name]
        stands = {cut.frame: cut.body for cut in frames.expanded.cuts}
        sides = [stands.get(body, body) for body in (split(table.inboard)[0], table.outboard_body)]
        inboard, outboard = (frames.positions.get(body, -1) if body != "ground" else -1
                             for body in sides)  # fmt: skip
        place = frames.hinge_position[slots.name]
        return CoupledHinge(place, inboard, outboard, self.curved.get(slots.name, -1))

    def _levels(
        self, coupling: Coupling, graph: Graph, slots: list[HingeSlots]
    ) -> tuple[Node, Node, Node]:
        """Value, rate, and the rate at rest."""

        def resolve(name: Name) -> Node:
            number, quantity, entry = coordinate(self.scene, name)
            own = self.frames.layout.hinges[self.scene.hinges.name(number)]
            return graph.element(quantity, (own.q if quantity == "q" else own.u) + entry)

        time, nothing = graph.element("t", 0), graph.constant(0)
        wanted = coupling.equals.build(graph, lambda _: time) if coupling.equals else nothing
        found = coupling.row.build(graph, resolve) - wanted
        if coupling.speeds is not None:
            return nothing, found, -wanted
        still = derivative(found, {time: 1})
        return found, derivative(found, self._motion(graph, slots, False)), still

    def _motion(self, graph: Graph, slots: list[HingeSlots], second: bool) -> _Seeds:
        """Rates of the time and of all coordinates, and where `second` of the rates of those, while
        no speed changes."""
        seeds: _Seeds = {graph.element("t", 0): 1}
        for one in slots:
            rates = _rates(graph, one)
            for i, rate in enumerate(rates):
                seeds[graph.element("q", one.q + i)] = rate
            if second and not one.straight:
                for i, rate in enumerate(rates):
                    change = graph.constant(0)
                    for j, other in enumerate(rates):
                        change = change + self._slope(graph, one, one.nu + j, i) * other
                    seeds[rate] = change
        return seeds

    def _along(self, graph: Graph, slots: HingeSlots, k: int) -> _Seeds:
        """What a speed alone moves."""
        seeds: _Seeds = {graph.element("u", slots.u + k): 1}
        if not slots.straight:
            for i, rate in enumerate(_rates(graph, slots)):
                seeds[rate] = self._slope(graph, slots, k, i)
        return seeds

    def _slope(self, graph: Graph, slots: HingeSlots, along: int, i: int) -> Node:
        """Slope of the rate of coordinate i: along a speed, behind them along a coordinate."""
        return graph.element(_SLOPES, self.curved[slots.name] + along * slots.nq + i)


def _rates(graph: Graph, slots: HingeSlots) -> list[Node]:
    """Rates of a hinge's coordinates."""
    if slots.straight:
        return [graph.element("u", slots.u + i) for i in range(slots.nq)]
    return [graph.element(_RATES, slots.q + i) for i in range(slots.nq)]
