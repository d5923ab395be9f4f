"""Fused engine: the whole sweep of one scene as straight-line KernelIRs, by value numbering.

The element kernels are replayed in the order in which the looped engine calls them, but on the
nodes of one graph: axes that are aligned, loads that are zero and motions that stay in a plane fold
away as they arise, and what no acceleration needs is never emitted.  No SymPy.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction

from mstmm.errors import ElementError
from mstmm.ir import KernelIR, Port
from mstmm.ir.graph import Node
from mstmm.ir.structure import BodyStructure, Structure, angle_of

from .inline import Nodes
from .loads import LoadPass
from .modal import ModalPass
from .passes.balance import balance
from .state import BodyNodes, FusionState, Kernels
from .transport import stages_of

#: Reasons of a failure, as the looped engine numbers them.
UNDETERMINED, HINGE = 1, 4
#: A pivot must exceed this share of the mean inertia of the body it moves.
PIVOT_FLOOR = Fraction(1, 10**14)


@dataclass(frozen=True)
class Fused:
    """Kernels of one scene.  Guard code 1 + k stands for failures[k] = (reason, element, code)."""

    kernels: dict[str, KernelIR]
    failures: tuple[tuple[int, int, int], ...]


def fuse(structure: Structure, kernels: Kernels, numbers: Sequence[float] | None = None) -> Fused:
    """Kernel "accelerations" of a scene, and "accelerations_power" where there are laws or loads.

    Inputs p, t, q, u, memory, efforts; outputs qdot, udot, and with power the power of everything
    that is not stored and the potential of springs and laws.  With `numbers` the parameters are
    baked in as constants and p is not read.
    """
    return _Fusion(structure, kernels, numbers).run()


class _Fusion(FusionState):
    """One replay of the sweep: forward, laws and loads, condense, recover."""

    def __init__(
        self, structure: Structure, kernels: Kernels, numbers: Sequence[float] | None
    ) -> None:
        super().__init__(structure, kernels, numbers)
        self.modal = ModalPass(self)

    # --- passes ----------------------------------------------------------------------------------

    def run(self) -> Fused:
        imposed = self._drives()
        ground = [*self.zeros(6), *(-g for g in self.entries(self.structure.gravity))]
        qdot, udot = self.zeros(self.structure.nq), self.zeros(self.structure.nu)
        for index, body in enumerate(self.structure.bodies):
            nodes = self._forward(index, body, imposed, ground)
            self.bodies.append(nodes)
            qdot[body.q : body.q + body.nq] = nodes.hinge["qdot"]
            if body.modal is not None:
                first, n = body.modal.u, body.modal.n
                qdot[body.modal.q : body.modal.q + n] = self.u[first : first + n]
        LoadPass(self, self.modal).run()
        for index in reversed(range(len(self.bodies))):
            self._condense(index)
        for index, body in enumerate(self.structure.bodies):
            self._recover(index)
            udot[body.u : body.u + body.nu] = self.bodies[index].udot
            if body.modal is not None:
                accelerations = self.modal.modes[index].etadd
                udot[body.modal.u : body.modal.u + body.modal.n] = accelerations
        self._drive_power()
        return self._kernels(qdot, udot)

    def _drives(self) -> dict[tuple[int, int], Node]:
        """Driven coordinates and speeds filled in; prescribed accelerations by (body, speed)."""
        if self.structure.drives is None:
            return {}
        flat = self.expression(self.structure.drives)
        imposed = {}
        for k, (index, speed) in enumerate(self.structure.driven):
            body = self.structure.bodies[index]
            self.q[body.q + speed], self.u[body.u + speed] = flat[3 * k], flat[3 * k + 1]
            imposed[index, speed] = flat[3 * k + 2]
        return imposed

    def _forward(
        self,
        index: int,
        body: BodyStructure,
        imposed: dict[tuple[int, int], Node],
        ground: Nodes,
    ) -> BodyNodes:
        """Hinge motion, bias motion, own inertia and own load of a body."""
        hinge = self._hinge(index, body)
        s = [imposed.get((index, k), self.zero) for k in range(body.nu)]
        stages = stages_of(self, body, hinge)
        motion = self.bodies[body.parent].motion if body.parent >= 0 else ground
        for stage in stages[:-1]:
            motion = stage.motion(motion)
        motion = stages[-1].motion_behind_hinge(motion, hinge, s)
        if not any(body.imposed) and not any(self._moves(x) for x in body.rotor):
            self._stop_free_directions(hinge["H"], motion, s)
        own, load = self._own(index, body, motion)
        tau = self.efforts[body.u : body.u + body.nu]
        none: Nodes = []
        axial = stages[-1].keeps(hinge["H"])
        return BodyNodes(stages, axial, hinge, s, motion, own, load, own, tau, {}, none, none)

    def _own(self, index: int, body: BodyStructure, motion: Nodes) -> tuple[Nodes, Nodes]:
        """S and e of the body alone at its bias motion."""
        if body.modal is not None:
            return self.modal.own(index, body.modal, motion)
        p = self.entries(body.body_p)
        own = self.inline.run(self.kernels(body.body, "inertia"), {"p": p})["S"]
        load = self.inline.run(self.kernels(body.body, "bias_load"), {"p": p, "motion": motion})
        return own, load["e"]

    def _hinge(self, index: int, body: BodyStructure) -> dict[str, Nodes]:
        """Outputs of the hinge kernel; behind a link the constant part of its screw included."""
        if body.section is not None:
            return self.modal.hinge(index, body.section)

        def run(q: Nodes) -> dict[str, Nodes]:
            return self.inline.run(
                self.kernels(body.hinge, "hinge"),
                {"p": self.entries(body.hinge_p), "q": q, "u": u},
                lambda condition, code: self.fail_unless(condition, HINGE, index, code),
            )

        q, u = self.q[body.q : body.q + body.nq], self.u[body.u : body.u + body.nu]
        hinge = run(q)
        if body.link:
            angle, shift = self.entries(body.link[3:])
            x, y, z = hinge["d"]
            hinge["d"] = [x, y, z + shift]
            if angle.value != 0:
                place = angle_of(body.hinge)
                turned = [x + angle if k == place else x for k, x in enumerate(q)]
                hinge["R"] = run(turned)["R"]
        return hinge

    @staticmethod
    def _moves(entry: float | int) -> bool:
        """Whether an entry is anything but a structural zero."""
        return isinstance(entry, int) or entry != 0.0

    def _stop_free_directions(self, subspace: Nodes, motion: Nodes, s: Nodes) -> None:
        """Choose the bias motion: the deviations from it are recovered whatever it is.

        Along a free unit direction of H the speed's own acceleration s can cancel what the carrier
        brings along; the zeros that this leaves in the bias motion fold away behind it.  (Not with
        rotor inertia, whose effort goes with the whole acceleration.)
        """
        nu = len(s)
        for k in range(nu):
            column = subspace[k::nu]
            units = [row for row in range(6) if column[row].value == 1]
            if len(units) == 1 and sum(x.value == 0 for x in column) == 5:
                place = units[0] + 6 if units[0] < 3 else units[0]  # motion is w, wd, rdd
                s[k] = -motion[place]
                motion[place] = self.zero

    def free(self, index: int) -> list[int]:
        """Speeds of a body's hinge that no drive prescribes."""
        body = self.structure.bodies[index]
        return [k for k in range(body.nu) if not body.imposed[k]]

    def _free_subspace(self, index: int) -> Nodes:
        body, h = self.structure.bodies[index], self.bodies[index].hinge["H"]
        return [h[row * body.nu + k] for row in range(6) for k in self.free(index)]

    def _condense(self, index: int) -> None:
        """Eliminate the free speeds, then carry S and e to the parent."""
        body, nodes = self.structure.bodies[index], self.bodies[index]
        if body.idle:
            return
        if body.modal is not None:
            nodes.inertia, nodes.load = self.modal.condense(index, nodes.inertia, nodes.load)
        inertia, load = nodes.inertia, nodes.load
        if body.section is not None and not body.section.inward:
            stage = nodes.stages[-1]
            self.modal.absorb(index, body.parent, stage.rotation, stage.position)
        if nodes.axial:
            inertia, load = nodes.stages[-1].condense(inertia, load)
        if self.free(index):
            inertia, load = self._eliminate(index, inertia, load)
        if body.parent < 0:
            return
        for stage in reversed(nodes.stages[:-1] if nodes.axial else nodes.stages):
            inertia, load = stage.condense(inertia, load)
        parent = self.bodies[body.parent]
        parent.inertia = [a + b for a, b in zip(parent.inertia, inertia, strict=True)]
        parent.load = [a + b for a, b in zip(parent.load, load, strict=True)]

    def _eliminate(self, index: int, inertia: Nodes, load: Nodes) -> tuple[Nodes, Nodes]:
        body, nodes, free = self.structure.bodies[index], self.bodies[index], self.free(index)
        rotor = self.entries(body.rotor)
        given: dict[str, Sequence[Node]] = {
            "S": inertia, "e": load, "tau": [nodes.tau[k] for k in free],
        }  # fmt: skip
        kernel = self._own_elimination(body) if len(free) == body.nu else None
        if kernel is not None and all(x.value == 0 for x in rotor):
            given |= {"p": self.entries(body.hinge_p), "q": self.q[body.q : body.q + body.nq]}
        else:
            kernel = self.kernels(("sweep", f"generic{len(free)}"), "eliminate")
            given |= {"H": self._free_subspace(index), "J": [rotor[k] for k in free]}
        found = self.inline.run(kernel, given, self._pivot_guard(index))
        self._floor(index, found["D_ii"])
        nodes.eliminated = found
        return found["S_Q"], found["e_Q"]

    def _own_elimination(self, body: BodyStructure) -> KernelIR | None:
        """Elimination specialised to the hinge; definitions of earlier versions have none."""
        try:
            return self.kernels(body.hinge, "eliminate")
        except ElementError:
            return None

    def _pivot_guard(self, index: int) -> Callable[[Node, int], None]:
        def guard(condition: Node, code: int) -> None:
            if condition.op == "lt" and condition.args[0].value == 0:
                return  # the floor below asks for more
            self.fail_unless(condition, UNDETERMINED, index, code)

        return guard

    def _floor(self, index: int, pivots: Nodes) -> None:
        """Every diagonal entry of D against the mean inertia of the body itself."""
        nodes, free = self.bodies[index], self.free(index)
        own, h = nodes.own, self._free_subspace(index)
        diagonal = (0, 6, 11, 15, 18, 20)
        mass, inertia = (
            self.graph.constant(PIVOT_FLOOR / 3) * self._mean_of(own, nodes.inertia, places)
            for places in (diagonal[:3], diagonal[3:])
        )
        for i, pivot in enumerate(pivots):
            column = h[i :: len(free)]
            moves = any(x.value != 0 for x in column[:3])
            self.fail_unless(
                self.graph.call("lt", mass if moves else inertia, pivot), UNDETERMINED, index, 1
            )

    @staticmethod
    def _mean_of(own: Nodes, whole: Nodes, places: tuple[int, ...]) -> Node:
        """Sum over the body's own entries; over all that hangs on it where it has none."""
        a, b, c = places
        total = own[a] + own[b] + own[c]
        return total if total.value != 0 else whole[a] + whole[b] + whole[c]

    def _recover(self, index: int) -> None:
        body, nodes = self.structure.bodies[index], self.bodies[index]
        delta = self.bodies[body.parent].delta if body.parent >= 0 else self.zeros(6)
        for stage in nodes.stages[:-1]:
            delta = stage.delta(delta)
        free = self.free(index)
        last = nodes.stages[-1]
        known = self._free_subspace(index), nodes.eliminated
        if nodes.axial:
            rates, delta = last.still().delta_behind_hinge(delta, *known)
            nodes.delta = last.delta(delta)
        else:
            rates, nodes.delta = last.delta_behind_hinge(delta, *known)
        if body.modal is not None:
            nodes.delta = self.modal.recover(index, nodes.delta)
        elif body.section is not None:
            nodes.delta = self.modal.follow(index, body.section.frame, nodes.delta)
        nodes.udot = list(nodes.s)
        for k, rate in zip(free, rates, strict=True):
            nodes.udot[k] = nodes.s[k] + rate

    def _drive_power(self) -> None:
        """Power that drives feed in: tau_d . u_d with tau_d = H_d^T f + J udot - given."""
        for body, nodes in zip(self.structure.bodies, self.bodies, strict=True):
            if not any(body.imposed):
                continue
            load = self.frames(
                "reaction", S=nodes.inertia, e=nodes.load, delta=nodes.delta, A=self.identity()
            )["f"]
            tau = self.sweep(body.nu, "effort", H=nodes.hinge["H"], f=load)["tau"]
            rotor = self.entries(body.rotor)
            for k in range(body.nu):
                if body.imposed[k]:
                    effort = tau[k] + rotor[k] * nodes.udot[k] - nodes.tau[k]
                    self.power = self.power + effort * self.u[body.u + k]

    def _kernels(self, qdot: Nodes, udot: Nodes) -> Fused:
        s = self.structure
        inputs = [
            Port("p", (s.np,)), Port("t", (1,)), Port("q", (s.nq,)), Port("u", (s.nu,)),
            Port("memory", (s.n_memory,)), Port("efforts", (s.nu,)),
        ]  # fmt: skip
        outputs = [Port("qdot", (s.nq,)), Port("udot", (s.nu,))]
        sums = [Port("power", (1,)), Port("potential", (1,))]
        values: dict[str, object] = {"qdot": qdot, "udot": udot}
        power: dict[str, object] = {"power": [self.power], "potential": [self.potential]}
        found = [self.graph.kernel("accelerations", inputs, outputs, values, as_made=True)]
        if s.laws or s.driven or s.loads or s.forces or self.modal.modes:
            wide = self.graph.kernel(
                "accelerations_power", inputs, [*outputs, *sums], values | power, as_made=True
            )
            found.append(wide)
        return Fused(
            {kernel.name: balance(kernel) for kernel in found},
            tuple(self.failures),
        )
