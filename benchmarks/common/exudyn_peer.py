"""Exudyn: a kinematic tree (minimal coordinates) inside its own explicit solver.

A ball is three pins with massless links between them (its tree has no ball joint), a free root
three slides more.
"""

from __future__ import annotations

from typing import Any

import exudyn as exu
import numpy as np
from exudyn.itemInterface import NodeGenericODE2, ObjectKinematicTree
from scipy.spatial.transform import Rotation

from .links import COORDINATES, Tree

PINS = (exu.JointType.RevoluteX, exu.JointType.RevoluteY, exu.JointType.RevoluteZ)
SLIDES = (exu.JointType.PrismaticX, exu.JointType.PrismaticY, exu.JointType.PrismaticZ)
EVALUATIONS = {
    exu.DynamicSolverType.ExplicitEuler: 1, exu.DynamicSolverType.RK44: 4,
    exu.DynamicSolverType.DOPRI5: 6, exu.DynamicSolverType.RK67: 9,
}  # fmt: skip


def joint_types(kind: str, axis: np.ndarray) -> list[Any]:
    """Exudyn's joint types for a hinge, from the inboard side."""
    if kind == "pin":
        return [PINS[int(np.flatnonzero(axis)[0])]]
    return [*(SLIDES if kind == "free" else ()), PINS[2], PINS[1], PINS[0]]


def euler_angles(quaternion: np.ndarray) -> np.ndarray:
    """Angles about z, y, x in this order."""
    return Rotation.from_quat(np.roll(quaternion, -1)).as_euler("ZYX")


def euler_rates(angles: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """Rates of the angles about z, y, x from the angular velocity in outboard axes."""
    _, y, x = angles
    columns = np.array([
        [-np.sin(y), np.cos(y) * np.sin(x), np.cos(y) * np.cos(x)],
        [0.0, np.cos(x), -np.sin(x)],
        [1.0, 0.0, 0.0],
    ]).T  # fmt: skip
    return np.linalg.solve(columns, omega)


def exudyn_state(tree: Tree, q: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Exudyn's coordinates and rates of a state."""
    exudyn_q, exudyn_u, iq, iu = [], [], 0, 0
    for link in tree.links:
        nq, nu = COORDINATES[link.kind]
        coordinates_of_link, speed = q[iq : iq + nq], u[iu : iu + nu]
        iq, iu = iq + nq, iu + nu
        if link.kind == "pin":
            exudyn_q.append(coordinates_of_link)
            exudyn_u.append(speed)
            continue
        angles_of_ball = euler_angles(coordinates_of_link[-4:])
        exudyn_q.append(np.concatenate([coordinates_of_link[:-4], angles_of_ball]))
        linear = (
            Rotation.from_quat(np.roll(coordinates_of_link[-4:], -1)).apply(speed[:3])
            if nu == 6
            else []
        )
        exudyn_u.append(np.concatenate([linear, euler_rates(angles_of_ball, speed[-3:])]))
    return np.concatenate(exudyn_q), np.concatenate(exudyn_u)


def coordinates(tree: Tree, angles: np.ndarray) -> np.ndarray:
    """q of a chain of pins and balls from its angles (z, y, x in turn)."""
    parts, offset = [], 0
    for link in tree.links:
        if link.kind == "pin":
            parts.append(angles[offset : offset + 1])
            offset += 1
            continue
        rotation = Rotation.from_euler("ZYX", angles[offset : offset + 3])
        parts.append(np.roll(rotation.as_quat(), 1))
        offset += 3
    return np.concatenate(parts)


class ExudynRun:
    """Kinematic tree with an initial state."""

    def __init__(self, tree: Tree, q: np.ndarray, u: np.ndarray) -> None:
        if any(link.armature for link in tree.links):
            raise ValueError("the kinematic tree has no drive inertia")
        self.container = exu.SystemContainer()
        self.system = self.container.AddSystem()
        start = exudyn_state(tree, q, u)
        number = len(start[0])
        node = self.system.AddNode(
            NodeGenericODE2(
                referenceCoordinates=[0.0] * number, initialCoordinates=list(start[0]),
                initialCoordinates_t=list(start[1]), numberOfODE2Coordinates=number,
            )
        )  # fmt: skip
        self.body = self.system.AddObject(self._tree(tree, node))
        self.system.Assemble()

    def _tree(self, tree: Tree, node: Any) -> Any:
        lists: dict[str, list[Any]] = {
            name: [] for name in ("types", "parents", "turns", "places", "I", "c", "m")
        }
        outermost: dict[int, int] = {-1: -1}
        for number, link in enumerate(tree.links):
            chain = joint_types(link.kind, link.axis)
            for position, joint_type in enumerate(chain):
                is_first, is_last = position == 0, position == len(chain) - 1
                parent = outermost[link.parent] if is_first else len(lists["types"]) - 1
                values = (
                    joint_type, parent, link.orientation if is_first else np.eye(3),
                    link.position if is_first else np.zeros(3),
                    link.inertia if is_last else np.zeros((3, 3)),
                    link.center if is_last else np.zeros(3), link.mass if is_last else 0.0,
                )  # fmt: skip
                for name, value in zip(lists, values, strict=True):
                    lists[name].append(value)
            outermost[number] = len(lists["types"]) - 1
        return ObjectKinematicTree(
            nodeNumber=node, gravity=list(tree.gravity), jointTypes=lists["types"],
            linkParents=lists["parents"], jointTransformations=exu.Matrix3DList(lists["turns"]),
            jointOffsets=exu.Vector3DList(lists["places"]),
            linkInertiasCOM=exu.Matrix3DList(lists["I"]), linkCOMs=exu.Vector3DList(lists["c"]),
            linkMasses=lists["m"],
        )  # fmt: skip

    def run(
        self,
        t_end: float,
        steps: int,
        method: Any = exu.DynamicSolverType.RK44,
        tolerance: float = 0.0,
    ) -> None:
        """From the start to t_end in equal steps, or with error control; nothing written."""
        settings = exu.SimulationSettings()
        settings.timeIntegration.numberOfSteps = steps
        settings.timeIntegration.endTime = t_end
        settings.timeIntegration.automaticStepSize = tolerance > 0
        if tolerance > 0:
            settings.timeIntegration.absoluteTolerance = tolerance
            settings.timeIntegration.relativeTolerance = tolerance
            settings.timeIntegration.initialStepSize = 1e-3
        settings.timeIntegration.verboseMode = 0
        settings.solutionSettings.writeSolutionToFile = False
        settings.parallel.numberOfThreads = 1
        self.system.SolveDynamic(settings, solverType=method)

    def end_state(self) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates and rates after the last run."""
        data = self.system.systemData
        return data.GetODE2Coordinates(), data.GetODE2Coordinates_t()

    def accelerations(self, u: np.ndarray, step: float = 1e-7) -> np.ndarray:
        """Second derivatives at the start, from one explicit step."""
        self.run(step, 1, exu.DynamicSolverType.ExplicitEuler)
        return (self.end_state()[1] - u) / step
