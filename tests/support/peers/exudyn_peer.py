"""A mechanism in Exudyn: every body with Euler parameters of its own, every hinge by constraints.

Nothing is a tree there, and no hinge is cut: tree and loops are rows of one saddle point.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    LoadMassProportional,
    MarkerBodyMass,
    MarkerBodyRigid,
    NodeRigidBodyEP,
    ObjectGround,
    ObjectJointGeneric,
    ObjectRigidBody,
)

from tests.reference import newton_euler as dense
from tests.reference.algebra import to_quaternion, triad
from tests.reference.jets import Array
from tests.reference.tree import Hinge, read

#: Displacements and rotations that a hinge holds, its axis being the third.
HELD = {
    "fixed": [1, 1, 1, 1, 1, 1], "pin": [1, 1, 1, 1, 1, 0], "prismatic": [1, 1, 0, 1, 1, 1],
    "cylindrical": [1, 1, 0, 1, 1, 0], "ball": [1, 1, 1, 0, 0, 0],
}  # fmt: skip


class ExudynPeer:
    """A scene without laws, drives and loads but its weight, at one closed state (q, u)."""

    def __init__(self, scene: Mapping[str, Any], q: Array, u: Array) -> None:
        self.tree = read(scene)
        self._container = exu.SystemContainer()
        self.system = self._container.AddSystem()
        self.nodes: list[Any] = []
        at = dense.motion(self.tree, q, u)
        self.numbers = [self._body(number, at) for number in range(len(self.tree.bodies))]
        self.numbers.append(self.system.AddObject(ObjectGround()))  # body -1
        for hinge in self.tree.hinges:
            self._hinge(hinge)
        self.system.Assemble()

    def _body(self, number: int, at: Any) -> Any:
        body, w = self.tree.bodies[number], at.w[number]
        turned = to_quaternion(at.A[number])
        rates = 0.5 * np.array([-w @ turned[1:], *(turned[0] * w + np.cross(w, turned[1:]))])
        node = self.system.AddNode(NodeRigidBodyEP(
            referenceCoordinates=[*at.r[number], *turned],
            initialVelocities=[*at.v[number], *rates],
        ))  # fmt: skip
        self.nodes.append(node)
        arm = body.center
        about = body.inertia + body.mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
        entries = [about[i, j] for i, j in ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))]
        object_ = self.system.AddObject(ObjectRigidBody(
            mass=body.mass, inertia=entries, centerOfMass=list(arm),
            nodeNumber=node,
        ))  # fmt: skip
        mass = self.system.AddMarker(MarkerBodyMass(bodyNumber=object_))
        self.system.AddLoad(
            LoadMassProportional(markerNumber=mass, loadVector=list(self.tree.gravity))
        )
        return object_

    def _hinge(self, hinge: Hinge) -> None:
        basis = triad(hinge.axis)
        markers = []
        for body, place, axes in (
            (hinge.parent, hinge.ro, hinge.Ro), (hinge.child, hinge.rp, hinge.Rp)
        ):  # fmt: skip
            frame = exu.HT(rotation=axes @ basis, translation=place)
            marker = MarkerBodyRigid(bodyNumber=self.numbers[body], localHT=frame)
            markers.append(self.system.AddMarker(marker))
        self.system.AddObject(
            ObjectJointGeneric(markerNumbers=markers, constrainedAxes=HELD[hinge.type])
        )

    def run(self, t_end: float, steps: int) -> None:
        """Generalized alpha in equal steps, its Newton iterations to rounding; rows may repeat
        others."""
        settings = exu.SimulationSettings()
        stepping = settings.timeIntegration
        stepping.numberOfSteps, stepping.endTime, stepping.verboseMode = steps, t_end, 0
        stepping.newton.relativeTolerance = stepping.newton.absoluteTolerance = 1e-10
        stepping.newton.useModifiedNewton = False
        stepping.generalizedAlpha.spectralRadius = 0.9
        settings.solution.file.write = False
        settings.parallel.numberOfThreads = 1
        settings.linearSolver.solverType = exu.LinearSolverType.EigenDense
        settings.linearSolver.ignoreSingularJacobian = True
        if not self.system.SolveDynamic(settings, storeSolver=True):
            raise RuntimeError("Exudyn did not arrive")

    def motions(self, kind: str) -> Array:
        """Of the bodies' origins (bodies, 3), in inertial axes: "Position", "Velocity", ..."""
        what = getattr(exu.OutputVariableType, kind)
        return np.array([self.system.GetNodeOutput(node, what) for node in self.nodes])
