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
    """MuJoCo's model of the tree; through its builder, since deep XML is refused."""
    spec = mujoco.MjSpec()
    spec.option.gravity = tree.gravity
    kinds = {
        "pin": mujoco.mjtJoint.mjJNT_HINGE, "ball": mujoco.mjtJoint.mjJNT_BALL,
        "free": mujoco.mjtJoint.mjJNT_FREE,
    }  # fmt: skip
    nodes = {-1: spec.worldbody}
    for number, link in enumerate(tree.links):
        nodes[number] = nodes[link.parent].add_body(
            name=link.name, pos=link.place, quat=quaternion(link.turn), mass=1.0,
            ipos=link.center, inertia=[1.0, 1.0, 1.0], explicitinertial=True,
        )  # fmt: skip
        joint = nodes[number].add_joint(type=kinds[link.kind], axis=link.axis)
        joint.armature = link.armature
    model = spec.compile()
    for link in tree.links:
        # Written here, because the reader refuses massless links and tabulated inertias.
        number = model.body(link.name).id
        model.body_mass[number], model.body_inertia[number] = link.mass, np.diag(link.inertia)
        if np.count_nonzero(link.inertia - np.diag(np.diag(link.inertia))):
            model.body_inertia[number], axes = np.linalg.eigh(link.inertia)
            axes[:, 2] *= np.sign(np.linalg.det(axes))
            model.body_iquat[number] = quaternion(axes)
            model.body_sameframe[number] = 0
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


def places(tree: Tree, model: mujoco.MjModel) -> tuple[np.ndarray, np.ndarray]:
    """MuJoCo's q and u from ours: columns, in its order of bodies."""
    starts, at_q, at_u = [], 0, 0
    for link in tree.links:
        starts.append((at_q, at_u))
        at_q, at_u = at_q + COORDINATES[link.kind][0], at_u + COORDINATES[link.kind][1]
    q, u = np.zeros(tree.nq, int), np.zeros(tree.nu, int)
    for number, link in enumerate(tree.links):
        joint = model.body(link.name).jntadr[0]
        nq, nu = COORDINATES[link.kind]
        first = model.jnt_qposadr[joint], model.jnt_dofadr[joint]
        q[first[0] : first[0] + nq] = starts[number][0] + np.arange(nq)
        u[first[1] : first[1] + nu] = starts[number][1] + np.arange(nu)
    return q, u


def turned(tree: Tree, q: np.ndarray, u: np.ndarray, sign: int) -> np.ndarray:
    """Linear part of a free root's speeds (+1) from outboard to world axes, (-1) back."""
    if tree.links[0].kind != "free":
        return u
    out = u.copy()
    turns = Rotation.from_quat(np.roll(q[:, 3:7], -1, axis=1))
    out[:, :3] = (turns if sign > 0 else turns.inv()).apply(u[:, :3])
    return out


def library() -> Path:
    """mujoco.c beside the wheel's libmujoco."""
    home = Path(mujoco.__file__).parent
    shared = next(home.glob("libmujoco.so*"))
    flags = ["-O3", "-march=native", "-std=gnu17", f"-I{home / 'include'}"]
    source = (native.HERE / "mujoco.c").read_text()
    return native.library("mujoco", source, flags, after=[str(shared), f"-Wl,-rpath,{home}"])


def subject(tree: Tree, q: np.ndarray, u: np.ndarray) -> native.Subject:
    """Function and states in MuJoCo's order; `back` of its accelerations with `accelerations`."""
    model = model_of(tree)
    data = mujoco.MjData(model)
    opened = ctypes.CDLL(str(library()))
    f: Any = ctypes.c_void_p.in_dll(opened, "mujoco_accelerations").value
    pair = (ctypes.c_void_p * 2)(model._address, data._address)
    of_q, of_u = places(tree, model)
    found = native.Subject(
        f, ctypes.addressof(pair), q[:, of_q], turned(tree, q, u, 1)[:, of_u],
        keep=(opened, pair, model, data),
    )  # fmt: skip
    found.order = of_u
    return found


def accelerations(found: native.Subject, tree: Tree, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """udot in our order and axes."""
    out = np.zeros_like(u)
    out[:, found.order] = found.accelerations()
    out = turned(tree, q, out, -1)
    if tree.links[0].kind == "free":
        out[:, :3] -= np.cross(u[:, 3:6], u[:, :3])
    return out


class MujocoRun:
    """Fixed steps of MuJoCo's own Runge-Kutta integrator of fourth order, in C."""

    def __init__(self, tree: Tree) -> None:
        mujoco.set_mju_user_warning(lambda _: None)  # or steps too long for it fill a file
        self.model = model_of(tree)
        option = self.model.opt
        option.integrator = mujoco.mjtIntegrator.mjINT_RK4
        flags = mujoco.mjtDisableBit
        option.disableflags = int(
            flags.mjDSBL_CONSTRAINT | flags.mjDSBL_CONTACT | flags.mjDSBL_SENSOR
            | flags.mjDSBL_ACTUATION | flags.mjDSBL_EQUALITY | flags.mjDSBL_LIMIT
        )  # fmt: skip
        self.data = mujoco.MjData(self.model)
        self.pair = (ctypes.c_void_p * 2)(self.model._address, self.data._address)
        self.library = ctypes.CDLL(str(library()))

    def run(self, q: np.ndarray, u: np.ndarray, t_end: float, steps: int) -> np.ndarray:
        """q at t_end (chains of pins and balls)."""
        self.model.opt.timestep = t_end / steps
        q, u = q.copy(), u.copy()
        self.library.mujoco_run(
            self.pair, ctypes.c_long(steps), ctypes.c_void_p(q.ctypes.data),
            ctypes.c_void_p(u.ctypes.data),
        )  # fmt: skip
        return q
