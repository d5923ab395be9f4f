"""A robot as our model and as Pinocchio's, in the same state."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from importlib.metadata import files
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import mstmm
from mstmm.errors import SceneError
from mstmm.scene.robots.robot_model import Robot
from mstmm.scene.robots.scene_from_robot import ImportedRobot, ImportOptions, scene_from_robot
from mstmm.scene.robots.urdf import read_urdf

#: Packages with robots in URDF.
PACKAGES = ("example-robot-data", "pybullet")


def urdf_files(*packages: str) -> list[Path]:
    """The URDF files of packages (all of them), without the random objects of pybullet."""
    found = [one for package in packages or PACKAGES for one in files(package) or ()]
    return sorted(
        Path(str(one.locate())) for one in found
        if one.suffix == ".urdf" and "random_urdfs" not in one.parts
    )  # fmt: skip


def of_peers(robot: Robot, *keys: str) -> Robot:
    """Without joints that mimic others, and of the laws of joints only `keys`: Pinocchio's aba
    leaves the others out."""

    def keep_listed_laws(given: Any) -> dict[str, Any]:
        law = {key: x for key, x in given.get("law", {}).items() if key in keys}
        rest = {key: x for key, x in given.items() if key != "law"}
        return rest | ({"law": law} if law else {})

    joints = (replace(joint, keys=keep_listed_laws(joint.keys)) for joint in robot.joints)
    return replace(robot, mimics=(), joints=tuple(joints))


def import_robot(path: Path, base: str, *keys: str) -> ImportedRobot:
    return scene_from_robot(
        of_peers(read_urdf(path.read_bytes(), path.name), *keys), ImportOptions(base)
    )


class Pair:
    """Our model and Pinocchio's of a robot, in a state that is drawn: `q`, `u`, `efforts` are ours,
    `at`, `speeds`, `pushes` theirs; speeds of joints stand at `ours` and `theirs`."""

    def __init__(self, path: Path, one: ImportedRobot, base: str, rng: np.random.Generator) -> None:
        root = (pin.JointModelFreeFlyer(),) if base == "free" else ()
        self.one, self.peer = one, pin.buildModelFromUrdf(str(path), *root)
        # the others take orientations as files write them
        self.model = mstmm.compile(one.scene, simplify={"turns": 0})
        self.data = self.peer.createData()
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
        hinges = self.model.coordinate_layout.hinges
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
        first = self.model.coordinate_layout.hinges[flying[0]].u
        return [*range(first, first + 6), *self.ours], [*range(6), *self.theirs]

    def mass(self) -> Any:
        """Pinocchio's mass matrix."""
        upper = np.triu(pin.crba(self.peer, self.data, self.at))
        return upper + np.triu(upper, 1).T


def pairs(package: str) -> Iterator[tuple[str, Pair]]:
    """Every robot of a package that moves and that both read, on the ground and flying."""
    rng = np.random.default_rng(16)
    for path in urdf_files(package):
        if not _is_read_by_both(path):
            continue
        for base in ("fixed", "free"):
            one = import_robot(path, base)
            if any("fixed, because" in note.text for note in one.notes):
                continue  # Pinocchio divides by no mass there
            if base == "fixed" and all(hinge.type == "fixed" for hinge in one.scene.hinge):
                continue
            try:
                pair = Pair(path, one, base, rng)
            except SceneError as error:
                assert base == "free" and "its motion is undetermined" in str(error), path
                continue  # a base without mass, by which Pinocchio divides
            yield f"{path.parent.name}/{path.name} {base}", pair


def _is_read_by_both(path: Path) -> bool:
    """Whether there is a robot in a file; what we refuse Pinocchio refuses too."""
    try:
        if not read_urdf(path.read_bytes(), path.name).links:
            return False  # a file that only includes another
        import_robot(path, "fixed")
    except SceneError as error:
        if "no link moves or has mass" in str(error):
            return False
        with pytest.raises(ValueError, match="valid URDF"):
            pin.buildModelFromUrdf(str(path))
        return False
    try:
        pin.buildModelFromUrdf(str(path))
    except ValueError:  # joints of types and numbers that it does not know
        return False
    return True


def relative_difference(found: Any, wanted: Any) -> float:
    """The largest difference, in parts of the largest number."""
    scale = max(1.0, float(np.abs(wanted).max(initial=0.0)))
    return float(np.abs(found - wanted).max(initial=0.0)) / scale
