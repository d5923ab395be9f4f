"""Planar mechanisms in Exudyn: bodies with three coordinates each, joints as constraints."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    LoadMassProportional,
    LoadTorqueVector,
    MarkerBodyMass,
    MarkerBodyPosition,
    MarkerBodyRigid,
    NodeRigidBody2D,
    ObjectConnectorSpringDamper,
    ObjectGround,
    ObjectJointRevolute2D,
    ObjectRigidBody2D,
)

Point = Sequence[float]


@dataclass(frozen=True)
class Body:
    """Number of a body and of its node, and its mass centre in axes of its own."""

    number: Any
    node: Any
    center: np.ndarray


class Planar:
    """Planar system, built body by body.  Angles are relative to x of the ground."""

    def __init__(self, gravity: float = 0.0) -> None:
        self.container = exu.SystemContainer()
        self.system, self.gravity = self.container.AddSystem(), gravity
        self.ground = Body(self.system.AddObject(ObjectGround()), None, np.zeros(2))

    def add_body(
        self, origin: Point, angle: float, center: Point, mass: float, inertia: float
    ) -> Body:  # fmt: skip
        """Body at rest at `origin`; `inertia` is about its mass centre `center`."""
        c, s = np.cos(angle), np.sin(angle)
        position = np.asarray(origin) + np.array([[c, -s], [s, c]]) @ center
        node = self.system.AddNode(NodeRigidBody2D(referenceCoordinates=[*position, angle]))
        number = self.system.AddObject(
            ObjectRigidBody2D(physicsMass=mass, physicsInertia=inertia, nodeNumber=node)
        )
        if self.gravity:
            marker = self.system.AddMarker(MarkerBodyMass(bodyNumber=number))
            load = LoadMassProportional(markerNumber=marker, loadVector=[0, self.gravity, 0])
            self.system.AddLoad(load)
        return Body(number, node, np.asarray(center, float))

    def _marker(self, body: Body, position: Point) -> Any:
        local = [*(np.asarray(position, float) - body.center), 0.0]
        return self.system.AddMarker(
            MarkerBodyPosition(bodyNumber=body.number, localPosition=local)
        )

    def add_pin(self, first: Body, position: Point, second: Body, second_position: Point) -> None:
        """Pin between two points, each in axes of its body."""
        markers = [self._marker(first, position), self._marker(second, second_position)]
        self.system.AddObject(ObjectJointRevolute2D(markerNumbers=markers))

    def add_spring(
        self,
        first: Body,
        position: Point,
        second: Body,
        second_position: Point,
        stiffness: float,
        free_length: float,
    ) -> None:
        """Spring between two points."""
        markers = [self._marker(first, position), self._marker(second, second_position)]
        self.system.AddObject(ObjectConnectorSpringDamper(
            markerNumbers=markers, stiffness=stiffness, referenceLength=free_length, damping=0.0
        ))  # fmt: skip

    def add_torque(self, body: Body, value: float) -> None:
        """Constant torque about z."""
        marker = self.system.AddMarker(MarkerBodyRigid(bodyNumber=body.number))
        self.system.AddLoad(LoadTorqueVector(markerNumber=marker, loadVector=[0, 0, value]))

    def run(self, t_end: float, steps: int, sparse: bool, reuse_jacobian: bool) -> tuple[int, int]:
        """Generalized alpha from the start; returns (iterations, Jacobians)."""
        settings = exu.SimulationSettings()
        stepping = settings.timeIntegration
        stepping.numberOfSteps, stepping.endTime, stepping.verboseMode = steps, t_end, 0
        stepping.newton.useModifiedNewton = reuse_jacobian
        stepping.newton.relativeTolerance = 1e-10  # its default leaves 4e-6 rad of Andrews' crank
        settings.solutionSettings.writeSolutionToFile = False
        settings.parallel.numberOfThreads = 1
        kind = exu.LinearSolverType
        settings.linearSolverType = kind.EigenSparse if sparse else kind.EXUdense
        if not self.system.SolveDynamic(settings, storeSolver=True):
            raise RuntimeError("Exudyn did not reach the end")
        counters = self.system.sys["dynamicSolver"].it
        return counters.newtonStepsCount, counters.newtonJacobiCount

    def angle(self, body: Body) -> float:
        """Angle of a body at the end of the run, rad."""
        system = self.system
        rotation = system.GetNodeOutput(body.node, exu.OutputVariableType.Coordinates)[2]
        return float(rotation + system.GetNode(body.node)["referenceCoordinates"][2])


def build_windows(count: int, angle: float = 0.7) -> Planar:
    """Parallel cranks of 1 m, joined at their tips by couplers of 1 m; at rest."""
    system = Planar(-9.81)
    centre, tip = (0.5, 0.0), (1.0, 0.0)
    crank_tip = np.array([np.cos(angle), np.sin(angle)])
    cranks = []
    for k in range(count + 1):
        cranks.append(system.add_body((k, 0), angle, centre, 1.0, 1 / 12))
        system.add_pin(system.ground, (k, 0), cranks[-1], (0, 0))
    for k in range(count):
        coupler = system.add_body(crank_tip + np.array([k, 0]), 0.0, centre, 1.0, 1 / 12)
        system.add_pin(cranks[k], tip, coupler, (0, 0))
        system.add_pin(coupler, tip, cranks[k + 1], tip)
    system.system.Assemble()
    return system
