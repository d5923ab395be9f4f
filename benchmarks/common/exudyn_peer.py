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


def joints(kind: str, axis: np.ndarray) -> list[Any]:
    """Its joint types of one of our hinges, from the inboard side."""
    if kind == "pin":
        return [PINS[int(np.flatnonzero(axis)[0])]]
    return [*(SLIDES if kind == "free" else ()), PINS[2], PINS[1], PINS[0]]


def angles(quaternion: np.ndarray) -> np.ndarray:
    """About z, y, x in turn."""
    return Rotation.from_quat(np.roll(quaternion, -1)).as_euler("ZYX")


def rates(turn: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """Of angles about z, y, x from the angular velocity in outboard axes."""
    _, y, x = turn
    columns = np.array([
        [-np.sin(y), np.cos(y) * np.sin(x), np.cos(y) * np.cos(x)],
        [0.0, np.cos(x), -np.sin(x)],
        [1.0, 0.0, 0.0],
    ]).T  # fmt: skip
    return np.linalg.solve(columns, omega)


def state(tree: Tree, q: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Its coordinates and rates from one state."""
    own_q, own_u, at_q, at_u = [], [], 0, 0
    for link in tree.links:
        nq, nu = COORDINATES[link.kind]
        here, speed = q[at_q : at_q + nq], u[at_u : at_u + nu]
        at_q, at_u = at_q + nq, at_u + nu
        if link.kind == "pin":
            own_q.append(here)
            own_u.append(speed)
            continue
        turn = angles(here[-4:])
        own_q.append(np.concatenate([here[:-4], turn]))
        linear = Rotation.from_quat(np.roll(here[-4:], -1)).apply(speed[:3]) if nu == 6 else []
        own_u.append(np.concatenate([linear, rates(turn, speed[-3:])]))
    return np.concatenate(own_q), np.concatenate(own_u)


def coordinates(tree: Tree, own: np.ndarray) -> np.ndarray:
    """q of a chain of pins and balls from its angles (z, y, x in turn)."""
    parts, at = [], 0
    for link in tree.links:
        if link.kind == "pin":
            parts.append(own[at : at + 1])
            at += 1
            continue
        turn = Rotation.from_euler("ZYX", own[at : at + 3])
        parts.append(np.roll(turn.as_quat(), 1))
        at += 3
    return np.concatenate(parts)


class ExudynRun:
    """A tree with one start."""

    def __init__(self, tree: Tree, q: np.ndarray, u: np.ndarray) -> None:
        if any(link.armature for link in tree.links):
            raise ValueError("no inertia of drives in its kinematic tree")
        self.container = exu.SystemContainer()
        self.system = self.container.AddSystem()
        start = state(tree, q, u)
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
        last: dict[int, int] = {-1: -1}
        for number, link in enumerate(tree.links):
            chain = joints(link.kind, link.axis)
            for position, kind in enumerate(chain):
                first, final = position == 0, position == len(chain) - 1
                parent = last[link.parent] if first else len(lists["types"]) - 1
                values = (
                    kind, parent, link.turn if first else np.eye(3),
                    link.place if first else np.zeros(3),
                    link.inertia if final else np.zeros((3, 3)),
                    link.center if final else np.zeros(3), link.mass if final else 0.0,
                )  # fmt: skip
                for name, value in zip(lists, values, strict=True):
                    lists[name].append(value)
            last[number] = len(lists["types"]) - 1
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

    def end(self) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates and rates after the last run."""
        data = self.system.systemData
        return data.GetODE2Coordinates(), data.GetODE2Coordinates_t()

    def accelerations(self, u: np.ndarray, step: float = 1e-7) -> np.ndarray:
        """Second derivatives at the start, from one explicit step."""
        self.run(step, 1, exu.DynamicSolverType.ExplicitEuler)
        return (self.end()[1] - u) / step
