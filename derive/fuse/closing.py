"""What brings a scene back to where its loops are closed, as straight-line KernelIRs.

The correction of the looped engine replayed once for gaps, once for slips; see
derive/schedule/loops.py.
"""

from __future__ import annotations

from dataclasses import replace

from mstmm.ir import KernelIR, Port
from mstmm.ir.graph import Node
from mstmm.ir.structure import ClosureStructure

from ..schedule.motion import HINGE_MOTION
from ..schedule.steps import Run, Sweep
from ..schedule.sweeps import CORRECTION
from .replay import Replay
from .state import FusionState

#: Coordinates follow a change along the speeds as they follow speeds.
_MOVED = Sweep("moved", "Change of the coordinates.", (Run(whole=HINGE_MOTION),))


def slips(state: FusionState, inputs: list[Port]) -> KernelIR:
    """Kernel "slips": the change of the speeds, du (nu), that stops the slip of closed loops."""
    replay = Replay(state, level="slipping")
    replay.sweep(CORRECTION)
    outputs, values = [Port("du", (state.structure.nu,))], {"du": replay.gathered("udot")}
    return state.graph.kernel("slips", inputs, outputs, dict(values), as_made=True)


def gaps(state: FusionState, inputs: list[Port]) -> KernelIR:
    """Kernel "gaps": the change of the coordinates, dq (nq), that closes gaps to first order.

    By closure and direction (6 each) follow the gap of what is met and that of what repeats others
    (m, rad); of each the other number is zero.
    """
    replay, closures = Replay(state, level="gaping"), state.structure.closures
    replay.sweep(CORRECTION)
    told = [pair for one in closures for pair in _told(replay, one)]
    state.u = replay.gathered("udot")
    moved = Replay(state)
    moved.sweep(_MOVED)
    outputs = [Port("dq", (state.structure.nq,)), Port("gap", (len(told),)),
               Port("apart", (len(told),))]  # fmt: skip
    values: dict[str, object] = {
        "dq": moved.gathered("qdot"),
        "gap": [met for met, _ in told], "apart": [repeated for _, repeated in told],
    }  # fmt: skip
    return state.graph.kernel("gaps", inputs, outputs, values, as_made=True)


def _told(replay: Replay, closure: ClosureStructure) -> list[tuple[Node, Node]]:
    """(gap of what is met, gap of what repeats others) of the six directions of a closure."""
    graph, zero, found = replay.state.graph, replay.state.zero, list[tuple[Node, Node]]()
    subject = replay.body_subject(closure.frame)
    replay.enter(subject)
    own = replay.body.nu
    for direction, known in enumerate(replay.get("closure.l", 6)):
        row = closure.rows[direction]
        if row < -1:
            found.append((zero, zero))
            continue
        replay.enter(replace(subject, row=row))
        inverse = replay.get("row.inverse", 1)[0] if row >= 0 else zero
        if inverse.value is not None:
            met = row < 0 and direction < own
            found.append((known, zero) if met else (zero, known))
        else:
            counts = graph.call("lt", zero, inverse)
            found.append((graph.select(counts, known, zero), graph.select(counts, zero, known)))
    return found
