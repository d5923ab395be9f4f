"""What brings a scene back to where its loops are closed, as straight-line KernelIRs.

The correction of the looped engine replayed once for gaps, once for slips; see
derive/schedule/loop_closure.py.
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

#: Coordinates follow a change along the speeds as they follow speeds.
_MOVED_ALONG = Pass(
    "moved", "body", "Change of the coordinates of a hinge and of modes.",
    (
        RunPass(whole=HINGE_MOTION, when="!section"),
        Copy(to="modes.qdot", source="modes.etad", when="modal"),
    ),
)  # fmt: skip
_MOVED = Sweep("moved", "Change of the coordinates.", (Run(whole=_MOVED_ALONG),))


def slips(state: FusionState, inputs: list[Port]) -> KernelIR:
    """Kernel "slips": the change of the speeds, du (nu), that stops the slip of closed loops, and
    the strain (1): the largest of what is rounding for a row in parts of its pivot."""
    replay, strain = ScheduleInterpreter(state, level="slipping"), state.zero
    replay.sweep(CORRECTION)
    for row in range(len(state.structure.rows)):
        replay.enter(row_subject(state.structure.rows, row))
        share = replay.get("row.floor", 1)[0] * replay.get("row.inverse", 1)[0]
        strain = state.graph.call("max", strain, share)
    outputs = [Port("du", (state.structure.nu,)), Port("strain", (1,))]
    values: dict[str, object] = {"du": replay.gathered("udot"), "strain": [strain]}
    return state.graph.kernel("slips", inputs, outputs, values, as_made=True)


def gaps(state: FusionState, inputs: list[Port]) -> KernelIR:
    """Kernel "gaps": the change of the coordinates, dq (nq), that closes gaps to first order.

    By closure and direction (6 each), and of couplings the first of 6 each, follow the gap of what
    is met and that of what repeats others (m, rad); of each the other number is zero.
    """
    replay, closures = ScheduleInterpreter(state, level="gaping"), state.structure.closures
    replay.sweep(CORRECTION)
    told = [pair for one in closures for pair in _told(replay, one)]
    for one, lack in replay.lacks:
        replay.enter(row_subject(state.structure.rows, one.row))
        told += [_met_or_apart(replay, one.row, lack), *[(state.zero, state.zero)] * 5]
    state.u = replay.gathered("udot")
    moved = ScheduleInterpreter(state)
    moved.sweep(_MOVED)
    outputs = [Port("dq", (state.structure.nq,)), Port("gap", (len(told),)),
               Port("apart", (len(told),))]  # fmt: skip
    values: dict[str, object] = {
        "dq": moved.gathered("qdot"),
        "gap": [met for met, _ in told], "apart": [repeated for _, repeated in told],
    }  # fmt: skip
    return state.graph.kernel("gaps", inputs, outputs, values, as_made=True)


def _told(replay: ScheduleInterpreter, closure: ClosureStructure) -> list[tuple[Node, Node]]:
    """(gap of what is met, gap of what repeats others) of the six directions of a closure."""
    zero, found = replay.state.zero, list[tuple[Node, Node]]()
    subject = replay.body_subject(closure.frame)
    replay.enter(subject)
    own = replay.body.nu
    for direction, known in enumerate(replay.get("closure.l", 6)):
        row = closure.rows[direction]
        if row < -1:
            found.append((zero, zero))
            continue
        replay.enter(replace(subject, row=row))
        met = row < 0 and direction < own
        found.append((known, zero) if met else _met_or_apart(replay, row, known))
    return found


def _met_or_apart(replay: ScheduleInterpreter, row: int, lack: Node) -> tuple[Node, Node]:
    """What the row at hand lacks: in the first place where it counts, else in the second."""
    graph, zero = replay.state.graph, replay.state.zero
    inverse = replay.get("row.inverse", 1)[0] if row >= 0 else zero
    if inverse.value is not None:
        return zero, lack
    counts = graph.call("lt", zero, inverse)
    return graph.select(counts, lack, zero), graph.select(counts, zero, lack)
