"""Laws, loads and force elements of a fused scene: what acts on efforts and on e before the sweep.

The same kernels in the same order as the looped engine's law and load passes; poses and velocities
are replayed too, and whatever no load needs of them is never emitted.
"""

from __future__ import annotations

from dataclasses import dataclass

from mstmm.ir.graph import Node
from mstmm.ir.structure import ForceStructure, LawStructure, LoadStructure

from .inline import Nodes
from .modal import ModalPass
from .state import FusionState

#: Reason of a failing force element, as the looped engine numbers it.
FORCE = 2


@dataclass
class _Pose:
    """Axes (9), position and velocity of P of a body, inertial axes."""

    axes: Nodes
    x: Nodes
    v: Nodes


class LoadPass:
    """Adds laws to the efforts, loads and forces to e, their power and potential to the sums."""

    def __init__(self, fusion: FusionState, modal: ModalPass) -> None:
        self.fusion, self.modal = fusion, modal
        self.values: Nodes = []
        self._poses: dict[int, _Pose] = {}

    def run(self) -> None:
        f = self.fusion
        for effort, speed in zip(f.efforts, f.u, strict=True):
            f.power = f.power + effort * speed
        if f.structure.values is not None:
            self.values = f.expression(f.structure.values)
        for law in f.structure.laws:
            self._law(law)
        for index, body in enumerate(f.structure.bodies):
            if body.modal is not None and body.modal.drag:
                self.modal.drag(index, body.modal, self._pose(index).v)
        for load in f.structure.loads:
            self._load(load)
        for index, force in enumerate(f.structure.forces):
            self._force(index, force)

    def _value(self, place: int) -> Node:
        return self.values[place] if place >= 0 else self.fusion.zero

    def _law(self, law: LawStructure) -> None:
        f = self.fusion
        body, nodes = f.structure.bodies[law.body], f.bodies[law.body]
        kernel = f.kernels(("sweep", "laws"), law.kernel)
        q, u = body.q + law.coordinate, body.u + law.speed
        nq = next(p.length() for p in kernel.inputs if p.name == "q")
        inputs = {
            "p": f.entries(law.p),
            "q": f.q[q : q + nq],
            "u": f.u[u : u + law.n],
            "effort": [self._value(place) for place in law.effort],
        }
        if law.axes:
            inputs |= {"B": f.entries(law.axes), "twist_ref": [f.memory[law.twist]]}
        found = f.inline.run(kernel, inputs)
        for k, tau in enumerate(found["tau"]):
            nodes.tau[law.speed + k] = nodes.tau[law.speed + k] + tau
        f.power = f.power + found["P"][0]
        f.potential = f.potential + found["V"][0]

    # --- poses -----------------------------------------------------------------------------------

    def _pose(self, index: int) -> _Pose:
        """Pose of a body, those of its ancestors first (no recursion)."""
        f = self.fusion
        if index < 0:
            return _Pose(f.identity(), f.zeros(3), f.zeros(3))
        path = []
        while index >= 0 and index not in self._poses:
            path.append(index)
            index = f.structure.bodies[index].parent
        for i in reversed(path):
            self._poses[i] = self._next_pose(i)
        return self._poses[path[0]] if path else self._poses[index]

    def _next_pose(self, index: int) -> _Pose:
        f = self.fusion
        body, nodes = f.structure.bodies[index], f.bodies[index]
        pose = self._pose(body.parent) if body.parent < 0 else self._poses[body.parent]
        w = f.bodies[body.parent].motion[:3] if body.parent >= 0 else f.zeros(3)
        axes, x, v = pose.axes, pose.x, pose.v
        for place, stage in enumerate(nodes.stages):
            last = place == len(nodes.stages) - 1
            found = f.frames("pose", A_I=axes, x_I=x, Rc=stage.rotation, r=stage.position)
            relative = nodes.hinge["v"] if last else f.zeros(3)
            v = f.frames(
                "velocity", Rc=stage.rotation, r=stage.position, v_I=v, w_I=w, v_rel=relative
            )["v"]
            axes, x = found["A"], found["x"]
            w = stage.carried(w)
        return _Pose(axes, x, v)

    # --- loads -----------------------------------------------------------------------------------

    def _apply(self, index: int, axes: Nodes, offset: Nodes, force: Nodes, moment: Nodes) -> None:
        if index < 0:
            return
        f = self.fusion
        found = f.frames(
            "applied_load", A=self._pose(index).axes, A_F=axes, offset=offset, F=force, M=moment
        )
        nodes = f.bodies[index]
        nodes.load = [a + b for a, b in zip(nodes.load, found["e"], strict=True)]

    def _motion(self, index: int, offset: Nodes) -> tuple[Nodes, Nodes, Nodes]:
        """Position, velocity and angular velocity of a point of a body, inertial axes."""
        f = self.fusion
        if index < 0:
            return offset, f.zeros(3), f.zeros(3)
        pose, motion = self._pose(index), f.bodies[index].motion
        point = f.frames(
            "point", A=pose.axes, x=pose.x, v=pose.v, motion=motion, delta=f.zeros(6),
            offset=offset, gravity=f.zeros(3),
        )  # fmt: skip
        turning = f.frames("turning", A=pose.axes, motion=motion, delta=f.zeros(6))
        return point["x_K"], point["v_K"], turning["w_K"]

    def _load(self, load: LoadStructure) -> None:
        f = self.fusion
        own = f.entries(load.axes_own)
        axes = f.frames("end_frame", A=self._pose(load.axes).axes, R_end=own)["A_end"]
        force, moment = ([self._value(k) for k in places] for places in (load.force, load.moment))
        offset = f.entries(load.offset)
        self._apply(load.body, axes, offset, force, moment)
        _, v, w = self._motion(load.body, offset)
        power = f.frames("power", A_F=axes, F=force, M=moment, v_K=v, w_K=w)
        f.power = f.power + power["P"][0]

    def _force(self, index: int, force: ForceStructure) -> None:
        f = self.fusion
        ends: dict[str, Nodes] = {}
        offsets = {"F": f.entries(force.offset_f), "T": f.entries(force.offset_t)}
        for letter, body, own in (
            ("F", force.body_f, force.axes_f),
            ("T", force.body_t, force.axes_t),
        ):
            x, v, w = self._motion(body, offsets[letter])
            axes = f.frames("end_frame", A=self._pose(body).axes, R_end=f.entries(own))["A_end"]
            ends |= {f"A_{letter}": axes, f"x_{letter}": x, f"v_{letter}": v, f"w_{letter}": w}
        effort = [f.zero]
        if force.effort is not None:
            moves = {name: ends[name] for name in ("x_F", "v_F", "x_T", "v_T")}
            length = f.frames("length", **moves)["l"]
            effort = f.expression(force.effort, length=length)
        found = f.inline.run(
            f.kernels(force.element, "wrench"),
            {"p": f.entries(force.p), "t": [f.t], "effort": effort, **ends},
            lambda condition, code: f.fail_unless(condition, FORCE, index, code),
        )
        back = f.frames("opposite", x_F=ends["x_F"], x_T=ends["x_T"], F=found["F"], M=found["M"])
        self._apply(force.body_t, f.identity(), offsets["T"], found["F"], found["M"])
        self._apply(force.body_f, f.identity(), offsets["F"], back["F_back"], back["M_back"])
        f.power = f.power + found["P"][0]
        f.potential = f.potential + found["V"][0]
