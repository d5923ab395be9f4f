"""Robots that are published as they move: against Pinocchio in SciPy's DOP853, and MuJoCo's RK4."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp

import mstmm
from tests.support.peers.robot_pairs import Pair, import_robot, urdf_files

#: End of a robot's path, and what its root stands on.
ROBOTS = {
    "ur5_robot.urdf": "fixed", "panda.urdf": "fixed", "kinova.urdf": "fixed", "go2.urdf": "free",
    "model_vr_limits.urdf": "fixed", "mini_cheetah.urdf": "free",
}  # fmt: skip
#: N m s/rad, N s/m, at every joint.
DAMPING, T_END = 0.3, 0.5


def path_of(name: str) -> Path:
    return next(path for path in urdf_files() if path.name == name)


def damped_pair(name: str) -> Pair:
    """A robot with the same damping at every joint, in a state that is drawn."""
    base = ROBOTS[name]
    one = import_robot(path_of(name), base)
    hinges = [
        hinge | {"law": {"damping": DAMPING}} if hinge["type"] in ("pin", "prismatic") else hinge
        for hinge in one.tables["hinge"]
    ]
    scene = mstmm.Scene.from_data({**one.tables, "hinge": hinges}, name)
    changed = type(one)(scene, one.links, one.joints, one.notes, one.tables)
    return Pair(path_of(name), changed, base, np.random.default_rng(16))


def coordinate_rates(peer: Any, at: np.ndarray, speeds: np.ndarray) -> np.ndarray:
    """Of Pinocchio's coordinates: angles and lengths, cosine and sine of wheels, a free base."""
    rate = np.zeros(peer.nq)
    for k in range(1, peer.njoints):
        q, v, width = peer.idx_qs[k], peer.idx_vs[k], peer.nqs[k]
        if width == 1:
            rate[q] = speeds[v]
        elif width == 2:
            rate[q : q + 2] = -at[q + 1] * speeds[v], at[q] * speeds[v]
        else:
            turn = pin.Quaternion(at[3:7])
            rate[:3] = turn.matrix() @ speeds[:3]
            rate[3:7] = (turn * pin.Quaternion(0.0, *(0.5 * speeds[3:6]))).coeffs()
    return rate


@pytest.mark.parametrize("name", ROBOTS)
def test_pinocchio_in_dop853(name: str) -> None:
    pair = damped_pair(name)
    peer, n = pair.peer, pair.peer.nq
    joints = [peer.idx_vs[k] for k in range(1, peer.njoints) if peer.nvs[k] == 1]

    def rates(_: float, y: np.ndarray) -> np.ndarray:
        at, speeds, efforts = pin.normalize(peer, y[:n].copy()), y[n:], np.zeros(peer.nv)
        efforts[joints] = -DAMPING * speeds[joints]
        udot = pin.aba(peer, pair.data, at, speeds, efforts)
        return np.concatenate([coordinate_rates(peer, at, speeds), udot])

    start = np.concatenate([pair.at, pair.speeds])
    wanted = solve_ivp(rates, (0.0, T_END), start, "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    run = pair.model.simulate(
        T_END, rtol=1e-11, atol=1e-12, output_times=[T_END], initial=(pair.q, pair.u)
    )
    assert run.success
    found, theirs = run.u[-1][pair.ours], wanted[n:][pair.theirs]
    assert np.abs(found - theirs).max() < 1e-8 * max(1.0, np.abs(theirs).max())
    frame = next(f for f in reversed(peer.frames) if f.type == pin.FrameType.BODY)
    pin.framesForwardKinematics(peer, pair.data, pin.normalize(peer, wanted[:n].copy()))
    place = pair.data.oMf[peer.getFrameId(frame.name)].translation
    assert run.position(pair.one.links[frame.name])[-1] == pytest.approx(place, abs=1e-8)


def mujoco_of(name: str, step: float) -> Any:
    """The same robot by MuJoCo's own reader of URDF, with RK4."""
    root = ElementTree.parse(path_of(name)).getroot()
    for inside, taken in (("link", ("visual", "collision")), ("joint", ("mimic", "limit"))):
        for one in root.iter(inside):
            for tag in taken:
                for part in one.findall(tag):
                    one.remove(part)
    ElementTree.SubElement(ElementTree.SubElement(root, "mujoco"), "compiler", fusestatic="true")
    spec = mujoco.MjSpec.from_string(ElementTree.tostring(root, encoding="unicode"))
    if ROBOTS[name] == "free":
        spec.worldbody.bodies[0].add_freejoint()
    spec.option.integrator, spec.option.timestep = mujoco.mjtIntegrator.mjINT_RK4, step
    made = spec.compile()
    for joint in range(made.njnt):
        v = int(made.jnt_dofadr[joint])
        made.dof_frictionloss[v] = 0.0
        made.dof_damping[v] = DAMPING * (made.jnt_type[joint] != mujoco.mjtJoint.mjJNT_FREE)
    return made


@pytest.mark.parametrize("name", [name for name, base in ROBOTS.items() if base == "fixed"])
def test_mujocos_rk4_step_by_step(name: str) -> None:
    """The same method with the same steps gives the same numbers, but for rounding."""
    step, steps = 1e-3, 200
    pair, peer = damped_pair(name), mujoco_of(name, step)
    data = mujoco.MjData(peer)
    places = [pair.model.coordinate_layout.hinges[pair.one.joints[peer.joint(k).name]]
              for k in range(peer.njnt)]  # fmt: skip
    for k, slots in enumerate(places):
        data.qpos[peer.jnt_qposadr[k]] = pair.q[slots.q]
        data.qvel[peer.jnt_dofadr[k]] = pair.u[slots.u]
    for _ in range(steps):
        mujoco.mj_step(peer, data)
    run = pair.model.simulate(step * steps, "rk4", step, initial=(pair.q, pair.u))
    found = run.q[-1][[slots.q for slots in places]]
    assert np.abs(found - data.qpos[peer.jnt_qposadr]).max() < 1e-11
