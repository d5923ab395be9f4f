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
    """A system that is put together body by body.  Angles are against x of the ground."""

    def __init__(self, gravity: float = 0.0) -> None:
        self.container = exu.SystemContainer()
        self.system, self.gravity = self.container.AddSystem(), gravity
        self.ground = Body(self.system.AddObject(ObjectGround()), None, np.zeros(2))

    def body(
        self, foot: Point, angle: float, center: Point, mass: float, moment: float
    ) -> Body:  # fmt: skip
        """At rest with its origin at `foot`; `moment` is about its mass centre."""
        c, s = np.cos(angle), np.sin(angle)
        place = np.asarray(foot) + np.array([[c, -s], [s, c]]) @ center
        node = self.system.AddNode(NodeRigidBody2D(referenceCoordinates=[*place, angle]))
        number = self.system.AddObject(
            ObjectRigidBody2D(physicsMass=mass, physicsInertia=moment, nodeNumber=node)
        )
        if self.gravity:
            marker = self.system.AddMarker(MarkerBodyMass(bodyNumber=number))
            load = LoadMassProportional(markerNumber=marker, loadVector=[0, self.gravity, 0])
            self.system.AddLoad(load)
        return Body(number, node, np.asarray(center, float))

    def _marker(self, body: Body, place: Point) -> Any:
        local = [*(np.asarray(place, float) - body.center), 0.0]
        return self.system.AddMarker(
            MarkerBodyPosition(bodyNumber=body.number, localPosition=local)
        )

    def pin(self, one: Body, place: Point, other: Body, there: Point) -> None:
        """Holds two points together, each in axes of its body."""
        markers = [self._marker(one, place), self._marker(other, there)]
        self.system.AddObject(ObjectJointRevolute2D(markerNumbers=markers))

    def spring(
        self, one: Body, place: Point, other: Body, there: Point, stiffness: float, rest: float
    ) -> None:
        """Between two points."""
        markers = [self._marker(one, place), self._marker(other, there)]
        self.system.AddObject(ObjectConnectorSpringDamper(
            markerNumbers=markers, stiffness=stiffness, referenceLength=rest, damping=0.0
        ))  # fmt: skip

    def torque(self, body: Body, value: float) -> None:
        """A constant one about z."""
        marker = self.system.AddMarker(MarkerBodyRigid(bodyNumber=body.number))
        self.system.AddLoad(LoadTorqueVector(markerNumber=marker, loadVector=[0, 0, value]))

    def run(self, t_end: float, steps: int, sparse: bool, modified: bool) -> tuple[int, int]:
        """Generalized alpha from the start; returns (iterations, Jacobians)."""
        settings = exu.SimulationSettings()
        stepping = settings.timeIntegration
        stepping.numberOfSteps, stepping.endTime, stepping.verboseMode = steps, t_end, 0
        stepping.newton.useModifiedNewton = modified
        stepping.newton.relativeTolerance = 1e-10  # its default leaves 4e-6 rad of Andrews' crank
        settings.solutionSettings.writeSolutionToFile = False
        settings.parallel.numberOfThreads = 1
        kind = exu.LinearSolverType
        settings.linearSolverType = kind.EigenSparse if sparse else kind.EXUdense
        if not self.system.SolveDynamic(settings, storeSolver=True):
            raise RuntimeError("Exudyn did not arrive")
        done = self.system.sys["dynamicSolver"].it
        return done.newtonStepsCount, done.newtonJacobiCount

    def angle(self, body: Body) -> float:
        """Against x of the ground, at the end of the run."""
        system = self.system
        turned = system.GetNodeOutput(body.node, exu.OutputVariableType.Coordinates)[2]
        return float(turned + system.GetNode(body.node)["referenceCoordinates"][2])


def windows(count: int, angle: float = 0.7) -> Planar:
    """Cranks of 1 m side by side, joined at their tips by couplers of 1 m; at rest."""
    made = Planar(-9.81)
    middle, tip = (0.5, 0.0), (1.0, 0.0)
    top = np.array([np.cos(angle), np.sin(angle)])
    cranks = []
    for k in range(count + 1):
        cranks.append(made.body((k, 0), angle, middle, 1.0, 1 / 12))
        made.pin(made.ground, (k, 0), cranks[-1], (0, 0))
    for k in range(count):
        coupler = made.body(top + np.array([k, 0]), 0.0, middle, 1.0, 1 / 12)
        made.pin(cranks[k], tip, coupler, (0, 0))
        made.pin(coupler, tip, cranks[k + 1], tip)
    made.system.Assemble()
    return made
