"""MuJoCo's C functions that lead to accelerations, on a model made with its builder."""

from __future__ import annotations

import ctypes
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from . import native
from .links import COORDINATES, Tree


def quaternion(matrix: np.ndarray) -> np.ndarray:
    """w, x, y, z of a rotation matrix."""
    return np.roll(Rotation.from_matrix(matrix).as_quat(), 1)


def model_of(tree: Tree) -> mujoco.MjModel:
    """MuJoCo's model of the tree; through its builder, since deeply nested XML is rejected."""
    spec = mujoco.MjSpec()
    spec.option.gravity = tree.gravity
    kinds = {
        "pin": mujoco.mjtJoint.mjJNT_HINGE, "ball": mujoco.mjtJoint.mjJNT_BALL,
        "free": mujoco.mjtJoint.mjJNT_FREE,
    }  # fmt: skip
    nodes = {-1: spec.worldbody}
    for index, link in enumerate(tree.links):
        nodes[index] = nodes[link.parent].add_body(
            name=link.name, pos=link.position, quat=quaternion(link.orientation), mass=1.0,
            ipos=link.center, inertia=[1.0, 1.0, 1.0], explicitinertial=True,
        )  # fmt: skip
        joint = nodes[index].add_joint(type=kinds[link.kind], axis=link.axis)
        joint.armature = link.armature
    model = spec.compile()
    for link in tree.links:
        # Set here, because the reader rejects massless links and tabulated inertias.
        index = model.body(link.name).id
        model.body_mass[index], model.body_inertia[index] = link.mass, np.diag(link.inertia)
        if np.count_nonzero(link.inertia - np.diag(np.diag(link.inertia))):
            model.body_inertia[index], axes = np.linalg.eigh(link.inertia)
            axes[:, 2] *= np.sign(np.linalg.det(axes))
            model.body_iquat[index] = quaternion(axes)
            model.body_sameframe[index] = 0
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


def coordinate_indices(tree: Tree, model: mujoco.MjModel) -> tuple[np.ndarray, np.ndarray]:
    """Columns of mstmm's q and u in MuJoCo's order of bodies."""
    offsets, iq, iu = [], 0, 0
    for link in tree.links:
        offsets.append((iq, iu))
        iq, iu = iq + COORDINATES[link.kind][0], iu + COORDINATES[link.kind][1]
    q, u = np.zeros(tree.nq, int), np.zeros(tree.nu, int)
    for index, link in enumerate(tree.links):
        joint = model.body(link.name).jntadr[0]
        nq, nu = COORDINATES[link.kind]
        addresses = model.jnt_qposadr[joint], model.jnt_dofadr[joint]
        q[addresses[0] : addresses[0] + nq] = offsets[index][0] + np.arange(nq)
        u[addresses[1] : addresses[1] + nu] = offsets[index][1] + np.arange(nu)
    return q, u


def convert_root_speeds(tree: Tree, q: np.ndarray, u: np.ndarray, sign: int) -> np.ndarray:
    """Linear part of a free root's speeds (+1) from outboard to world axes, (-1) back."""
    if tree.links[0].kind != "free":
        return u
    speeds = u.copy()
    rotations = Rotation.from_quat(np.roll(q[:, 3:7], -1, axis=1))
    speeds[:, :3] = (rotations if sign > 0 else rotations.inv()).apply(u[:, :3])
    return speeds


def compile_library() -> Path:
    """Library of mujoco.c, linked to the libmujoco of the wheel."""
    folder = Path(mujoco.__file__).parent
    mujoco_library = next(folder.glob("libmujoco.so*"))
    flags = ["-O3", "-march=native", "-std=gnu17", f"-I{folder / 'include'}"]
    source = (native.HERE / "mujoco.c").read_text()
    return native.compile_library(
        "mujoco", source, flags, libraries=[str(mujoco_library), f"-Wl,-rpath,{folder}"]
    )


def subject(tree: Tree, q: np.ndarray, u: np.ndarray) -> native.Subject:
    """Function and states in MuJoCo's order; `accelerations` converts its results."""
    model = model_of(tree)
    data = mujoco.MjData(model)
    shared_library = ctypes.CDLL(str(compile_library()))
    f: Any = ctypes.c_void_p.in_dll(shared_library, "mujoco_accelerations").value
    addresses = (ctypes.c_void_p * 2)(model._address, data._address)
    q_indices, u_indices = coordinate_indices(tree, model)
    created = native.Subject(
        f, ctypes.addressof(addresses), q[:, q_indices], convert_root_speeds(tree, q, u, 1)[:,
        u_indices],
        owner=(shared_library, addresses, model, data),
    )  # fmt: skip
    created.speed_order = u_indices
    return created


def accelerations(subject: native.Subject, tree: Tree, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """udot in the order and axes of mstmm."""
    udot = np.zeros_like(u)
    udot[:, subject.speed_order] = subject.accelerations()
    udot = convert_root_speeds(tree, q, udot, -1)
    if tree.links[0].kind == "free":
        udot[:, :3] -= np.cross(u[:, 3:6], u[:, :3])
    return udot


class MujocoRun:
    """Fixed steps of MuJoCo's own Runge-Kutta integrator of fourth order, in C."""

    def __init__(self, tree: Tree) -> None:
        mujoco.set_mju_user_warning(lambda _: None)  # else long steps fill a log file
        self.model = model_of(tree)
        option = self.model.opt
        option.integrator = mujoco.mjtIntegrator.mjINT_RK4
        flags = mujoco.mjtDisableBit
        option.disableflags = int(
            flags.mjDSBL_CONSTRAINT | flags.mjDSBL_CONTACT | flags.mjDSBL_SENSOR
            | flags.mjDSBL_ACTUATION | flags.mjDSBL_EQUALITY | flags.mjDSBL_LIMIT
        )  # fmt: skip
        self.data = mujoco.MjData(self.model)
        self.addresses = (ctypes.c_void_p * 2)(self.model._address, self.data._address)
        self.library = ctypes.CDLL(str(compile_library()))

    def run(self, q: np.ndarray, u: np.ndarray, t_end: float, steps: int) -> np.ndarray:
        """q at t_end (chains of pins and balls)."""
        self.model.opt.timestep = t_end / steps
        q, u = q.copy(), u.copy()
        self.library.mujoco_run(
            self.addresses, ctypes.c_long(steps), ctypes.c_void_p(q.ctypes.data),
            ctypes.c_void_p(u.ctypes.data),
        )  # fmt: skip
        return q
