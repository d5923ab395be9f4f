"""Exudyn with rigid bodies and joints in redundant coordinates: sparse, implicit."""

from __future__ import annotations

from typing import Any

import exudyn as exu
import numpy as np
from exudyn.utilities import RigidBodyInertia

from .links import Tree


def build_chain(tree: Tree) -> Any:
    """A chain of pins or balls, all angles zero, every body at its mass centre."""
    container = exu.SystemContainer()
    system = container.AddSystem()
    carrier, hinge_position = system.CreateGround(), np.zeros(3)
    for link in tree.links:
        hinge_position = hinge_position + link.position
        body = system.CreateRigidBody(
            inertia=RigidBodyInertia(link.mass, link.inertia),
            referencePosition=list(hinge_position + link.center), gravity=list(tree.gravity),
        )  # fmt: skip
        if link.kind == "pin":
            system.CreateRevoluteJoint(
                bodyNumbers=[carrier, body], position=list(hinge_position), axis=list(link.axis),
                useGlobalFrame=True,
            )  # fmt: skip
        else:
            system.CreateSphericalJoint(bodyNumbers=[carrier, body], position=list(hinge_position))
        carrier = body
    system.Assemble()
    return system, container


def run(chain: Any, t_end: float, steps: int) -> None:
    """Generalized alpha with default settings and the sparse solver."""
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = steps
    settings.timeIntegration.endTime = t_end
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.solutionSettings.writeSolutionToFile = False
    settings.linearSolverType = exu.LinearSolverType.EigenSparse
    settings.parallel.numberOfThreads = 1
    chain[0].SolveDynamic(settings)
