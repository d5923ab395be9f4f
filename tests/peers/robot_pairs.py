"""A robot as our model and as Pinocchio's, in the same state."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from importlib.metadata import files
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

import mstmm
from mstmm.scene.robots.convert import Choices, Imported, converted
from mstmm.scene.robots.robot import Robot
from mstmm.scene.robots.urdf import read_urdf


def published() -> list[Path]:
    """The URDF files of the package example-robot-data."""
    found = files("example-robot-data") or ()
    return sorted(Path(str(one.locate())) for one in found if one.suffix == ".urdf")


def of_peers(robot: Robot, *keys: str) -> Robot:
    """Without joints that mimic others, and of the laws of joints only `keys`: Pinocchio's aba
    leaves the others out."""

    def bare(given: Any) -> dict[str, Any]:
        law = {key: x for key, x in given.get("law", {}).items() if key in keys}
        rest = {key: x for key, x in given.items() if key != "law"}
        return rest | ({"law": law} if law else {})

    joints = (replace(joint, keys=bare(joint.keys)) for joint in robot.joints)
    return replace(robot, mimics=(), joints=tuple(joints))


def imported(path: Path, base: str, *keys: str) -> Imported:
    return converted(of_peers(read_urdf(path.read_bytes(), path.name), *keys), Choices(base))


class Pair:
    """Our model and Pinocchio's of a robot, in a state that is drawn: `q`, `u`, `efforts` are ours,
    `at`, `speeds`, `pushes` theirs; speeds of joints stand at `ours` and `theirs`."""

    def __init__(self, path: Path, one: Imported, base: str, rng: np.random.Generator) -> None:
        root = (pin.JointModelFreeFlyer(),) if base == "free" else ()
        self.one, self.peer = one, pin.buildModelFromUrdf(str(path), *root)
        self.model, self.data = mstmm.compile(one.scene), self.peer.createData()
        assert self.model.nu == self.peer.nv
        self.q, self.u, self.efforts = (
            np.zeros(n) for n in (self.model.nq, self.model.nu, self.model.nu)
        )
        self.at, self.speeds = pin.neutral(self.peer), np.zeros(self.peer.nv)
        self.pushes, self.ours, self.theirs = np.zeros(self.peer.nv), list[int](), list[int]()
        for number in range(1, self.peer.njoints):
            self._draw(number, rng)

    def _draw(self, number: int, rng: np.random.Generator) -> None:
        joint, name = self.peer.joints[number], self.peer.names[number]
        hinges = self.model.layout.hinges
        if name == "root_joint":
            flying = next(h.name for h in self.one.scene.hinge if h.inboard == "ground")
            turn, slots = rng.normal(size=4), hinges[flying]
            turn /= np.linalg.norm(turn)
            self.q[slots.q : slots.q + 7] = [0.1, 0.2, 0.3, turn[3], *turn[:3]]
            self.at[:7] = [0.1, 0.2, 0.3, *turn]
            return
        slots = hinges[self.one.names[name]]
        angle, speed, push = rng.uniform(-1, 1, 3)
        self.q[slots.q], self.u[slots.u], self.efforts[slots.u] = angle, speed, push
        circle = joint.nq == 2
        self.at[joint.idx_q : joint.idx_q + joint.nq] = (
            [np.cos(angle), np.sin(angle)] if circle else angle
        )
        self.speeds[joint.idx_v], self.pushes[joint.idx_v] = speed, push
        self.ours.append(slots.u)
        self.theirs.append(joint.idx_v)

    def speeds_of_all(self) -> tuple[list[int], list[int]]:
        """`ours` and `theirs` with those of a base that flies."""
        flying = [hinge.name for hinge in self.one.scene.hinge if hinge.type == "free"]
        if not flying:
            return self.ours, self.theirs
        first = self.model.layout.hinges[flying[0]].u
        return [*range(first, first + 6), *self.ours], [*range(6), *self.theirs]

    def mass(self) -> Any:
        """Pinocchio's mass matrix."""
        upper = np.triu(pin.crba(self.peer, self.data, self.at))
        return upper + np.triu(upper, 1).T


def pairs() -> Iterator[tuple[str, Pair]]:
    """Every published robot that moves, on the ground and flying."""
    rng = np.random.default_rng(16)
    for path in published():
        if not read_urdf(path.read_bytes(), path.name).links:
            continue  # a file that only includes another
        for base in ("fixed", "free"):
            one = imported(path, base)
            if any("held fixed" in note.text for note in one.notes):
                continue  # Pinocchio divides by no mass there
            if base == "free" or any(h.type != "fixed" for h in one.scene.hinge):
                yield f"{path.parent.name}/{path.name} {base}", Pair(path, one, base, rng)


def apart(found: Any, wanted: Any) -> float:
    """The largest difference, in parts of the largest number."""
    scale = max(1.0, float(np.abs(wanted).max(initial=0.0)))
    return float(np.abs(found - wanted).max(initial=0.0)) / scale
