"""Four robots of the package example-robot-data as models of mstmm, Pinocchio and MuJoCo.

Rigid links; joints without damping, friction, limits and mimicry, which the programs model
differently.
"""

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
from mstmm.scene.robots.urdf import read_urdf

#: Name -> end of the path of the file, and type of the root joint.
ROBOTS = {
    "ur5": ("ur_description/urdf/ur5_robot.urdf", "fixed"),
    "panda": ("panda_description/urdf/panda.urdf", "fixed"),
    "go2": ("go2_description/urdf/go2.urdf", "free"),
    "talos_reduced": ("talos_data/robots/talos_reduced.urdf", "free"),
}

#: Features of MuJoCo that are switched off.
_DISABLED = ("constraint", "contact", "equality", "frictionloss", "limit", "spring", "damper")


def robot_file(end: str) -> Path:
    """File of the package whose path ends so."""
    package_file = next(
        package_path
        for package_path in files("example-robot-data") or ()
        if str(package_path).endswith(end)
    )
    return Path(str(package_file.locate()))


@dataclass(frozen=True)
class Case:
    """A robot, and its models in the three programs."""

    name: str
    fixed_joints: tuple[str, ...] = ()

    @cached_property
    def path(self) -> Path:
        return robot_file(ROBOTS[self.name][0])

    @property
    def root_joint(self) -> str:
        return ROBOTS[self.name][1]

    @cached_property
    def imported_robot(self) -> ImportedRobot:
        """The robot as a scene; joints in `fixed_joints` are fixed."""
        return scene_from_robot(
            self._without_laws(read_urdf(self.path.read_bytes(), self.name)),
            ImportOptions(self.root_joint),
        )

    def _without_laws(self, robot: Robot) -> Robot:
        joints = (
            replace(joint, type="fixed", keys={})
            if joint.name in self.fixed_joints
            else replace(
                joint, keys={key: value for key, value in joint.keys.items() if key == "axis"}
            )
            for joint in robot.joints
        )
        return replace(robot, mimics=(), joints=tuple(joints))

    def model(self, engine: str) -> mstmm.Model:
        return mstmm.compile(self.imported_robot.scene, engine=engine)

    def pinocchio(self) -> pin.Model:
        root = (pin.JointModelFreeFlyer(),) if self.root_joint == "free" else ()
        return pin.buildModelFromUrdf(str(self.path), *root)

    def mujoco(self, step: float) -> mujoco.MjModel:
        """Model with merged fixed links, RK4 and smooth dynamics only."""
        root = ElementTree.parse(self.path).getroot()
        for link in root.iter("link"):
            for geometry in (*link.findall("visual"), *link.findall("collision")):
                link.remove(geometry)
        for joint in root.iter("joint"):
            for mimic in joint.findall("mimic"):
                joint.remove(mimic)
        ElementTree.SubElement(
            ElementTree.SubElement(root, "mujoco"), "compiler", fusestatic="true"
        )
        spec = mujoco.MjSpec.from_string(ElementTree.tostring(root, encoding="unicode"))
        if self.root_joint == "free":
            spec.worldbody.bodies[0].add_freejoint()
        spec.option.integrator, spec.option.timestep = mujoco.mjtIntegrator.mjINT_RK4, step
        for flag in _DISABLED:
            spec.option.disableflags |= getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag.upper()}", 0)
        model = spec.compile()
        model.dof_frictionloss[:] = model.dof_damping[:] = 0.0
        return model

    def initial_state(self, seed: int = 16) -> tuple[np.ndarray, np.ndarray]:
        """Random (q, u) of mstmm: joints within 0.5 (rad, m, 1/s), a floating base at rest."""
        layout, rng = self.layout, np.random.default_rng(seed)
        q, u = np.zeros(layout.nq), np.zeros(layout.nu)
        for layout_entry in layout.hinges.values():
            if layout_entry.nq == 1:
                q[layout_entry.q], u[layout_entry.u] = rng.uniform(-0.5, 0.5, 2)
            elif layout_entry.nq == 7:
                q[layout_entry.q : layout_entry.q + 7] = (0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0)
        return q, u

    @cached_property
    def layout(self) -> Any:
        return mstmm.compile(self.imported_robot.scene, engine="looped").coordinate_layout

    def joints(self, peer: mujoco.MjModel) -> list[tuple[Any, int]]:
        """Joints of one degree of freedom: layout entry in mstmm, index in MuJoCo."""
        scene_names = self.imported_robot.names
        return [(self.layout.hinges[scene_names[peer.joint(joint).name]],
        joint) for joint in range(peer.njnt)
                if peer.joint(joint).name in scene_names]  # fmt: skip


def mujoco_state(case: Case, peer: mujoco.MjModel, q: np.ndarray, u: np.ndarray) -> Any:
    """MuJoCo's data at a state of mstmm."""
    data = mujoco.MjData(peer)
    if case.root_joint == "free":
        data.qpos[:7] = (0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0)
    for layout_entry, joint in case.joints(peer):
        data.qpos[peer.jnt_qposadr[joint]] = q[layout_entry.q]
        data.qvel[peer.jnt_dofadr[joint]] = u[layout_entry.u]
    return data


def pinocchio_state(case: Case, peer: pin.Model, q: np.ndarray, u: np.ndarray) -> Any:
    """Pinocchio's q and v at a state of mstmm, and the speed indices of joints in both."""
    pinocchio_q, v, own_indices, peer_indices = (
        pin.neutral(peer),
        np.zeros(peer.nv),
        list[int](),
        list[int](),
    )
    if case.root_joint == "free":
        pinocchio_q[:7] = (0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    for k in range(1, peer.njoints):
        layout_entry = case.layout.hinges.get(case.imported_robot.names.get(peer.names[k], ""))
        if layout_entry is None or peer.nvs[k] != 1:
            continue
        angle = q[layout_entry.q]
        cosine_sine = [np.cos(angle), np.sin(angle)]
        pinocchio_q[peer.idx_qs[k] : peer.idx_qs[k] + peer.nqs[k]] = (
            cosine_sine if peer.nqs[k] == 2 else angle
        )
        v[peer.idx_vs[k]] = u[layout_entry.u]
        own_indices.append(layout_entry.u)
        peer_indices.append(peer.idx_vs[k])
    return pinocchio_q, v, (own_indices, peer_indices)
