"""Exudyn's ANCF cable: a beam that is spun up about its root, and chains of beams on pins.

Cable elements are planar (`ObjectANCFCable2D`), cubic in both coordinates, with slopes at nodes.
Files, sensors, output and threads are switched off.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.advancedUtilities import CreateSymbolicUserFunction
from exudyn.itemInterface import (
    CartesianSpringDamper,
    CoordinateConstraint,
    Gravity,
    MarkerBodyMass,
    MarkerBodyPosition,
    MarkerNodeCoordinate,
    MarkerNodePosition,
    NodePoint2DSlope1,
    NodePointGround,
    ObjectANCFCable2D,
    ObjectGround,
    ObjectJointRevolute2D,
    SensorNode,
)

from .flexible_scenes import GRAVITY, Spin, Strip

Array = np.ndarray
esym = exu.symbolic


class CableSystem:
    """System whose last node can be recorded."""

    def __init__(self) -> None:
        self.container = exu.SystemContainer()
        self.system = self.container.AddSystem()

    def assemble(self, node: Any) -> None:
        """Finish the model with a sensor at this node."""
        self.sensor = self.system.AddSensor(
            SensorNode(
                nodeNumber=node, storeInternal=True,
                outputVariableType=exu.OutputVariableType.Position,
            )
        )  # fmt: skip
        self.system.Assemble()

    def cable(
        self, nodes: Sequence[Any], length: float, data: dict[str, float], reduced: int
    ) -> Any:
        """An element between two nodes."""
        return self.system.AddObject(
            ObjectANCFCable2D(
                length=length, massPerLength=data["mass_per_length"],
                bendingStiffness=data["bending_stiffness"],
                axialStiffness=data["axial_stiffness"], nodeNumbers=list(nodes),
                useReducedOrderIntegration=reduced,
            )
        )  # fmt: skip

    def solve(
        self,
        t_end: float,
        steps: int,
        radius: float,
        tolerance: tuple[float, float],
        newton: str,
        solver: str,
        record_positions: bool = False,
    ) -> float:
        """CPU s of a run by generalised alpha; `tolerance` of Newton, relative and absolute.

        `newton`: "full", "modified" (a new Jacobian when convergence is slow) or "once a step".
        Steps that do not converge are halved (`adaptiveStep`).
        """
        settings = exu.SimulationSettings()
        integration = settings.timeIntegration
        integration.numberOfSteps, integration.endTime = steps, t_end
        integration.generalizedAlpha.spectralRadius = radius
        integration.newton.relativeTolerance, integration.newton.absoluteTolerance = tolerance
        integration.newton.useModifiedNewton = newton != "full"
        integration.newton.modifiedNewtonJacUpdatePerStep = newton == "once a step"
        integration.verboseMode = 0
        settings.solution.file.write = False
        settings.solution.sensors.active = record_positions
        settings.solution.sensors.writePeriod = 1e-12
        settings.linearSolver.solverType = getattr(exu.LinearSolverType, solver)
        settings.linearSolver.reuseAnalyzedPattern = True
        settings.parallel.numberOfThreads = 1
        begin = time.process_time()
        self.system.SolveDynamic(settings, showHints=False, showCausingItems=False)
        return time.process_time() - begin

    def recorded_positions(self) -> tuple[Array, Array]:
        """Times (m,) and positions (m, 2) of the last node in the last recorded run."""
        data = np.asarray(self.system.GetSensorStoredData(self.sensor))
        return data[:, 0], data[:, 1:3]


class SpinUp(CableSystem):
    """Beam whose root rotates by a given angle: both entries of the root's slope are prescribed,
    by symbolic functions, which Exudyn evaluates without Python."""

    def __init__(self, elements: int, reduced: int) -> None:
        super().__init__()
        length = Spin.LENGTH / elements
        nodes = [
            self.system.AddNode(NodePoint2DSlope1(referenceCoordinates=[length * i, 0, 1, 0]))
            for i in range(elements + 1)
        ]
        for pair in pairwise(nodes):
            self.cable(pair, length, Spin.BEAM, reduced)
        ground = self.system.AddMarker(
            MarkerNodeCoordinate(nodeNumber=self.system.AddNode(NodePointGround()), coordinate=0)
        )
        self.user_functions = []
        for coordinate, function in enumerate((None, None, _cosine_less_one, _sine)):
            marker = self.system.AddMarker(
                MarkerNodeCoordinate(nodeNumber=nodes[0], coordinate=coordinate)
            )
            number = self.system.AddObject(CoordinateConstraint(markerNumbers=[ground, marker]))
            if function is not None:
                user_function = CreateSymbolicUserFunction(
                    self.system, function, "offsetUserFunction", number
                )
                self.system.SetObjectParameter(number, "offsetUserFunction", user_function)
                self.user_functions.append(user_function)
        self.assemble(nodes[-1])

    def deflection(self) -> tuple[Array, Array]:
        """Times and the tip's deflection across the turned axis, m."""
        times, positions = self.recorded_positions()
        angle = Spin.angle(times)
        return times, np.cos(angle) * positions[:, 1] - np.sin(angle) * positions[:, 0]


def _root_angle(t: Any) -> Any:
    rate, period = Spin.RATE / Spin.PERIOD, 2 * np.pi / Spin.PERIOD
    spin_up_angle = rate * (t * t * 0.5 + (esym.cos(t * period) - 1) * (1 / period**2))
    return esym.IfThenElse(t < Spin.PERIOD, spin_up_angle, Spin.RATE * (t - Spin.PERIOD / 2))


def _cosine_less_one(mbs: Any, t: Any, item: Any, offset: Any) -> Any:
    return esym.cos(_root_angle(t)) - 1


def _sine(mbs: Any, t: Any, item: Any, offset: Any) -> Any:
    return esym.sin(_root_angle(t))


class Chain(CableSystem):
    """Strips on pins under gravity, straight and at rest at an angle below the horizontal.

    `joint`: "constraint" or "spring" (stiff springs instead of constraints).
    """

    def __init__(self, count: int, elements: int, joint: str = "constraint") -> None:
        super().__init__()
        direction = np.array([np.cos(Strip.INITIAL_SLOPE), -np.sin(Strip.INITIAL_SLOPE)])
        ground = self.system.AddObject(ObjectGround())
        parent_marker = self.system.AddMarker(
            MarkerBodyPosition(bodyNumber=ground, localPosition=[0, 0, 0])
        )
        length = Strip.LENGTH / elements
        for strip_index in range(count):
            nodes = [
                self.system.AddNode(
                    NodePoint2DSlope1(
                        referenceCoordinates=[
                            *(direction * (strip_index * Strip.LENGTH + i * length)),
                            *direction,
                        ]
                    )
                )
                for i in range(elements + 1)
            ]
            for pair in pairwise(nodes):
                cable = self.cable(pair, length, Strip.BEAM, 1)
                mass = self.system.AddMarker(MarkerBodyMass(bodyNumber=cable))
                self.system.AddLoad(Gravity(markerNumber=mass, loadVector=[0, -GRAVITY, 0]))
            first, last = (
                self.system.AddMarker(MarkerNodePosition(nodeNumber=node))
                for node in (nodes[0], nodes[-1])
            )
            self.system.AddObject(
                ObjectJointRevolute2D(markerNumbers=[parent_marker, first])
                if joint == "constraint"
                else CartesianSpringDamper(
                    markerNumbers=[parent_marker, first], stiffness=[1e7] * 3
                )
            )
            parent_marker = last
        self.assemble(nodes[-1])
