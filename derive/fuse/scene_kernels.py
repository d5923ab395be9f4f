"""Fused engine: the whole sweep of one scene as straight-line KernelIRs, by value numbering.

The schedule is evaluated on one graph. Aligned axes, zero loads and planar motion fold at once, and
nodes that no acceleration needs are not emitted.  No SymPy.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from mstmm.ir import KernelIR, Port
from mstmm.ir.graph import Node
from mstmm.ir.inline import Nodes
from mstmm.ir.scene_structure import Structure

from ..schedule.inverse_dynamics import COMPOSITION, HINGE_EFFORTS, OUTBOARD_LOAD
from ..schedule.pass_steps import Pass
from ..schedule.sweeps import ACCELERATIONS, FACTORISATION, INVERSE_DYNAMICS, SOLUTION
from .fusion_state import FusionState, Kernels
from .loop_assembly import gaps, slips
from .schedule_interpreter import ScheduleInterpreter
from .sum_balancing import BalancedKernels, balance

#: Guard code of kernels that leave the failure message to the looped engine.
FAILED = 1

#: Power and potential are computed together with accelerations if they add at most this share of
#: operations: one function for both halves the compile time.
_MAX_EXTRA_SHARE = 0.03


@dataclass(frozen=True)
class FusedSceneIR:
    """Kernels of one scene.  Guard code 1 + k means failures[k] = (reason, element, code).

    If `power_is_cheap`, "accelerations_power" also serves as "accelerations".
    """

    kernels: Mapping[str, KernelIR]
    failures: tuple[tuple[int, int, int], ...]
    power_is_cheap: bool = False


def inputs_of(structure: Structure) -> list[Port]:
    """Inputs of every kernel of a scene: p, t, q, u, memory, efforts."""
    s = structure
    return [
        Port("p", (s.np,)), Port("t", (1,)), Port("q", (s.nq,)), Port("u", (s.nu,)),
        Port("memory", (s.n_memory,)), Port("efforts", (s.nu,)),
    ]  # fmt: skip


def fuse(
    structure: Structure, kernels: Kernels, numbers: Sequence[float] | None = None
) -> FusedSceneIR:
    """Kernels "accelerations" and, with laws or loads, "accelerations_power" of a scene.

    Closed loops add "gaps" and "slips" (see `loop_assembly`).  Inputs p, t, q, u, memory,
    efforts; outputs qdot, udot, and with power the power of everything that is not stored and
    the potential of springs and laws.  With `numbers` the parameters are compiled in as
    constants and p is not read.
    """
    state, s = FusionState(structure, kernels, numbers), structure
    replay = ScheduleInterpreter(state)
    replay.sweep(ACCELERATIONS)
    for _ in range(s.refines):  # same pivots as in the first solution: their nodes are shared
        state.given_accelerations = replay.collect("udot")
        replay = ScheduleInterpreter(state, refined=True)
        replay.sweep(ACCELERATIONS)
    outputs = [Port("qdot", (s.nq,)), Port("udot", (s.nu,))]
    sums = [Port("power", (1,)), Port("potential", (1,))]
    values: dict[str, object] = {
        "qdot": replay.collect("qdot"), "udot": replay.collect("udot"),
    }  # fmt: skip
    power: dict[str, object] = {port.name: replay.get(f"sums.{port.name}", 1) for port in sums}
    kernel_list = [
        state.graph.kernel("accelerations", inputs_of(s), outputs, values, keep_order=True)
    ]
    is_cheap = False
    flexible = any(body.modal is not None for body in s.bodies)
    if s.laws or s.driven or s.loads or s.forces or s.couplings or flexible:
        kernel_list.append(
            state.graph.kernel(
                "accelerations_power", inputs_of(s), [*outputs, *sums], values | power,
                keep_order=True,
            )
        )  # fmt: skip
        alone, with_power = (kernel.flops() for kernel in kernel_list)
        is_cheap = with_power <= (1 + _MAX_EXTRA_SHARE) * alone
    for fuse_correction in (gaps, slips) if s.closes else ():
        kernel_list.append(
            fuse_correction(FusionState(s, kernels, numbers, state.failures), inputs_of(s))
        )
    return FusedSceneIR(BalancedKernels(*kernel_list), tuple(state.failures), is_cheap)


def fuse_solution(structure: Structure, kernels: Kernels) -> KernelIR:
    """Kernel "solution": M^-1 times one column, and 1 if every pivot moves inertia.

    Inputs as those of "accelerations", of which p, q and memory are read, and the column.
    """
    state, s = FusionState(structure, kernels, None), structure
    state.u, state.efforts = state.zeros(s.nu), state.graph.vector("column", s.nu)
    replay = ScheduleInterpreter(state, staged=False)
    replay.sweep(FACTORISATION)
    replay.sweep(SOLUTION)
    holds = state.one
    for condition in replay.conditions:
        holds = state.graph.call("and", holds, condition)
    solution = state.graph.kernel(
        "solution",
        [*inputs_of(s), Port("column", (s.nu,))],
        [Port("answer", (s.nu + 1,))],
        {"answer": [*replay.collect("answer"), holds]},
        keep_order=True,
    )
    return balance(solution)


# --- inverse dynamics and mass matrix -------------------------------------------------------------


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
