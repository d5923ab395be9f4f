"""Exudyn's other form: rigid bodies with joints, sparse matrices, implicit steps."""

from __future__ import annotations

from typing import Any

import exudyn as exu
import numpy as np
from exudyn.utilities import RigidBodyInertia

from .links import Tree


def chain_of(tree: Tree) -> Any:
    """A chain of pins or balls, all angles zero, every body at its mass centre."""
    container = exu.SystemContainer()
    system = container.AddSystem()
    carrier, hinge = system.CreateGround(), np.zeros(3)
    for link in tree.links:
        hinge = hinge + link.place
        body = system.CreateRigidBody(
            inertia=RigidBodyInertia(link.mass, link.inertia),
            referencePosition=list(hinge + link.center), gravity=list(tree.gravity),
        )  # fmt: skip
        if link.kind == "pin":
            system.CreateRevoluteJoint(
                bodyNumbers=[carrier, body], position=list(hinge), axis=list(link.axis),
                useGlobalFrame=True,
            )  # fmt: skip
        else:
            system.CreateSphericalJoint(bodyNumbers=[carrier, body], position=list(hinge))
        carrier = body
    system.Assemble()
    return system, container


def run(made: Any, t_end: float, steps: int) -> None:
    """Generalized alpha with its defaults, sparse solver, nothing written."""
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = steps
    settings.timeIntegration.endTime = t_end
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.solutionSettings.writeSolutionToFile = False
    settings.linearSolverType = exu.LinearSolverType.EigenSparse
    settings.parallel.numberOfThreads = 1
    made[0].SolveDynamic(settings)
