"""Four robots of the package example-robot-data, as everybody has them: rigid links, joints without
damping, friction, limits and mimicry, which Pinocchio's algorithms and ours count differently."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from importlib.metadata import files
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
import pinocchio as pin

import mstmm
from mstmm.scene.robots.robot_model import Robot
from mstmm.scene.robots.scene_from_robot import ImportedRobot, ImportOptions, scene_from_robot
from mstmm.scene.robots.urdf_reader import read_urdf

#: Name -> end of the file's path, and what its root stands on.
ROBOTS = {
    "ur5": ("ur_description/urdf/ur5_robot.urdf", "fixed"),
    "panda": ("panda_description/urdf/panda.urdf", "fixed"),
    "go2": ("go2_description/urdf/go2.urdf", "free"),
    "talos_reduced": ("talos_data/robots/talos_reduced.urdf", "free"),
}

#: What MuJoCo is to leave out beside what it does for the motion of links.
_OFF = ("constraint", "contact", "equality", "frictionloss", "limit", "spring", "damper")


def path_of(end: str) -> Path:
    """A file of the package."""
    found = next(one for one in files("example-robot-data") or () if str(one).endswith(end))
    return Path(str(found.locate()))


@dataclass(frozen=True)
class Case:
    """One robot, and the models that all make of it."""

    name: str
    held: tuple[str, ...] = ()

    @cached_property
    def path(self) -> Path:
        return path_of(ROBOTS[self.name][0])

    @property
    def base(self) -> str:
        return ROBOTS[self.name][1]

    @cached_property
    def imported(self) -> ImportedRobot:
        """The robot as a scene; its joints in `held` are fixed."""
        return scene_from_robot(
            self._bare(read_urdf(self.path.read_bytes(), self.name)), ImportOptions(self.base)
        )

    def _bare(self, robot: Robot) -> Robot:
        joints = (
            replace(joint, type="fixed", keys={})
            if joint.name in self.held
            else replace(joint, keys={key: x for key, x in joint.keys.items() if key == "axis"})
            for joint in robot.joints
        )
        return replace(robot, mimics=(), joints=tuple(joints))

    def model(self, engine: str) -> mstmm.Model:
        return mstmm.compile(self.imported.scene, engine=engine)

    def pinocchio(self) -> pin.Model:
        root = (pin.JointModelFreeFlyer(),) if self.base == "free" else ()
        return pin.buildModelFromUrdf(str(self.path), *root)

    def mujoco(self, step: float) -> mujoco.MjModel:
        """With fixed links merged, RK4, and nothing but the motion of links."""
        root = ElementTree.parse(self.path).getroot()
        for link in root.iter("link"):
            for look in (*link.findall("visual"), *link.findall("collision")):
                link.remove(look)
        for joint in root.iter("joint"):
            for mimic in joint.findall("mimic"):
                joint.remove(mimic)
        ElementTree.SubElement(
            ElementTree.SubElement(root, "mujoco"), "compiler", fusestatic="true"
        )
        spec = mujoco.MjSpec.from_string(ElementTree.tostring(root, encoding="unicode"))
        if self.base == "free":
            spec.worldbody.bodies[0].add_freejoint()
        spec.option.integrator, spec.option.timestep = mujoco.mjtIntegrator.mjINT_RK4, step
        for flag in _OFF:
            spec.option.disableflags |= getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag.upper()}", 0)
        made = spec.compile()
        made.dof_frictionloss[:] = made.dof_damping[:] = 0.0
        return made

    def start(self, seed: int = 16) -> tuple[np.ndarray, np.ndarray]:
        """(q, u) of ours: joints between -0.5 and 0.5 (rad, m, 1/s), a base that flies at rest."""
        layout, rng = self.layout, np.random.default_rng(seed)
        q, u = np.zeros(layout.nq), np.zeros(layout.nu)
        for slots in layout.hinges.values():
            if slots.nq == 1:
                q[slots.q], u[slots.u] = rng.uniform(-0.5, 0.5, 2)
            elif slots.nq == 7:
                q[slots.q : slots.q + 7] = (0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0)
        return q, u

    @cached_property
    def layout(self) -> Any:
        return mstmm.compile(self.imported.scene, engine="looped").coordinate_layout

    def joints(self, peer: mujoco.MjModel) -> list[tuple[Any, int]]:
        """Joints of one freedom: their places among ours, and their numbers in MuJoCo's model."""
        known = self.imported.names
        return [(self.layout.hinges[known[peer.joint(k).name]], k) for k in range(peer.njnt)
                if peer.joint(k).name in known]  # fmt: skip


def state_of(case: Case, peer: mujoco.MjModel, q: np.ndarray, u: np.ndarray) -> Any:
    """MuJoCo's data in our state."""
    data = mujoco.MjData(peer)
    if case.base == "free":
        data.qpos[:7] = (0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0)
    for ours, joint in case.joints(peer):
        data.qpos[peer.jnt_qposadr[joint]] = q[ours.q]
        data.qvel[peer.jnt_dofadr[joint]] = u[ours.u]
    return data


def pinocchio_state(case: Case, peer: pin.Model, q: np.ndarray, u: np.ndarray) -> Any:
    """Pinocchio's q and v in our state, and the places of the joints' speeds, ours and theirs."""
    at, v, ours, theirs = pin.neutral(peer), np.zeros(peer.nv), list[int](), list[int]()
    if case.base == "free":
        at[:7] = (0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    for k in range(1, peer.njoints):
        slots = case.layout.hinges.get(case.imported.names.get(peer.names[k], ""))
        if slots is None or peer.nvs[k] != 1:
            continue
        angle = q[slots.q]
        circle = [np.cos(angle), np.sin(angle)]
        at[peer.idx_qs[k] : peer.idx_qs[k] + peer.nqs[k]] = circle if peer.nqs[k] == 2 else angle
        v[peer.idx_vs[k]] = u[slots.u]
        ours.append(slots.u)
        theirs.append(peer.idx_vs[k])
    return at, v, (ours, theirs)
