"""Inverse dynamics and mass matrix of a tree without prescribed motion."""

from __future__ import annotations

from mstmm.ir import Port
from mstmm.ir.graph import Node
from mstmm.ir.inline import Nodes
from mstmm.ir.scene_structure import Structure

from ..schedule.mass_matrix import COMPOSITION, HINGE_EFFORTS, OUTBOARD_LOAD
from ..schedule.pass_steps import Pass
from ..schedule.sweeps import INVERSE_DYNAMICS
from .fusion_state import FusionState, Kernels
from .optimisation.sum_balancing import BalancedKernels
from .scene_kernels import FAILED, FusedSceneIR, inputs_of
from .schedule_interpreter import ScheduleInterpreter


def fuse_inverse(structure: Structure, kernels: Kernels) -> FusedSceneIR:
    """Kernels "required" and, for rigid bodies, "mass" of a scene without prescribed motion.

    "required": the efforts (nu) beyond those of the laws that give the accelerations a; of p,
    t, q, u, memory and a.  "mass": the mass matrix (nu x nu); same inputs, of which p and q are
    read.  A failing guard does not name its cause: evaluate the looped engine for the message.
    """
    state = FusionState(structure, kernels, None)
    state.efforts = state.zeros(structure.nu)
    replay = ScheduleInterpreter(state, staged=False, inverse=True)
    replay.sweep(INVERSE_DYNAMICS)
    for condition in replay.conditions:
        state.graph.guard(condition, FAILED, "the looped engine names what fails")
    inputs = [*inputs_of(structure)[:-1], Port("a", (structure.nu,))]
    outputs = [Port("required", (structure.nu,))]
    values: dict[str, object] = {"required": replay.collect("required")}
    kernel_list = [state.graph.kernel("required", inputs, outputs, values, keep_order=True)]
    if not any(body.modal for body in structure.bodies):
        state = FusionState(structure, kernels, None)
        square = [Port("M", (structure.nu, structure.nu))]
        matrix: dict[str, object] = {"M": _Composition(state).matrix()}
        kernel_list.append(state.graph.kernel("mass", inputs, square, matrix, keep_order=True))
    return FusedSceneIR(BalancedKernels(*kernel_list), ((0, -1, FAILED),))


class _Composition:
    """Composite inertias of a scene; mass matrix speed by speed as in mass_matrix.c."""

    def __init__(self, state: FusionState) -> None:
        self._structure, self._zeros = state.structure, state.zeros
        state.u = state.zeros(state.structure.nu)
        self._one, self._replay = state.one, ScheduleInterpreter(state, staged=False)
        self._replay.sweep(COMPOSITION)

    def matrix(self) -> list[Nodes]:
        """Rows of the mass matrix."""
        rows = [self._zeros(self._structure.nu) for _ in range(self._structure.nu)]
        for index, body in enumerate(self._structure.bodies):
            for k in range(body.nu):
                for column, load in self._loads_to_root(index, k):
                    rows[column][body.u + k] = rows[body.u + k][column] = load
        return rows

    def _loads_to_root(self, index: int, speed: int) -> list[tuple[int, Node]]:
        """(speed, load on it) from a hinge to the root for unit acceleration of one speed."""
        bodies, path = self._structure.bodies, [index]
        while bodies[path[-1]].parent >= 0:
            path.append(bodies[path[-1]].parent)
        for i in path:
            self._enter(i)
            self._replay.fill("body.e", self._zeros(6))
            self._replay.fill("body.given", self._zeros(bodies[i].nu))
        self._enter(index)
        self._replay.fill(f"body.given[{speed}]", [self._one])
        self._run_pass_at(OUTBOARD_LOAD, index)
        pairs = []
        for i in path:
            self._run_pass_at(HINGE_EFFORTS, i)
            loads = self._replay.get("body.required", bodies[i].nu)
            pairs += [(bodies[i].u + k, load) for k, load in enumerate(loads)]
        return pairs

    def _enter(self, index: int) -> None:
        self._replay.enter(self._replay.body_subject(index))

    def _run_pass_at(self, body_pass: Pass, index: int) -> None:
        self._enter(index)
        self._replay.steps(body_pass.steps)
