"""Corrections that close the loops of a scene, as straight-line KernelIRs.

The correction of the looped engine, evaluated once for position gaps and once for velocity errors;
see derive/schedule/loop_closure.py.
"""

from __future__ import annotations

from dataclasses import replace

from mstmm.ir import KernelIR, Port
from mstmm.ir.graph import Node
from mstmm.ir.scene_structure import ClosureStructure

from ..schedule.forward_kinematics import HINGE_MOTION
from ..schedule.pass_steps import Copy, Pass, Run, RunPass, Sweep
from ..schedule.sweeps import CORRECTION
from .constraint_slots import row_subject
from .fusion_state import FusionState
from .schedule_interpreter import ScheduleInterpreter

#: A change along the speeds moves the coordinates by the same relation q' = N u.
_INCREMENT_PASS = Pass(
    "increments", "body", "Change of the coordinates of a hinge and of modes.",
    (
        RunPass(whole=HINGE_MOTION, when="!section"),
        Copy(to="modes.qdot", source="modes.etad", when="modal"),
    ),
)  # fmt: skip
_INCREMENTS = Sweep("increments", "Change of the coordinates.", (Run(whole=_INCREMENT_PASS),))


def slips(state: FusionState, inputs: list[Port]) -> KernelIR:
    """Kernel "slips": speed correction du (nu) that removes velocity errors, and strain (1).

    The strain is the largest ratio of a row's rounding error to its pivot.
    """
    replay, strain = ScheduleInterpreter(state, level="velocity_error"), state.zero
    replay.sweep(CORRECTION)
    for row in range(len(state.structure.rows)):
        replay.enter(row_subject(state.structure.rows, row))
        share = replay.get("row.floor", 1)[0] * replay.get("row.inverse", 1)[0]
        strain = state.graph.call("max", strain, share)
    outputs = [Port("du", (state.structure.nu,)), Port("strain", (1,))]
    values: dict[str, object] = {"du": replay.collect("udot"), "strain": [strain]}
    return state.graph.kernel("slips", inputs, outputs, values, keep_order=True)


def gaps(state: FusionState, inputs: list[Port]) -> KernelIR:
    """Kernel "gaps": correction dq (nq) of the coordinates that closes gaps to first order.

    Further outputs, by closure and direction (6 each; a coupling uses the first of 6): the gap
    of satisfied rows and that of redundant rows (m, rad); for each row the other number is
    zero.
    """
    replay, closures = ScheduleInterpreter(state, level="position_gap"), state.structure.closures
    replay.sweep(CORRECTION)
    pairs = [pair for item in closures for pair in _closure_gaps(replay, item)]
    for item, lack in replay.lacks:
        replay.enter(row_subject(state.structure.rows, item.row))
        pairs += [_split_error(replay, item.row, lack), *[(state.zero, state.zero)] * 5]
    state.u = replay.collect("udot")
    increments = ScheduleInterpreter(state)
    increments.sweep(_INCREMENTS)
    outputs = [Port("dq", (state.structure.nq,)), Port("gap", (len(pairs),)),
               Port("apart", (len(pairs),))]  # fmt: skip
    values: dict[str, object] = {
        "dq": increments.collect("qdot"),
        "gap": [gap for gap, _ in pairs], "apart": [repeated for _, repeated in pairs],
    }  # fmt: skip
    return state.graph.kernel("gaps", inputs, outputs, values, keep_order=True)


def _closure_gaps(
    replay: ScheduleInterpreter, closure: ClosureStructure
) -> list[tuple[Node, Node]]:
    """(gap of a satisfied row, gap of a redundant row) for the six directions of a closure."""
    zero, pairs = replay.state.zero, list[tuple[Node, Node]]()
    subject = replay.body_subject(closure.frame)
    replay.enter(subject)
    n_free = replay.body.nu
    for direction, error in enumerate(replay.get("closure.l", 6)):
        row = closure.rows[direction]
        if row < -1:
            pairs.append((zero, zero))
            continue
        replay.enter(replace(subject, row=row))
        is_free = row < 0 and direction < n_free
        pairs.append((error, zero) if is_free else _split_error(replay, row, error))
    return pairs


def _split_error(replay: ScheduleInterpreter, row: int, error: Node) -> tuple[Node, Node]:
    """Error of the current row: first place if the row is active, else second place."""
    graph, zero = replay.state.graph, replay.state.zero
    inverse = replay.get("row.inverse", 1)[0] if row >= 0 else zero
    if inverse.value is not None:
        return zero, error
    is_active = graph.call("lt", zero, inverse)
    return graph.select(is_active, error, zero), graph.select(is_active, zero, error)
