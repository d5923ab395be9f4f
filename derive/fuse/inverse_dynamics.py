"""Inverse dynamics and mass matrix of a tree that nothing drives, as straight-line KernelIRs."""

from __future__ import annotations

from mstmm.ir import Port
from mstmm.ir.graph import Node
from mstmm.ir.inline import Nodes
from mstmm.ir.scene_structure import Structure

from ..schedule.mass_matrix import COMPOSITION, EXERTED, FELT_BY
from ..schedule.pass_steps import Pass
from ..schedule.sweeps import INVERSE_DYNAMICS
from .fusion_state import FusionState, Kernels
from .optimisation.sum_balancing import BalancedKernels
from .scene_kernels import FAILED, FusedSceneIR, inputs_of
from .schedule_interpreter import ScheduleInterpreter


def fuse_inverse(structure: Structure, kernels: Kernels) -> FusedSceneIR:
    """Kernels "required" and, of rigid bodies, "mass".  The scene has no drives.

    "required": the efforts (nu) beyond the laws' own that give the accelerations a; of p, t, q, u,
    memory and a.  "mass": the mass matrix (nu x nu), of the same, of which p and q are read.  A
    guard that fails says no more than that the looped engine must be asked.
    """
    state = FusionState(structure, kernels, None)
    state.efforts = state.zeros(structure.nu)
    replay = ScheduleInterpreter(state, staged=False, inverse=True)
    replay.sweep(INVERSE_DYNAMICS)
    for condition in replay.conditions:
        state.graph.guard(condition, FAILED, "the looped engine names what fails")
    inputs = [*inputs_of(structure)[:-1], Port("a", (structure.nu,))]
    outputs = [Port("required", (structure.nu,))]
    values: dict[str, object] = {"required": replay.gathered("required")}
    made = [state.graph.kernel("required", inputs, outputs, values, as_made=True)]
    if not any(body.modal for body in structure.bodies):
        state = FusionState(structure, kernels, None)
        square = [Port("M", (structure.nu, structure.nu))]
        matrix: dict[str, object] = {"M": _Composition(state).matrix()}
        made.append(state.graph.kernel("mass", inputs, square, matrix, as_made=True))
    return FusedSceneIR(BalancedKernels(*made), ((0, -1, FAILED),))


class _Composition:
    """The composed inertias of a scene; then a speed at a time, as mass_matrix.c of the engine
    goes."""

    def __init__(self, state: FusionState) -> None:
        self._structure, self._zeros = state.structure, state.zeros
        state.u = state.zeros(state.structure.nu)
        self._one, self._replay = state.one, ScheduleInterpreter(state, staged=False)
        self._replay.sweep(COMPOSITION)

    def matrix(self) -> list[Nodes]:
        """Rows of the mass matrix."""
        found = [self._zeros(self._structure.nu) for _ in range(self._structure.nu)]
        for index, body in enumerate(self._structure.bodies):
            for k in range(body.nu):
                for other, load in self._felt(index, k):
                    found[other][body.u + k] = found[body.u + k][other] = load
        return found

    def _felt(self, index: int, speed: int) -> list[tuple[int, Node]]:
        """(speed, load on it) from a hinge to the root, where one speed changes at 1 a second."""
        bodies, way = self._structure.bodies, [index]
        while bodies[way[-1]].parent >= 0:
            way.append(bodies[way[-1]].parent)
        for place in way:
            self._enter(place)
            self._replay.fill("body.e", self._zeros(6))
            self._replay.fill("body.given", self._zeros(bodies[place].nu))
        self._enter(index)
        self._replay.fill(f"body.given[{speed}]", [self._one])
        self._at(EXERTED, index)
        found = []
        for place in way:
            self._at(FELT_BY, place)
            loads = self._replay.get("body.required", bodies[place].nu)
            found += [(bodies[place].u + k, load) for k, load in enumerate(loads)]
        return found

    def _enter(self, index: int) -> None:
        self._replay.enter(self._replay.body_subject(index))

    def _at(self, whole: Pass, index: int) -> None:
        self._enter(index)
        self._replay.steps(whole.steps)
