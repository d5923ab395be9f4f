"""Flexible bodies of a fused scene: the modal steps of the sweep, replayed on the fused graph."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from mstmm.ir.graph import Node
from mstmm.ir.structure import ModalStructure, SectionStructure

from .inline import Guarding, Nodes
from .state import FusionState

#: Reasons of a failure, as the looped engine numbers them.
SECTION, MODES = 7, 8


@dataclass
class ModalNodes:
    """Modal rows of a flexible body while the sweep runs; `rows` are S_rf as it is condensed."""

    s_rf: Nodes
    s_ff: Nodes
    e_f: Nodes
    gain: Nodes = field(default_factory=list)
    etadd: Nodes = field(default_factory=list)


class ModalPass:
    """The modal steps, by body."""

    def __init__(self, fusion: FusionState) -> None:
        self.fusion = fusion
        self.modes: dict[int, ModalNodes] = {}
        self.subspaces: dict[int, Nodes] = {}

    def _run(self, name: str, n: int, **inputs: Sequence[Node]) -> dict[str, Nodes]:
        return self._guarded(None, name, n, **inputs)

    def _guarded(
        self, guard: Guarding | None, name: str, n: int, **inputs: Sequence[Node]
    ) -> dict[str, Nodes]:
        f = self.fusion
        return f.inline.run(f.kernels(("sweep", "modal"), name), inputs, guard, n=n)

    def _coordinates(self, modal: ModalStructure) -> tuple[Nodes, Nodes]:
        f, n = self.fusion, modal.n
        return f.q[modal.q : modal.q + n], f.u[modal.u : modal.u + n]

    def hinge(self, index: int, section: SectionStructure) -> dict[str, Nodes]:
        """Motion across a section, as the kernel of a hinge without speeds gives it."""
        f = self.fusion
        modal = f.structure.bodies[section.frame].modal
        assert modal is not None
        eta, etad = self._coordinates(modal)
        numbers = {name: f.entries(entries) for name, entries in section.numbers}
        found = self._run("section", modal.n, eta=eta, etad=etad, **numbers)
        idle = f.structure.bodies[index].idle
        motion = self._guarded(
            None if idle else lambda c, code: f.fail_unless(c, SECTION, index, code),
            "inward" if section.inward else "outward", modal.n,
            R_end=f.entries(section.end),
            **{name: found[name] for name in ("x", "Psi", "xd", "Psid", "xdd", "Psidd")},
        )  # fmt: skip
        self.subspaces[index] = self._run("subspace", modal.n, H6=motion["H6"], Phi=found["Phi"])[
            "H"
        ]
        return {name: motion[name] for name in ("R", "d", "v", "w", "c")} | {"H": [], "qdot": []}

    def own(self, index: int, modal: ModalStructure, motion: Nodes) -> tuple[Nodes, Nodes]:
        """S and e of a flexible body before anything hangs on it; keeps its modal rows."""
        f = self.fusion
        eta, etad = self._coordinates(modal)
        numbers = {name: f.entries(entries) for name, entries in modal.moments}
        k, d = f.entries(modal.stiffness), f.entries(modal.damping)
        found = self._run(
            "residual", modal.n, K=k, D=d, eta=eta, etad=etad, motion=motion, **numbers
        )
        efforts = f.efforts[modal.u : modal.u + modal.n]
        load = [a - b for a, b in zip(found["e_f"], efforts, strict=True)]
        self.modes[index] = ModalNodes(found["S_rf"], found["S_ff"], load)
        energy = self._run("strain_energy", modal.n, K=k, D=d, eta=eta, etad=etad)
        f.potential = f.potential + energy["V"][0]
        f.power = f.power - energy["W_d"][0]
        return found["S"], found["e"]

    def absorb(self, index: int, frame: int, rotation: Nodes, shift: Nodes) -> None:
        """What hangs on an end, seen by the modes of the body that it belongs to."""
        modes, nodes = self.modes[frame], self.fusion.bodies[index]
        found = self._run(
            "absorb", len(modes.e_f), Rc=rotation, r=shift, H=self.subspaces[index],
            S=nodes.inertia, e=nodes.load,
        )  # fmt: skip
        modes.s_rf = _sum(modes.s_rf, found["S_rf"])
        modes.s_ff = _sum(modes.s_ff, found["S_ff"])
        modes.e_f = _sum(modes.e_f, found["e_f"])

    def condense(self, index: int, inertia: Nodes, load: Nodes) -> tuple[Nodes, Nodes]:
        """S and e of a flexible body without its modes."""
        f, modes = self.fusion, self.modes[index]
        n, rows = len(modes.e_f), modes.s_rf
        if index in self.subspaces:
            found = self._run(
                "rebase", n, H=self.subspaces[index], S=inertia, e=load, S_rf=modes.s_rf
            )
            rows = found["S_rf_I"]
            modes.s_ff = _sum(modes.s_ff, found["S_ff"])
            modes.e_f = _sum(modes.e_f, found["e_f"])
        found = self._guarded(
            lambda condition, code: f.fail_unless(condition, MODES, index, code), "condense", n,
            S=inertia, e=load, S_rf=rows, S_ff=modes.s_ff, e_f=modes.e_f,
        )  # fmt: skip
        modes.gain = found["Gg"]
        return found["S_c"], found["e_c"]

    def recover(self, index: int, delta: Nodes) -> Nodes:
        """Modal accelerations kept; the deviation of the frame with the modes' part."""
        modes = self.modes[index]
        n = len(modes.e_f)
        modes.etadd = self._run("recover", n, Gg=modes.gain, delta_I=delta)["etadd"]
        return self.follow(index, index, delta) if index in self.subspaces else delta

    def follow(self, index: int, frame: int, delta: Nodes) -> Nodes:
        """Deviation of what passes a section, with the modes' part."""
        etadd = self.modes[frame].etadd
        return self._run(
            "displaced", len(etadd), H=self.subspaces[index], etadd=etadd, delta_I=delta
        )["delta"]

    def drag(self, index: int, modal: ModalStructure, v: Nodes) -> None:
        """Viscous drag: momentum under its density."""
        f, nodes = self.fusion, self.fusion.bodies[index]
        eta, etad = self._coordinates(modal)
        numbers = {name: f.entries(entries) for name, entries in modal.drag}
        found = self._run(
            "momentum", modal.n, eta=eta, etad=etad, v=v, w=nodes.motion[:3], **numbers
        )
        nodes.load = _sum(nodes.load, found["h"])
        self.modes[index].e_f = _sum(self.modes[index].e_f, found["h_f"])
        f.power = f.power - (found["T"][0] + found["T"][0])


def _sum(a: Nodes, b: Nodes) -> Nodes:
    return [x + y for x, y in zip(a, b, strict=True)]
