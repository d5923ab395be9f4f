"""Fused engine: the whole sweep of one scene as straight-line KernelIRs, by value numbering.

The schedule is evaluated on one graph. Aligned axes, zero loads and planar motion fold at once, and
nodes that no acceleration needs are not emitted.  No SymPy.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from mstmm.ir import KernelIR, Port
from mstmm.ir.scene_structure import Structure

from ..schedule.sweeps import ACCELERATIONS, FACTORISATION, SOLUTION
from .fusion_state import FusionState, Kernels
from .loop_assembly import gaps, slips
from .optimisation.sum_balancing import BalancedKernels, balance
from .schedule_interpreter import ScheduleInterpreter

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
