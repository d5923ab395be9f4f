"""Where a point of a body is and how it moves, as straight-line KernelIRs: kinematics alone.

The way from the root to the body is replayed, and nothing else of the scene.  A speed of a hinge on
it turns and moves the hinge's body by H, in its axes, and carries the point along rigidly.
"""

from __future__ import annotations

from collections.abc import Mapping

from mstmm.ir import KernelIR, Port
from mstmm.ir.differentiation import derivatives
from mstmm.ir.graph import Node
from mstmm.ir.inline import Nodes
from mstmm.ir.scene_structure import Structure

from ..schedule.forward_kinematics import POSES
from ..schedule.pass_steps import Run, Sweep
from .fusion_state import FusionState, Kernels
from .implicit_residual import RATES
from .optimisation.sum_balancing import BalancedKernels
from .scene_kernels import FAILED, FusedSceneIR, inputs_of
from .schedule_interpreter import ScheduleInterpreter

MOVED = Sweep("moved", "Poses and velocities as they are given.", (*RATES.runs, Run(whole=POSES)))


def fuse_points(structure: Structure, kernels: Kernels, body: int) -> FusedSceneIR:
    """Kernels about points of a rigid `body`, all of p, t, q, u, memory and the end: its offset (3)
    and its axes (9) in those of the body.

    "placed": place (3) and axes (9) of the end.  "moving": its velocity and angular velocity (6).
    "jacobian": what each speed adds to them (6 x nu), "jacobian_rate": the rate of that along u.
    Inertial axes; coordinates and speeds as they are given, those that drives impose or loops
    decide as well.  A guard that fails says no more than that the looped engine must be asked.
    """
    made = [
        _Point(structure, kernels, body).kernel(name)
        for name in ("placed", "moving", "jacobian", "jacobian_rate")
    ]
    return FusedSceneIR(BalancedKernels(*made), ((0, -1, FAILED),))


class _Point:
    """One point, with what a kernel asks of it; every kernel begins anew, so that it holds no more
    than it needs."""

    def __init__(self, structure: Structure, kernels: Kernels, body: int) -> None:
        self._state = FusionState(structure, kernels, None)
        self._way = [body]
        while (parent := structure.bodies[self._way[-1]].parent) >= 0:
            self._way.append(parent)
        self._replay = ScheduleInterpreter(self._state, staged=False, way=self._way)
        self._replay.sweep(MOVED)
        end = self._state.graph.vector("end", 12)
        self._offset, self._axes = end[:3], end[3:]
        self._enter(body)
        self._place, self._velocity = self._point()

    def kernel(self, name: str) -> KernelIR:
        state, s = self._state, self._state.structure
        outputs = {
            "placed": [Port("place", (3,)), Port("axes", (9,))],
            "moving": [Port("velocity", (6,))],
        }.get(name, [Port("J", (6, s.nu))])
        for condition in self._replay.conditions:
            state.graph.guard(condition, FAILED, "the looped engine names what fails")
        values: dict[str, object] = getattr(self, f"_{name}")()
        inputs = [*inputs_of(s)[:-1], Port("end", (12,))]
        return state.graph.kernel(name, inputs, outputs, values, as_made=True)

    def _placed(self) -> dict[str, object]:
        axes = self._frames("end_frame", A=self._get("A", 9), R_end=self._axes)["A_end"]
        return {"place": self._place, "axes": axes}

    def _moving(self) -> dict[str, object]:
        turning = self._frames("turning", A=self._get("A", 9), motion=self._get("motion", 9),
                               delta=self._state.zeros(6))  # fmt: skip
        return {"velocity": [*self._velocity, *turning["w_K"]]}

    def _jacobian(self) -> dict[str, object]:
        return self._by_speeds(rates=False)

    def _jacobian_rate(self) -> dict[str, object]:
        return self._by_speeds(rates=True)

    def _by_speeds(self, rates: bool) -> dict[str, object]:
        rows = [self._state.zeros(self._state.structure.nu) for _ in range(6)]
        for index in self._way:
            self._enter(index)
            body = self._replay.body
            for k in range(body.u, body.u + body.nu):
                column = self._rate(self._state.u[k]) if rates else self._column(self._state.u[k])
                for row, entry in zip(rows, column, strict=True):
                    row[k] = entry
        return {"J": rows}

    def _column(self, speed: Node) -> Nodes:
        """What a speed of the hinge at hand adds to the point's motion."""
        moves, turns = map(self._turned, self._own(speed))
        return [*_sum(moves, _cross(turns, self._arm())), *turns]

    def _rate(self, speed: Node) -> Nodes:
        """The rate of that: axes turn with the body, and H along its own coordinates."""
        body, state, w = self._replay.body, self._state, self._get("motion", 9)[:3]
        along = dict(zip(state.q[body.q : body.q + body.nq], self._get("qdot", body.nq),
                         strict=True))  # fmt: skip
        own = self._own(speed)
        moves, turns = (
            self._turned(_sum(_cross(w, column), derivatives(column, along))) for column in own
        )
        arm_rate = _difference(self._velocity, self._turned(self._get("v", 3)))
        carried = _sum(_cross(turns, self._arm()), _cross(self._turned(own[1]), arm_rate))
        return [*_sum(moves, carried), *turns]

    def _own(self, speed: Node) -> tuple[Nodes, Nodes]:
        """How a speed of the hinge at hand moves the hinge's body and turns it, in its axes."""
        moves, turns = (self._replay.get(f"hinge.{name}", 3) for name in "vw")
        return derivatives(moves, {speed: 1}), derivatives(turns, {speed: 1})

    def _arm(self) -> Nodes:
        return _difference(self._place, self._get("x", 3))

    def _turned(self, vector: Nodes) -> Nodes:
        """A vector in axes of the body at hand, in inertial ones."""
        a = self._get("A", 9)
        return [_dot(a[row : row + 3], vector) for row in (0, 3, 6)]

    def _point(self) -> tuple[Nodes, Nodes]:
        zeros = self._state.zeros
        found = self._frames(
            "point", A=self._get("A", 9), x=self._get("x", 3), v=self._get("v", 3),
            motion=self._get("motion", 9), delta=zeros(6), offset=self._offset, gravity=zeros(3),
        )  # fmt: skip
        return found["x_K"], found["v_K"]

    def _frames(self, name: str, **given: Nodes) -> Mapping[str, Nodes]:
        return self._state.inline.run(self._state.kernels(("sweep", "frames"), name), given)

    def _get(self, name: str, size: int) -> Nodes:
        return self._replay.get(f"body.{name}", size)

    def _enter(self, index: int) -> None:
        self._replay.enter(self._replay.body_subject(index))


def _sum(one: Nodes, other: Nodes) -> Nodes:
    return [a + b for a, b in zip(one, other, strict=True)]


def _difference(one: Nodes, other: Nodes) -> Nodes:
    return [a - b for a, b in zip(one, other, strict=True)]


def _dot(one: Nodes, other: Nodes) -> Node:
    return one[0] * other[0] + one[1] * other[1] + one[2] * other[2]


def _cross(one: Nodes, other: Nodes) -> Nodes:
    (a, b, c), (x, y, z) = one, other
    return [b * z - c * y, c * x - a * z, a * y - b * x]
