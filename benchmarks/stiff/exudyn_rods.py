"""Exudyn's generalised-alpha on rods in a row: on bushings, and on pins with dampers.

Planar rigid bodies in absolute coordinates with sparse matrices; springs between markers, or
constraints.  Files, sensors, output and threads are switched off.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import exudyn as exu
import numpy as np
from exudyn.itemInterface import (
    CartesianSpringDamper,
    CoordinateSpringDamper,
    Gravity,
    MarkerBodyMass,
    MarkerBodyPosition,
    MarkerNodeCoordinate,
    NodePointGround,
    NodeRigidBody2D,
    ObjectGround,
    ObjectJointRevolute2D,
    ObjectRigidBody2D,
)

Array = np.ndarray
HALF, MASS, INERTIA, GRAVITY = 0.5, 1.0, 1 / 12, 9.81  # m, kg, kg m2, m/s2


@dataclass(frozen=True)
class Variant:
    """Variant of the method: `radius` of the damping at infinity; `newton` is "full", "modified" (a
    new Jacobian when convergence is slow) or "once a step"; tolerance, relative and absolute."""

    radius: float
    newton: str
    tolerance: tuple[float, float] = (1e-6, 1e-9)

    def __str__(self) -> str:
        return f"radius {self.radius:g}, Newton {self.newton}"


class Rods:
    """A row of rods from the ground; each on a bushing (k, zeta), or on a pin with a damper c."""

    def __init__(
        self, count: int, bushings: tuple[float, float] | None = None, damper: float = 0.0
    ) -> None:
        self.container = exu.SystemContainer()
        self.system = mbs = self.container.AddSystem()
        ground = mbs.AddObject(ObjectGround())
        parent_marker = mbs.AddMarker(
            MarkerBodyPosition(bodyNumber=ground, localPosition=[0, 0, 0])
        )
        inboard_rotation = mbs.AddMarker(
            MarkerNodeCoordinate(nodeNumber=mbs.AddNode(NodePointGround()), coordinate=0)
        )
        self.nodes = []
        for i in range(count):
            node = mbs.AddNode(NodeRigidBody2D(referenceCoordinates=[HALF + i, 0, 0]))
            rod = mbs.AddObject(
                ObjectRigidBody2D(physicsMass=MASS, physicsInertia=INERTIA, nodeNumber=node)
            )
            mass = mbs.AddMarker(MarkerBodyMass(bodyNumber=rod))
            mbs.AddLoad(Gravity(markerNumber=mass, loadVector=[0, -GRAVITY, 0]))
            inboard, outboard = (
                mbs.AddMarker(MarkerBodyPosition(bodyNumber=rod, localPosition=[x, 0, 0]))
                for x in (-HALF, HALF)
            )
            pair = [parent_marker, inboard]
            if bushings is None:
                mbs.AddObject(ObjectJointRevolute2D(markerNumbers=pair))
            else:
                k, zeta = bushings
                c = 2 * zeta * math.sqrt(k * MASS)
                mbs.AddObject(
                    CartesianSpringDamper(
                        markerNumbers=pair, stiffness=[k, k, 0], damping=[c, c, 0]
                    )
                )
            rotation = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=2))
            if damper:
                mbs.AddObject(
                    CoordinateSpringDamper(
                        markerNumbers=[inboard_rotation, rotation], stiffness=0, damping=damper
                    )
                )
            parent_marker, inboard_rotation = outboard, rotation
            self.nodes.append(node)
        mbs.Assemble()

    def run(
        self, t_end: float, steps: int, variant: Variant
    ) -> tuple[Callable[[], Array], dict[str, int]]:
        """Function that returns the tips at t_end after `steps` equal steps, and counts."""
        settings = exu.SimulationSettings()
        integration = settings.timeIntegration
        integration.numberOfSteps, integration.endTime = steps, t_end
        integration.adaptiveStep = False
        integration.generalizedAlpha.spectralRadius = variant.radius
        newton = integration.newton
        newton.relativeTolerance, newton.absoluteTolerance = variant.tolerance
        newton.useModifiedNewton = variant.newton != "full"
        newton.modifiedNewtonJacUpdatePerStep = variant.newton == "once a step"
        integration.verboseMode = 0
        settings.solution.file.write = False
        settings.solution.sensors.active = False
        settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
        settings.linearSolver.reuseAnalyzedPattern = True
        settings.parallel.numberOfThreads = 1
        solver: Any = exu.MainSolverImplicitSecondOrder()  # its stubs lack arguments
        if not solver.SolveSystem(self.system, settings):
            raise RuntimeError("Newton's method did not converge")
        counters = solver.it
        counts = {"steps": steps, "newton_steps": int(counters.newtonStepsCount),
                  "jacobians": int(counters.newtonJacobiCount)}  # fmt: skip
        return self.tips, counts

    def tips(self) -> Array:
        """(n, 3) m, after the last run."""
        x = np.asarray(self.system.systemData.GetODE2Coordinates()).reshape(-1, 3)
        center = x[:, 0] + HALF + np.arange(len(x))
        return np.column_stack([
            center + HALF * np.cos(x[:, 2]), x[:, 1] + HALF * np.sin(x[:, 2]), np.zeros(len(x)),
        ])  # fmt: skip
