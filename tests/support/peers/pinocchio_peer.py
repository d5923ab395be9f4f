"""A scene as a pinocchio.Model: every hinge type, laws and loads as efforts and external forces.

The frame of a joint is the outboard end of its hinge.  Hinges without a joint of their own are
composite joints; a fixed hinge adds the body to the joint that carries it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pinocchio as pin

from tests.reference import laws
from tests.reference import newton_euler as dense
from tests.reference.algebra import triad
from tests.reference.tree import Hinge, Tree, read


def _joint(hinge: Hinge) -> Any:
    a, kind = hinge.axis, hinge.type
    turn, slide = pin.JointModelRevoluteUnaligned, pin.JointModelPrismaticUnaligned
    if kind in ("pin", "prismatic"):
        return (turn if kind == "pin" else slide)(a)
    if kind == "screw":
        return pin.JointModelHelicalUnaligned(a, hinge.pitch)
    if kind == "ball":
        return pin.JointModelSpherical()
    if kind in ("free", "elastic"):
        return pin.JointModelFreeFlyer()
    e1, e2, n = triad(a, hinge.axis2 if kind == "planar" else None).T
    x, y, z = np.eye(3)
    parts = {
        "cylindrical": lambda: [slide(a), turn(a)],
        "universal": lambda: [turn(a), turn(hinge.axis2)],
        "planar": lambda: [slide(e1), slide(e2), turn(n)],
        "gimbal": lambda: [turn(z), turn(y), turn(x)],
    }[kind]()
    joint = pin.JointModelComposite(len(parts))
    for part in parts:
        joint.addJoint(part, pin.SE3.Identity())
    return joint


class PinocchioPeer:
    """Forward dynamics and mass matrix of a scene by Pinocchio, in the scene's q and u."""

    def __init__(self, scene: Mapping[str, Any] | Tree) -> None:
        self.tree = read(scene)
        self.model = pin.Model()
        self.model.gravity.linear = self.tree.gravity
        ground = (0, pin.SE3.Identity())
        #: Body number -> joint that carries it, body axes in that joint's frame.
        self.carrier: dict[int, tuple[int, Any]] = {-1: ground}
        self.joint: dict[int, int] = {}
        self._add_outboard_of(-1)
        self.data = self.model.createData()

    def _add_outboard_of(self, body: int) -> None:
        """Depth first: Pinocchio's mass matrix takes subtrees to be contiguous."""
        for number, hinge in enumerate(self.tree.hinges):
            if hinge.parent == body:
                self._add(number)
                self._add_outboard_of(hinge.child)

    def _add(self, number: int) -> None:
        hinge = self.tree.hinges[number]
        body = self.tree.bodies[hinge.child]
        parent, axes = self.carrier[hinge.parent]
        frame = axes * pin.SE3(hinge.Ro, hinge.ro)
        local = pin.SE3(hinge.Rp, hinge.rp).inverse()
        if hinge.type == "fixed":
            joint, local = parent, frame * local
        else:
            joint = self.model.addJoint(parent, _joint(hinge), frame, hinge.name)
            self.joint[number] = joint
            armature = self.model.armature
            armature[self._dof(number)] = self._reorder_gimbal(hinge, laws.reflected_inertia(hinge))
            self.model.armature = armature
        self.carrier[hinge.child] = (joint, local)
        inertia = pin.Inertia(body.mass, body.center, body.inertia)
        self.model.appendBodyToJoint(joint, inertia, local)

    def _dof(self, number: int) -> slice:
        joint = self.model.joints[self.joint[number]]
        return slice(joint.idx_v, joint.idx_v + joint.nv)

    @staticmethod
    def _reorder_gimbal(hinge: Hinge, values: Any) -> Any:
        """Speeds (or efforts) in the other one's order; the gimbal's run backwards."""
        return values[::-1] if hinge.type == "gimbal" else values

    def coordinates(self, q: Any) -> Any:
        """Pinocchio's configuration: quaternions as x, y, z, w."""
        out = pin.neutral(self.model)
        for number, joint in self.joint.items():
            hinge, own = self.tree.hinges[number], self.model.joints[joint]
            value = self._reorder_gimbal(hinge, q[hinge.q])
            if hinge.type in ("ball", "free", "elastic"):
                value = np.concatenate([value[:-4], np.roll(value[-4:], -1)])
            out[own.idx_q : own.idx_q + own.nq] = value
        return out

    def speeds(self, u: Any) -> Any:
        """Pinocchio's velocity (or effort) vector."""
        out = np.zeros(self.model.nv)
        for number in self.joint:
            hinge = self.tree.hinges[number]
            out[self._dof(number)] = self._reorder_gimbal(hinge, u[hinge.u])
        return out

    def back(self, v: Any) -> Any:
        """The inverse of `speeds`."""
        out = np.zeros(self.tree.nu)
        for number in self.joint:
            hinge = self.tree.hinges[number]
            out[hinge.u] = self._reorder_gimbal(hinge, v[self._dof(number)])
        return out

    def accelerations(self, q: Any, u: Any, t: float = 0.0) -> Any:
        """udot, the laws' efforts and external loads taken from the reference."""
        tau, forces = self.speeds(self._efforts(q, u, t)), self._forces(q, u, t)
        found = pin.aba(self.model, self.data, self.coordinates(q), self.speeds(u), tau, forces)
        return self.back(found)

    def inverse_dynamics(self, q: Any, u: Any, udot: Any, t: float = 0.0) -> Any:
        """Efforts beyond the laws' own that give udot."""
        state = (self.coordinates(q), self.speeds(u), self.speeds(udot))
        found = pin.rnea(self.model, self.data, *state, self._forces(q, u, t))
        return self.back(found) - self._efforts(q, u, t)

    def _efforts(self, q: Any, u: Any, t: float) -> Any:
        own = [laws.hinge_effort(self.tree, hinge, q, u, t) for hinge in self.tree.hinges]
        return np.concatenate([np.zeros(0), *own])

    def _forces(self, q: Any, u: Any, t: float) -> Any:
        """External wrenches without gravity, in the joints' frames."""
        tree, at = self.tree, dense.motion(self.tree, q, u)
        wrenches = laws.external_wrenches(tree, at, q, u, t)
        forces = [pin.Force.Zero() for _ in range(self.model.njoints)]
        for i, body in enumerate(tree.bodies):
            push = at.A[i].T @ (wrenches[i, :3] - body.mass * tree.gravity)
            about = at.A[i].T @ wrenches[i, 3:] + np.cross(body.center, push)
            joint, local = self.carrier[i]
            forces[joint] += local.act(pin.Force(push, about))
        vector = pin.StdVec_Force()
        vector.extend(forces)
        return vector

    def mass_matrix(self, q: Any) -> Any:
        """Joint-space inertia in the scene's speeds, reflected inertias included."""
        upper = np.triu(pin.crba(self.model, self.data, self.coordinates(q)))
        full = upper + np.triu(upper, 1).T
        columns = np.array([self.back(column) for column in full]).reshape(
            self.model.nv, self.tree.nu
        )
        return np.array([self.back(row) for row in columns.T]).reshape(self.tree.nu, self.tree.nu)

    def derivatives(self, q: Any, u: Any) -> tuple[Any, Any, Any]:
        """Of accelerations under gravity alone by tangent increments of q, by u and by efforts."""
        state = self.coordinates(q), self.speeds(u), np.zeros(self.model.nv)
        pin.computeABADerivatives(self.model, self.data, *state)
        places = self.back(np.arange(self.model.nv)).astype(int)
        inverse = np.triu(self.data.Minv)
        inverse = inverse + np.triu(inverse, 1).T
        found = self.data.ddq_dq, self.data.ddq_dv, inverse
        return tuple(matrix[np.ix_(places, places)] for matrix in found)
