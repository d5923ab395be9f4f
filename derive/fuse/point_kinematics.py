"""Position and motion of a body point as straight-line KernelIRs, from kinematics alone.

Only the path from the root to the body is evaluated.  A speed of a hinge on it moves the hinge's
body by H, in body axes, and the point with it as on a rigid body.
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
from .scene_kernels import FAILED, FusedSceneIR, inputs_of
from .schedule_interpreter import ScheduleInterpreter
from .sum_balancing import BalancedKernels

GIVEN_MOTION = Sweep(
    "given_motion", "Poses and velocities as they are given.", (*RATES.runs, Run(whole=POSES))
)


def fuse_points(structure: Structure, kernels: Kernels, body: int) -> FusedSceneIR:
    """Kernels of points of a rigid `body`; inputs p, t, q, u, memory and the end.

    The end is given by its offset (3) and axes (9) in body axes.  "pose": position (3) and
    axes (9) of the end.  "velocities": its velocity and angular velocity (6).  "jacobian": its
    columns by speed (6 x nu); "jacobian_rate": its time derivative along u.  Inertial axes;
    coordinates and speeds as given, also where they are prescribed or follow from closed loops.
    A failing guard does not name its cause: evaluate the looped engine for the message.
    """
    kernel_list = [
        _Point(structure, kernels, body).kernel(name)
        for name in ("pose", "velocities", "jacobian", "jacobian_rate")
    ]
    return FusedSceneIR(BalancedKernels(*kernel_list), ((0, -1, FAILED),))


class _Point:
    """One point and its kernels; each kernel starts a new graph to stay small."""

    def __init__(self, structure: Structure, kernels: Kernels, body: int) -> None:
        self._state = FusionState(structure, kernels, None)
        self._path = [body]
        while (parent := structure.bodies[self._path[-1]].parent) >= 0:
            self._path.append(parent)
        self._replay = ScheduleInterpreter(self._state, staged=False, way=self._path)
        self._replay.sweep(GIVEN_MOTION)
        end = self._state.graph.vector("end", 12)
        self._offset, self._axes = end[:3], end[3:]
        self._enter(body)
        self._position, self._velocity = self._point_motion()

    def kernel(self, name: str) -> KernelIR:
        state, s = self._state, self._state.structure
        outputs = {
            "pose": [Port("place", (3,)), Port("axes", (9,))],
            "velocities": [Port("velocity", (6,))],
        }.get(name, [Port("J", (6, s.nu))])
        for condition in self._replay.conditions:
            state.graph.guard(condition, FAILED, "the looped engine names what fails")
        values: dict[str, object] = getattr(self, f"_{name}")()
        inputs = [*inputs_of(s)[:-1], Port("end", (12,))]
        return state.graph.kernel(name, inputs, outputs, values, keep_order=True)

    def _pose(self) -> dict[str, object]:
        axes = self._run_frame_kernel("end_frame", A=self._body_slot("A", 9), R_end=self._axes)[
            "A_end"
        ]
        return {"place": self._position, "axes": axes}

    def _velocities(self) -> dict[str, object]:
        outputs = self._run_frame_kernel(
            "angular_motion", A=self._body_slot("A", 9), motion=self._body_slot("motion", 9),
            delta=self._state.zeros(6),
        )  # fmt: skip
        return {"velocity": [*self._velocity, *outputs["w_K"]]}

    def _jacobian(self) -> dict[str, object]:
        return self._columns_by_speed(rates=False)

    def _jacobian_rate(self) -> dict[str, object]:
        return self._columns_by_speed(rates=True)

    def _columns_by_speed(self, rates: bool) -> dict[str, object]:
        rows = [self._state.zeros(self._state.structure.nu) for _ in range(6)]
        for index in self._path:
            self._enter(index)
            body = self._replay.body
            for k in range(body.u, body.u + body.nu):
                column = self._rate(self._state.u[k]) if rates else self._column(self._state.u[k])
                for row, entry in zip(rows, column, strict=True):
                    row[k] = entry
        return {"J": rows}

    def _column(self, speed: Node) -> Nodes:
        """Jacobian column of a speed of the current hinge."""
        moves, turns = map(self._to_inertial, self._unit_motion(speed))
        return [*_add(moves, _cross_product(turns, self._arm())), *turns]

    def _rate(self, speed: Node) -> Nodes:
        """Time derivative of that column: axes rotate with the body, H depends on q."""
        body, state, w = self._replay.body, self._state, self._body_slot("motion", 9)[:3]
        seeds = dict(zip(state.q[body.q : body.q + body.nq], self._body_slot("qdot", body.nq),
                         strict=True))  # fmt: skip
        motion = self._unit_motion(speed)
        moves, turns = (
            self._to_inertial(_add(_cross_product(w, column), derivatives(column, seeds)))
            for column in motion
        )
        arm_rate = _subtract(self._velocity, self._to_inertial(self._body_slot("v", 3)))
        lever_rate = _add(
            _cross_product(turns, self._arm()),
            _cross_product(self._to_inertial(motion[1]), arm_rate),
        )
        return [*_add(moves, lever_rate), *turns]

    def _unit_motion(self, speed: Node) -> tuple[Nodes, Nodes]:
        """Velocity and angular velocity of the hinge's body per unit speed, body axes."""
        moves, turns = (self._replay.get(f"hinge.{name}", 3) for name in "vw")
        return derivatives(moves, {speed: 1}), derivatives(turns, {speed: 1})

    def _arm(self) -> Nodes:
        return _subtract(self._position, self._body_slot("x", 3))

    def _to_inertial(self, vector: Nodes) -> Nodes:
        """Vector transformed from axes of the current body to inertial axes."""
        a = self._body_slot("A", 9)
        return [_dot_product(a[row : row + 3], vector) for row in (0, 3, 6)]

    def _point_motion(self) -> tuple[Nodes, Nodes]:
        zeros = self._state.zeros
        outputs = self._run_frame_kernel(
            "point", A=self._body_slot("A", 9), x=self._body_slot("x", 3),
            v=self._body_slot("v", 3), motion=self._body_slot("motion", 9), delta=zeros(6),
            offset=self._offset, gravity=zeros(3),
        )  # fmt: skip
        return outputs["x_K"], outputs["v_K"]

    def _run_frame_kernel(self, name: str, **inputs: Nodes) -> Mapping[str, Nodes]:
        return self._state.inline.run(self._state.kernels(("sweep", "frames"), name), inputs)

    def _body_slot(self, name: str, size: int) -> Nodes:
        return self._replay.get(f"body.{name}", size)

    def _enter(self, index: int) -> None:
        self._replay.enter(self._replay.body_subject(index))


def _add(u: Nodes, v: Nodes) -> Nodes:
    return [a + b for a, b in zip(u, v, strict=True)]


def _subtract(u: Nodes, v: Nodes) -> Nodes:
    return [a - b for a, b in zip(u, v, strict=True)]


def _dot_product(u: Nodes, v: Nodes) -> Node:
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


def _cross_product(u: Nodes, v: Nodes) -> Nodes:
    (a, b, c), (x, y, z) = u, v
    return [b * z - c * y, c * x - a * z, a * y - b * x]
